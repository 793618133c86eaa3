"""Whether the default filter's sigmas are those of its errors, in simulated motions."""

from __future__ import annotations

from functools import cache
from typing import Literal

import numpy as np
import pytest

import zerorate as zr
from zerorate.geometry.rotations import inverse, product
from zerorate.simulation.motion import Kind
from zerorate.types import Floats

SWUNG: tuple[Kind, ...] = ("pendulum", "spinning pendulum", "arm", "hand")
SEEDS = range(20, 32)
SETTLED = 1000
"""Samples after which all is judged: 10 s."""


@cache
def errors(
    kind: Kind, start: Literal["rest", "motion"], seeds: range = SEEDS
) -> tuple[Floats, Floats, Floats]:
    """Return errors of tilt, heading and bias over their sigmas, every half second."""
    tilts, headings, biases = [], [], []
    for seed in seeds:
        motion = zr.simulate_motion(kind, 100.0, 60.0, seed=seed, start=start)
        trace = zr.Attitude(100.0).trace(motion.gyro, motion.accel, motion.mag)
        w, x, y, z = product(trace["quaternion"], inverse(motion.quaternion)).T
        tilt = 2.0 * np.arctan2(np.hypot(x, y), np.hypot(w, z))
        heading = 2.0 * np.abs(np.arctan(z / w))
        part = slice(SETTLED, None, 50)
        tilts.append((tilt / trace["tilt_sigma"])[part])
        headings.append((heading / trace["heading_sigma"])[part])
        biases.append((np.abs(trace["bias"] - motion.bias) / trace["bias_sigma"])[part].ravel())
    return np.concatenate(tilts), np.concatenate(headings), np.concatenate(biases)


def covered(z: Floats) -> float:
    return float(np.mean(z <= 1.0))


def of_swung(seeds: range = SEEDS) -> list[tuple[Floats, Floats, Floats]]:
    return [errors(kind, start, seeds) for kind in SWUNG for start in ("rest", "motion")]


@pytest.mark.slow
def test_tilt_and_bias_of_what_is_swung() -> None:
    """One sigma holds 63 % of a tilt about two axes and 68 % of a bias. Half-second samples of one
    run are hardly independent: 96 runs leave some 2 % of spread, and the rest is room for what the
    filter allows for and the simulated accelerometer does not have: single kinds lie from 48 to
    93 %."""
    tilts, _, biases = (np.concatenate(z) for z in zip(*of_swung(), strict=True))
    assert 0.55 < covered(tilts) < 0.80
    # A gyro that is begun in motion may have 1 deg/s of bias, the simulated ones have half of it.
    assert 0.55 < covered(biases) < 0.90


@pytest.mark.parametrize("seeds", [SEEDS[:4], pytest.param(SEEDS, marks=pytest.mark.slow)], ids=len)
def test_heading_of_what_is_swung(seeds: range) -> None:
    """68 % if right. The filter allows for errors that turn with the body, which these sensors do
    not have, and leans to the careful side."""
    headings = np.concatenate([z for _, z, _ in of_swung(seeds)])
    assert 0.60 < covered(headings) < 0.90


@pytest.mark.parametrize("seeds", [SEEDS[:6], pytest.param(SEEDS, marks=pytest.mark.slow)], ids=len)
def test_vehicle(seeds: range) -> None:
    """Corners are seldom and long, so a run has few of them: wide bounds. A velocity taken for
    white noise would leave less than a tenth covered."""
    for tilt, heading, _ in (errors("vehicle", "rest", seeds), errors("vehicle", "motion", seeds)):
        assert 0.45 < covered(tilt) < 0.95
        assert np.sqrt(np.mean(tilt**2)) < 2.0
        assert covered(heading) > 0.55


@pytest.mark.parametrize("kind", SWUNG)
def test_an_accelerometers_bias_is_in_the_tilt(kind: Kind) -> None:
    """At rest nothing tells it from a tilt: 0.05 m/s^2 about each of two axes."""
    motion = zr.simulate_motion(kind, 100.0, 4.5, seed=3)
    trace = zr.Attitude(100.0).trace(motion.gyro, motion.accel, motion.mag)
    floor = np.sqrt(2.0) * 0.05 / 9.81
    assert floor < trace["tilt_sigma"][-1] < 1.2 * floor


def test_a_steady_field_does_not_make_the_heading_certain() -> None:
    """However long one stands in a room, its field may be turned: sigma does not fall as that of a
    mean of white noise, 25 deg/sqrt(s), and it starts as large as the field's spread."""
    motion = zr.simulate_motion("hand", 100.0, 30.0, seed=4)
    trace = zr.Attitude(100.0).trace(motion.gyro, motion.accel, motion.mag)
    sigma = np.degrees(trace["heading_sigma"])
    assert sigma[-1] < 10.0
    assert sigma.min() > 2.0
