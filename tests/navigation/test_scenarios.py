"""Consistency on the fourteen scenarios of the evidence, with three seeds each."""

import numpy as np
import pytest

from support.scenarios import scenarios

STUDY = scenarios()
SEEDS = 3


@pytest.mark.parametrize("name", STUDY.SCENARIOS)
def test_errors_are_as_large_as_stated(name):
    """ANEES is 0.8 to 1.2 with 50 seeds; three seeds scatter more, above all in the heading."""
    results = [STUDY.study(STUDY.run, False, name, seed) for seed in range(SEEDS)]
    nees, false, missed, usable, track, fixes = STUDY.summary(results)
    assert 0.6 < nees[0] < 1.4, nees
    assert (nees[1:5] < 2.5).all(), nees
    assert track < fixes
    assert false < 0.03
    assert missed < 0.1
    assert usable > 0.8


NOISES = {
    "true": ({}, (0.5, 0.25, 0.12)),
    "default": ({"gyro": None, "accel": None}, (1 / 3, 0.1, 0.04)),
}


@pytest.mark.parametrize(("noise", "limits"), NOISES.values(), ids=NOISES)
def test_a_barometer_holds_the_height(noise, limits):
    """With the default noise of the sensors σ after 10 s is a third of that without."""
    found = np.array([STUDY.heights(noise, seed) for seed in range(SEEDS)]).reshape(SEEDS, 3, 4)
    ratio = found[:, :, 2] / found[:, :, 0]
    assert (ratio < limits).all(), ratio
    assert STUDY.rms(found[:, :, 3] / found[:, :, 2]) < 2.0


def test_a_compass_holds_the_heading_at_rest():
    found = np.vstack([STUDY.headings(seed) for seed in range(SEEDS)])
    assert (found[:, 1] < found[:, 3]).all()
    assert STUDY.rms(found[:, 0] / found[:, 1]) < 2.0
