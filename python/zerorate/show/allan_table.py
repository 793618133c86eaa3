"""A characterisation as plain text: coefficients and deviations of every axis."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from zerorate.noise import AllanResult, Coefficient, NoiseModel
from zerorate.noise.characterise import Axis, Characterisation, notes_on
from zerorate.noise.kinds import KINDS
from zerorate.noise.quantities import TERMS, Quantity, Term, shown_unit, si_unit, term_of
from zerorate.numerals import significant, with_error
from zerorate.record.names import looks_like_accelerometer
from zerorate.show.tables import GAP, aligned, bulleted, prose
from zerorate.tasks.characterise import Characterised
from zerorate.texts import width

_SECOND: Final = "  by the spectrum"
_SECOND_FIELDS: Final = ("angle_random_walk", "bias_instability", "rate_random_walk")
_WORST: Final = "worst axis"
_BOUND: Final = (
    'A "<" is an upper bound at 95 %: the coefficient is not identifiable from this record.'
)
_UNIT: Final = '"unit" is the unit of the samples. Exports to estimators need to know which it is.'


def format_allan(found: Sequence[Characterisation]) -> str:
    """Return tables of coefficients and deviations, at most `WIDTH` columns wide.

    For each a heading, then a block for as many axes as fit side by side, in the units of data
    sheets.
    """
    text = "\n\n\n".join(_table(one) for one in found)
    said = [_BOUND] if "< " in text else []
    said += [_UNIT] if any(_quantity(one) == "unknown" for one in found) else []
    return "\n\n".join((text, "\n".join(map(prose, said)))) if said else text


def format_characterised(found: Characterised) -> str:
    """Return the tables of all sensors of a recording, and notes."""
    return "\n\n".join(filter(None, (format_allan(found.sensors), bulleted(found.notes))))


def format_allan_notes(found: Sequence[Characterisation]) -> str:
    """Return the sentences on motion, gaps and fits, and on the log.

    Empty if there is nothing to say.
    """
    return bulleted(notes_on(found))


def _table(found: Characterisation) -> str:
    columns = [_column(found, axis, i) for i, axis in enumerate(found.axes)]
    labels, units = _labels(found), _units(found)
    if len(columns) > 1 and found.worst is not None:
        columns.append(_worst_column(found, found.worst))
    blocks = (_block(labels, units, part) for part in _parts(labels, units, columns))
    return "\n\n".join((_heading(found), *blocks))


def _heading(found: Characterisation) -> str:
    quantity, curve = _quantity(found), found.curve
    named = quantity == "unknown" and looks_like_accelerometer(curve.names[0])
    sensor = "accelerometer" if named or quantity == "acceleration" else "gyro"
    return prose(
        f"{sensor}: {KINDS[curve.kind].title} of {curve.duration:g} s at {curve.rate:g} Hz, "
        f"{curve.taus.size} averaging times"
    )


def _labels(found: Characterisation) -> list[str]:
    labels = ["", *(label for term in _terms(found) for label in _of_term(found, term))]
    labels += ["Markov noise", "  correlation time"] * _n_markov(found)
    return [*labels, "", "deviation", *(f"  {tau:.4g} s" for tau in _shown_taus(found.curve))]


def _units(found: Characterisation) -> list[str]:
    units = [""]
    for term in _terms(found):
        units += [term.shown] + [""] * (len(_of_term(found, term)) - 1)
    units += [_walk(found).shown, "s"] * _n_markov(found)
    return [*units, "", shown_unit(found.curve).unit, *[""] * len(_shown_taus(found.curve))]


def _of_term(found: Characterisation, term: Term) -> list[str]:
    has_second = term.field in _SECOND_FIELDS and any(axis.second for axis in found.axes)
    return [term.name, _SECOND] if has_second else [term.name]


def _column(found: Characterisation, axis: Axis, i: int) -> list[str]:
    cells = [axis.name]
    for term in _terms(found):
        models = (axis.model, axis.second)
        cells += [
            _cell(model, term) for model, _ in zip(models, _of_term(found, term), strict=False)
        ]
    deviations = _deviations(found.curve.axis(i), shown_unit(found.curve).factor)
    return [*cells, *_markov(found, axis.model), "", "", *deviations]


def _worst_column(found: Characterisation, worst: NoiseModel) -> list[str]:
    cells = [_WORST]
    for term in _terms(found):
        cells += [_cell(worst, term)] + [""] * (len(_of_term(found, term)) - 1)
    empty = [""] * len(_shown_taus(found.curve))
    return [*cells, *_markov(found, worst), "", "", *empty]


def _cell(model: NoiseModel | None, term: Term) -> str:
    if model is None:
        return "-"
    return _coefficient(getattr(model, term.field), term.factor)


def _coefficient(coefficient: Coefficient, factor: float) -> str:
    if not coefficient.known:
        return "-"
    shown = coefficient.scaled(factor)
    if not shown.identifiable:
        return f"< {significant(shown.upper_bound)}"
    return with_error(shown.value, shown.sigma)


def _markov(found: Characterisation, model: NoiseModel | None) -> list[str]:
    if model is None:
        return ["-", "-"] * _n_markov(found)
    factor = _walk(found).factor
    pairs = [(_coefficient(m.amplitude, factor), f"{m.time:.3g}") for m in model.markov]
    return [cell for pair in pairs for cell in pair]


def _n_markov(found: Characterisation) -> int:
    return max((len(model.markov) for model in found.models if model is not None), default=0)


def _deviations(curve: AllanResult, factor: float) -> Iterator[str]:
    for tau in _shown_taus(curve):
        i = int(np.flatnonzero(curve.taus == tau)[0])
        middle, low, high = (a[i] for a in (curve.deviation, curve.lower, curve.upper))
        yield _with_bounds(factor * middle, low / middle, high / middle) if middle > 0.0 else "-"


def _with_bounds(value: float, low: float, high: float) -> str:
    """Return a deviation with its bounds in per cent of it."""
    if not np.isfinite([low, high]).all():
        return significant(value)
    down, up = (_per_cent(part) for part in (1.0 - low, high - 1.0))
    bounds = f"±{up}" if down == up else f"-{down}/+{up}"
    return f"{significant(value)} {bounds} %"


def _per_cent(part: float) -> str:
    return significant(100.0 * part, 1 if part < 0.1 else 2)


def _shown_taus(curve: AllanResult) -> list[float]:
    """Return the averaging times of the curve that are closest to the decades."""
    taus = curve.taus
    first, last = np.ceil(np.log10(taus[[0, -1]]) - 0.151)
    decades = 10.0 ** np.arange(first, last + 1)
    near = [int(np.argmin(np.abs(np.log(taus / decade)))) for decade in decades]
    return [float(taus[i]) for i in dict.fromkeys((*near, taus.size - 1))]


def _terms(found: Characterisation) -> tuple[Term, ...]:
    return TERMS[_quantity(found)] if found.worst is not None else ()


def _quantity(found: Characterisation) -> Quantity:
    return si_unit(found.curve.unit)[1]


def _walk(found: Characterisation) -> Term:
    return term_of(_quantity(found), "rate_random_walk")


def _parts(
    labels: Sequence[str], units: Sequence[str], columns: list[list[str]]
) -> Iterator[list[list[str]]]:
    """Yield as many columns at a time as fit beside the labels and units."""
    room = width() - _width(labels) - _width(units) - len(GAP)
    part: list[list[str]] = []
    for column in columns:
        if part and sum(_width(c) + len(GAP) for c in (*part, column)) > room:
            yield part
            part = []
        part.append(column)
    yield part


def _block(labels: Sequence[str], units: Sequence[str], columns: list[list[str]]) -> str:
    end = 1 + max(i for column in columns for i, cell in enumerate(column) if cell)
    # Blocks of one table are aligned with each other, so also by the rows that this one lacks.
    rows = list(zip(labels, units, *columns, strict=True))
    lines = zip(rows[:end], aligned(rows, 2), strict=False)
    return "\n".join(line for row, line in lines if any(row[2:]) or row[0] != _SECOND)


def _width(cells: Sequence[str]) -> int:
    return max(map(len, cells))
