"""Temperature model as plain text: bias, slope and hysteresis of each axis, and notes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from zerorate.numerals import DASH, format_significant, format_with_error
from zerorate.show.tables import Table, as_text, bullet_list

if TYPE_CHECKING:
    from zerorate.calibration.temperature import TemperatureModel
    from zerorate.noise.coefficient import Coefficient

_BOUND_NOTE: Final = 'A "<" marks an upper bound at 95 %: the record does not determine the slope.'


def format_temperature(model: TemperatureModel) -> str:
    """Return a table with one row per axis, and the notes below it."""
    low, high = model.range
    head = (
        f"bias [{model.unit}]",
        "degree",
        f"at {model.reference:.1f} degC",
        "per K",
        "warming minus cooling",
    )
    rows = tuple(_make_row(model, i) for i in range(model.axes))
    title = f"Bias from {low:.1f} to {high:.1f} degC"
    has_bounds = any("<" in row[3] for row in rows)
    table = as_text(Table(title, head, rows, note=_BOUND_NOTE if has_bounds else ""))
    return "\n\n".join(filter(None, (table, bullet_list(model.notes))))


def _make_row(model: TemperatureModel, i: int) -> tuple[str, ...]:
    level = format_with_error(model.coefficients[i, 0], model.covariance[i, 0, 0] ** 0.5)
    cells = (model.names[i], str(model.degrees[i]), level)
    return (*cells, _format_coefficient(model.slopes[i]), _format_coefficient(model.hystereses[i]))


def _format_coefficient(coefficient: Coefficient) -> str:
    if not coefficient.known:
        return DASH
    return (
        format_with_error(coefficient, coefficient.sigma)
        if coefficient.identifiable
        else f"< {format_significant(coefficient.upper_bound)}"
    )
