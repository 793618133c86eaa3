"""The noise model's Allan curve and the table of devices."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from zerorate.devices import DEVICES, device
from zerorate.noise import FLICKER_FLOOR, Coefficient, NoiseModel
from zerorate.units import convert

FIELDS = (
    "angle_random_walk",
    "bias_instability",
    "rate_random_walk",
    "rate_ramp",
    "quantization",
)
COEFFICIENTS = st.floats(min_value=0.0, max_value=1e100)


@pytest.mark.parametrize(
    ("term", "tau", "expected"),
    [
        ("angle_random_walk", 1.0, 1.0),
        ("angle_random_walk", 100.0, 0.1),
        ("bias_instability", 50.0, 0.66428247),
        ("rate_random_walk", 3.0, 1.0),
        ("rate_random_walk", 300.0, 10.0),
        ("rate_ramp", math.sqrt(2.0), 1.0),
    ],
)
def test_each_term_is_read_where_ieee_952_reads_it(term, tau, expected):
    # The printed floor has eight digits.
    deviation = NoiseModel(**{term: 1.0}).allan_deviation(tau)
    assert float(deviation) == pytest.approx(expected, rel=1e-8)


def test_terms_add_as_variances():
    model = NoiseModel(3.0, 2.0, 1.0, -0.5)
    tau = np.array([0.1, 1.0, 10.0])
    variance = 9.0 / tau + 8.0 * math.log(2.0) / math.pi + tau / 3.0 + 0.125 * tau**2
    np.testing.assert_allclose(model.allan_deviation(tau), np.sqrt(variance), rtol=1e-14)


@settings(derandomize=True)
@given(COEFFICIENTS, COEFFICIENTS, COEFFICIENTS, st.floats(-1e100, 1e100))
def test_any_model_has_a_finite_curve_of_the_taus_shape(n, b, k, r):
    deviation = NoiseModel(n, b, k, r).allan_deviation([[1e-3, 1.0], [1e3, 1e6]])
    assert deviation.shape == (2, 2)
    assert np.all(np.isfinite(deviation) & (deviation >= 0.0))


@pytest.mark.parametrize("field", [f.name for f in dataclasses.fields(NoiseModel)])
@pytest.mark.parametrize("value", [math.nan, math.inf, "much", None])
def test_coefficients_are_finite_numbers(field, value):
    with pytest.raises(ValueError, match=f"{field} must be"):
        NoiseModel(**{field: value})


def test_only_the_ramp_may_fall():
    assert NoiseModel(rate_ramp=-1.0).rate_ramp == -1.0
    for field in ("angle_random_walk", "bias_instability", "rate_random_walk"):
        with pytest.raises(ValueError, match=f"{field} must not be negative"):
            NoiseModel(**{field: -1e-9})


def test_numbers_are_kept_as_coefficients():
    model = NoiseModel(np.float32(0.5), 1)
    kept = [getattr(model, name) for name in FIELDS]
    assert [type(value) for value in kept] == [Coefficient] * 5
    assert kept == [0.5, 1.0, 0.0, 0.0, 0.0]
    with pytest.raises(dataclasses.FrozenInstanceError):
        model.rate_ramp = 1.0


@pytest.mark.parametrize("tau", [0.0, -1.0, math.nan, math.inf])
def test_taus_are_positive(tau):
    with pytest.raises(ValueError, match="positive and finite"):
        NoiseModel().allan_deviation([1.0, tau])


@pytest.mark.parametrize(
    ("name", "density", "instability", "turn_on", "resolution"),
    [
        ("MTi-100", 0.01, 10.0 / 3600.0, 0.2, 0.0),
        ("3DM-GX4-25", 0.005, 10.0 / 3600.0, 0.05, 0.0),
        ("ADIS16405", 2.0 / 60.0, 0.007, 3.0, 0.05),
        ("MPU-6050", 0.005, 0.002, 20.0 / 3.0, 1.0 / 131.0),
    ],
)
def test_devices_are_as_their_sheets_state(name, density, instability, turn_on, resolution):
    gyro = DEVICES[name]
    in_degrees = [
        convert(gyro.noise.angle_random_walk, "rad/s/sqrt(Hz)", "deg/s/sqrt(Hz)"),
        convert(gyro.noise.bias_instability, "rad/s", "deg/s"),
        convert(gyro.turn_on_bias, "rad/s", "deg/s"),
        convert(gyro.resolution, "rad/s", "deg/s"),
    ]
    assert in_degrees == pytest.approx([density, instability, turn_on, resolution], rel=1e-14)


@pytest.mark.parametrize("gyro", DEVICES.values(), ids=lambda gyro: gyro.name)
def test_chosen_walks_meet_the_floor_and_say_so(gyro):
    assert "chosen for simulation" in gyro.source
    walk = NoiseModel(rate_random_walk=gyro.noise.rate_random_walk)
    floor = FLICKER_FLOOR * gyro.noise.bias_instability
    assert float(walk.allan_deviation(1000.0)) == pytest.approx(floor, rel=1e-14)


@pytest.mark.parametrize("name", ["mpu-6050", "MPU6050", "mpu 6050", "Mpu_6050"])
def test_device_names_are_found_however_written(name):
    assert device(name) is DEVICES["MPU-6050"]


def test_unknown_device_lists_the_known():
    with pytest.raises(ValueError, match=r"unknown device 'HG1700': known are MTi-100, .*MPU-6050"):
        device("HG1700")
