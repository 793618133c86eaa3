"""Text logs as people have them: read right or refused, never wrong without a word."""

import numpy as np
import pytest

import zerorate as zr
from support.forms import forms
from support.recordings import RECORDINGS, needs_recordings
from zerorate.record import LogError

FORMS = forms()
READ = [form for form in FORMS if form.expected in ("read", "asks")]
REFUSED = [form for form in FORMS if form.expected not in ("read", "asks")]


def named(listed):
    return [pytest.param(form, id=form.name) for form in listed]


@pytest.mark.parametrize("form", named(READ))
def test_the_gyro_is_read_right(tmp_path, form):
    log = zr.read_log(form.write(tmp_path))
    check(log, form, "gyro")
    assert log.unit == (form.gyro if form.expected == "read" else "unit")
    noted = any("unit" in note for note in log.meta["notes"])
    assert noted or log.unit != "unit"


def check(log, form, kind):
    truth = form.truth(kind)
    assert log.data.shape == truth.shape, log.names
    # Half a unit of the last digit that stands in the file, and what a double adds.
    np.testing.assert_allclose(log.data, truth, rtol=0, atol=0.5 * form.to + 1e-9)
    # Stamps of a millisecond over twelve seconds.
    assert log.rate == pytest.approx(form.rate, rel=1e-4)


@pytest.mark.parametrize("form", named(READ))
def test_all_sensors_are_read_right(tmp_path, form):
    recording = zr.read_recording(form.write(tmp_path))
    for kind in ("gyro", "accel", "mag"):
        unit = getattr(form, kind)
        if unit is not None:
            check(recording[kind], form, kind)
            assert recording[kind].unit in (unit, "unit")


@pytest.mark.parametrize("form", named(REFUSED))
def test_the_rest_is_refused_with_what_to_type(tmp_path, form):
    with pytest.raises(LogError) as caught:
        zr.read_log(form.write(tmp_path))
    assert form.expected in str(caught.value)


def test_a_folder_of_one_file_a_sensor(tmp_path):
    """As Sensor Logger writes it; its Accelerometer is without gravity."""
    by_name = {form.name: form for form in FORMS}
    gyro = by_name["sensor logger gyroscope"]
    rows = gyro.text.splitlines(keepends=True)
    gyro.write(tmp_path)
    (tmp_path / "GyroscopeUncalibrated.csv").write_text(gyro.text)
    (tmp_path / "TotalAcceleration.csv").write_text("".join(rows[:900]))
    (tmp_path / "Accelerometer.csv").write_text("".join(rows[:500]))
    (tmp_path / "Orientation.csv").write_text("time,qx,qy\n0,1,2\n")
    log = zr.read_log(tmp_path)
    check(log, gyro, "gyro")
    assert log.meta["sensor"] == "Gyroscope"
    recording = zr.read_recording(tmp_path)
    assert recording.names == ("gyro", "accel", "gyro_1")
    assert recording.accel.n == 899
    assert zr.read_log(tmp_path, topic="GyroscopeUncalibrated").n == gyro.rows
    with pytest.raises(LogError, match="no topic 'Barometer'; it has: Gyroscope, Total"):
        zr.read_log(tmp_path, topic="Barometer")


def test_messages_of_several_units_of_one_log(tmp_path):
    rows = "".join(
        f"IMU, {10_000 * i}, {unit}, {i + 10 * unit}.5, 2, 3, 0, 0, 9.8, 0, 0, 45, 1, 1, 100, 100\n"
        for i in range(50)
        for unit in (0, 1)
    )
    (tmp_path / "a.log").write_text(rows)
    log = zr.read_log(tmp_path / "a.log")
    assert (log.rate, log.data[0].tolist()) == (100, [0.5, 2, 3])
    assert any("distinguishes 2 sensors" in note for note in log.meta["notes"])
    assert zr.read_log(tmp_path / "a.log", topic="IMU_1").data[0, 0] == 10.5


@pytest.mark.parametrize(
    ("sensor", "first"),
    [(None, 4.0), ("raw", 1.0), ("left", 7.0), ("left raw", 7.0), ("imu2", 10.0)],
)
def test_one_sensor_of_several(sensor, first):
    columns = {"t": np.arange(8) / 100}
    for i, prefix in enumerate(("gyro_raw", "gyro_cal", "left_gyro_raw", "imu2_w")):
        for j, axis in enumerate("zyx"):
            columns[f"{prefix}_{axis}"] = np.full(8, 3.0 * i + 3 - j)
    log = zr.read_log(columns, sensor=sensor)
    assert log.data[0].tolist() == [first, first + 1, first + 2]
    assert any("sensor= chooses another" in note for note in log.meta["notes"])


def test_names_that_tell_no_axes_are_taken_in_order():
    columns = {"t": np.arange(4) / 100, "g1": np.ones(4), "g2": np.zeros(4), "g3": np.ones(4)}
    log = zr.read_log(columns)
    assert log.names == ("g1", "g2", "g3")
    assert (
        "the names g1, g2, g3 show no axes, so they are x, y, z in this order"
        in (log.meta["notes"])
    )


@pytest.mark.parametrize(
    "name",
    [
        "gyro_bias_x",
        "gyro_odr",
        "gyro_accuracy",
        "gyro_temperature",
        "gyro_angle_x",
        "gyro_device_id",
    ],
)
def test_what_is_no_component_is_no_channel(name):
    columns = {"t": np.arange(4) / 100, name: np.ones(4)}
    with pytest.raises(LogError, match="no column looks like a gyro"):
        zr.read_log(columns)


def test_a_unit_that_is_not_computed_with():
    columns = {"t": np.arange(4) / 100, **{f"gyro_{axis} [mdps]": np.ones(4) for axis in "xyz"}}
    with pytest.raises(LogError, match=r"are in mdps; scale=0\.001 makes deg/s of them"):
        zr.read_log(columns, unit="deg/s")
    log = zr.read_log(columns, unit="deg/s", scale=1e-3)
    assert (log.unit, log.data[0, 0]) == ("deg/s", 1e-3)


@needs_recordings
def test_exports_of_motion_capture():
    folder = RECORDINGS / "formats"
    recording = zr.read_recording(folder / "apdm_format7.csv")
    assert len(recording.of_kind("gyro")) == 6
    assert recording.gyro.names == tuple(f"Lumbar Gyroscope {axis}" for axis in "XYZ")
    assert recording.gyro.data[0].tolist() == [-0.928487, -0.085719, -0.059549]
    ankle = zr.read_log(folder / "apdm_format7.csv", sensor="left ankle")
    assert ankle.data[0].tolist() == [-3.734939, 0.411611, -0.395161]
    for mark in ("tab", "semicolon"):
        log = zr.read_log(folder / f"xsens_{mark}.txt", rate=100)
        assert log.names == ("Gyr_X", "Gyr_Y", "Gyr_Z")
