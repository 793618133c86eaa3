"""Coefficients of a noise model as plain text."""

from collections.abc import Iterator

from zerorate.noise.coefficient import Coefficient
from zerorate.noise.model import NoiseModel
from zerorate.noise.quantities import TERMS, Term, term_of

Row = tuple[str, str, str]


def format_noise_model(model: NoiseModel) -> str:
    """Return aligned lines with term, value, standard error and unit."""
    rows, unknown = list(_make_rows(model)), _list_unknown(model)
    if not rows and not unknown:
        return "no noise"
    name_width = max((len(name) for name, _, _ in rows), default=0)
    value_width = max((len(value) for _, value, unit in rows if unit), default=0)
    lines = [
        f"{name.ljust(name_width)}  {value.ljust(value_width)}  {unit}".rstrip()
        for name, value, unit in rows
    ]
    if unknown:
        lines.append(f"unknown: {', '.join(unknown)}")
    if model.quantity == "unknown":
        lines.append('"unit" is the unknown unit of the samples')
    return "\n".join(lines)


def _list_unknown(model: NoiseModel) -> list[str]:
    """Return the names of the coefficients without a value or a bound."""
    terms = TERMS[model.quantity]
    return [term.name for term in terms if not getattr(model, term.field).known]


def _make_rows(model: NoiseModel) -> Iterator[Row]:
    for term in TERMS[model.quantity]:
        coefficient = getattr(model, term.field)
        if coefficient.known and coefficient.conservative != 0.0:
            yield _make_row(term, coefficient)
    driving = term_of(model.quantity, "rate_random_walk")
    rate = term_of(model.quantity, "bias_instability")
    for markov in model.markov:
        yield _make_row(driving._replace(name="Markov noise"), markov.amplitude)
        yield "  correlation time", _format_value(markov.time), "s"
    for sinusoid in model.sinusoid:
        yield _make_row(rate._replace(name="sinusoid"), sinusoid.amplitude)
        yield "  frequency", _format_value(sinusoid.frequency), "Hz"


def _make_row(term: Term, coefficient: Coefficient) -> Row:
    shown = coefficient.scaled(term.factor)
    if not shown.identifiable:
        return term.name, f"not identifiable (< {shown.upper_bound:.2g} {term.shown})", ""
    return term.name, _format_value(shown), term.shown


def _format_value(coefficient: Coefficient) -> str:
    if coefficient.sigma == 0.0:
        return f"{coefficient:.4g}"
    return f"{coefficient:.4g} ± {coefficient.sigma:.2g}"
