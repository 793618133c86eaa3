"""The preparation of recordings: faults of any kind drawn are found, and what is right stays."""

import runpy
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import zerorate as zr
from zerorate.checks.gravity import lacks_gravity
from zerorate.checks.held import drop_held_fixes
from zerorate.checks.preparation import Choices, prepare
from zerorate.geometry.rotations import rotate

KINDS = ("pendulum", "spinning pendulum", "arm", "vehicle", "circle", "hand")
G = 9.80665
SEEDS = range(6)
BODIES = runpy.run_path(str(Path(__file__).parents[2] / "examples" / "foot_bodies.py"))


@cache
def motion(kind="hand", seed=1, duration=60.0):
    return zr.simulate_motion(kind, duration=duration, seed=seed)


def with_log(recording, name, data, unit=None):
    log = recording[name]
    changed = replace(log, data=data, unit=unit or log.unit)
    return replace(recording, logs={**recording, name: changed})


def without_gravity(made):
    """The force less gravity, in the axes of the sensor, m/s²."""
    inverse = made.quaternion * [1.0, -1.0, -1.0, -1.0]
    up = rotate(inverse, np.tile([0.0, 0.0, G], (len(made.time), 1)))
    return made.accel - up, up


@pytest.mark.parametrize("kind", KINDS)
def test_a_right_recording_stays_as_it_is(kind):
    recording = motion(kind).recording()
    made = prepare(recording)
    assert made.alarms == ()
    for name, log in recording.items():
        np.testing.assert_array_equal(made.recording[name].data, log.data, name)


@pytest.mark.parametrize("seed", SEEDS)
def test_right_walks_and_drives_stay_as_they_are(seed):
    walk = zr.simulate_walk(strides=12, seed=seed).recording()
    drive = zr.simulate_drive(duration=60.0, seed=seed)
    for recording in (walk, drive.recording()):
        assert prepare(recording).alarms == ()
    assert drop_held_fixes(drive.fixes) == (drive.fixes, ())


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("kind", ["hand", "arm"])
def test_a_wrong_axis_is_seen_in_spite_of_clipping(kind, seed):
    made = motion(kind, seed)
    limit = np.quantile(np.abs(made.gyro).max(axis=1), 0.97)
    wrong = np.clip(made.gyro, -limit, limit) * [1.0, -1.0, 1.0]
    alarms = prepare(with_log(made.recording(), "gyro", wrong)).alarms
    assert any("y axis has the opposite sign to" in alarm for alarm in alarms)


class TestGravity:
    @pytest.mark.parametrize("kind", KINDS)
    def test_it_is_missed_and_named(self, kind):
        made = motion(kind)
        free, _ = without_gravity(made)
        recording = with_log(made.recording(), "accel", free)
        with pytest.raises(zr.LogError, match="gravity is absent"):
            prepare(recording)
        (alarm,) = prepare(recording, Choices(gravity=False, skip=("units and axes",))).alarms
        assert "gravity is absent" in alarm

    @pytest.mark.parametrize("seed", SEEDS)
    def test_it_is_made_whole_of_columns(self, seed):
        made = motion(KINDS[seed], seed)
        free, up = without_gravity(made)
        recording = with_log(made.recording(), "accel", free)
        gravity = replace(recording.accel, data=up, names=("gravity_x", "gravity_y", "gravity_z"))
        whole = prepare(replace(recording, logs={**recording, "gravity": gravity})).recording
        np.testing.assert_allclose(whole.accel.data, made.accel, atol=1e-12)

    @pytest.mark.parametrize("scale", [1.0 / G, 0.3, 3.0])
    def test_another_unit_is_not_taken_for_it(self, scale):
        walk = zr.simulate_walk(strides=30, seed=2).recording().accel
        hand = motion().recording().accel
        for log in (walk, hand):
            assert not lacks_gravity(log.with_data(scale * log.data))

    @pytest.mark.parametrize("kind", BODIES["FEET"])
    @pytest.mark.parametrize("gravity", [0.0, G])
    def test_it_is_missed_on_a_foot_however_fast(self, kind, gravity):
        for seed in range(3):
            _, rate, *samples = BODIES["foot"](seed, kind, 100.0, 20.0, gravity)
            recording = BODIES["recording"](samples[0], rate, *samples[1:])
            assert lacks_gravity(recording.accel, recording.gyro) == (gravity == 0.0), seed

    def test_less_than_five_seconds_are_not_judged(self):
        made = motion(duration=4.0)
        free, _ = without_gravity(made)
        assert not lacks_gravity(made.recording().accel.with_data(free))


class TestAbsent:
    @pytest.mark.parametrize("seed", SEEDS)
    def test_halves_without_values_are_left_out(self, seed):
        random = np.random.default_rng(seed)
        right = motion(seed=seed).recording()
        value = random.choice([0.0, -1.0])
        blank = {
            kind: right[kind].with_data(np.full((right[kind].n, 3), value))
            for kind in ("gyro", "accel")
        }
        logs = {"gyro": right.gyro, "accel": blank["accel"]}
        other = {"gyro_1": blank["gyro"], "accel_1": right.accel}
        if random.integers(2):
            logs = {"gyro": blank["gyro"], "accel": right.accel}
            other = {"gyro_1": right.gyro, "accel_1": blank["accel"]}
        made = prepare(zr.Recording({**logs, **other}, "two.bag"))
        assert set(made.recording) == {"gyro", "accel"}
        assert made.recording.gyro is right.gyro
        assert made.recording.accel is right.accel
        assert sum("measures nothing" in note for note in made.recording.notes) == 2

    @pytest.mark.parametrize("seed", SEEDS)
    def test_a_dead_axis_is_named(self, seed):
        random = np.random.default_rng(seed)
        recording = motion(seed=seed).recording()
        name, axis = random.choice(["gyro", "accel", "mag"]), int(random.integers(3))
        data = recording[name].data.copy()
        data[:, axis] = random.choice([0.0, 0.3, -20.0])
        made = prepare(with_log(recording, name, data), Choices(skip=("units and axes",)))
        named = recording[name].names[axis]
        assert any(f"{named}: " in alarm and "dead axis" in alarm for alarm in made.alarms)


