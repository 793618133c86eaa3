"""Temperature models in the files of others: the file's own arithmetic gives the model's bias."""

import json

import numpy as np
import pytest

import zerorate as zr

RATE = 4.0
INSIDE = np.linspace(21.0, 57.0, 37)


@pytest.fixture(scope="module")
def model():
    """Of three axes, degrees 3, 1 and 0, in deg/s."""
    rng = np.random.default_rng(0)
    T = 20.0 + 38.0 * np.arange(3600) / 3600.0
    d = T - 25.0
    curves = (0.5 + 0.03 * d + 1e-3 * d**2 - 4e-5 * d**3, -1.0 - 0.02 * d, np.full(T.size, 0.2))
    z = np.column_stack(curves) + 0.01 * rng.standard_normal((T.size, 3))
    found = zr.TemperatureModel.fit(z, T, RATE, unit="deg/s")
    assert found.degree == (3, 1, 0)
    return found


def px4_parameters(text):
    """Return the parameters of QGroundControl's file, numbers as PX4 holds them."""
    found = {}
    for line in text.splitlines():
        if not line.startswith("#"):
            vehicle, component, name, value, kind = line.split("\t")
            assert (vehicle, component) == ("1", "1")
            found[name] = np.float32(value) if kind == "9" else int(value)
    return found


def px4_offsets(p, temperature, instance):
    """calc_thermal_offsets_3D of PX4's TemperatureCompensation.cpp, in 32 bits."""
    c = {name.removeprefix(f"TC_G{instance}_"): value for name, value in p.items()}
    delta = np.clip(np.float32(temperature), c["TMIN"], c["TMAX"]) - c["TREF"]
    return [
        c[f"X0_{i}"] + c[f"X1_{i}"] * delta + c[f"X2_{i}"] * delta**2 + c[f"X3_{i}"] * delta**3
        for i in range(3)
    ]


def ardupilot_parameters(text):
    lines = (line.split(",") for line in text.splitlines() if not line.startswith("#"))
    return {name: np.float32(value) for name, value in lines}


def ardupilot_correction(p, temperature, n):
    """TCal::correct_gyro of ArduPilot's AP_InertialSensor_tempcal.cpp, and the offsets."""

    def polynomial(T):
        d = np.clip(np.float32(T), p[f"INS_TCAL{n}_TMIN"], p[f"INS_TCAL{n}_TMAX"]) - np.float32(35)
        c = [np.array([p[f"INS_TCAL{n}_GYR{k}_{axis}"] for axis in "XYZ"]) for k in (1, 2, 3)]
        return (c[0] + (c[1] + c[2] * d) * d) * d * np.float32(1e-6)

    offset = "INS_GYROFFS" if n == 1 else f"INS_GYR{n}OFFS"
    offsets = np.array([p[f"{offset}_{axis}"] for axis in "XYZ"])
    return offsets + polynomial(temperature) - polynomial(p[f"INS_GYR{n}_CALTEMP"])


@pytest.mark.parametrize("instance", [0, 3])
def test_px4_subtracts_the_bias_that_is_predicted(model, instance):
    p = px4_parameters(model.to_px4(instance=instance, device_id=2360328))
    assert (p["TC_G_ENABLE"], p[f"TC_G{instance}_ID"]) == (1, 2360328)
    used = np.array([px4_offsets(p, T, instance) for T in INSIDE])
    expected = np.deg2rad(model.predict(INSIDE).value)
    # 32 bits: eight digits of the largest term.
    np.testing.assert_allclose(used, expected, atol=1e-7)


def test_px4_clamps_at_the_ends(model):
    p = px4_parameters(model.to_px4())
    low, high = (np.deg2rad(model.predict(end).value) for end in model.range)
    np.testing.assert_allclose(px4_offsets(p, -40.0, 0), low, atol=1e-7)
    np.testing.assert_allclose(px4_offsets(p, 85.0, 0), high, atol=1e-7)


def test_px4_has_the_highest_power_in_x3(model):
    """The order that PX4-Autopilot#6419 had the other way round."""
    p = px4_parameters(model.to_px4())
    assert p["TC_G0_X3_0"] == pytest.approx(np.deg2rad(-4e-5), rel=0.05)
    assert p["TC_G0_X3_1"] == p["TC_G0_X3_2"] == p["TC_G0_X1_2"] == 0.0
    assert p["TC_G0_X1_1"] == pytest.approx(np.deg2rad(-0.02), rel=0.05)
    assert p["TC_G0_X0_2"] == pytest.approx(np.deg2rad(0.2), rel=0.05)


@pytest.mark.parametrize("instance", [1, 2])
def test_ardupilot_subtracts_the_bias_that_is_predicted(model, instance):
    p = ardupilot_parameters(model.to_ardupilot(instance=instance))
    assert p[f"INS_TCAL{instance}_ENABLE"] == 1.0
    used = np.array([ardupilot_correction(p, T, instance) for T in INSIDE])
    np.testing.assert_allclose(used, np.deg2rad(model.predict(INSIDE).value), atol=2e-7)


def test_json_loads_again_to_the_last_bit(model, tmp_path):
    path = tmp_path / "temperature.json"
    text = model.to_json(path)
    assert path.read_text() == text
    for loaded in (zr.TemperatureModel.from_json(path), zr.TemperatureModel.from_json(text)):
        for name in ("coefficients", "covariance"):
            np.testing.assert_array_equal(getattr(loaded, name), getattr(model, name))
        for name in ("degrees", "range", "reference", "slopes", "hystereses", "names", "unit"):
            assert getattr(loaded, name) == getattr(model, name)
        assert [one.sigma for one in loaded.slopes] == [one.sigma for one in model.slopes]
        assert loaded.notes == model.notes
        assert loaded.to_json() == text
    with pytest.raises(FileExistsError):
        model.to_json(path)
    assert model.to_json(path, force=True) == text


def spoilt(model, change):
    content = json.loads(model.to_json())
    change(content)
    return json.dumps(content)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda c: c.update(version=2), "of version 2, and this zerorate reads version 1"),
        (lambda c: c.update(axes=[]), "needs an axis"),
        (lambda c: c.update(range=[3.0, 1.0]), "from low to high"),
        (lambda c: c.update(single=True), "single"),
        (lambda c: c.pop("unit"), "'unit' must be a string"),
        (lambda c: c["axes"][0].update(degree=7), "degrees must be 0 to 3"),
        (lambda c: c["axes"][0].update(coefficients=[1.0, 2.0]), "'coefficients' must hold"),
        (lambda c: c["axes"][1].update(slope=3), "'slope' must be an object"),
        (lambda c: c.update(reference=True), "'reference' must be a number"),
    ],
)
def test_spoilt_json_is_refused_in_a_sentence(model, change, said):
    with pytest.raises(ValueError, match=f"not a zerorate temperature model in JSON: .*{said}"):
        zr.TemperatureModel.from_json(spoilt(model, change))


def test_autopilots_need_three_axes_and_a_unit(model):
    T = np.linspace(20.0, 30.0, 400)
    alone = zr.TemperatureModel.fit(0.1 * T, T, RATE, unit="deg/s")
    unknown = zr.TemperatureModel.fit(np.column_stack([0.1 * T] * 3), T, RATE)
    for name in ("to_px4", "to_ardupilot"):
        with pytest.raises(ValueError, match="three axes, the model has 1"):
            getattr(alone, name)()
        with pytest.raises(ValueError, match="unit of the model is 'unit'"):
            getattr(unknown, name)()
        with pytest.raises(ValueError, match="instance must be"):
            getattr(model, name)(instance=9)
