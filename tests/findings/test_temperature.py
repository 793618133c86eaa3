"""The bias of a gyro by temperature in a report: a slope with a true error, or why none is."""

import numpy as np
import pytest

import zerorate as zr

RATE = 20.0
SLOPE = np.array([0.05, -0.02, 0.0])
"""deg/s/K."""


def warmed(seed, *, span=12.0, seconds=1200.0, slope=SLOPE, moves=(), walk=0.0):
    """Return a log at rest that warms and cools, or moves for some spans."""
    random = np.random.default_rng([seed, 3])
    t = np.arange(round(seconds * RATE)) / RATE
    temperature = 25.0 + span * np.sin(np.pi * t / seconds) ** 2
    gyro = 0.1 * random.standard_normal((len(t), 3)) + 0.3
    gyro += (temperature - 25.0)[:, None] * slope
    gyro += walk * np.cumsum(random.standard_normal((len(t), 3)), axis=0) / np.sqrt(RATE)
    force = [0.0, 0.0, 9.80665] + 0.02 * random.standard_normal((len(t), 3))
    for first, last in moves:
        on = (t > first) & (t < last)
        gyro[on] += 40.0 * np.sin(2.0 * np.pi * t[on, None] * [0.31, 0.23, 0.17])
        force[on] += random.standard_normal((np.count_nonzero(on), 3))
    table = {"time_s": t, "temperature_degc": temperature}
    for axis, turn, push in zip("xyz", gyro.T, force.T, strict=True):
        table |= {f"gyro_{axis}_dps": turn, f"accel_{axis}_mps2": push}
    return zr.read_recording(table)


def told(recording):
    found = zr.findings.findings_of(recording).findings
    return [one for one in found if one.kind == "bias by temperature"]


def test_the_steepest_slope_is_told_within_its_error():
    errors = []
    for seed in range(12):
        (one,) = told(warmed(seed, walk=0.002))
        assert one.unit == "deg/s/K"
        errors.append((one.value - 0.05) / one.sigma)
        assert one.sigma < 0.01
    assert np.mean(np.abs(errors) < 2.0) > 0.8
    assert np.sqrt(np.mean(np.square(errors))) < 1.5


def test_a_slope_beyond_its_limit_is_looked_at():
    (one,) = told(warmed(1))
    assert one.severity == "look"
    assert " about x" in one.text
    assert " about y" in one.text
    assert "over 25.0 to 37.0 degC" in one.text
    assert told(warmed(1, slope=0.2 * SLOPE))[0].severity == "good"


def test_it_is_told_from_rests_between_moves():
    (one,) = told(warmed(2, moves=((200.0, 500.0), (700.0, 1000.0))))
    assert one.value == pytest.approx(0.05, abs=4.0 * one.sigma)
    assert one.sigma < 0.01


@pytest.mark.parametrize(
    ("what", "why"),
    [
        ({"span": 0.4}, "temperature moved by 0.4 K only"),
        ({"seconds": 40.0}, "it rests for 40 s in all, and 60 s are needed"),
        ({"slope": 0.0 * SLOPE}, "no slope is significant"),
    ],
)
def test_where_it_is_not_identifiable_the_page_says_why(what, why):
    recording = warmed(3, **what)
    (one,) = told(recording)
    assert (one.severity, one.value) == ("good", None)
    assert "not identifiable" in one.text
    assert why in one.text
    found = zr.report(recording).findings
    wanted = [one.text for one in found if one.section == "What to record next"]
    assert any("the bias by temperature" in text for text in wanted)


def test_without_a_thermometer_nothing_is_told():
    recording = warmed(1)
    without = {name: log for name, log in recording.items() if name != "temperature"}
    assert told(zr.Recording(without)) == []
