"""Spans with a constant hard iron, and groups of spans with the same hard iron."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from zerorate._native import magnet_partition
from zerorate.calibration.magnet.fit import Fit, count_known_directions, covariance, fit
from zerorate.calibration.magnet.ticks import Ticks, estimate_noise
from zerorate.types import Floats, Integers

_WALK_STRENGTHS: Final = (0.5, 2.0, 8.0)
_TICKS_PER_S: Final = 10
"""Ticks per second."""
_MIN_SPAN_S: Final = 5.0
_MIN_CHI_SQUARED: Final = 16.0


@dataclass(frozen=True)
class Span:
    """Interval with a constant hard iron.

    Parameters
    ----------
    start, stop
        Start and stop, s, since the first sample.
    kind
        "informative", "still" (too little rotation for the iron) or "disturbed".
    group
        Index of the group of spans with the same hard iron.
    """

    start: float
    stop: float
    kind: str
    group: int = 0

    def tick_indices(self, ticks: Ticks) -> Integers:
        """Return the indices of the ticks (short means of all sensors) in this span."""
        second = ticks.number // _TICKS_PER_S
        return np.flatnonzero((second >= self.start) & (second < self.stop))


def list_iron_changes(
    spans: Sequence[Span], irons: Sequence[Sequence[float]]
) -> Iterator[tuple[float, float]]:
    """Yield start and size of each change of the hard iron, in the unit of the irons."""
    for before, after in pairwise(span for span in spans if span.kind != "disturbed"):
        if before.group != after.group:
            change = np.subtract(irons[after.group], irons[before.group])
            yield after.start, float(np.linalg.norm(change))


@dataclass(frozen=True, eq=False)
class _Member:
    spans: tuple[int, ...]
    iron: Floats
    covariance: Floats


def partition_spans(ticks: Ticks) -> list[Span]:
    """Return the spans of least cost, for the walk of the field with the most evidence."""
    partitions = magnet_partition(
        ticks.number, ticks.rotated_field, ticks.rotation, estimate_noise(ticks), _WALK_STRENGTHS
    )
    spans = min(partitions, key=lambda partition: partition[0])[1]
    return [Span(i, j, "disturbed" if is_disturbed else "plain") for i, j, is_disturbed in spans]


def group_spans(ticks: Ticks, spans: list[Span]) -> tuple[list[Span], int]:
    """Return the spans with their kinds and groups, and the number of groups."""
    spans, members = _classify_spans(ticks, spans)
    members = _merge_members(ticks, spans, members)
    for g, member in enumerate(members):
        for index in member.spans:
            spans[index] = replace(spans[index], group=g)
    return spans, len(members)


def _classify_spans(ticks: Ticks, spans: list[Span]) -> tuple[list[Span], list[_Member]]:
    classified, members = list(spans), []
    for k, span in enumerate(spans):
        if span.kind == "disturbed":
            continue
        member = None
        if span.stop - span.start >= _MIN_SPAN_S:
            member = _fit_member(ticks, spans, (k,))
        if member is not None and count_known_directions(member.covariance) >= 2:
            classified[k] = replace(span, kind="informative")
            members.append(member)
        else:
            classified[k] = replace(span, kind="still")
    return classified, members


def _fit_member(ticks: Ticks, spans: list[Span], which: tuple[int, ...]) -> _Member | None:
    indices = np.concatenate([spans[k].tick_indices(ticks) for k in which])
    if len(indices) < _TICKS_PER_S:
        return None
    part, zero_group = ticks.select(np.sort(indices)), np.zeros(len(indices), dtype=np.int64)
    iron_fit = fit(part, zero_group)
    return _Member(which, iron_fit.iron[0], covariance(part, zero_group, iron_fit)[8:, 8:])


def _merge_members(ticks: Ticks, spans: list[Span], members: list[_Member]) -> list[_Member]:
    """Merge the two nearest groups until all differ: a removed magnet leaves the old iron."""
    members = list(members)
    while len(members) > 1:
        pairs = [
            (_distance(a, b), i, j)
            for j, b in enumerate(members)
            for i, a in enumerate(members[:j])
        ]
        least, i, j = min(pairs)
        if least > _MIN_CHI_SQUARED:
            break
        both = _fit_member(ticks, spans, tuple(sorted(members[i].spans + members[j].spans)))
        assert both is not None
        members[i] = both
        del members[j]
    return members


def _distance(first: _Member, second: _Member) -> float:
    difference = first.iron - second.iron
    return float(difference @ np.linalg.solve(first.covariance + second.covariance, difference))


def assign_groups(ticks: Ticks, spans: list[Span], iron_fit: Fit, group: Integers) -> list[Span]:
    """Give every other span the hard iron that keeps the field of the nearest informative span.

    ``iron_fit`` and ``group`` refer to the ticks of informative spans.
    """
    second = ticks.number[
        np.concatenate([s.tick_indices(ticks) for s in spans if s.kind == "informative"])
    ]
    inverse = np.asarray(np.linalg.inv(iron_fit.matrix), dtype=np.float64)
    result: list[Span] = []
    for span in spans:
        inside = span.tick_indices(ticks)
        if span.kind == "informative" or not len(inside):
            result.append(span)
            continue
        middle = ticks.number[inside[len(inside) // 2]]
        known = iron_fit.fields[iron_fit.window[np.abs(second - middle).argmin()]]
        costs = [
            float(np.linalg.norm(_median_field(ticks, inside, inverse, iron) - known))
            for iron in iron_fit.iron
        ]
        result.append(replace(span, group=int(np.argmin(costs))))
    return result


def _median_field(ticks: Ticks, inside: Integers, inverse: Floats, iron: Floats) -> Floats:
    corrected = (ticks.field[inside] - iron) @ inverse.T
    rotated: Floats = np.median((ticks.rotation[inside] @ corrected[:, :, None])[:, :, 0], axis=0)
    return rotated
