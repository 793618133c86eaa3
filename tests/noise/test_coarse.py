"""Noise of samples whose steps are wider than it."""

import numpy as np
import pytest
from scipy.signal import lfilter

import zerorate as zr
from zerorate.noise.coarse import find_coarse, find_step

RATE = 100.0
STEP = 0.01


def samples(ratio, level=0.25, drift=0.0, n=30_000, seed=1):
    """Return white noise of a ratio to the step, rounded to it."""
    rng = np.random.default_rng(seed)
    z = STEP * (level + ratio * rng.standard_normal(n) + np.linspace(0.0, drift, n))
    return np.rint(z / STEP) * STEP


@pytest.mark.parametrize("level", [0.0, 0.25, 0.45])
@pytest.mark.parametrize("ratio", [0.25, 0.3, 0.4, 0.5])
def test_counts_give_the_noise(ratio, level):
    held = []
    for seed in range(10):
        found = find_coarse(samples(ratio, level, seed=seed), RATE)
        if found is None:
            # Rounded noise of half a step is that of the samples.
            assert ratio == 0.5
            continue
        if found.deviation.identifiable:
            assert found.deviation == pytest.approx(ratio * STEP, rel=0.08)
        held.append(found.deviation.upper_bound > ratio * STEP)
    # Of two levels nine in ten are seen to hold.
    assert np.mean(held or [1.0]) >= 0.8


@pytest.mark.parametrize("ratio", [0.1, 0.15, 0.2])
@pytest.mark.parametrize("drift", [0.0, 0.3])
def test_few_levels_give_a_bound(ratio, drift):
    held = []
    for seed in range(6):
        found = find_coarse(samples(ratio, 0.45, drift, seed=seed), RATE)
        if found is not None:
            held.append(found.deviation.upper_bound >= ratio * STEP)
            assert found.deviation.upper_bound < 4.0 * ratio * STEP
            assert ratio == 0.2 or not found.deviation.identifiable
    # Of six, one may miss a bound of 95 %.
    assert np.mean(held) > 0.8


@pytest.mark.parametrize("ratio", [0.7, 2.0, 50.0])
def test_fine_samples_are_left_alone(ratio):
    assert find_coarse(samples(ratio), RATE) is None


def test_what_rounding_adds_is_said():
    z = samples(0.7)
    found = zr.characterise({"gyro_x_radps": z}, rate=RATE)
    assert any("rounding to steps of 0.01 adds" in note for note in found.notes)
    assert found.gyro.axes[0].model.angle_random_walk > 0.7 * STEP / np.sqrt(RATE)
    assert not any(
        "rounding" in n for n in zr.characterise({"gyro_x_radps": samples(3.0)}, rate=RATE).notes
    )


def test_samples_without_steps_have_none():
    z = np.random.default_rng(2).standard_normal(5000)
    assert find_step(z) == 0.0
    assert find_coarse(z, RATE) is None
    assert find_step(np.zeros(100)) == 0.0


def test_correlated_noise_below_the_step_tells_nothing():
    noise = lfilter([0.03], [1.0, -0.97], np.random.default_rng(3).standard_normal(30_000))
    z = np.rint(0.45 + 0.3 * noise / noise.std()) * STEP
    assert find_coarse(z, RATE).deviation is None
    found = zr.characterise({"gyro_x_radps": z}, rate=RATE)
    assert found.gyro.axes[0].model is None
    assert any("N is not identifiable" in note for note in found.notes)


def test_characterise_says_it():
    z = samples(0.15, 0.45)
    found = zr.characterise({"gyro_x_radps": z}, rate=RATE)
    (axis,) = found.gyro.axes
    white = axis.model.angle_random_walk
    assert white.upper_bound > 0.15 * STEP / np.sqrt(RATE) * 0.97
    assert not axis.model.bias_instability.known
    assert any(
        "samples come in steps of 0.01 rad/s, wider than the noise" in n for n in found.notes
    )


def test_the_step_is_that_of_neighbouring_levels():
    assert find_step(samples(0.5)) == pytest.approx(STEP, rel=1e-9)
    assert find_step(3.0 * samples(2.0)) == pytest.approx(3.0 * STEP, rel=1e-9)
