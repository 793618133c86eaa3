"""Views of results with a few numbers and errors; the figures show intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from zerorate.geometry.rotations import euler_angles
from zerorate.numerals import format_significant, format_with_error
from zerorate.show.style import (
    BLACK,
    BLUE,
    GREY_TEXT,
    VERMILION,
    add_panel,
    new_figure,
    style_panels,
    write_caption,
    write_in_middle,
    write_title,
)
from zerorate.show.tables import Table, as_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.array.rotations import Rotations
    from zerorate.array.virtual_gyro import VirtualGyro
    from zerorate.calibration.comparison import CalibrationComparison
    from zerorate.calibration.rate.reference import FittedRate
    from zerorate.navigation.alignment import Alignment
    from zerorate.noise.coefficient import Coefficient
    from zerorate.record.offset import TimeOffset

# Sizes in mm.
_WIDTH, _ROW, _LEFT, _BELOW, _ABOVE, _BETWEEN = 110.0, 5.0, 38.0, 11.0, 8.0, 9.0
_BARS_CAPTION: Final = "Bars: ± 2σ."
_MAX_PARAMETERS: Final = 24
"""Largest number of parameters in a comparison figure; the largest changes are shown."""


class _Row(NamedTuple):
    """A number with its standard error (0 if none), and a flag to highlight it."""

    name: str
    value: float
    sigma: float = 0.0
    marked: bool = False


class _Group(NamedTuple):
    """Numbers with the same unit, and values at which the panel has lines."""

    label: str
    rows: tuple[_Row, ...]
    lines: tuple[float, ...] = (0.0,)


def plot_fitted_rate(result: FittedRate) -> Figure:
    """Return a figure of a gyro's scale, bias and lag relative to its reference, as intervals."""
    scales = ("scale", "positive", "negative")
    groups = (
        _Group("scale", tuple(_make_row(name, getattr(result, name)) for name in scales), ()),
        _Group("asymmetry of the scale", (_make_row("asymmetry", result.asymmetry),)),
        _Group("bias [in the unit of the gyro]", (_make_row("bias", result.bias),)),
        _Group("lag [s]", (_make_row("lag", result.lag),)),
    )
    return _draw_figure("How far is the gyro off its reference?", groups)


def plot_comparison(result: CalibrationComparison) -> Figure:
    """Return a figure of each parameter's change in standard errors."""
    comparable = [p for p in result.parameters if not math.isnan(p.z)]
    farthest = sorted(comparable, key=lambda p: -abs(p.z))[:_MAX_PARAMETERS]
    rows = tuple(_Row(p.name, p.z, 0.0, p.moved) for p in farthest)
    group = _Group("second minus first [standard errors]", rows, (-3.0, 0.0, 3.0))
    return _draw_figure(
        "What changed between two calibrations?", (group,), "Beyond ± 3 a parameter has changed."
    )


def plot_alignment(result: Alignment) -> Figure:
    """Return a figure of the angles at the end of the rest, and the biases, as intervals."""
    angles = np.degrees(euler_angles(result.quaternion[np.newaxis])[0])
    level, heading = math.degrees(result.level_sigma), math.degrees(result.heading_sigma)
    rows = [_Row("roll", angles[0], level), _Row("pitch", angles[1], level)]
    rows += [_Row("heading", angles[2], heading)] if result.heading_known else []
    gyro = np.degrees(result.gyro_bias)
    sigma = math.degrees(result.gyro_bias_sigma)
    accel = _make_axis_rows(result.accel_bias, result.accel_bias_sigma)
    groups = (
        _Group("angle [deg]", tuple(rows)),
        _Group("bias of the gyro [deg/s]", _make_axis_rows(gyro, sigma)),
        _Group("bias of the accelerometer [m/s²]", accel),
    )
    return _draw_figure(f"Which way did it point at {result.time:g} s?", groups)


def plot_time_offset(result: TimeOffset) -> Figure:
    """Return a figure of the offset between two clocks, as an interval."""
    rows = (_Row("time offset", result.seconds, result.sigma),) if result.identifiable else ()
    return _draw_figure("How late are the fixes?", (_Group("time offset [s]", rows),))


