"""Peaks that the sampling folds: found with their amplitude where the fundamental moves."""

import numpy as np
import pytest

import zerorate as zr
from zerorate.findings.aliasing import find_aliased_harmonic

SECONDS = 60


def shaken(rate, size, seed, *, wander=0.06, order=2, start=0.31, tone=0.07):
    """Return forces with a peak of 6 m/s², a harmonic of some size, a steady tone and noise."""
    random = np.random.default_rng(seed)
    t = np.arange(round(SECONDS * rate)) / rate
    hertz = (start + 0.005 * seed) * rate * (1.0 + wander * np.sin(2 * np.pi * t / 17.0))
    phase = 2.0 * np.pi * np.cumsum(hertz) / rate
    forces = 0.3 * random.standard_normal((len(t), 3))
    forces += 1.0 * np.sin(2.0 * np.pi * tone * rate * t)[:, None]
    forces[:, 2] += 6.0 * np.sin(phase) + size * np.sin(order * phase + 1.0)
    return forces


def windows(forces, rate):
    length = round(rate)
    starts = np.arange(0, len(forces) - length + 1, length // 2)
    return forces[starts[:, None] + np.arange(length)]


@pytest.mark.parametrize("rate", [200.0, 250.0, 1000.0])
@pytest.mark.parametrize(("order", "start"), [(2, 0.31), (3, 0.22)])
def test_a_folded_harmonic_is_told_with_its_amplitude(rate, order, start):
    for seed in range(4):
        forces = shaken(rate, 3.0, seed, order=order, start=start)
        seen = find_aliased_harmonic(windows(forces, rate), rate)
        assert (seen.order, seen.fold) == (order, 1)
        assert seen.amplitude == pytest.approx(3.0, rel=0.05)
        assert seen.sigma < 0.15
        hertz = (start + 0.005 * seed) * rate
        assert 0.935 * hertz < seen.peak[0] < seen.peak[1] < 1.065 * hertz
        folded = rate - order * hertz
        assert abs(np.array(seen.alias) - folded).max() < 0.065 * order * hertz


@pytest.mark.parametrize("rate", [100.0, 250.0])
@pytest.mark.parametrize("tone", [0.07, 0.25, 0.38])
def test_without_a_harmonic_none_is_told(rate, tone):
    """A steady tone too, which the place of a folded harmonic crosses."""
    for seed in range(10):
        assert (
            find_aliased_harmonic(windows(shaken(rate, 0.0, seed, tone=tone), rate), rate) is None
        )


def test_a_harmonic_that_is_not_folded_is_none():
    assert find_aliased_harmonic(windows(shaken(250.0, 3.0, 1, start=0.2), 250.0), 250.0) is None


def test_where_the_peak_stands_nothing_is_told():
    assert find_aliased_harmonic(windows(shaken(250.0, 3.0, 1, wander=0.0), 250.0), 250.0) is None


def test_too_few_windows_tell_nothing():
    assert find_aliased_harmonic(windows(shaken(250.0, 3.0, 1), 250.0)[:11], 250.0) is None
    assert find_aliased_harmonic(np.zeros((0, 250, 3)), 250.0) is None
    assert find_aliased_harmonic(np.zeros((50, 250, 3)), 250.0) is None


def test_a_report_judges_it_by_its_limit():
    rate = 200.0
    for size, severity in ((3.0, "look"), (1.0, "good")):
        forces = shaken(rate, size, 2)
        forces[:, 2] += 9.81
        table = {"time_s": np.arange(len(forces)) / rate}
        turns = 10.0 * np.random.default_rng(1).standard_normal(forces.shape)
        for axis, force, turn in zip("xyz", forces.T, turns.T, strict=True):
            table |= {f"accel_{axis}_mps2": force, f"gyro_{axis}_dps": turn}
        ours = zr.report(zr.read_recording(table)).findings
        (one,) = [one for one in ours if one.kind == "aliased peak"]
        assert one.severity == severity
        assert one.value == pytest.approx(size, rel=0.1)
        assert "2 times the frequency of the peak at" in one.text
