"""Start in motion, with an attitude corrected by the first minute of fixes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from zerorate._native import NavigationFilter
from zerorate.geometry.rotations import from_rotation_vectors, product
from zerorate.navigation.alignment import Alignment
from zerorate.navigation.events import Events
from zerorate.record.fixes import Fixes
from zerorate.record.samples import Samples

_SPAN_S: Final = 60.0
"""Length of the fixes that correct the attitude, s."""
_LEAD_S: Final = 1.0
_MAX_ROUNDS: Final = 8
_CONVERGED_SIGMAS: Final = 0.3
_SIGMA_FACTOR: Final = 3.0
"""Factor on the smoothed standard deviation, because the filter uses the same fixes again."""


def refine_attitude(
    samples: Samples, fixes: Fixes, start: Alignment, options: Mapping[str, Any]
) -> Alignment:
    """Correct roll, pitch and heading of a start by repeated smoothing of the first minute.

    A filter that starts with an attitude error of tens of degrees mistakes this error for biases.
    It soon trusts these biases too much. An iterated smoother corrects the attitude instead (B. M.
    Bell, *SIAM Journal on Optimization* 4(3), 1994). If the iteration does not converge, the start
    is returned unchanged.
    """
    last = start.time + _SPAN_S
    piece = slice(*np.searchsorted(samples.time, [start.time - _LEAD_S, last]))
    arrays = samples.time[piece], samples.gyro[piece], samples.accel[piece]
    rows = Events.of(fixes.between(start.time - _LEAD_S, last)).rows
    begin = start
    for _ in range(_MAX_ROUNDS):
        _, steps = NavigationFilter(begin, **options).process_arrays(*arrays, rows, record=True)
        smoothed = {} if steps is None else steps.smoothed()
        # A second start within the minute means that the filter lost its position.
        if not len(smoothed.get("sample", ())) or smoothed["begins"][1:].any():
            return start
        error, sigma = smoothed["before"][0, 6:9], smoothed["sigma"][0, 6:9]
        turn = from_rotation_vectors(error)
        begin = replace(begin, quaternion=product(turn, begin.quaternion))
        if (np.abs(error) < _CONVERGED_SIGMAS * sigma).all():
            level, heading = (_SIGMA_FACTOR * float(x) for x in (sigma[:2].max(), sigma[2]))
            return replace(
                begin,
                level_sigma=min(start.level_sigma, level),
                heading_sigma=min(start.heading_sigma, heading),
            )
    return start