def plot_rotations(result: Rotations) -> Figure:
    """Return a figure of each sensor's rotation angle with its error, and the residual."""
    angles = zip(result.labels, result.angles, result.sigma_deg, strict=True)
    residuals = zip(result.labels, 100.0 * result.residuals, strict=True)
    groups = (
        _Group(
            "angle to the first [deg]", tuple(_Row(n, a, _finite_or_zero(e)) for n, a, e in angles)
        ),
        _Group("residual rate [%]", tuple(_Row(n, r) for n, r in residuals)),
    )
    return _draw_figure(f"How are the gyros turned against {result.labels[0]}?", groups)


def plot_virtual_gyro(result: VirtualGyro) -> Figure:
    """Return a figure of each gyro's weight, and the gain over the plain mean."""
    plain_weight = 1.0 / len(result.weights)
    rows = tuple(_Row(f"gyro {k}", float(w)) for k, w in enumerate(result.weights))
    gain = _Row("gain", result.gain, _finite_or_zero(result.gain_error))
    groups = (
        _Group("weight; line: plain mean", rows, (plain_weight,)),
        _Group("deviation of the plain mean over that of these weights", (gain,), (1.0,)),
    )
    return _draw_figure(
        f"How much does each of {len(result.weights)} gyros count, for {result.horizon:g} s?",
        groups,
    )


def format_virtual_gyro(result: VirtualGyro) -> str:
    """Return each gyro's weight, and the gain over the plain mean."""
    rows = tuple((f"gyro {k}", f"{w:.4f}") for k, w in enumerate(result.weights))
    gain = format_with_error(result.gain, result.gain_error)
    note = f"Its deviation over {result.horizon:g} s is that of the plain mean over {gain}."
    return as_text(Table(f"One gyro of {len(result.weights)}", ("", "weight"), rows, note=note))


def _make_row(name: str, coefficient: Coefficient) -> _Row:
    is_identifiable = coefficient.known and coefficient.identifiable
    return (
        _Row(name, coefficient.value, coefficient.sigma)
        if is_identifiable
        else _Row(name, math.nan)
    )


def _make_axis_rows(values: Sequence[float] | np.ndarray, sigma: float) -> tuple[_Row, ...]:
    return tuple(_Row(axis, float(v), sigma) for axis, v in zip("xyz", values, strict=True))


def _finite_or_zero(error: float) -> float:
    return error if math.isfinite(error) else 0.0


def _draw_figure(title: str, groups: Sequence[_Group], caption: str = _BARS_CAPTION) -> Figure:
    heights = [_ROW * max(1, len(group.rows)) + 2.0 for group in groups]
    height = _ABOVE + sum(heights) + _BETWEEN * len(groups) + _BELOW - 4.0
    figure = new_figure(_WIDTH, height)
    top, panels = height - _ABOVE, []
    for group, panel_height in zip(groups, heights, strict=True):
        top -= panel_height
        panels.append(add_panel(figure, _LEFT, top, _WIDTH - _LEFT - 5.0, panel_height))
        _draw_group(panels[-1], group)
        top -= _BETWEEN
    style_panels(panels)
    for panel, group in zip(panels, groups, strict=True):
        panel.set_yticks(range(len(group.rows)), [row.name for row in group.rows])
        panel.ticklabel_format(axis="x", useOffset=False)
    write_title(figure, title)
    write_caption(figure, caption)
    return figure


def _draw_group(axes: Axes, group: _Group) -> None:
    axes.set_xlabel(group.label)
    # Numbers are above their bars, so the first bar needs room above it.
    axes.set_ylim(max(1, len(group.rows)) - 0.5, -0.9)
    axes.margins(x=0.25)
    drawn_rows = [(i, row) for i, row in enumerate(group.rows) if math.isfinite(row.value)]
    if not drawn_rows:
        write_in_middle(axes, "not identifiable")
        return
    for line in group.lines:
        axes.axvline(line, color=GREY_TEXT, lw=0.5, ls="-" if line == group.lines[0] else ":")
    for i, row in drawn_rows:
        colour = VERMILION if row.marked else BLUE
        bar = 2.0 * row.sigma if math.isfinite(row.sigma) else 0.0
        axes.errorbar(row.value, i, xerr=bar or None, fmt="o", ms=2.5, lw=0.9, color=colour)
        axes.annotate(
            _format_row(row),
            (row.value, i),
            xytext=(0.0, 2.5),
            textcoords="offset points",
            ha="center",
            fontsize=5.0,
            color=BLACK,
        )


def _format_row(row: _Row) -> str:
    return (
        format_with_error(row.value, row.sigma)
        if row.sigma > 0.0
        else format_significant(row.value)
    )
