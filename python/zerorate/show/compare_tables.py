"""A comparison as plain text: tables of all recordings of a kind, or of every axis."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Final

from zerorate.numerals import NOTHING, or_dash
from zerorate.show.tables import Table, as_text, bulleted
from zerorate.simulation import Contamination
from zerorate.tasks.compare.attitude import OFFLINE
from zerorate.tasks.compare.comparison import Comparison
from zerorate.tasks.compare.measures import DEGRADATION, ERRORS, Row
from zerorate.tasks.compare.methods import HINDSIGHT, WHOLE
from zerorate.tasks.compare.trial import Kind


@dataclass(frozen=True)
class Measure:
    """One measure in a table.

    Attributes
    ----------
    name, head : str
        In the rows of a comparison, and over its column.
    factor : float
        From SI to the unit shown.
    ideal : float
        The value of a perfect filter; the worst axis is that farthest from it.
    of_one : bool
        Whether it can be compared only within one recording, so that it stands in tables of one
        axis only.
    """

    name: str
    head: str
    factor: float = 1.0
    ideal: float = 0.0
    of_one: bool = False

    def of(self, row: Row) -> float:
        """Return what is shown of a row."""
        known = self.factor if row.angle == "rad" else 1.0
        return known * row.values.get(self.name, math.nan)

    def badness(self, value: float) -> float:
        """Return how far a value shown is from ideal; twice is as far as half."""
        if self.ideal == 0.0:
            return abs(value)
        return abs(math.log(value / self.ideal)) if value > 0.0 else math.inf

    def text(self, value: float) -> str:
        """Return a value as it is shown."""
        return or_dash(value)


@dataclass(frozen=True)
class Section:
    """A table of some measures.

    Attributes
    ----------
    title : str
        Of what the measures are.
    measures : tuple of Measure
        Its columns.
    question : str
        What they answer.
    """

    title: str
    measures: tuple[Measure, ...]
    question: str


_DEG: Final = math.degrees(1.0)
_MS: Final = 1e3
_NS: Final = 1e9
_NIS: Final = (
    Measure("nis_rest", "NIS at rest", ideal=1.0),
    Measure("nis_motion", "moving", ideal=1.0),
)


def _moving(title: str, name: str, *more: Measure) -> Section:
    return Section(
        f"In motion, {title}",
        (
            Measure(f"{name}_rmse", "error, deg/s", _DEG),
            Measure(f"{name}_delay", "delay, ms", _MS),
            Measure(f"{name}_rmse_undelayed", "without delay", _DEG),
            Measure(f"{name}_rmse_lowpass", "low-pass", _DEG),
            *more,
        ),
        "Which filter follows the turns best?",
    )


def _growth(title: str, name: str, *more: Measure) -> Section:
    return Section(
        f"Orientation, {title}",
        tuple(Measure(f"{name}_{h}", f"{h} s, deg", _DEG) for h in (1, 10, 60)) + more,
        "With which filter does an angle drift least?",
    )


_SECTIONS: Final[Mapping[Kind, tuple[Section, ...]]] = {
    "rest": (
        Section(
            "At rest",
            (
                Measure("coasting_10", "10 s, deg", _DEG, of_one=True),
                Measure("coasting_10_over_best", "10 s/best", ideal=1.0),
                Measure("coasting_60", "60 s, deg", _DEG, of_one=True),
                Measure("coasting_60_over_best", "60 s/best", ideal=1.0),
                Measure("allan_ratio", "Allan", ideal=1.0),
                Measure("nis", "NIS", ideal=1.0),
                Measure("reduction", "deviation"),
            ),
            "Which filter knows the bias best at rest?",
        ),
    ),
    "turning": (
        _moving("raw minus bias", "compensated", Measure("angle_drift", "angle, deg", _DEG)),
        _moving("smoothed rate", "smooth", *_NIS),
    ),
    "orientation": (
        _growth("raw minus bias", "growth"),
        _growth("smoothed rate", "smooth_growth", *_NIS),
    ),
    "attitude": (
        Section(
            "Attitude in motion, nine axes",
            (
                Measure("total", "total, deg", _DEG),
                Measure("heading", "heading", _DEG),
                Measure("inclination", "inclination", _DEG),
                Measure("time", "ns", _NS),
            ),
            "Which filter knows best how it lies (nine axes)?",
        ),
        Section(
            "Attitude in motion, six axes",
            (
                Measure("heading_6", "heading, deg", _DEG),
                Measure("inclination_6", "inclination", _DEG),
                Measure("time_6", "ns", _NS),
            ),
            "Which filter knows best how it lies (six axes)?",
        ),
    ),
}
"""The tables of each kind in their order; a deviation at rest comes last, for it says least."""

_DAGGER: Final = "†: chosen with knowledge of the record, which no filter has"
_DOUBLE_DAGGER: Final = "‡: uses samples that come later, which no filter does"
_FOUND: Final = (
    "given the first half of a record alone, it returned other values for that half than with the "
    "rest after it"
)
_JUDGED: Final = (
    "fed with the contaminated record and judged by the clean one; /clean: error over that of the "
    "same method fed with the clean record"
)

_ON_NIS: Final = (
    "NIS: normalised innovation squared, the mean square of the prediction errors over the "
    "variance that the filter gave them. 1: it knows its errors; below 1 it expects larger ones"
)
_LEGENDS: Final[Mapping[Kind, tuple[str, ...]]] = {
    "rest": (
        "10 s/best, 60 s/best: error of the angle after the estimate was held for so long as the "
        "bias, over that of the best moving average; 1 is as good as that average",
        "Allan: Allan deviation of the estimate over that of the samples, at ten times the memory "
        "of the filter; far below 1 the filter hides noise that the sensor has",
        "deviation: standard deviation of the estimate over that of the samples; any low-pass "
        "filter makes it small, so it says least",
    ),
    "turning": (
        "error: RMS difference from the reference, and the same without delay; low-pass: error of "
        "the one-pole low-pass filter that is as late; angle: largest error of the integrated rate",
    ),
    "orientation": (
        "mean angle between gyro and reference after so many seconds of integration; first rest: "
        "the mean of the first ten seconds is taken for the bias",
    ),
    "attitude": (
        "RMS angles between filter and reference while that turns; nine axes: with magnetometer; "
        "six axes: without, so heading is drift since the motion began; ns: what a sample took",
    ),
}
"""What the columns mean."""


def format_compare(found: Sequence[Comparison], per_axis: bool = False) -> str:
    """Return the tables of each kind, at most `WIDTH` columns wide, with their notes.

    A dash stands where a number means nothing.

    `per_axis`: whether every axis has tables of its own; by default each number is the mean over
    all axes of all recordings of the kind, with that of the worst axis next to it.
    """
    return "\n\n".join(part for one in found for part in _parts(one, per_axis))


def leading_section(found: Comparison) -> Section:
    """Return the measures by which recordings of this kind are judged first."""
    section = _SECTIONS[found.kind][0]
    return section if found.contamination is None else _faulty(section, found.contamination)


def format_comparison(found: Comparison) -> str:
    """Return the tables of one kind of recording."""
    return format_compare([found])


def _parts(found: Comparison, per_axis: bool) -> Iterator[str]:
    axes = [list(rows) for _, rows in groupby(found.rows, lambda row: (row.source, row.axis))]
    if not axes:
        yield bulleted(found.notes)
        return
    for section in _SECTIONS[found.kind]:
        alone = per_axis or len(axes) == 1
        shown = section if found.contamination is None else _faulty(section, found.contamination)
        tables = [_of_one(shown, one) for one in axes] if alone else [_of_all(shown, axes)]
        yield from (as_text(table) for table in tables if table.rows)
    legends = _LEGENDS[found.kind] if found.contamination is None else (_JUDGED,)
    yield bulleted((*legends, *_on_marks(found), *found.notes))


def _on_marks(found: Comparison) -> Iterator[str]:
    """Yield what needs a word where it stands in a table."""
    if found.contamination is None and any(map(_has_nis, found.rows)):
        yield _ON_NIS
    if HINDSIGHT in found.methods:
        yield _DAGGER
    yield from on_looking_ahead(_causal(found))


def _has_nis(row: Row) -> bool:
    return any(name.startswith("nis") and math.isfinite(row.values[name]) for name in row.values)


def on_looking_ahead(causal: Mapping[str, bool]) -> Iterator[str]:
    """Yield what the mark means where a method has it, and how it was found of a user's own."""
    ahead = [method for method, known in causal.items() if not known]
    if ahead:
        yield _DOUBLE_DAGGER
    for method in ahead:
        if method not in (*WHOLE, *OFFLINE):
            yield f"{method}: {_FOUND}"


