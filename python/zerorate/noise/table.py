"""A noise model as a table of text, in the units of data sheets."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from zerorate.noise.coefficient import Coefficient
from zerorate.noise.quantities import TERMS, Term, term_of
from zerorate.units import convert

if TYPE_CHECKING:
    from zerorate.noise.model import NoiseModel

__all__ = ["table"]

Row = tuple[str, str, str]


def table(model: "NoiseModel") -> str:
    """Return aligned lines without an end: term, value with standard error, unit."""
    rows = list(_rows(model))
    if not rows:
        return "no noise"
    name_width = max(len(name) for name, _, _ in rows)
    value_width = max((len(value) for _, value, unit in rows if unit), default=0)
    return "\n".join(
        f"{name.ljust(name_width)}  {value.ljust(value_width)}  {unit}".rstrip()
        for name, value, unit in rows
    )


def _rows(model: "NoiseModel") -> Iterator[Row]:
    for term in TERMS[model.quantity]:
        coefficient = getattr(model, term.field)
        if coefficient.conservative != 0.0:
            yield _row(term, coefficient)
    driving = term_of(model.quantity, "rate_random_walk")
    rate = term_of(model.quantity, "bias_instability")
    for markov in model.markov:
        yield _row(driving._replace(name="Markov noise"), markov.amplitude)
        yield "  correlation time", _value(markov.time), "s"
    for sinusoid in model.sinusoid:
        yield _row(rate._replace(name="sinusoid"), sinusoid.amplitude)
        yield "  frequency", _value(sinusoid.frequency), "Hz"


def _row(term: Term, coefficient: Coefficient) -> Row:
    shown = coefficient.scaled(convert(1.0, term.unit, term.shown))
    if not shown.identifiable:
        return term.name, f"not identifiable (< {shown.upper_bound:.2g} {term.shown})", ""
    return term.name, _value(shown), term.shown


def _value(coefficient: Coefficient) -> str:
    if coefficient.sigma == 0.0:
        return f"{coefficient:.4g}"
    return f"{coefficient:.4g} ± {coefficient.sigma:.2g}"
