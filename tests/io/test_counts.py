"""Raw counts: sensitivities of devices, factors, and the note on what looks like counts."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import zerorate as zr
from zerorate.io.counts import SENSITIVITIES
from zerorate.io.reading import read_sensors

RNG = np.random.default_rng(1)
COUNTS = {
    "millis": 5 * np.arange(400),
    **{name: np.rint(40 * RNG.standard_normal(400) + 300) for name in ("ax", "ay", "gx", "gy")},
}
MPU = zr.raw_counts("MPU-6050", 250, 2)


@pytest.mark.parametrize(
    ("device", "gyro", "accel", "per_degree", "per_g"),
    [
        ("MPU-6050", 250, 2, 131, 16384),
        ("mpu6050", 2000, 16, 16.4, 2048),
        ("ICM 42688 P", 62.5, 4, 524.3, 8192),
        ("BMI160", 500, 8, 65.6, 4096),
        ("BMI088", 1000, 6, 32.768, 5460),
        ("LSM6DS3", 245, 2, 1 / 0.00875, 1 / 0.000061),
        ("LSM9DS1", 2000, 16, 1 / 0.07, 1 / 0.000732),
        ("ISM330DHCX", 4000, 4, 1 / 0.14, 1 / 0.000122),
        ("ITG-3200", 2000, None, 14.375, None),
    ],
)
def test_numbers_of_data_sheets(device, gyro, accel, per_degree, per_g):
    found = zr.raw_counts(device, gyro, accel)
    assert 1 / found.gyro == pytest.approx(per_degree)
    assert found.accel is per_g is None or 1 / found.accel == pytest.approx(per_g)


def test_full_range_is_about_all_counts_of_16_bits():
    for device, table in SENSITIVITIES.items():
        for per_unit in table:
            for end, counts in per_unit.items():
                assert 0.66 * 2**15 <= end * counts <= 1.01 * 2**15, (device, end)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("MPU-6051", 250), "device= is 'MPU-6051', which has no entry.*MPU-6000, MPU-6050"),
        (("MPU-6050", 245), "range= is 245 deg/s, but the gyro of the MPU-6050 has these ranges: "),
        (("MPU-6050", 250, 3), "range= is 3 g, but the accelerometer of the MPU-6050"),
        (("ITG-3200", 2000, 2), "the accelerometer of the ITG-3200 has these ranges: none"),
    ],
)
def test_what_no_data_sheet_says(arguments, told):
    with pytest.raises(ValueError, match=told):
        zr.raw_counts(*arguments)


def test_counts_become_rates_and_accelerations():
    log = zr.read_log(COUNTS, scale=MPU)
    assert (log.unit, log.names, log.meta["notes"]) == ("deg/s", ("gx", "gy"), ())
    np.testing.assert_array_equal(log.data[:, 0], COUNTS["gx"] * (1 / 131))
    recording = zr.read_recording(COUNTS, scale=MPU)
    assert (recording.gyro.unit, recording.accel.unit) == ("deg/s", "g")
    for gyro, accel in (
        read_sensors(COUNTS, scale=MPU),
        read_sensors(COUNTS, unit="deg/s,g", scale={"gyro": 1 / 131, "accel": 1 / 16384}),
        (recording.gyro, recording.accel),
    ):
        np.testing.assert_array_equal(gyro.data, log.data)
        np.testing.assert_array_equal(accel.data[:, 1], COUNTS["ay"] * (1 / 16384))
        assert (accel.unit, accel.meta["notes"]) == ("g", ())
    assert zr.read_log(COUNTS, columns=["ax"], scale=MPU).unit == "g"


@given(st.floats(allow_nan=False, allow_infinity=False).filter(bool), st.integers(0, 3))
def test_a_factor_multiplies_what_is_read(factor, column):
    name = ["ax", "ay", "gx", "gy"][column]
    log = zr.read_log(COUNTS, columns=name, scale=factor, unit="rad/s")
    with np.errstate(over="ignore"):
        np.testing.assert_array_equal(log.data[:, 0], COUNTS[name] * factor)


def test_of_the_other_sensor_nothing_is_known():
    gyro, accel = read_sensors(COUNTS, scale=zr.raw_counts("MPU-6050", 250))
    assert (gyro.unit, accel.unit) == ("deg/s", "unit")
    assert 'scale=zr.raw_counts("MPU-6050", 250, 2), or scale= and unit=, make g of' in str(
        accel.meta
    )


@pytest.mark.parametrize("scale", [0, np.nan, np.inf, True, "2", {"mag": 2.0}, {"gyro": 0}])
def test_what_is_no_factor(scale):
    with pytest.raises(ValueError, match="scale= "):
        zr.read_log(COUNTS, scale=scale)


def test_a_unit_that_contradicts_the_device():
    assert zr.read_log(COUNTS, scale=MPU, unit="dps").unit == "deg/s"
    with pytest.raises(ValueError, match=r"unit= is rad/s, but the counts .* become deg/s"):
        zr.read_log(COUNTS, scale=MPU, unit="rad/s")
    with pytest.raises(zr.LogError, match="'deg/s' was given, but column 'gx_radps' is in rad/s"):
        zr.read_log({"gx_radps": COUNTS["gx"]}, 100, scale=MPU)


@pytest.mark.parametrize(
    ("column", "unit", "told"),
    [
        ("gx", None, "gx are whole numbers without a unit, as raw counts are"),
        ("gx", "deg/s", "gx are whole numbers up to "),
        ("gx", "deg/h", None),
        ("gx_dps", None, None),
    ],
)
def test_what_looks_like_counts_is_noted(column, unit, told):
    table = {"t": 0.01 * np.arange(400), column: COUNTS["gx"]}
    notes = zr.read_log(table, unit=unit).meta["notes"]
    assert [note.partition(":")[0][: len(told or "")] for note in notes] == [told] * bool(told)
    small = {**table, column: np.rint(RNG.standard_normal(400))}
    assert not any("counts" in note for note in zr.read_log(small, unit="deg/s").meta["notes"])
    assert not any(
        "counts" in note for note in zr.read_log(table, unit=unit, scale=2.0).meta["notes"]
    )
