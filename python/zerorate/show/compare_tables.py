"""Comparison as plain text: tables of all recordings of a kind, or of every axis."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Final

from zerorate.numerals import DASH, format_or_dash
from zerorate.show.tables import Table, as_text, bullet_list
from zerorate.simulation import Contamination
from zerorate.tasks.compare.attitude import OFFLINE_METHODS
from zerorate.tasks.compare.comparison import Comparison
from zerorate.tasks.compare.measures import DEGRADATION_SUFFIX, ERROR_MEASURES, Row
from zerorate.tasks.compare.methods import HINDSIGHT_METHOD, WHOLE_RECORD_METHODS
from zerorate.tasks.compare.trial import Kind


@dataclass(frozen=True)
class Measure:
    """A measure in a table.

    Attributes
    ----------
    name, head : str
        Name in the rows of a comparison, and head of the column.
    factor : float
        Factor from SI to the shown unit.
    ideal : float
        Value of a perfect filter. The worst axis has the largest distance from it.
    of_one : bool
        True if the measure can only be compared within a recording. It is then shown only in tables
        of one axis.
    """

    name: str
    head: str
    factor: float = 1.0
    ideal: float = 0.0
    of_one: bool = False

    def of(self, row: Row) -> float:
        """Return a row's value in the shown unit."""
        known = self.factor if row.angle == "rad" else 1.0
        return known * row.values.get(self.name, math.nan)

    def badness(self, value: float) -> float:
        """Return the distance of a value from its ideal; double and half are equally far."""
        if self.ideal == 0.0:
            return abs(value)
        return abs(math.log(value / self.ideal)) if value > 0.0 else math.inf

    def text(self, value: float) -> str:
        """Return a value as text."""
        return format_or_dash(value)


@dataclass(frozen=True)
class Section:
    """A table of related measures.

    Attributes
    ----------
    title : str
        Title of the table.
    measures : tuple of Measure
        Columns of the table.
    question : str
        Question that the measures answer.
    """

    title: str
    measures: tuple[Measure, ...]
    question: str


DEG_PER_RAD: Final = math.degrees(1.0)
MS_PER_S: Final = 1e3
NS_PER_S: Final = 1e9
_NIS_MEASURES: Final = (
    Measure("nis_rest", "NIS at rest", ideal=1.0),
    Measure("nis_motion", "moving", ideal=1.0),
)


def _make_motion_section(title: str, name: str, *more: Measure) -> Section:
    return Section(
        f"In motion, {title}",
        (
            Measure(f"{name}_rmse", "error, deg/s", DEG_PER_RAD),
            Measure(f"{name}_delay", "delay, ms", MS_PER_S),
            Measure(f"{name}_rmse_undelayed", "without delay", DEG_PER_RAD),
            Measure(f"{name}_rmse_lowpass", "low-pass", DEG_PER_RAD),
            *more,
        ),
        "Which filter follows rotations best?",
    )


def _make_growth_section(title: str, name: str, *more: Measure) -> Section:
    return Section(
        f"Orientation, {title}",
        tuple(Measure(f"{name}_{h}", f"{h} s, deg", DEG_PER_RAD) for h in (1, 10, 60)) + more,
        "With which filter does an angle drift least?",
    )


_SECTIONS: Final[Mapping[Kind, tuple[Section, ...]]] = {
    "rest": (
        Section(
            "At rest",
            (
                Measure("coasting_10", "10 s, deg", DEG_PER_RAD, of_one=True),
                Measure("coasting_10_over_best", "10 s/best", ideal=1.0),
                Measure("coasting_60", "60 s, deg", DEG_PER_RAD, of_one=True),
                Measure("coasting_60_over_best", "60 s/best", ideal=1.0),
                Measure("allan_ratio", "Allan", ideal=1.0),
                Measure("nis", "NIS", ideal=1.0),
                Measure("reduction", "deviation"),
            ),
            "Which filter estimates the bias best at rest?",
        ),
    ),
    "turning": (
        _make_motion_section(
            "raw minus bias", "compensated", Measure("angle_drift", "angle, deg", DEG_PER_RAD)
        ),
        _make_motion_section("smoothed rate", "smooth", *_NIS_MEASURES),
    ),
    "orientation": (
        _make_growth_section("raw minus bias", "growth"),
        _make_growth_section("smoothed rate", "smooth_growth", *_NIS_MEASURES),
    ),
    "attitude": (
        Section(
            "Attitude in motion, nine axes",
            (
                Measure("total", "total, deg", DEG_PER_RAD),
                Measure("heading", "heading", DEG_PER_RAD),
                Measure("inclination", "inclination", DEG_PER_RAD),
                Measure("time", "ns", NS_PER_S),
            ),
            "Which filter estimates attitude best (nine axes)?",
        ),
        Section(
            "Attitude in motion, six axes",
            (
                Measure("heading_6", "heading, deg", DEG_PER_RAD),
                Measure("inclination_6", "inclination", DEG_PER_RAD),
                Measure("time_6", "ns", NS_PER_S),
            ),
            "Which filter estimates attitude best (six axes)?",
        ),
    ),
}
"""Tables of each kind, in order; the deviation at rest is last, as it is least informative."""