def _causal(found: Comparison) -> dict[str, bool]:
    ahead = {row.method for row in found.rows if not row.causal}
    return {method: method not in ahead for method in found.methods}


def _faulty(section: Section, contamination: Contamination) -> Section:
    """Return a section of the errors alone, with the ratios to those on the clean record."""
    errors = [one for one in section.measures if one.name.removesuffix("_over_best") in ERRORS]
    ratios = [
        Measure(f"{one.name}{DEGRADATION}", f"{one.head.partition(',')[0]}/clean")
        for one in errors
        if one.name in ERRORS
    ]
    title = f"{section.title}, {contamination}"
    return Section(title, (*errors, *ratios), f"{section.question} {contamination}")


def _of_one(section: Section, rows: Sequence[Row]) -> Table:
    first, measures = rows[0], section.measures
    place = Path(first.source).name + (f", {first.axis}" if first.axis != "all" else "")
    lines = ((label([row]), *(one.text(one.of(row)) for one in measures)) for row in rows)
    # Of an unknown unit no more can be said.
    head = (one.head if first.angle == "rad" else one.head.partition(",")[0] for one in measures)
    return Table(f"{section.title}: {place}", ("method", *head), _with_numbers(lines))


def _of_all(section: Section, axes: Sequence[Sequence[Row]]) -> Table:
    shared = [one for one in section.measures if not one.of_one]
    head = (text for one in shared for text in (one.head, "worst"))
    title = f"{section.title}: mean and worst of {len(axes)} {_counted(axes)}"
    lines = (
        (label(rows), *(cell for one in shared for cell in _mean_and_worst(one, rows)))
        for rows in zip(*axes, strict=True)
    )
    last = 2 * len(shared)
    spare = (*range(last, 1, -2), *range(last - 1, 1, -2))  # the worst, then means
    return Table(title, ("method", *head), _with_numbers(lines), spare=spare)


def _counted(axes: Sequence[Sequence[Row]]) -> str:
    return "recordings" if axes[0][0].axis == "all" else "axes"


def _mean_and_worst(measure: Measure, rows: Sequence[Row]) -> tuple[str, str]:
    known = [value for value in map(measure.of, rows) if math.isfinite(value)]
    mean = sum(known) / len(known) if known else math.nan
    return measure.text(mean), measure.text(max(known, key=measure.badness, default=math.nan))


def _with_numbers(lines: Iterable[tuple[str, ...]]) -> tuple[tuple[str, ...], ...]:
    """Return the rows of methods that have a number in this table."""
    return tuple(line for line in lines if any(cell != NOTHING for cell in line[1:]))


def label(rows: Sequence[Row]) -> str:
    """Return what the rows of one method are called."""
    return marked(rows[0].method, all(row.causal for row in rows))


def marked(method: str, causal: bool) -> str:
    """Return the name of a method with a dagger if it knows what no filter does."""
    return f"{method}{'†' if method == HINDSIGHT else '' if causal else '‡'}"
