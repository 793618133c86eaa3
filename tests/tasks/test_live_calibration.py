"""Lines of samples corrected by a calibration, and rate and unit of a first line."""

import numpy as np
import pytest

import zerorate as zr
from zerorate.record.log import Log
from zerorate.tasks.live import LineStream, Settings
from zerorate.tasks.live.header import stated_in_header
from zerorate.tasks.live.lines import ColumnError

HEAD = ",".join([*(f"gyro_{a}_dps" for a in "xyz"), *(f"accel_{a}_g" for a in "xyz")])


@pytest.fixture(scope="module")
def session():
    return zr.simulation.simulate_session(12, seed=3)


def answers(settings, head, rows):
    stream = LineStream(settings)
    texts = [stream.take(head)] + [stream.take(",".join(map(repr, row))) for row in rows.tolist()]
    return np.array([[float(cell) for cell in text.split(",")] for text in texts[1:]])


def test_lines_are_corrected_as_a_replay_does(session):
    recording = session.recording
    rows = np.hstack([recording.gyro.data, recording.accel.data])[:4000]
    part = {name: log.part(slice(0, 4000)) for name, log in recording.items()}
    found = answers(Settings(100.0, calibration=session.truth), HEAD, rows)
    log = zr.replay(zr.Recording(part, "session"), calibration=session.truth).to_log()
    np.testing.assert_array_equal(found[:, :3], log.data)
    np.testing.assert_array_equal(found[:, 3:], rows[:, 3:])


def test_without_an_accelerometer_the_gyro_alone_is_corrected(session):
    rows = session.recording.gyro.data[:500]
    head = ",".join(f"gyro_{a}_dps" for a in "xyz")
    found = answers(Settings(100.0, calibration=session.truth.to_json()), head, rows)
    corrected = session.truth.corrector(inputs=3).process(rows)
    log = Log(np.arange(500) / 100.0, 100.0, corrected, list(head.split(",")), "deg/s")
    expected = zr.DriftFilter(
        100.0, channels=3, output="compensated", rest_limit=10.0, bias_limit=20.0
    ).process(log.data)
    np.testing.assert_array_equal(found, expected)


def test_a_calibration_goes_with_the_checkpoint(session):
    settings = Settings(100.0, calibration=session.truth)
    rows = np.hstack([session.recording.gyro.data, session.recording.accel.data])[:300]
    whole = answers(settings, HEAD, rows)
    stream = LineStream(settings)
    lines = [",".join(map(repr, row)) for row in rows.tolist()]
    for line in (HEAD, *lines[:150]):
        stream.take(line)
    again = LineStream.from_bytes(stream.to_bytes(), settings)
    texts = [again.take(line) for line in lines[150:]]
    found = np.array([[float(cell) for cell in text.split(",")] for text in texts])
    np.testing.assert_array_equal(found, whole[150:])


@pytest.mark.parametrize(
    ("head", "message"), [("gx,gy", "three axes, the lines have 2"), ("gx,gy,gz", "give unit=")]
)
def test_lines_that_it_cannot_correct_are_refused(session, head, message):
    with pytest.raises(ColumnError, match=message):
        LineStream(Settings(100.0, calibration=session.truth)).take(head)


@pytest.mark.parametrize(
    ("line", "stated"),
    [
        ("# rate: 100 Hz, unit: deg/s", {"rate": 100.0, "unit": "deg/s"}),
        ("#Sampling frequency = 52.5 Hz", {"rate": 52.5}),
        ('# zerorate {"rate": 200, "unit": "rad/s"}', {"rate": 200, "unit": "rad/s"}),
        ("# unit: furlong, rate: 0 Hz", {}),
        ("# zerorate {", {}),
        ("rate,unit", {}),
        ("", {}),
    ],
)
def test_a_comment_states_rate_and_unit(line, stated):
    assert stated_in_header(line) == stated


def test_several_imus_in_a_header_are_refused_by_name():
    head = ",".join(f"imu{k}_gyro_{a}_dps" for k in (1, 2) for a in "xyz")
    with pytest.raises(ColumnError, match=r"2 IMUs: imu1, imu2; choose one, such as columns=imu1"):
        LineStream(Settings(100.0)).take(head)
    columns = tuple(f"imu2_gyro_{a}_dps" for a in "xyz")
    assert LineStream(Settings(100.0, columns=columns)).take(head) == head
