"""Deviations of several logs in one figure and one table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zerorate.faults import render_text
from zerorate.noise.kinds import KINDS
from zerorate.noise.quantities import TERMS, Quantity, Term, choose_display_unit, si_unit
from zerorate.numerals import DASH, format_significant, format_with_error
from zerorate.show.style import (
    BLACK,
    BLUE,
    FONT_PT,
    GREY,
    INCHES_PER_MM,
    ORANGE,
    VERMILION,
    add_panel,
    new_figure,
    shorten_source,
    style_decades,
    style_panels,
    write_caption,
    write_title,
)
from zerorate.show.tables import Table, as_text, bullet_list

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.noise import AllanResult, Coefficient, NoiseModel
    from zerorate.noise.characterise import Characterisation
    from zerorate.tasks.characterise import Characterisations

Logs = Mapping[str, Sequence["Characterisation"]]
"""Results of the logs, by the logs' names."""

# Sizes in mm.
_PANEL, _LEFT, _RIGHT, _BELOW, _ABOVE, _BETWEEN = (44.0, 44.0), 14.0, 3.0, 9.0, 6.0, 5.0
_CAPTION, _TITLE = 5.0, 11.0
_MAX_COLUMNS: Final = 4
_COLOURS: Final = (BLUE, VERMILION, BLACK, ORANGE, GREY)
_DASHES: Final = ("-", "--", ":", "-.")
_SHOWN_TERMS: Final = ("angle_random_walk", "bias_instability", "rate_random_walk")
"""Fields of N, B and K."""
_QUANTITIES: Final[tuple[Quantity, ...]] = ("angular rate", "acceleration", "unknown")


def plot_characterisations(results: Characterisations) -> Figure:
    """Return a figure with the deviations of several recordings."""
    return plot_overlay(
        {name: characterised.sensors for name, characterised in results.results.items()}
    )


def format_characterisations(results: Characterisations) -> str:
    """Return the noise of several recordings in one table, and notes on each recording."""
    parts = [
        format_overlay(
            {name: characterised.sensors for name, characterised in results.results.items()}
        )
    ]
    for name, characterised in results.results.items():
        alarms = "\n".join(map(render_text, characterised.alarms))
        text = "\n\n".join(filter(None, (alarms, bullet_list(characterised.notes))))
        parts += [f"{name}\n{text}"] if text else []
    return "\n\n".join(parts)


def plot_overlay(logs: Logs) -> Figure:
    """Return a figure with the deviations of several logs, and one panel per axis of a sensor.

    Gyros are above, accelerometers below, with the first four axes of each. Axes of different logs
    are compared in their order.

    `logs`: gyros and accelerometers of each log, by the log's name.
    """
    rows = [row for quantity in _QUANTITIES if (row := _select_curves(logs, quantity))]
    columns = min(max(len(curve.names) for row in rows for curve in row.values()), _MAX_COLUMNS)
    width = _LEFT + _RIGHT + columns * _PANEL[0] + (columns - 1) * _BETWEEN
    row_height = _PANEL[1] + _BELOW + _ABOVE
    figure = new_figure(width, _CAPTION + _TITLE + len(rows) * row_height)
    for i, row in enumerate(rows):
        low = _CAPTION + _BELOW + (len(rows) - 1 - i) * row_height
        lefts = [_LEFT + j * (_PANEL[0] + _BETWEEN) for j in range(columns)]
        panels = [add_panel(figure, left, low, *_PANEL) for left in lefts]
        _draw_row(panels, row)
        if i == 0:
            _write_names(figure, panels[0])
    write_title(figure, "How noisy is each log, by averaging time?")
    write_caption(figure, "Bands: 68 % intervals of the true deviation.")
    return figure


def _select_curves(logs: Logs, quantity: Quantity) -> dict[str, AllanResult]:
    return {
        name: sensor.curve
        for name, sensors in logs.items()
        for sensor in sensors
        if si_unit(sensor.curve.unit)[1] == quantity
    }


