"""The figure of a calibration: what it was made of, what it gained, and how well it is known."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Final

from zerorate.show.calibration_panels import (
    draw_carry,
    draw_deviations,
    draw_known,
    draw_log,
    draw_norm,
    draw_poses,
    name_elements,
    name_groups,
)
from zerorate.show.calibration_table import verdict
from zerorate.show.style import (
    BLACK,
    FONT,
    VERMILION_TEXT,
    add_panel,
    new_figure,
    style_decades,
    style_panels,
    write_caption,
    write_title,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.calibration.calibration import Calibration
    from zerorate.io import Recording

# Millimetres.
_WIDTH: Final = 180.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 14.0, 4.0, 13.0, 16.0
_LOG, _POSES, _PANEL = 24.0, 56.0, 36.0
_BETWEEN_COLUMNS, _BETWEEN_ROWS, _BETWEEN_LOGS, _BETWEEN_SIZES = 15.0, 15.0, 3.0, 14.0


def plot_calibration(calibration: Calibration, recording: Recording | None = None) -> Figure:
    """Return the figure of a calibration, 180 mm wide.

    Parameters
    ----------
    calibration : Calibration
        What was found.
    recording : Recording, optional
        What it was found from: shown above all else, with the rests.

    Returns
    -------
    matplotlib.figure.Figure
        The raw log with its rests; poses on the sphere, and where there are none; norm and
        carry error, rest by rest and turn by turn, before and after; scale and misalignment with
        their errors; and how much the record tells of each parameter. No global state of
        matplotlib is used.
    """
    shown = [] if recording is None else [one for one in ("accel", "gyro") if one in recording]
    logs = len(shown) * (_LOG + _BETWEEN_LOGS) + (_BETWEEN_ROWS if shown else 0.0)
    height = _TOP + logs + _POSES + _BETWEEN_ROWS + _PANEL + _BOTTOM
    figure = new_figure(_WIDTH, height)
    top = height - _TOP
    for i, name in enumerate(shown):
        assert recording is not None
        axes = _axes(figure, top, _LOG, 0, 3)
        draw_log(axes, calibration, recording[name], last=i == len(shown) - 1)
        top -= _LOG + _BETWEEN_LOGS
    top -= _BETWEEN_ROWS if shown else 0.0
    draw_poses(_axes(figure, top, _POSES, 0, 2), calibration)
    half = 0.5 * (_POSES - _BETWEEN_SIZES)
    sizes = [_axes(figure, at, half, 2) for at in (top, top - half - _BETWEEN_SIZES)]
    draw_norm(sizes[0], calibration)
    draw_carry(sizes[1], calibration)
    top -= _POSES + _BETWEEN_ROWS
    deviations = _axes(figure, top, _PANEL, 0, 2)
    draw_deviations(deviations, calibration)
    known = _axes(figure, top, _PANEL, 2)
    draw_known(known, calibration)
    style_panels([axes for axes in figure.axes if axes.axison])
    for axes in (*sizes, known):
        if axes.get_yscale() == "log":
            style_decades(axes)
    name_elements(deviations)
    name_groups(known)
    colour = BLACK if calibration.valid else VERMILION_TEXT
    write_title(figure, "Calibration")
    said = textwrap.shorten(verdict(calibration), 150, placeholder=" ...")
    figure.text(0.5, 1.0 - 6.0 / height, said, ha="center", va="top", size=FONT, color=colour)
    write_caption(figure, textwrap.fill(_caption(shown), 150))
    return figure


def _axes(figure: Figure, top: float, tall: float, column: int, span: int = 1) -> Axes:
    """Return a panel so many millimetres tall whose upper edge lies so high."""
    inner = _WIDTH - _LEFT - _RIGHT - 2 * _BETWEEN_COLUMNS
    single = inner / 3
    left = _LEFT + column * (single + _BETWEEN_COLUMNS)
    width = span * single + (span - 1) * _BETWEEN_COLUMNS
    return add_panel(figure, left, top - tall, width, tall)


def _caption(shown: list[str]) -> str:
    said = (
        "Poses: which direction of the body was up; shaded: more than 40° from any that was used. "
        "Hollow: not used, or not identifiable. Bars: two standard errors. Above the dashed line a "
        "parameter is not identifiable."
    )
    return f"Blue in the log: rests; rose: not used. {said}" if shown else said
