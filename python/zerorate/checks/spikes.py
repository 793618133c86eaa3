"""Detection of isolated fixes, far from the line between the fixes before and after."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from zerorate.geometry.earth import local_ned
from zerorate.record.fixes import Fixes
from zerorate.types import Booleans, Floats

_SIGMAS: Final = 6.0
_MEDIANS: Final = 8.0
"""Distance from this line, in medians of the distance, above which a fix is wrong."""
_NOISE_MEDIAN: Final = math.sqrt(2.0 * math.log(2.0))
"""Median of the distance of two axes, over the standard deviation of one."""
_USUAL_SIGMAS: Final = (2.0, 0.1)
"""Standard deviations assumed if the receiver states none: of positions, m, and of velocities."""
_MIN_COUNT: Final = 10
_MAX_PASSES: Final = 4
_LINE_FACTOR: Final = math.sqrt(1.5)
"""Standard deviation of a point minus the mean of its neighbours, over the point's own."""


def find_spikes(fixes: Fixes) -> tuple[Booleans, Booleans]:
    """Return the masks of isolated positions and isolated velocities, shape (m,) each.

    A fix is isolated if its distance from the line between its neighbours exceeds three limits:

    - six standard deviations;
    - eight medians of the distance that motion causes;
    - the neighbours' own distances.
    """
    position = fixes.position
    known = np.isfinite(position[:, :2]).all(axis=1)
    metres = np.full((len(fixes), 2), np.nan)
    if known.any():
        level = np.column_stack([position[:, :2], np.nan_to_num(position[:, 2])])
        metres[known] = local_ned(level[known], level[known][0])[:, :2]
    velocity = np.full_like(metres, np.nan)
    if fixes.velocity is not None:
        velocity = fixes.velocity[:, :2]
    stated = fixes.position_sigma, fixes.velocity_sigma
    one, other = (
        _spikes(fixes.time, values, _horizontal(sigma, usual, len(fixes)))
        for values, sigma, usual in zip((metres, velocity), stated, _USUAL_SIGMAS, strict=True)
    )
    return one, other


def drop_spikes(fixes: Fixes) -> Fixes:
    """Return the fixes without isolated positions, if the receiver has no velocities.

    Without velocities a filter follows the first isolated position and then rejects correct fixes.
    """
    if fixes.velocity is not None and np.isfinite(fixes.velocity[:, :2]).any():
        return fixes
    wrong, _ = find_spikes(fixes)
    if not wrong.any():
        return fixes
    right = fixes.chosen(~wrong)
    note = (
        f"{wrong.sum()} of {len(fixes)} positions are far off the line between those before and "
        f"after, and are left out"
    )
    return replace(right, notes=(*right.notes, note))


def without_spikes(fixes: Fixes) -> tuple[Fixes, float]:
    """Return the fixes without isolated positions and velocities, and their share."""
    of_position, of_velocity = find_spikes(fixes)
    share = max(_share(of_position), _share(of_velocity))
    if fixes.velocity is not None and of_velocity.any():
        velocity = np.where(of_velocity[:, np.newaxis], np.nan, fixes.velocity)
        fixes = replace(fixes, velocity=velocity)
    return fixes.chosen(~of_position) if of_position.any() else fixes, share


def _share(mask: Booleans) -> float:
    return float(mask.mean()) if len(mask) else 0.0


def _horizontal(sigma: Floats | None, usual: float, n: int) -> Floats:
    if sigma is None:
        return np.full(n, usual)
    stated: Floats = np.where(np.isnan(sigma[:, :2]), usual, sigma[:, :2]).max(axis=1)
    return stated


def _spikes(time: Floats, values: Floats, sigma: Floats) -> Booleans:
    """Return the mask of values, shape (m, 2), away from the line between their neighbours."""
    spikes = np.zeros(len(time), dtype=np.bool_)
    known = np.flatnonzero(np.isfinite(values).all(axis=1))
    if len(known) < _MIN_COUNT:
        return spikes
    for _ in range(_MAX_PASSES):
        # Of two adjacent outliers, the first pass finds only the one with the larger distance.
        far = _peaks(time[known], values[known], sigma[known])
        spikes[known[far]] = True
        known = known[~far]
        if not far.any() or len(known) < _MIN_COUNT:
            break
    return spikes


def _peaks(t: Floats, x: Floats, sigma: Floats) -> Booleans:
    """Return the mask of points farther from their neighbours' line than the neighbours."""
    part = ((t[1:-1] - t[:-2]) / (t[2:] - t[:-2]))[:, np.newaxis]
    off = np.linalg.norm(x[1:-1] - (1.0 - part) * x[:-2] - part * x[2:], axis=1)
    noise = _LINE_FACTOR * sigma[1:-1]
    # The median minus its noise is the part from the vehicle's turns and stops.
    motion = math.sqrt(max(0.0, np.median(off) ** 2 - (_NOISE_MEDIAN * np.median(noise)) ** 2))
    limit = np.hypot(_SIGMAS * noise, _MEDIANS * motion)
    around = np.concatenate([[0.0], off, [0.0]])
    far = (off > limit) & (off >= around[:-2]) & (off >= around[2:])
    return np.concatenate([[False], far, [False]])
