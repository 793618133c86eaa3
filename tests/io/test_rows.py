"""Rows of several sensors in one table, and which of several numbered sensors is read."""

import numpy as np
import pytest

from zerorate.io import read_log, read_recording
from zerorate.record import LogError

N = 300
T = np.arange(N) / 100
RATES = np.c_[np.sin(T), 0.2 * np.cos(3 * T), 0.1 + 0.3 * np.sin(2 * T)]


def table(path, head, rows):
    path.write_text("\n".join([head, *rows] if head else rows) + "\n")
    return path


def cells(*values):
    return ",".join(f"{v:.6f}" if isinstance(v, float) else str(v) for v in values)


def check(log, rates=RATES):
    assert log.rate == pytest.approx(100.0, rel=1e-3)
    np.testing.assert_allclose(log.data, rates, atol=1e-6)


@pytest.mark.parametrize("name", ["device_id", "I", "imu", "sensor_id", "node"])
@pytest.mark.parametrize("numbers", [(0, 1), (2883594, 17), (1, 0)])
def test_sensors_that_take_turns(tmp_path, name, numbers):
    rows = [
        cells(10_000 * k + 3 * i, number, *(RATES[k] + (number != min(numbers))))
        for k in range(N)
        for i, number in enumerate(numbers)
    ]
    log = read_log(table(tmp_path / "a.csv", f"time_us,{name},gx,gy,gz", rows))
    check(log)
    assert any(f"'{name}' distinguishes 2 sensors" in note for note in log.meta["notes"])


def test_a_number_that_stays_tells_nothing_apart(tmp_path):
    rows = [cells(10_000 * k, 7 if k < 200 else 8, *RATES[k]) for k in range(N)]
    check(read_log(table(tmp_path / "a.csv", "time_us,id,gx,gy,gz", rows)))


def test_messages_without_formats(tmp_path):
    rows = [
        line
        for k in range(N)
        for line in (
            f"GYR, {cells(10_000 * k, *RATES[k])}",
            f"ACC, {cells(10_000 * k, 0.0, 0.1, 9.8)}",
        )
    ]
    recording = read_recording(table(tmp_path / "a.txt", "", rows))
    check(recording.gyro)
    np.testing.assert_allclose(recording.accel.data[0], [0.0, 0.1, 9.8])
    assert any("rows of GYR have no names" in note for note in recording.gyro.meta["notes"])


def test_messages_of_another_width_are_not_read_as_what_their_name_was(tmp_path):
    rows = [f"GYR, {cells(10_000 * k, *RATES[k], 1.0, 2.0, 3.0)}" for k in range(N)]
    with pytest.raises(LogError):
        read_log(table(tmp_path / "a.txt", "", rows))


def test_the_lowest_number_comes_first(tmp_path):
    rows = [cells(10 * k, *(RATES[k] + 1.0), *RATES[k]) for k in range(N)]
    head = "time_ms,imu1_gx_dps,imu1_gy_dps,imu1_gz_dps,imu0_gx_dps,imu0_gy_dps,imu0_gz_dps"
    check(read_log(table(tmp_path / "a.csv", head, rows)))
    check(read_log(tmp_path / "a.csv", sensor="imu1"), RATES + 1.0)


def test_more_numbers_than_axes_are_refused(tmp_path):
    head = "time_ms," + ",".join(f"gyro_{i}" for i in range(6))
    rows = [cells(10 * k, *RATES[k], *RATES[k]) for k in range(N)]
    with pytest.raises(LogError, match=r"6 columns are of a gyro.*columns=gyro_0,gyro_1,gyro_2"):
        read_log(table(tmp_path / "a.csv", head, rows))
    check(read_log(tmp_path / "a.csv", columns=["gyro_0", "gyro_1", "gyro_2"]))
