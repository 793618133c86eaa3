"""Gyros of one body against one another: delay, rotation, scale with true errors; the odd one."""

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from zerorate.findings.gyro_comparison import compare_gyros
from zerorate.findings.imus import find_imus

DELAY = 0.008
SCALE = np.array([1.02, 0.99, 1.0])
TURN = np.radians([0.6, -0.4, 0.8])
STUDENT = 2.2
"""Of 11 degrees of freedom, 95 %."""


def rotation(vector):
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


class Turns:
    """Rates of a body, rad/s, at any time: it rests for ten seconds, then turns by hand."""

    def __init__(self, seed, size=1.5, axes=(1.0, 1.0, 1.0)):
        random = np.random.default_rng([seed, 1])
        self.hertz, self.phase = random.uniform(0.06, 0.6, (6, 3)), random.uniform(0, 6.28, (6, 3))
        self.size = size / np.sqrt(3.0) * np.asarray(axes)

    def __call__(self, t):
        on = np.clip((t - 10.0) / 2.0, 0.0, 1.0)[:, None]
        waves = np.sin(2.0 * np.pi * self.hertz * t[:, None, None] + self.phase).sum(axis=1)
        return self.size * on * waves


def coloured(random, shape, size, rate):
    """Noise that remembers a fifth of a second, of some deviation."""
    keep = np.exp(-1.0 / (0.2 * rate))
    white = np.sqrt(1.0 - keep**2) * size * random.standard_normal(shape)
    for i in range(1, len(white)):
        white[i] += keep * white[i - 1]
    return white


def table(
    seed,
    seconds=60.0,
    *,
    second=None,
    noise=2e-3,
    slow=0.0,
    rates=(100.0, 100.0),
    bias=0.01,
    **turns,
):
    """Return columns of two gyros, or three, of which the last is late, turned and scaled."""
    body, random = Turns(seed, **turns), np.random.default_rng([seed, 2])
    logs = []
    for k, rate in enumerate(rates):
        last = k == len(rates) - 1
        t = np.arange(round(seconds * rate)) / rate + 0.003 * k
        # The first shows SCALE times R of what the last does.
        true = (body(t - DELAY) / SCALE) @ rotation(TURN) if last else body(t)
        true = second(t) if last and second is not None else true
        seen = true + bias * random.standard_normal(3) + noise * random.standard_normal(true.shape)
        if slow:
            seen += coloured(random, true.shape, slow, rate)
        force = [0.0, 0.0, 9.80665] + 0.02 * random.standard_normal(true.shape)
        log = {"time_s": t}
        for axis, turn, push in zip("xyz", seen.T, force.T, strict=True):
            log |= {f"gyro_{axis}_radps": turn, f"accel_{axis}_mps2": push}
        logs.append(log)
    return logs


def recording(logs):
    """Return a recording of several IMUs on clocks of their own."""
    named = {}
    for k, log in enumerate(logs):
        for name, one in zr.read_recording(log).items():
            named[f"{name}_{k}" if k else name] = one
    return zr.Recording(named)


def compared(logs):
    first, second = find_imus(recording(logs))
    return compare_gyros(first.gyro, second.gyro)


def errors_of(found):
    turn = found.matrix @ rotation(TURN).T
    off = 0.5 * (turn - turn.T)
    error = [found.delay - DELAY, off[2, 1], off[0, 2], off[1, 0], *(found.scale - SCALE)]
    return np.array(error), np.array([found.delay_sigma, *found.turn_sigma, *found.scale_sigma])


