"""Sentences on the aids of a track: estimated constants and rejected readings."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from zerorate._native import NavigationFilter
from zerorate.navigation.aids import AidResults
from zerorate.numerals import format_with_error
from zerorate.record.runs import runs

_SENSORS: Final = {
    "height": "barometer",
    "pressure": "barometer",
    "heading": "compass",
    "baseline": "two antennas",
}
_REJECTED: Final = 1
"""Index of "rejected" in `zerorate.navigation.VERDICTS`."""
_MIN_REJECTED_S: Final = 1.0


def describe_aids(nav: NavigationFilter, aids: Mapping[str, AidResults]) -> Iterator[str]:
    """Yield sentences on the constants that the filter estimated, and on rejected readings."""
    if math.isfinite(nav.height_reference_sigma):
        reference = format_with_error(nav.height_reference, nav.height_reference_sigma)
        yield f"the barometer's height is {reference} m above that of the receiver"
    if math.isfinite(nav.compass_offset_sigma):
        offset = format_with_error(*np.degrees([nav.compass_offset, nav.compass_offset_sigma]))
        yield f"the compass reads {offset} deg more than the heading"
    for kind, results in aids.items():
        yield from _describe_rejected(kind, results)


def _describe_rejected(kind: str, results: AidResults) -> Iterator[str]:
    """Yield a sentence if the readings of a sensor were rejected for a second or more."""
    spans = [
        (float(results.time[first]), float(results.time[last - 1]))
        for first, last in runs(results.verdict == _REJECTED)
        if results.time[last - 1] - results.time[first] >= _MIN_REJECTED_S
    ]
    if not spans:
        return
    longest = max(spans, key=lambda span: span[1] - span[0])
    count = int((results.verdict == _REJECTED).sum())
    more = "" if len(spans) == 1 else f" in {len(spans)} spans, the longest"
    yield (
        f"{_SENSORS[kind]}: {count} of {len(results.time)} readings are rejected{more} from "
        f"{longest[0]:.1f} to {longest[1]:.1f} s"
    )
