"""Changes of the magnetometer's hard iron in a recording: named, with time and size."""

import re
from dataclasses import replace

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from zerorate.calibration.magnet.changes import note_iron_changes


def hand(seed):
    return zr.simulate_motion("hand", duration=90.0, seed=seed).recording()


def with_iron(recording, iron, start, stop):
    mag = recording.mag
    there = (mag.sampled >= start) & (mag.sampled < stop)
    logs = {**recording, "mag": mag.with_data(mag.data + np.outer(there, iron))}
    return replace(recording, logs=logs)


@pytest.mark.parametrize("seed", range(4))
def test_a_magnet_that_comes_and_goes_is_named_with_time_and_size(seed):
    random = np.random.default_rng(seed)
    iron = random.normal(size=3)
    iron *= random.uniform(25.0, 60.0) / np.linalg.norm(iron)
    start, stop = random.uniform(25.0, 35.0), random.uniform(60.0, 70.0)
    (note,) = note_iron_changes(with_iron(hand(seed), iron, start, stop))
    found = re.findall(r"by ([\d.]+) uT at (\d+) s", note)
    sizes, times = np.array(found, dtype=float).T
    # Spans begin at whole seconds, and a second of both irons is of neither.
    assert times == pytest.approx([start, stop], abs=3.0)
    assert sizes == pytest.approx(np.linalg.norm(iron), rel=0.1)


@pytest.mark.parametrize("seed", range(3))
def test_iron_that_stays_is_no_change(seed):
    clean = hand(seed)
    assert note_iron_changes(clean) == ()
    assert note_iron_changes(with_iron(clean, [20.0, -10.0, 15.0], -1.0, 1e9)) == ()


@needs_recordings
def test_the_magnet_of_broad_32_is_named_by_task_and_report():
    path = RECORDINGS / "broad_32_disturbed_attached_magnet_1cm.parquet"
    recording = zr.read_recording(path, rate=2000 / 7)
    (note,) = [note for note in zr.estimate_attitude(recording).notes if "hard iron" in note]
    assert "by 59.1 uT at 40 s, by 59.1 uT at 96 s" in note
