"""A characterisation as plain text: coefficients and deviations of every axis."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from zerorate.noise import AllanResult, Coefficient, NoiseModel
from zerorate.noise.characterise import Axis, Characterisation, collect_notes
from zerorate.noise.kinds import KINDS
from zerorate.noise.quantities import TERMS, Quantity, Term, choose_display_unit, si_unit, term_of
from zerorate.numerals import format_significant, format_with_error, shorten
from zerorate.record.names import looks_like_accelerometer
from zerorate.show.tables import GAP, align_rows, bullet_list, wrap_prose
from zerorate.tasks.characterise import Characterised
from zerorate.texts import width

_SECOND_LABEL: Final = "  by the spectrum"
_SECOND_FIELDS: Final = ("angle_random_walk", "bias_instability", "rate_random_walk")
_WORST_LABEL: Final = "worst axis"
_BOUND_NOTE: Final = (
    'A "<" marks an upper bound at 95 %: this record does not determine the coefficient.'
)
_UNIT_NOTE: Final = '"unit" is the unknown unit of the samples; exports to estimators need it.'


def format_allan(sensors: Sequence[Characterisation]) -> str:
    """Return tables of coefficients and deviations, at most `WIDTH` characters wide.

    Each sensor has a heading and blocks. A block has as many axes as fit next to each other, in
    data-sheet units.
    """
    text = "\n\n\n".join(_format_sensor(sensor) for sensor in sensors)
    notes = [_BOUND_NOTE] if "< " in text else []
    notes += [_UNIT_NOTE] if any(_quantity(sensor) == "unknown" for sensor in sensors) else []
    return "\n\n".join((text, "\n".join(map(wrap_prose, notes)))) if notes else text


def format_characterised(result: Characterised) -> str:
    """Return the tables of all sensors of a recording, and notes."""
    return "\n\n".join(filter(None, (format_allan(result.sensors), bullet_list(result.notes))))


def format_allan_notes(sensors: Sequence[Characterisation]) -> str:
    """Return sentences on motion, gaps, fits and the log.

    The text is empty if there are no sentences.
    """
    return bullet_list(collect_notes(sensors))


def _format_sensor(sensor: Characterisation) -> str:
    columns = [_column(sensor, axis, i) for i, axis in enumerate(sensor.axes)]
    labels, units = _row_labels(sensor), _row_units(sensor)
    if len(columns) > 1 and sensor.worst is not None:
        columns.append(_worst_column(sensor, sensor.worst))
    blocks = (_format_block(labels, units, part) for part in _split_columns(labels, units, columns))
    return "\n\n".join((_format_heading(sensor), *blocks))


def _format_heading(characterisation: Characterisation) -> str:
    quantity, curve = _quantity(characterisation), characterisation.curve
    is_accelerometer = quantity == "unknown" and looks_like_accelerometer(curve.names[0])
    sensor = "accelerometer" if is_accelerometer or quantity == "acceleration" else "gyro"
    return wrap_prose(
        f"{sensor}: {KINDS[curve.kind].title} of {curve.duration:g} s at {curve.rate:g} Hz, "
        f"{curve.taus.size} averaging times"
    )


def _row_labels(sensor: Characterisation) -> list[str]:
    labels = ["", *(label for term in _terms(sensor) for label in _term_labels(sensor, term))]
    labels += ["Markov noise", "  correlation time"] * _count_markov(sensor)
    return [
        *labels,
        "",
        "deviation",
        *(f"  {shorten(tau, 4)} s" for tau in _shown_taus(sensor.curve)),
    ]


def _row_units(sensor: Characterisation) -> list[str]:
    units = [""]
    for term in _terms(sensor):
        units += [term.shown] + [""] * (len(_term_labels(sensor, term)) - 1)
    units += [_walk(sensor).shown, "s"] * _count_markov(sensor)
    return [
        *units,
        "",
        choose_display_unit(sensor.curve).unit,
        *[""] * len(_shown_taus(sensor.curve)),
    ]


def _term_labels(sensor: Characterisation, term: Term) -> list[str]:
    has_second = term.field in _SECOND_FIELDS and any(axis.second for axis in sensor.axes)
    return [term.name, _SECOND_LABEL] if has_second else [term.name]


def _column(sensor: Characterisation, axis: Axis, i: int) -> list[str]:
    cells = [axis.name]
    for term in _terms(sensor):
        models = (axis.model, axis.second)
        cells += [
            _format_cell(model, term)
            for model, _ in zip(models, _term_labels(sensor, term), strict=False)
        ]
    deviations = _format_deviations(sensor.curve.axis(i), choose_display_unit(sensor.curve).factor)
    return [*cells, *_markov_cells(sensor, axis.model), "", "", *deviations]


def _worst_column(sensor: Characterisation, worst: NoiseModel) -> list[str]:
    cells = [_WORST_LABEL]
    for term in _terms(sensor):
        cells += [_format_cell(worst, term)] + [""] * (len(_term_labels(sensor, term)) - 1)
    empty = [""] * len(_shown_taus(sensor.curve))
    return [*cells, *_markov_cells(sensor, worst), "", "", *empty]


def _format_cell(model: NoiseModel | None, term: Term) -> str:
    if model is None:
        return "-"
    return _format_coefficient(getattr(model, term.field), term.factor)


def _format_coefficient(coefficient: Coefficient, factor: float) -> str:
    if not coefficient.known:
        return "-"
    shown = coefficient.scaled(factor)
    if not shown.identifiable:
        return f"< {format_significant(shown.upper_bound)}"
    return format_with_error(shown.value, shown.sigma)


def _markov_cells(sensor: Characterisation, model: NoiseModel | None) -> list[str]:
    if model is None:
        return ["-", "-"] * _count_markov(sensor)
    factor = _walk(sensor).factor
    pairs = [
        (_format_coefficient(m.amplitude, factor), f"{shorten(m.time, 3)}") for m in model.markov
    ]
    return [cell for pair in pairs for cell in pair]


def _count_markov(sensor: Characterisation) -> int:
    return max((len(model.markov) for model in sensor.models if model is not None), default=0)


def _format_deviations(curve: AllanResult, factor: float) -> Iterator[str]:
    for tau in _shown_taus(curve):
        i = int(np.flatnonzero(curve.taus == tau)[0])
        middle, low, high = (a[i] for a in (curve.deviation, curve.lower, curve.upper))
        yield (
            _format_with_bounds(factor * middle, low / middle, high / middle)
            if middle > 0.0
            else "-"
        )


def _format_with_bounds(value: float, low: float, high: float) -> str:
    """Return a deviation with its bounds in percent."""
    if not np.isfinite([low, high]).all():
        return format_significant(value)
    down, up = (_format_percent(part) for part in (1.0 - low, high - 1.0))
    bounds = f"±{up}" if down == up else f"-{down}/+{up}"
    return f"{format_significant(value)} {bounds} %"


def _format_percent(part: float) -> str:
    return format_significant(100.0 * part, 1 if part < 0.1 else 2)


def _shown_taus(curve: AllanResult) -> list[float]:
    """Return the averaging times of the curve that are closest to powers of ten."""
    taus = curve.taus
    first, last = np.ceil(np.log10(taus[[0, -1]]) - 0.151)
    decades = 10.0 ** np.arange(first, last + 1)
    near = [int(np.argmin(np.abs(np.log(taus / decade)))) for decade in decades]
    return [float(taus[i]) for i in dict.fromkeys((*near, taus.size - 1))]


def _terms(sensor: Characterisation) -> tuple[Term, ...]:
    return TERMS[_quantity(sensor)] if sensor.worst is not None else ()


def _quantity(sensor: Characterisation) -> Quantity:
    return si_unit(sensor.curve.unit)[1]


def _walk(sensor: Characterisation) -> Term:
    return term_of(_quantity(sensor), "rate_random_walk")


def _split_columns(
    labels: Sequence[str], units: Sequence[str], columns: list[list[str]]
) -> Iterator[list[list[str]]]:
    """Yield groups of columns that fit next to the labels and units."""
    width_left = width() - _max_width(labels) - _max_width(units) - len(GAP)
    part: list[list[str]] = []
    for column in columns:
        if part and sum(_max_width(c) + len(GAP) for c in (*part, column)) > width_left:
            yield part
            part = []
        part.append(column)
    yield part


def _format_block(labels: Sequence[str], units: Sequence[str], columns: list[list[str]]) -> str:
    end = 1 + max(i for column in columns for i, cell in enumerate(column) if cell)
    # Align all blocks of a table, including with rows that this block does not have.
    rows = list(zip(labels, units, *columns, strict=True))
    lines = zip(rows[:end], align_rows(rows, 2), strict=False)
    return "\n".join(line for row, line in lines if any(row[2:]) or row[0] != _SECOND_LABEL)


def _max_width(cells: Sequence[str]) -> int:
    return max(map(len, cells))
