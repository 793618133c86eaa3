"""Choice of the applied parameters: they must more than halve the scatter of held-out samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate.calibration.magnet.fit import (
    FULL,
    MAX_SOFT_SIGMA_RATIO,
    ROTATION,
    SCALE,
    SYMMETRIC,
    Fit,
    count_known_directions,
    covariance,
    fit,
    held_out_squares,
    robust_rms,
    soft_sigma_ratios,
    zero_unknown_directions,
)
from zerorate.calibration.magnet.spans import Span, assign_groups, group_spans
from zerorate.calibration.magnet.ticks import Ticks
from zerorate.types import Booleans, Floats, Integers

_MAX_SCATTER_RATIO: Final = 0.40
_MIN_CHI_SQUARED: Final = 25.0
_IRON_SIZES: Final = (0.10, 0.25)
_MAX_RATIOS_BY_SIZE: Final = (_MAX_SCATTER_RATIO, 0.7)
"""Largest remaining scatter, relative to the raw scatter, for the two sizes of hard iron in
`_IRON_SIZES`; interpolated between them. Buildings change the field by a tenth, but not by a
quarter.
"""
_MAX_IMPROVED_RATIO: Final = 0.85
_MAX_ELEMENT: Final = 0.6


@dataclass(frozen=True, eq=False)
class IronChoice:
    """The fit and its applied part, in units of the field's median size.

    Parameters
    ----------
    spans : list of Span
        All spans of the record.
    iron : ndarray, shape (g, 3)
        Estimated hard iron of each group; unknown components are zero.
    applied : ndarray of bool, shape (g,)
        True if the group's hard iron is subtracted.
    elements, soft
        Applied elements of D - 1, zero if none are applied; and indices of the fitted elements.
    rotation, rotation_sigma : ndarray, shape (3,)
        Antisymmetric elements from a fit of all elements, and their standard deviations.
    covariance : ndarray, shape (8 + 3 g, 8 + 3 g)
        Covariance of the elements of D, then of the hard irons.
    raw, left : ndarray, shape (g,)
        Held-out scatter of each group: raw, and with the hard iron removed.
    fit : Fit
        Last fit.
    ticks, group
        Fitted ticks, and the group of each.
    total_raw, total_left
        Held-out scatter of all ticks: raw, and with the applied correction.
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


def choose_iron(ticks: Ticks, spans: list[Span], single_iron: bool = False) -> IronChoice | None:
    """Return the iron to apply; None if no hard iron has two known directions."""
    spans, groups = group_spans(ticks, spans)
    informative = None
    if groups and not single_iron:
        informative = _select_informative(ticks, spans)
    if informative is not None and groups == 1:
        return _assemble_choice(ticks, informative[0], informative[1], informative[2])
    if informative is not None:
        fitted_ticks, group, spans = informative
        group_rms = robust_rms(held_out_squares(fitted_ticks, group, ()))
        single_rms = robust_rms(held_out_squares(fitted_ticks, np.zeros_like(group), ()))
        if group_rms <= _MAX_IMPROVED_RATIO * single_rms:
            return _assemble_choice(ticks, fitted_ticks, group, spans)
    single_spans = [
        Span(s.start, s.stop, "disturbed" if s.kind == "disturbed" else "informative")
        for s in spans
    ]
    group = np.zeros(ticks.n, dtype=np.int64)
    iron_fit = fit(ticks, group)
    if count_known_directions(covariance(ticks, group, iron_fit)[8:, 8:]) < 2:
        return None
    return _assemble_choice(ticks, ticks, group, single_spans)


def _select_informative(ticks: Ticks, spans: list[Span]) -> tuple[Ticks, Integers, list[Span]]:
    group = np.full(ticks.n, -1)
    for span in spans:
        if span.kind == "informative":
            group[span.tick_indices(ticks)] = span.group
    used = group >= 0
    return ticks.select(used), group[used], spans