_DAGGER_NOTE: Final = "†: chosen with knowledge of the whole record, which no filter has"
_DOUBLE_DAGGER_NOTE: Final = "‡: uses later samples, which no live filter can"
_ACAUSAL_NOTE: Final = (
    "on the first half of a record alone it returned other values than on the whole record"
)
_CONTAMINATION_NOTE: Final = (
    "run on the contaminated record, scored on the clean one; /clean: error divided by that of "
    "the same method run on the clean record"
)

_NIS_NOTE: Final = (
    "NIS: normalised innovation squared, the mean of squared prediction errors over their "
    "predicted variance; 1: the variance is right; below 1: too large"
)
_LEGENDS: Final[Mapping[Kind, tuple[str, ...]]] = {
    "rest": (
        "10 s/best, 60 s/best: angle error after the bias estimate is held for this time, over "
        "that of the best moving average; 1: as good as this average",
        "Allan: Allan deviation of the estimate over that of the samples, at ten time constants "
        "of the filter; far below 1: the filter hides noise of the sensor",
        "deviation: standard deviation of the estimate over that of the samples; least "
        "informative, since any low-pass filter makes it small",
    ),
    "turning": (
        "error: RMS difference from the reference, and the same without delay; low-pass: error of "
        "a one-pole low-pass filter with the same delay; angle: largest error of the integrated "
        "rate",
    ),
    "orientation": (
        "mean angle between gyro and reference after this time of integration; first rest: the "
        "bias is the mean of the first ten seconds",
    ),
    "attitude": (
        "RMS angles between filter and reference while the reference rotates; nine axes: with "
        "magnetometer; six axes: without, so heading is the drift since motion began; ns: time "
        "per sample",
    ),
}
"""The meanings of the columns."""


def format_compare(comparisons: Sequence[Comparison], per_axis: bool = False) -> str:
    """Return the tables of each kind of recording, at most `WIDTH` characters wide, with notes.

    A dash marks an undefined number.

    `per_axis`: True gives tables for every axis. By default each number is the mean over all axes
    of all recordings of the kind. The worst axis is next to the mean.
    """
    return "\n\n".join(
        part for comparison in comparisons for part in _format_parts(comparison, per_axis)
    )


def leading_section(comparison: Comparison) -> Section:
    """Return the main measures for recordings of this kind."""
    section = _SECTIONS[comparison.kind][0]
    return (
        section
        if comparison.contamination is None
        else _contaminated_section(section, comparison.contamination)
    )


def format_comparison(comparison: Comparison) -> str:
    """Return the tables of one kind of recording."""
    return format_compare([comparison])


def _format_parts(comparison: Comparison, per_axis: bool) -> Iterator[str]:
    axes = [list(rows) for _, rows in groupby(comparison.rows, lambda row: (row.source, row.axis))]
    if not axes:
        yield bullet_list(comparison.notes)
        return
    for section in _SECTIONS[comparison.kind]:
        is_per_axis = per_axis or len(axes) == 1
        drawn_section = (
            section
            if comparison.contamination is None
            else _contaminated_section(section, comparison.contamination)
        )
        tables = (
            [_make_axis_table(drawn_section, axis_rows) for axis_rows in axes]
            if is_per_axis
            else [_make_summary_table(drawn_section, axes)]
        )
        yield from (as_text(table) for table in tables if table.rows)
    legends = (
        _LEGENDS[comparison.kind] if comparison.contamination is None else (_CONTAMINATION_NOTE,)
    )
    yield bullet_list((*legends, *_explain_marks(comparison), *comparison.notes))


