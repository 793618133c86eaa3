"""Limits that nobody told: found by the shape of the samples, not where motion only looks so."""

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from zerorate.findings.samples import quantization_step
from zerorate.findings.saturation import find_saturation

RATE = 100.0
N = 12_000
T = np.arange(N) / RATE


def sine(hertz, size=1.0, phase=0.0):
    return size * np.sin(2.0 * np.pi * hertz * T + phase)


def motion():
    """Turns by hand, about; they do not repeat."""
    terms = ([0.51, 0.093, 0.27], [0.37, 0.11, 0.21], [0.23, 0.13, 0.31])
    return np.stack([sum(sine(f, 1.0, 7.0 * f) for f in one) for one in terms], axis=1)


def noise(size, seed=1):
    return size * np.random.default_rng(seed).standard_normal((N, 3))


def rounded(data, step):
    return np.round(data / step) * step


def found(data):
    """Return the stops by axis and side."""
    stops = {}
    for axis in range(3):
        column, others = data[:, axis], np.delete(data, axis, axis=1)
        for side in (1, -1):
            stop = find_saturation(side * column, others, RATE, quantization_step(column))
            if stop is not None:
                stops[axis, side] = stop
    return stops


@pytest.mark.parametrize("step", [0.0, 0.002, 0.02])
@pytest.mark.parametrize("limit", [2.4, 1.6, 0.5])
def test_a_clipped_axis_is_told_with_its_rows(step, limit):
    data = motion() + noise(0.02)
    data = rounded(data, step) if step else data
    data[:, 1] = data[:, 1].clip(-limit, limit)
    stops = found(data)
    assert set(stops) == {(1, 1), (1, -1)}
    for (axis, side), stop in stops.items():
        assert stop.hard
        assert stop.rows.tolist() == np.flatnonzero(side * data[:, axis] == limit).tolist()


def test_single_samples_of_a_vibration_at_the_limit_are_told():
    data = rounded(np.stack([sine(30.13, 2.0, k) for k in range(3)], axis=1) + noise(0.5), 0.0024)
    data[:, 2] = data[:, 2].clip(-3.0, 3.0)
    assert set(found(data)) == {(2, 1), (2, -1)}


def test_more_than_a_tenth_at_the_limit_is_told():
    data = (motion() + noise(0.02)).clip(-0.4, 0.4)
    stops = found(data)
    assert len(stops) == 6
    assert min(stop.rows.size for stop in stops.values()) > 0.1 * N


def trapezoid(hertz):
    return np.stack([0.0 * T, 0.0 * T, np.clip(3.0 * sine(hertz), -1.0, 1.0)], axis=1)


NOT_CLIPPED = {
    "repeats exactly": np.stack([sine(0.5), sine(0.5, 0.7, 1.0), sine(0.25, 0.3, 2.0)], axis=1),
    "repeats within five samples": np.stack([sine(20.0), *noise(0.01).T[:2]], axis=1),
    "repeats, in steps": rounded(np.stack([sine(0.5), sine(5.0), sine(0.25)], axis=1), 0.01),
    "stands at a rate without noise": trapezoid(0.1),
    "stands at a rate": trapezoid(0.1) + noise(0.01),
    "stands at a rate, in steps": rounded(trapezoid(0.1) + noise(0.003), 0.01),
    "rests at its largest value": rounded(
        sine(0.1).clip(None, 0.0)[:, None] * [1.0, 0.5, 0.2] + noise(0.003), 0.01
    ),
    "falls to zero": np.where((T % 20.0 < 1.0)[:, None], 0.0, noise(0.1) - 9.8),
    "white noise in steps": rounded(noise(1.0), 0.05),
    "even noise in steps": rounded(
        np.random.default_rng(2).uniform(-1.0, 1.0, (N, 3)), 0.01
    ),
    "vibration in steps": rounded(
        np.stack([sine(25.0, 2.5, k) for k in range(3)], axis=1) + noise(0.0005), 0.0024
    ),
    "motion": motion(),
    "motion with noise": motion() + noise(0.01),
    "motion in steps": rounded(motion() + noise(0.001), 0.02),
}  # fmt: skip


@pytest.mark.parametrize("name", NOT_CLIPPED)
def test_what_is_not_clipped_is_not_told(name):
    assert found(NOT_CLIPPED[name]) == {}


def test_few_samples_constants_and_nothing_are_no_limit():
    for data in (motion()[:99], np.ones((N, 3)), np.full((N, 3), np.nan)):
        assert found(data) == {}


def soft(data, edge):
    """A range that ends softly: what goes beyond is pressed into a fiftieth of it."""
    over = np.abs(data) - edge
    return np.where(over > 0.0, np.sign(data) * (edge + 0.01 * edge * np.tanh(over / edge)), data)


def test_a_limit_that_is_not_flat_is_told_as_soft():
    strides = np.stack([sine(1.1, 1.0) * (1.0 + 0.3 * sine(0.03)), *motion().T[:2]], axis=1)
    data = soft(3.0 * strides, 2.0) + noise(0.002)
    stops = found(data)
    assert {side for side, stop in stops.items() if not stop.hard} >= {(0, 1), (0, -1)}
    assert (0, 1) not in found(3.0 * strides + noise(0.002))


def test_a_sensor_that_clips_asks_to_act_from_a_fifth_of_a_second_on():
    """Under a hundredth of the samples, so that the time on end alone decides."""
    data = motion() + noise(0.01)
    for seconds, severity in ((0.25, "act"), (0.12, "look")):
        peak = int(np.argmax(data[:, 0]))
        half = round(0.5 * seconds * RATE)
        limit = motion()[[peak - half, peak + half], 0].max()
        table = {"time_s": T}
        clipped = data.copy()
        clipped[:, 0] = clipped[:, 0].clip(None, limit)
        clipped[peak - half : peak + half, 0] = limit
        for axis, column, force in zip("xyz", clipped.T, 9.81 + noise(0.1).T, strict=True):
            table |= {f"gyro_{axis}_radps": column, f"accel_{axis}_mps2": force}
        ours = zr.report(zr.read_recording(table)).findings
        (one,) = [one for one in ours if one.kind == "at its limit"]
        assert one.severity == severity


@needs_recordings
@pytest.mark.parametrize(
    ("name", "axes"),
    [
        ("foot_vicon_20171127111153", "-y"),
        ("foot_vicon_20171127112512", "-y"),
        ("foot_vicon_20171215180305", "-y"),
        ("foot_walk_SensorConnectData_37", ""),
        ("foot_vicon_20171122114044", ""),
    ],
)
def test_feet_show_the_soft_end_of_the_range_that_their_gyros_have(name, axes):
    recording = zr.read_recording(RECORDINGS / f"{name}_200hz.parquet")
    ours = [one for one in zr.report(recording).findings if one.kind == "soft limit"]
    assert ["-y" in one.text for one in ours] == [True] * bool(axes)
