"""What of a fit is applied: only what more than halves the scatter of samples it had not seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate.calibration.magnet.fit import (
    FULL,
    ROTATION,
    SCALE,
    SOFT_KNOWN,
    SYMMETRIC,
    Fit,
    conditioned,
    covariance,
    fit,
    known_directions,
    root_mean,
    soft_known,
    unseen,
)
from zerorate.calibration.magnet.spans import Span, grouped, joined
from zerorate.calibration.magnet.ticks import Ticks
from zerorate.types import Booleans, Floats, Integers

_HALVED: Final = 0.40
_LARGE_CHI: Final = 25.0
_SIZES: Final = (0.10, 0.25)
_LEFT: Final = (_HALVED, 0.7)
"""Scatter that a hard iron may leave, by its size: a room does a tenth of the field, a quarter is
none of a room; between them in proportion."""
_PAYS: Final = 0.85
_MOST: Final = 0.6


@dataclass(frozen=True, eq=False)
class Chosen:
    """The fit, and what of it is applied, in units of the field's median size.

    Parameters
    ----------
    spans : list of Span
        All of the record.
    iron : ndarray, shape (g, 3)
        Of each group as found; what is not known of it is zero.
    applied : ndarray of bool, shape (g,)
        Whether it is taken off.
    elements, soft
        Of D - 1 as applied, zero where none are, and which were fitted.
    rotation, rotation_sigma : ndarray, shape (3,)
        Antisymmetric elements of a fit of everything, and their deviations.
    covariance : ndarray, shape (8 + 3 g, 8 + 3 g)
        Of elements of D, then hard irons.
    raw, left : ndarray, shape (g,)
        Unseen scatter of each group, raw and with the hard iron.
    fit : Fit
        Last one.
    ticks, group
        Those that were fitted.
    total_raw, total_left
        Unseen scatter of all of them, raw and as applied.
    """

    spans: list[Span]
    iron: Floats
    applied: Booleans
    elements: Floats
    soft: tuple[int, ...]
    rotation: Floats
    rotation_sigma: Floats
    covariance: Floats
    raw: Floats
    left: Floats
    fit: Fit
    ticks: Ticks
    group: Integers
    total_raw: float
    total_left: float


def chosen(ticks: Ticks, spans: list[Span], one: bool = False) -> Chosen | None:
    """Return what is applied of the fit; None where no hard iron has two known directions."""
    spans, groups = grouped(ticks, spans)
    several = None
    if groups and not one:
        several = _of_groups(ticks, spans)
    if several is not None and groups == 1:
        return _finished(ticks, several[0], several[1], several[2])
    if several is not None:
        some, group, spans = several
        squares = root_mean(unseen(some, group, ()))
        alone = root_mean(unseen(some, np.zeros_like(group), ()))
        if squares <= _PAYS * alone:
            return _finished(ticks, some, group, spans)
    whole = [
        Span(s.start, s.stop, "disturbed" if s.kind == "disturbed" else "informative")
        for s in spans
    ]
    group = np.zeros(ticks.n, dtype=np.int64)
    found = fit(ticks, group)
    if known_directions(covariance(ticks, group, found)[8:, 8:]) < 2:
        return None
    return _finished(ticks, ticks, group, whole)


def _of_groups(ticks: Ticks, spans: list[Span]) -> tuple[Ticks, Integers, list[Span]]:
    group = np.full(ticks.n, -1)
    for span in spans:
        if span.kind == "informative":
            group[span.within(ticks)] = span.group
    used = group >= 0
    return ticks.only(used), group[used], spans


def _finished(ticks: Ticks, some: Ticks, group: Integers, spans: list[Span]) -> Chosen:
    groups = int(group.max()) + 1
    found = fit(some, group)
    matrix = covariance(some, group, found)
    raw, left = _by_group(some, group)
    applied = _applied(found, matrix, raw, left)
    all_raw, all_left = float(raw[0]), float(left[0])
    if groups > 1:
        all_raw, all_left = (root_mean(unseen(some, group, soft)) for soft in (None, ()))
    soft: tuple[int, ...] = ()
    for offered in (SCALE, SYMMETRIC):
        tried = _tried(some, group, offered)
        if tried is None:
            continue
        used, better, its = tried
        score = root_mean(unseen(some, group, used))
        base = all_left if applied.any() else all_raw
        enough = score < _PAYS * all_left
        if not applied.any():
            enough = enough and score < _HALVED * base
        if enough:
            soft, found, matrix, all_left = used, better, its, score
    if soft and not applied.any():
        applied = np.ones(groups, dtype=bool)
    if any(span.kind != "informative" for span in spans) and groups > 1:
        spans = joined(ticks, spans, found, group)
    iron = conditioned(found.iron, matrix, groups)
    everything = fit(some, group, FULL)
    spread = np.sqrt(np.diagonal(covariance(some, group, everything, FULL)))
    return Chosen(
        spans,
        iron,
        applied,
        found.elements,
        soft,
        everything.elements[list(ROTATION)],
        spread[list(ROTATION)],
        matrix,
        raw,
        left,
        found,
        some,
        group,
        all_raw,
        all_left,
    )


def _by_group(ticks: Ticks, group: Integers) -> tuple[Floats, Floats]:
    raw, left = [], []
    for g in range(int(group.max()) + 1):
        part = ticks.only(group == g)
        one = np.zeros(part.n, dtype=np.int64)
        raw.append(root_mean(unseen(part, one, None)))
        left.append(root_mean(unseen(part, one, ())))
    return np.array(raw), np.array(left)


def _applied(found: Fit, matrix: Floats, raw: Floats, left: Floats) -> Booleans:
    applied = left < _HALVED * raw
    iron = conditioned(found.iron, matrix, len(raw))
    for g, b in enumerate(iron):
        place = slice(8 + 3 * g, 11 + 3 * g)
        chi = float(b @ np.linalg.solve(matrix[place, place], b))
        limit = float(np.interp(np.linalg.norm(b), _SIZES, _LEFT))
        applied[g] |= chi > _LARGE_CHI and left[g] < limit * raw[g]
    result: Booleans = applied
    return result


def _tried(
    ticks: Ticks, group: Integers, soft: tuple[int, ...]
) -> tuple[tuple[int, ...], Fit, Floats] | None:
    """Fit elements of D, without those that the record does not determine."""
    while soft:
        found = fit(ticks, group, soft)
        matrix = covariance(ticks, group, found, soft)
        known = soft_known(matrix, soft)
        if known.max() < SOFT_KNOWN:
            if np.abs(found.elements).max() >= _MOST:
                return None
            return soft, found, matrix
        soft = tuple(np.delete(soft, known.argmax()).tolist())
    return None