def _explain_marks(comparison: Comparison) -> Iterator[str]:
    """Yield explanations of the marks in a table."""
    if comparison.contamination is None and any(map(_has_nis, comparison.rows)):
        yield _NIS_NOTE
    if HINDSIGHT_METHOD in comparison.methods:
        yield _DAGGER_NOTE
    yield from explain_acausal(_causality(comparison))


def _has_nis(row: Row) -> bool:
    return any(name.startswith("nis") and math.isfinite(row.values[name]) for name in row.values)


def explain_acausal(causal: Mapping[str, bool]) -> Iterator[str]:
    """Yield the meaning of the dagger if a method has it, and the reason for a user's method."""
    acausal = [method for method, known in causal.items() if not known]
    if acausal:
        yield _DOUBLE_DAGGER_NOTE
    for method in acausal:
        if method not in (*WHOLE_RECORD_METHODS, *OFFLINE_METHODS):
            yield f"{method}: {_ACAUSAL_NOTE}"


def _causality(comparison: Comparison) -> dict[str, bool]:
    acausal = {row.method for row in comparison.rows if not row.causal}
    return {method: method not in acausal for method in comparison.methods}


def _contaminated_section(section: Section, contamination: Contamination) -> Section:
    """Return a section of errors with contamination, and their ratio to the clean record."""
    errors = [
        measure
        for measure in section.measures
        if measure.name.removesuffix("_over_best") in ERROR_MEASURES
    ]
    ratios = [
        Measure(f"{measure.name}{DEGRADATION_SUFFIX}", f"{measure.head.partition(',')[0]}/clean")
        for measure in errors
        if measure.name in ERROR_MEASURES
    ]
    title = f"{section.title}, {contamination}"
    return Section(title, (*errors, *ratios), f"{section.question} {contamination}")


def _make_axis_table(section: Section, rows: Sequence[Row]) -> Table:
    first, measures = rows[0], section.measures
    axis_name = Path(first.source).name + (f", {first.axis}" if first.axis != "all" else "")
    lines = (
        (method_label([row]), *(measure.text(measure.of(row)) for measure in measures))
        for row in rows
    )
    # With an unknown unit, drop the unit from the head.
    head = (
        measure.head if first.angle == "rad" else measure.head.partition(",")[0]
        for measure in measures
    )
    return Table(f"{section.title}: {axis_name}", ("method", *head), _drop_empty_rows(lines))


def _make_summary_table(section: Section, axes: Sequence[Sequence[Row]]) -> Table:
    measures = [measure for measure in section.measures if not measure.of_one]
    head = (text for measure in measures for text in (measure.head, "worst"))
    title = f"{section.title}: mean and worst of {len(axes)} {_axes_noun(axes)}"
    lines = (
        (
            method_label(rows),
            *(cell for measure in measures for cell in _mean_and_worst(measure, rows)),
        )
        for rows in zip(*axes, strict=True)
    )
    last = 2 * len(measures)
    spare = (*range(last, 1, -2), *range(last - 1, 1, -2))  # first the worst axes, then means
    return Table(title, ("method", *head), _drop_empty_rows(lines), spare=spare)


def _axes_noun(axes: Sequence[Sequence[Row]]) -> str:
    return "recordings" if axes[0][0].axis == "all" else "axes"


def _mean_and_worst(measure: Measure, rows: Sequence[Row]) -> tuple[str, str]:
    finite = [value for value in map(measure.of, rows) if math.isfinite(value)]
    mean = sum(finite) / len(finite) if finite else math.nan
    return measure.text(mean), measure.text(max(finite, key=measure.badness, default=math.nan))


def _drop_empty_rows(lines: Iterable[tuple[str, ...]]) -> tuple[tuple[str, ...], ...]:
    """Return the rows of methods with at least one number in this table."""
    return tuple(line for line in lines if any(cell != DASH for cell in line[1:]))


def method_label(rows: Sequence[Row]) -> str:
    """Return the label of a method from its rows."""
    return mark_method(rows[0].method, all(row.causal for row in rows))


def mark_method(method: str, causal: bool) -> str:
    """Return a method's name, with a dagger if it uses later samples or the truth."""
    return f"{method}{'†' if method == HINDSIGHT_METHOD else '' if causal else '‡'}"