@pytest.mark.every(2)
@pytest.mark.parametrize(
    "what",
    [
        {},
        {"bias": 0.1, "size": 0.5},
        {"rates": (250.0, 100.0)},
        {"slow": 5e-3},
        {"size": 0.4, "noise": 5e-3},
    ],
    ids=["hand", "biases as large as turns", "two rates", "coloured noise", "small turns"],
)
def test_delay_rotation_and_scale_are_within_their_errors(what):
    pairs = [errors_of(compared(table(seed, **what))) for seed in range(20)]
    errors, sigmas = np.array(pairs).transpose(1, 0, 2)
    assert np.mean(np.abs(errors) < STUDENT * sigmas) > 0.9
    assert 0.7 < np.sqrt(np.mean(np.square(errors / sigmas))) < 1.5
    # Small enough to be of use: a millisecond, a tenth of a degree, half a percent.
    assert (np.median(sigmas, axis=0) < [1e-3, *3 * [2e-3], *3 * [5e-3]]).all()


def test_an_axis_that_does_not_turn_has_an_error_that_says_so():
    found = compared(table(1, axes=(0.0, 0.0, 1.0)))
    assert found.scale_sigma[2] < 1e-3
    assert found.delay_sigma < 1e-3
    assert found.scale_sigma[:2].min() > 0.01


def test_what_does_not_turn_or_is_too_short_tells_nothing():
    still = zr.report(recording(table(1, size=0.0)))
    assert not {one.kind for one in still.findings} & {"delay", "scales differ", "rotation"}
    first, second = find_imus(recording(table(1, seconds=5.0)))
    assert compare_gyros(first.gyro, second.gyro) is None


def test_gyros_of_two_bodies_are_not_compared():
    found = zr.report(recording(table(1, second=Turns(2))))
    assert [one for one in found.findings if one.section == "IMUs against one another"] == []


def test_gaps_clipping_and_missing_numbers_are_left_out():
    logs = table(3)
    for axis in "xyz":
        column = logs[1][f"gyro_{axis}_radps"]
        np.clip(column, -1.2, 1.2, out=column)
        column[3000:3010] = np.nan
    kept = np.ones(len(logs[0]["time_s"]), dtype=bool)
    kept[4000:4040] = False
    logs[0] = {name: column[kept] for name, column in logs[0].items()}
    error, sigma = errors_of(compared(logs))
    assert (np.abs(error) < 4.0 * sigma).all()


def test_of_three_the_late_one_is_told():
    found = zr.report(recording(table(1, rates=(100.0, 100.0, 100.0)))).findings
    odd = {one.text.split(": ")[0]: one for one in found if one.kind == "outlier"}
    late = odd["Of 3 IMUs, IMU 2 is the outlier in delay"]
    assert late.severity == "look"  # 8 ms are above 5.77 ms
    assert late.value == pytest.approx(8.0, abs=0.5)
    scales = odd["Of 3 IMUs, IMU 2 is the outlier in scale"]
    assert (scales.severity, round(scales.value)) == ("good", 2)
    delays = [one for one in found if one.kind == "delay"]
    assert [one.severity for one in delays] == ["good", "look", "look"]


def test_of_three_that_are_alike_none_is_odd():
    logs = table(1, rates=(100.0, 100.0, 100.0), second=Turns(1))
    found = zr.report(recording(logs)).findings
    assert len([one for one in found if one.kind == "delay"]) == 3
    assert [one.text for one in found if one.kind == "outlier" and one.severity != "good"] == []


def test_what_turns_would_tell_is_asked_for():
    found = zr.report(recording(table(1, size=0.0))).findings
    asked = [one.text for one in found if one.kind == "not identifiable"]
    assert any("delay, rotation and scale between its IMUs" in text for text in asked)


@needs_recordings
def test_imus_on_one_board_have_no_delay_and_scales_within_two_percent():
    found = zr.report(zr.read_recording(RECORDINGS / "mimu4444_array8_62hz_exp1.parquet"))
    delays = [one for one in found.findings if one.kind == "delay"]
    assert max(one.value for one in delays) < 0.05  # ms; one clock samples all
    scales = [one for one in found.findings if one.kind == "scales differ"]
    assert 0.1 < max(one.value for one in scales) < 2.0