class TestFrozen:
    @pytest.mark.parametrize("seed", SEEDS)
    def test_a_field_that_stands_still_in_a_turn_is_missing(self, seed):
        random = np.random.default_rng(seed)
        recording = motion(seed=seed).recording()
        first, count = int(random.integers(2000, 3000)), int(random.integers(1000, 2000))
        data = recording.mag.data.copy()
        data[first : first + count] = data[first]
        made = prepare(with_log(recording, "mag", data))
        lost = np.isnan(made.recording.mag.data).all(axis=1)
        assert np.flatnonzero(lost).tolist() == list(range(first, first + count))
        assert any("while the gyro turns" in alarm for alarm in made.alarms)

    def test_one_that_is_read_less_often_than_it_is_written_stays(self):
        recording = motion().recording()
        held = recording.mag.data[np.arange(recording.mag.n) // 50 * 50]
        made = prepare(with_log(recording, "mag", held))
        np.testing.assert_array_equal(made.recording.mag.data, held)


class TestHeld:
    @pytest.mark.parametrize("seed", SEEDS)
    def test_rows_that_hold_the_last_fix_are_left_out(self, seed):
        drive = zr.simulate_drive(duration=80.0, seed=seed)
        fixes, random = drive.fixes, np.random.default_rng(seed)
        rate = random.choice([3.0, 10.0, 100.0])
        time = np.arange(fixes.time[0], fixes.time[-1], 1.0 / rate)
        rows = np.searchsorted(fixes.time, time, side="right") - 1
        velocity = None if seed % 2 else fixes.velocity[rows]
        new, (note,) = drop_held_fixes(zr.Fixes(time, fixes.position[rows], velocity))
        assert len(new) == len(np.unique(rows))
        assert note in new.notes

    def test_a_receiver_that_stands_may_repeat_itself(self):
        fixes = zr.simulate_drive(duration=80.0, seed=1).fixes
        position = fixes.position.copy()
        position[:20] = position[0]
        standing = replace(fixes, position=position, velocity=None)
        assert drop_held_fixes(standing) == (standing, ())

    def test_a_fix_that_is_sent_twice_counts_once(self):
        fixes = zr.simulate_drive(duration=80.0, seed=1).fixes
        time = np.sort(np.concatenate((fixes.time, fixes.time[::7] + 0.01)))
        rows = np.searchsorted(fixes.time, time, side="right") - 1
        new, _ = drop_held_fixes(zr.Fixes(time, fixes.position[rows], fixes.velocity[rows]))
        np.testing.assert_array_equal(new.time, fixes.time)


class TestSteady:
    def at_rest(self, seed, size):
        random = np.random.default_rng(seed)
        direction = random.standard_normal(3)
        bias = np.radians(size) * direction / np.linalg.norm(direction)
        time = np.arange(3000) / 100.0
        gyro = bias + 0.002 * random.standard_normal((3000, 3))
        accel = [0.0, 0.0, G] + 0.03 * random.standard_normal((3000, 3))
        logs = {
            "gyro": zr.Log(time, 100.0, gyro, ("gx", "gy", "gz"), "rad/s"),
            "accel": zr.Log(time, 100.0, accel, ("ax", "ay", "az"), "m/s^2"),
        }
        return zr.Recording(logs, "still.csv")

    @pytest.mark.parametrize("seed", SEEDS)
    def test_a_large_bias_is_named_and_no_unit_is_accused(self, seed):
        size = np.random.default_rng(seed).uniform(12.0, 60.0)
        (alarm,) = prepare(self.at_rest(seed, size)).alarms
        assert f"{size:.1f} deg/s throughout" in alarm
        assert "bias_limit=" in alarm
        limited = Choices(bias_limit=float(np.radians(70.0)))
        assert prepare(self.at_rest(seed, size), limited).alarms == ()

    @pytest.mark.parametrize("seed", SEEDS)
    def test_a_usual_bias_is_none(self, seed):
        assert prepare(self.at_rest(seed, 8.0)).alarms == ()


@pytest.mark.parametrize("seed", SEEDS)
def test_a_garbage_sample_is_missing_for_every_task(seed):
    random = np.random.default_rng(seed)
    recording = motion(seed=seed).recording()
    data = recording.gyro.data.copy()
    row = int(random.integers(100, len(data) - 100))
    data[row, random.integers(3)] = random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(2.0, 9.0)
    made = prepare(with_log(recording, "gyro", data))
    assert np.flatnonzero(np.isnan(made.recording.gyro.data).any(axis=1)).tolist() == [row]
    assert any("1 of" in alarm and "impossible" in alarm for alarm in made.alarms)
