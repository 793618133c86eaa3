"""Gyro on a rate table, or against a reference, as plain text."""

from collections.abc import Iterator

from zerorate.calibration.rate.rate_table import TERMS, RateTable, RateTableAxis
from zerorate.calibration.rate.reference import FittedRate
from zerorate.noise.coefficient import Coefficient
from zerorate.numerals import format_significant, format_with_error, shorten


def format_rate_table(table: RateTable) -> str:
    """Return the coefficients of each axis, with standard errors."""
    names = ("",) if len(table.axes) == 1 else ("x", "y", "z")
    lines = (_format_axis(name, axis) for name, axis in zip(names, table.axes, strict=True))
    return "\n".join(line for of_axis in lines for line in of_axis)


def format_fitted_rate(fit: FittedRate) -> str:
    """Return the fitted values with standard errors, and the notes."""
    fields = ("scale", "bias", "lag", "positive", "negative", "asymmetry")
    lines = [f"{name:<11}{_format_coefficient(getattr(fit, name))}" for name in fields]
    lines.append(f"{'residual':<11}{format_significant(fit.residual)}")
    return "\n".join((*lines, *(f"- {note}" for note in fit.notes)))


def _format_axis(name: str, axis: RateTableAxis) -> Iterator[str]:
    head = f"{name} " if name else ""
    for field in ("bias", "scale", *TERMS):
        yield f"{head}{field:<14}{_format_term(getattr(axis, field))}"
    for other, coefficient in zip(
        (axis for axis in "xyz" if axis != name), axis.cross, strict=False
    ):
        yield f"{head}cross {other:<8}{_format_term(coefficient)}"
    yield f"{head}non-linearity {shorten(100.0 * axis.nonlinearity)} % of full scale"


def _format_term(coefficient: Coefficient) -> str:
    if coefficient.identifiable:
        return format_with_error(coefficient.value, coefficient.sigma)
    return (
        f"not chosen, below {shorten(coefficient.upper_bound)}"
        if coefficient.known
        else "not identifiable"
    )


def _format_coefficient(coefficient: Coefficient) -> str:
    if coefficient.identifiable:
        return format_with_error(coefficient.value, coefficient.sigma)
    return "not identifiable"
