"""Spans of one hard iron each, and which of them share one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from zerorate._native import magnet_partition
from zerorate.calibration.magnet.fit import Fit, covariance, fit, known_directions
from zerorate.calibration.magnet.ticks import Ticks, noise_of
from zerorate.types import Floats, Integers

_WALKS: Final = (0.5, 2.0, 8.0)
_PER: Final = 10
"""Ticks of a second."""
_SHORTEST: Final = 5.0
_APART: Final = 16.0


@dataclass(frozen=True)
class Span:
    """Seconds in which the hard iron is one.

    Parameters
    ----------
    start, stop
        Seconds since the first sample.
    kind
        "informative", "still" (too little turning to tell the iron) or "disturbed".
    group
        Which of the hard irons is its own.
    """

    start: float
    stop: float
    kind: str
    group: int = 0

    def within(self, ticks: Ticks) -> Integers:
        """Return the places of its ticks."""
        second = ticks.number // _PER
        return np.flatnonzero((second >= self.start) & (second < self.stop))


@dataclass(frozen=True, eq=False)
class _Member:
    spans: tuple[int, ...]
    iron: Floats
    covariance: Floats


def spans_of(ticks: Ticks) -> list[Span]:
    """Return the spans of least cost, of the walk of the field that has most evidence."""
    found = magnet_partition(ticks.number, ticks.turned, ticks.rotation, noise_of(ticks), _WALKS)
    spans = min(found, key=lambda one: one[0])[1]
    return [Span(i, j, "disturbed" if wild else "plain") for i, j, wild in spans]


def grouped(ticks: Ticks, spans: list[Span]) -> tuple[list[Span], int]:
    """Return the spans with their kinds and groups, and the number of groups."""
    spans, members = _informative(ticks, spans)
    members = _merged(ticks, spans, members)
    for g, member in enumerate(members):
        for place in member.spans:
            spans[place] = replace(spans[place], group=g)
    return spans, len(members)


def _informative(ticks: Ticks, spans: list[Span]) -> tuple[list[Span], list[_Member]]:
    found, members = list(spans), []
    for k, span in enumerate(spans):
        if span.kind == "disturbed":
            continue
        member = None
        if span.stop - span.start >= _SHORTEST:
            member = _member(ticks, spans, (k,))
        if member is not None and known_directions(member.covariance) >= 2:
            found[k] = replace(span, kind="informative")
            members.append(member)
        else:
            found[k] = replace(span, kind="still")
    return found, members


def _member(ticks: Ticks, spans: list[Span], which: tuple[int, ...]) -> _Member | None:
    places = np.concatenate([spans[k].within(ticks) for k in which])
    if len(places) < _PER:
        return None
    part, one = ticks.only(np.sort(places)), np.zeros(len(places), dtype=np.int64)
    found = fit(part, one)
    return _Member(which, found.iron[0], covariance(part, one, found)[8:, 8:])


def _merged(ticks: Ticks, spans: list[Span], members: list[_Member]) -> list[_Member]:
    """Merge the two nearest groups until none are alike: a magnet that goes leaves the old iron."""
    members = list(members)
    while len(members) > 1:
        pairs = [
            (_distance(a, b), i, j)
            for j, b in enumerate(members)
            for i, a in enumerate(members[:j])
        ]
        least, i, j = min(pairs)
        if least > _APART:
            break
        both = _member(ticks, spans, tuple(sorted(members[i].spans + members[j].spans)))
        assert both is not None
        members[i] = both
        del members[j]
    return members


def _distance(one: _Member, other: _Member) -> float:
    apart = one.iron - other.iron
    return float(apart @ np.linalg.solve(one.covariance + other.covariance, apart))


def joined(ticks: Ticks, spans: list[Span], found: Fit, group: Integers) -> list[Span]:
    """Give every other span the hard iron that keeps the field of the informative one next to it.

    ``found`` and ``group`` are of the ticks of informative spans.
    """
    second = ticks.number[
        np.concatenate([s.within(ticks) for s in spans if s.kind == "informative"])
    ]
    inverse = np.asarray(np.linalg.inv(found.matrix), dtype=np.float64)
    result: list[Span] = []
    for span in spans:
        inside = span.within(ticks)
        if span.kind == "informative" or not len(inside):
            result.append(span)
            continue
        middle = ticks.number[inside[len(inside) // 2]]
        known = found.fields[found.window[np.abs(second - middle).argmin()]]
        costs = [
            float(np.linalg.norm(_field(ticks, inside, inverse, iron) - known))
            for iron in found.iron
        ]
        result.append(replace(span, group=int(np.argmin(costs))))
    return result


def _field(ticks: Ticks, inside: Integers, inverse: Floats, iron: Floats) -> Floats:
    corrected = (ticks.field[inside] - iron) @ inverse.T
    turned: Floats = np.median((ticks.rotation[inside] @ corrected[:, :, None])[:, :, 0], axis=0)
    return turned
