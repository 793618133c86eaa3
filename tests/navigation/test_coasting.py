"""Process noise from coasting: simulated drives whose noise is known, and the recorded one."""

from functools import cache

import numpy as np
import pytest

import zerorate as zr
from zerorate.navigation import find_noise

RECEIVERS = {
    "2 m": {"fixes_rate": 1.0, "position_sigma": 2.0, "velocity_sigma": 0.1},
    "2 cm": {"fixes_rate": 4.0, "position_sigma": 0.02, "velocity_sigma": 0.02},
}
SEEDS = (0, 1)
"""Drives of the simulator, whose sensors have the noise below."""


def models(factor):
    """Return the noise of the simulator's sensors, times a factor."""
    return {
        "gyro": zr.NoiseModel(angle_random_walk=factor * 1e-4, rate_random_walk=factor * 2e-6),
        "accel": zr.NoiseModel(
            angle_random_walk=factor * 1e-3,
            rate_random_walk=factor * 2e-5,
            quantity="acceleration",
        ),
    }


@cache
def driven(receiver, seed, duration=400.0):
    return zr.simulate_drive(duration=duration, seed=seed, **RECEIVERS[receiver])


@cache
def start(receiver, seed, duration=400.0):
    imu = driven(receiver, seed, duration).recording()
    return zr.align(imu, latitude=48.0, heading="course", accel_bias_sigma=0.05)


def noise(receiver, seed, factor, duration=400.0, **options):
    drive = driven(receiver, seed, duration)
    told = {} if factor is None else models(factor)
    begin = start(receiver, seed, duration)
    return find_noise(drive.recording(), drive.fixes, begin, **told, **options)


def outages(receiver, seed, told):
    drive = driven(receiver, seed)
    nav = zr.NavigationFilter(start(receiver, seed), **told)
    one = {"seconds": 30.0, "between": 10.0, "nav": nav}
    return zr.navigation.outages(drive.recording(), drive.fixes, **one)[30.0]


@pytest.mark.parametrize("receiver", RECEIVERS)
@pytest.mark.parametrize("factor", [0.3, 5.0, None])
def test_a_wrong_noise_becomes_that_of_the_errors(receiver, factor):
    ratios, errors = [], []
    for seed in SEEDS:
        found = noise(receiver, seed, factor, lower=True)
        assert not found.kept
        assert found.gain > 2.0
        both = [outages(receiver, seed, told) for told in (found.models, models(1.0))]
        ratios.append([one.error_over_sigma() for one in both])
        errors.append([one.rms() for one in both])
    # Few outages scatter: what counts is that they are as with the noise that is true.
    found, right = np.sqrt(np.mean(np.square(ratios), axis=0))
    assert 0.8 < found / right < 1.2
    found, right = np.sqrt(np.mean(np.square(errors), axis=0))
    assert found < 1.1 * right


@pytest.mark.parametrize("receiver", RECEIVERS)
def test_the_right_noise_is_kept(receiver):
    for seed in SEEDS:
        found = noise(receiver, seed, 1.0)
        assert found.kept
        assert found.factors == (1.0, 1.0, 1.0)
        assert found.models == models(1.0)
        assert found.after[2] == pytest.approx(1.0, abs=0.3)


def test_a_stated_noise_is_raised_only():
    assert noise("2 cm", 0, 5.0).kept
    raised = noise("2 cm", 0, 0.3)
    assert not raised.kept
    assert raised.factors[2] == 1.0
    assert min(raised.factors[:2]) >= 1.0
    assert "gyro" in str(raised)


def test_a_short_record_keeps_its_noise():
    found = noise("2 m", 1, None, duration=80.0)
    assert found.kept
    assert found.models == {}
    assert "under 36" in str(found)


def test_wrong_fixes_move_the_noise_by_a_step_at_most():
    drive, begin = driven("2 cm", 1), start("2 cm", 1)
    random = np.random.default_rng(3)
    position = drive.fixes.position.copy()
    wrong = random.random(len(position)) < 0.05
    position[wrong, 0] += 30.0 / 111e3
    fixes = zr.Fixes(
        drive.fixes.time, position, velocity=drive.fixes.velocity,
        position_sigma=drive.fixes.position_sigma, velocity_sigma=drive.fixes.velocity_sigma,
    )  # fmt: skip
    clean, spoilt = (
        find_noise(drive.recording(), some, begin, **models(0.3)) for some in (drive.fixes, fixes)
    )
    assert abs(np.log(spoilt.factors[0] / clean.factors[0])) < np.log(1.5)


def test_a_receiver_much_worse_than_it_says_tells_no_noise():
    drive = driven("2 cm", 1)
    random = np.random.default_rng(3)
    position = drive.fixes.position.copy()
    wrong = random.random(len(position)) < 0.3
    position[wrong, 0] += 30.0 / 111e3
    fixes = zr.Fixes(drive.fixes.time, position, velocity=drive.fixes.velocity)
    found = find_noise(drive.recording(), fixes, start("2 cm", 1), adapt="fixed")
    assert found.kept
    assert "rejected" in found.reason


def test_errors_of_coasting_are_those_of_a_filter_without_fixes():
    drive, begin = driven("2 m", 0, 240.0), start("2 m", 0, 240.0)
    imu = drive.recording()
    found = find_noise(imu, drive.fixes, begin, **models(1.0), covariance_step=0.1)
    # The same by outages, which disturb the filter: the first of them begins as the first window.
    nav = zr.NavigationFilter(begin, **models(1.0))
    one = zr.navigation.outages(imu, drive.fixes, seconds=10.0, nav=nav, between=20.0)[10.0]
    assert found.before[2] == pytest.approx(one.error_over_sigma(), rel=0.35)


def test_navigate_says_what_it_found():
    drive = driven("2 cm", 2)
    auto, stated = (
        zr.navigate(drive.recording(), drive.fixes, noise=choice, outages=30.0)
        for choice in ("auto", "stated")
    )
    assert any(note.startswith("the filter's noise is fitted to its errors") for note in auto.notes)
    assert not any("coasting" in note for note in stated.notes)
    assert stated.outages[30.0].error_over_sigma() < 0.5
    assert 0.6 < auto.outages[30.0].error_over_sigma() < 1.4
    assert auto.outages[30.0].rms() < stated.outages[30.0].rms()
