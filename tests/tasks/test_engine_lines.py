"""Arrays and navigation line by line: answers of the engine, garbled lines, saved states."""

from dataclasses import replace

import numpy as np
import pytest

import zerorate as zr
from zerorate.tasks.live import (
    ArraySettings,
    AttitudeSettings,
    CheckpointError,
    ColumnError,
    LineError,
    LineStream,
    NavigationSettings,
    Settings,
    SettingsError,
)

RATE = 50.0
Z = np.random.default_rng(3).standard_normal((400, 2, 3))
DRIVE = zr.simulate_drive(RATE, 60.0, seed=3)


def texts(numbers):
    return ",".join("" if np.isnan(x) else repr(x) for x in np.ravel(numbers).tolist())


def numbers(answer):
    return [float(cell) for cell in answer.split(",")]


def array(**given):
    return ArraySettings(zr.GyroArray(RATE, 2), **given)


def navigation(**given):
    start = zr.align(DRIVE.recording(), latitude=48.0, heading=0.3, span=(0.0, 25.0))
    return NavigationSettings(zr.NavigationFilter(start), RATE, time=0, **given)


def drive_lines():
    """Time, gyro, accelerometer, and the fix that comes with a sample, if one does."""
    fixes = np.full((DRIVE.time.size, 6), np.nan)
    at = np.searchsorted(DRIVE.time, DRIVE.fixes.time)
    there = at < DRIVE.time.size
    fixes[at[there]] = np.hstack([DRIVE.fixes.position, DRIVE.fixes.velocity])[there]
    return [texts(row) for row in np.column_stack([DRIVE.time, DRIVE.gyro, DRIVE.accel, fixes])]


LINES = {"array": [texts(row) for row in Z], "navigation": drive_lines()}
SETTINGS = {"array": array, "navigation": navigation}
BESIDE = {"array": "health", "navigation": "status"}
BY_ENGINE = pytest.mark.parametrize("engine", SETTINGS)


def test_an_array_answers_with_its_rate():
    stream = LineStream(array(extra=("at_rest", "health")))
    alone, expected = zr.GyroArray(RATE, 2), []
    for z in Z:
        expected.append([*alone.update(z), *alone.at_rest])
    for line, row in zip(LINES["array"], expected, strict=True):
        answer = stream.take(line).split(",")
        assert numbers(",".join(answer[:6])) == row
        assert answer[6:] == list(alone.health)


def test_a_navigation_answers_with_its_place():
    stream = LineStream(navigation(extra=("status", "sigma", "verdict")))
    nav, verdicts = navigation().filter.copy(), []
    rows = [[float(cell or "nan") for cell in line.split(",")] for line in LINES["navigation"]]
    for line, row in zip(LINES["navigation"], rows, strict=True):
        status, verdict = nav.update(row[0], row[1:4], row[4:7]), "none"
        if np.isfinite(row[7:]).any():
            verdict = nav.update_gnss(row[0], row[7:10], row[10:])
            status = nav.status
        answer = stream.take(line).split(",")
        known = [row[0], *nav.position, *nav.velocity, *nav.quaternion]
        np.testing.assert_array_equal(numbers(",".join(answer[:11])), known)
        assert (answer[11], answer[15]) == (status, verdict)
        verdicts.append(verdict)
    assert status == "navigating"
    assert {"none", "used"} <= set(verdicts)


@BY_ENGINE
def test_saved_between_any_two_lines_it_goes_on(engine):
    lines = [f"{i},{line}" for i, line in enumerate(LINES[engine])]
    settings = SETTINGS[engine](sequence=0)
    if engine == "navigation":
        settings = replace(settings, time=1)
    whole = LineStream(settings)
    expected = [whole.take(line) for line in lines if not line.startswith(("7,", "8,"))]
    stream, answers = LineStream(settings), []
    for i, line in enumerate(lines):
        if i in (7, 8):
            continue
        answers.append(stream.take(line))
        if i % 97 == 0:
            stream = LineStream.from_bytes(stream.to_bytes(), settings)
    assert answers == expected
    assert stream.to_bytes() == whole.to_bytes()
    assert stream.sequence.lost_count == 2
    assert stream.position == len(lines)


@BY_ENGINE
def test_a_garbled_line_is_answered_and_stands_for_a_sample(engine):
    stream = LineStream(SETTINGS[engine]())
    width = len(stream.take(LINES[engine][0]).split(","))
    for line in ("garbled", LINES[engine][1] + ",1", ""):
        with pytest.raises(LineError):
            stream.take(line)
        assert stream.no_answer.split(",") == ["nan"] * width
    assert len(stream.take(LINES[engine][4]).split(",")) == width
    assert stream.position == 5


@BY_ENGINE
def test_other_settings_and_other_bytes_are_refused(engine):
    stream = LineStream(SETTINGS[engine]())
    stream.take(LINES[engine][0])
    raw = stream.to_bytes()
    with pytest.raises(SettingsError, match="made with extra=none"):
        LineStream.from_bytes(raw, SETTINGS[engine](extra=(BESIDE[engine],)))
    for other in (Settings(RATE), AttitudeSettings(RATE)):
        with pytest.raises(SettingsError, match=f"it is of the engine '{engine}', not of"):
            LineStream.from_bytes(raw, other)
    for bad in (b"", raw[:-1], raw[:50] + b"x" + raw[51:], b"ZRLINES1" + raw[8:]):
        with pytest.raises(CheckpointError):
            LineStream.from_bytes(bad)


def test_columns_that_cannot_be():
    with pytest.raises(ColumnError, match="2 sensors needs 6 columns, got 3"):
        LineStream(array()).take("1,2,3")
    with pytest.raises(ColumnError, match="six, nine or twelve columns, got 3"):
        LineStream(navigation()).take("0,1,2,3")
    with pytest.raises(ColumnError, match="the time is also the column of a sensor"):
        LineStream(navigation(columns=(0, 1, 2, 3, 4, 5))).take("0,1,2,3,4,5")


def test_an_engine_that_has_seen_samples_is_refused():
    used = zr.GyroArray(RATE, 2)
    used.update(Z[0])
    with pytest.raises(ValueError, match="has seen no sample, got 1"):
        ArraySettings(used)
    nav = navigation().filter
    nav.update(0.0, [0.0] * 3, [0.0, 0.0, -9.8])
    with pytest.raises(ValueError, match="has seen no sample, got 1"):
        NavigationSettings(nav, RATE, time=0)


def test_a_time_that_is_no_later_is_told_a_period_later():
    stream = LineStream(navigation())
    stream.take(LINES["navigation"][5])
    stream.take(LINES["navigation"][4])
    assert stream.samples == 2
    with pytest.raises(LineError, match="its time is missing"):
        stream.take("," + LINES["navigation"][6].split(",", 1)[1])