def _assemble_choice(
    ticks: Ticks, fitted_ticks: Ticks, group: Integers, spans: list[Span]
) -> IronChoice:
    groups = int(group.max()) + 1
    iron_fit = fit(fitted_ticks, group)
    matrix = covariance(fitted_ticks, group, iron_fit)
    raw, left = _scatter_by_group(fitted_ticks, group)
    applied = _decide_applied(iron_fit, matrix, raw, left)
    all_raw, all_left = float(raw[0]), float(left[0])
    if groups > 1:
        all_raw, all_left = (
            robust_rms(held_out_squares(fitted_ticks, group, soft)) for soft in (None, ())
        )
    soft: tuple[int, ...] = ()
    for elements in (SCALE, SYMMETRIC):
        trial = _fit_soft_iron(fitted_ticks, group, elements)
        if trial is None:
            continue
        used, better, its_covariance = trial
        score = robust_rms(held_out_squares(fitted_ticks, group, used))
        base = all_left if applied.any() else all_raw
        enough = score < _MAX_IMPROVED_RATIO * all_left
        if not applied.any():
            enough = enough and score < _MAX_SCATTER_RATIO * base
        if enough:
            soft, iron_fit, matrix, all_left = used, better, its_covariance, score
    if soft and not applied.any():
        applied = np.ones(groups, dtype=bool)
    if any(span.kind != "informative" for span in spans) and groups > 1:
        spans = assign_groups(ticks, spans, iron_fit, group)
    iron = zero_unknown_directions(iron_fit.iron, matrix, groups)
    everything = fit(fitted_ticks, group, FULL)
    spread = np.sqrt(np.diagonal(covariance(fitted_ticks, group, everything, FULL)))
    return IronChoice(
        spans,
        iron,
        applied,
        iron_fit.elements,
        soft,
        everything.elements[list(ROTATION)],
        spread[list(ROTATION)],
        matrix,
        raw,
        left,
        iron_fit,
        fitted_ticks,
        group,
        all_raw,
        all_left,
    )


def _scatter_by_group(ticks: Ticks, group: Integers) -> tuple[Floats, Floats]:
    raw, left = [], []
    for g in range(int(group.max()) + 1):
        part = ticks.select(group == g)
        zero_group = np.zeros(part.n, dtype=np.int64)
        raw.append(robust_rms(held_out_squares(part, zero_group, None)))
        left.append(robust_rms(held_out_squares(part, zero_group, ())))
    return np.array(raw), np.array(left)


def _decide_applied(iron_fit: Fit, matrix: Floats, raw: Floats, left: Floats) -> Booleans:
    applied = left < _MAX_SCATTER_RATIO * raw
    iron = zero_unknown_directions(iron_fit.iron, matrix, len(raw))
    for g, b in enumerate(iron):
        block = slice(8 + 3 * g, 11 + 3 * g)
        chi = float(b @ np.linalg.solve(matrix[block, block], b))
        limit = float(np.interp(np.linalg.norm(b), _IRON_SIZES, _MAX_RATIOS_BY_SIZE))
        applied[g] |= chi > _MIN_CHI_SQUARED and left[g] < limit * raw[g]
    result: Booleans = applied
    return result


def _fit_soft_iron(
    ticks: Ticks, group: Integers, soft: tuple[int, ...]
) -> tuple[tuple[int, ...], Fit, Floats] | None:
    """Fit those elements of D that the record determines."""
    while soft:
        iron_fit = fit(ticks, group, soft)
        matrix = covariance(ticks, group, iron_fit, soft)
        sigma_ratios = soft_sigma_ratios(matrix, soft)
        if sigma_ratios.max() < MAX_SOFT_SIGMA_RATIO:
            if np.abs(iron_fit.elements).max() >= _MAX_ELEMENT:
                return None
            return soft, iron_fit, matrix
        soft = tuple(np.delete(soft, sigma_ratios.argmax()).tolist())
    return None