def _draw_row(panels: Sequence[Axes], row: Mapping[str, AllanResult]) -> None:
    curves = list(row.values())
    shown = choose_display_unit(curves[0])
    in_si = si_unit(curves[0].unit)[0]
    for k, (name, curve) in enumerate(row.items()):
        factor = shown.factor * si_unit(curve.unit)[0] / in_si
        line: dict[str, Any] = {
            "color": _COLOURS[k % len(_COLOURS)],
            "ls": _DASHES[k // len(_COLOURS) % 4],
        }
        for axes, axis in zip(panels, curve.axes, strict=False):
            positive = axis.deviation > 0.0
            taus, y, low, high = (
                values[positive] for values in (axis.taus, axis.deviation, axis.lower, axis.upper)
            )
            axes.plot(taus, factor * y, lw=0.9, label=shorten_source(name, 28), **line)
            axes.fill_between(taus, factor * low, factor * high, color=line["color"], alpha=0.15)
    labels = max((curve.names for curve in curves), key=len)
    for axes, label in zip(panels, labels, strict=False):
        axes.set(xscale="log", yscale="log", xlabel="averaging time [s]", title=label)
    unit = shown.unit.replace("ug", "µg").replace("^2", "²")
    panels[0].set_ylabel(f"{KINDS[curves[0].kind].title} [{unit}]")
    used = panels[: len(labels)]
    for axes in panels[len(labels) :]:
        axes.set_axis_off()
    limits = [axes.get_ylim() for axes in used]
    style_panels(used)
    for axes in used:
        axes.set_ylim(min(low for low, _ in limits), max(high for _, high in limits))
        style_decades(axes)
    for axes in used[1:]:
        axes.tick_params(which="both", labelleft=False)


def _write_names(figure: Figure, panel: Axes) -> None:
    """Write the names of the logs below the title."""
    handles, labels = panel.get_legend_handles_labels()
    top = 1.0 - 6.0 * INCHES_PER_MM / figure.get_figheight()
    figure.legend(
        handles,
        labels,
        loc="upper center",
        bbox_to_anchor=(0.5, top),
        ncols=min(len(labels), 3),
        fontsize=FONT_PT - 0.5,
        frameon=False,
        borderpad=0.0,
    )


def format_overlay(logs: Logs) -> str:
    """Return a table per sensor: white noise, bias instability and random walk of each log."""
    return "\n\n".join(as_text(table) for table in _make_tables(logs))


def _make_tables(logs: Logs) -> Iterator[Table]:
    for quantity in _QUANTITIES:
        terms = [term for term in TERMS[quantity] if term.field in _SHOWN_TERMS]
        rows = [
            (shorten_source(name, 40) if i == 0 else "", axis.name, *_make_cells(axis.model, terms))
            for name, sensors in logs.items()
            for log_sensor in sensors
            if si_unit(log_sensor.curve.unit)[1] == quantity
            for i, axis in enumerate(log_sensor.axes)
        ]
        if rows:
            sensor = {"angular rate": "Gyros", "acceleration": "Accelerometers"}.get(quantity, "")
            head = ("log", "axis", *(f"{n}, {t.shown}" for n, t in zip("NBK", terms, strict=True)))
            note = "; ".join(f"{n}: {t.name}" for n, t in zip("NBK", terms, strict=True))
            has_bounds = any("<" in cell for row in rows for cell in row)
            note += '; "<" marks an upper bound at 95 %' if has_bounds else ""
            yield Table(sensor or "Noise", head, tuple(rows), words=2, note=note, spare=(4, 3))


def _make_cells(model: NoiseModel | None, terms: Sequence[Term]) -> Iterator[str]:
    for term in terms:
        yield DASH if model is None else _format_cell(getattr(model, term.field), term.factor)


def _format_cell(coefficient: Coefficient, factor: float) -> str:
    if not coefficient.known:
        return DASH
    shown = coefficient.scaled(factor)
    if not shown.identifiable:
        return (
            f"< {format_significant(shown.upper_bound)}" if np.isfinite(shown.upper_bound) else DASH
        )
    return format_with_error(shown.value, shown.sigma)
