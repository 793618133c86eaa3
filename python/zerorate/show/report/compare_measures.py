"""Which measures of a comparison are shown, and how."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from zerorate.compare.measures import Row
from zerorate.compare.recording import Kind
from zerorate.numerals import significant

__all__ = ["LEGENDS", "NOTHING", "SECTIONS", "Measure", "Section"]

NOTHING: Final = "-"
"""Stands where a number means nothing."""


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
        Whether it means nothing beside those of other recordings, and stands in tables of one axis
        only.
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
        return significant(value) if math.isfinite(value) else NOTHING


@dataclass(frozen=True)
class Section:
    """A table of some measures.

    Attributes
    ----------
    title : str
        Of what the measures are.
    measures : tuple of Measure
        Its columns.
    """

    title: str
    measures: tuple[Measure, ...]


_DEG: Final = math.degrees(1.0)
_MS: Final = 1e3
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
    )


def _growth(title: str, name: str, *more: Measure) -> Section:
    return Section(
        f"Orientation, {title}",
        tuple(Measure(f"{name}_{h}", f"{h} s, deg", _DEG) for h in (1, 10, 60)) + more,
    )


SECTIONS: Final[Mapping[Kind, tuple[Section, ...]]] = {
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
}
"""The tables of each kind in their order; a deviation at rest comes last, for it tells least."""

_DAGGER: Final = "†: chosen with knowledge of the record, which no filter has"

LEGENDS: Final[Mapping[Kind, tuple[str, ...]]] = {
    "rest": (
        "10 s and 60 s: angle lost by holding the estimate so long, over that of the best moving "
        "average; Allan: deviation of the estimate over raw at ten times its memory, 0.92 or more "
        "if no noise is claimed away; NIS: 1 for a filter that knows its errors; deviation: of the "
        "estimate over raw, which any low-pass filter wins",
        _DAGGER,
    ),
    "turning": (
        "error to the reference, as it is and with its delay removed; low-pass: error of the "
        "one-pole low-pass filter of that delay; angle: largest error of the integrated rate",
        _DAGGER,
    ),
    "orientation": (
        "mean angle between gyro and reference after so many seconds of integration; first rest: "
        "the mean of the first ten seconds is taken for the bias",
    ),
}
"""What the columns mean."""
