"""Noise models as files: numbers, remarks, whole files only, and JSON without loss."""

import functools
import json
import math
from dataclasses import replace

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

import zerorate as zr
from zerorate.noise import (
    Coefficient,
    FittedModel,
    Markov,
    NoiseModel,
    Sinusoid,
    worst_axis,
)
from zerorate.noise.exports import to_kalibr, to_orbslam3, to_px4, to_ros, to_vins

BOUNDED = Coefficient(0.0, identifiable=False, upper_bound=4e-6)
GYRO = NoiseModel(Coefficient(2e-4, 1e-5), 3e-5, 4e-6)
SHORT = NoiseModel(Coefficient(2e-4, 1e-5), 3e-5, BOUNDED)
ACCELEROMETER = NoiseModel(1e-3, 1e-4, 5e-5, quantity="acceleration")
RATE = 400.0
# Six digits are written.
SIX = {"rel": 5e-6}
EXPORTS = [to_kalibr, to_vins, to_orbslam3, to_px4]
ALL = pytest.mark.parametrize("export", [*EXPORTS, to_ros])
WITH_WALK = pytest.mark.parametrize("export", EXPORTS)


def px4_values(text):
    rows = [line.split("\t") for line in text.splitlines() if not line.startswith("#")]
    assert all((row[0], row[1], row[4]) == ("1", "1", "9") for row in rows)
    return {row[2]: float(row[3]) for row in rows}


def test_kalibr():
    read = yaml.safe_load(GYRO.to_kalibr(accelerometer=ACCELEROMETER, rate=RATE))
    assert read.pop("rostopic") == "/imu0"
    assert read == pytest.approx(
        {
            "gyroscope_noise_density": 2e-4,
            "gyroscope_random_walk": 4e-6,
            "accelerometer_noise_density": 1e-3,
            "accelerometer_random_walk": 5e-5,
            "update_rate": 400.0,
        },
        **SIX,
    )


def test_orbslam3():
    read = yaml.safe_load(GYRO.to_orbslam3(accelerometer=ACCELEROMETER, rate=RATE))
    assert read == pytest.approx(
        {
            "IMU.NoiseGyro": 2e-4,
            "IMU.GyroWalk": 4e-6,
            "IMU.NoiseAcc": 1e-3,
            "IMU.AccWalk": 5e-5,
            "IMU.Frequency": 400.0,
        },
        **SIX,
    )
    assert all(type(value) is float for value in read.values())


def test_vins_takes_deviations_per_sample():
    read = yaml.safe_load(GYRO.to_vins(accelerometer=ACCELEROMETER, rate=RATE))
    expected = {"gyr_n": 4e-3, "gyr_w": 8e-5, "acc_n": 2e-2, "acc_w": 1e-3}
    assert read == pytest.approx(expected, **SIX)


def test_vins_takes_densities_where_no_rate_is_given():
    read = yaml.safe_load(GYRO.to_vins(accelerometer=ACCELEROMETER))
    assert read == pytest.approx(
        {"gyr_n": 2e-4, "gyr_w": 4e-6, "acc_n": 1e-3, "acc_w": 5e-5}, **SIX
    )


def test_orbslam3_without_a_rate_leaves_the_frequency_out():
    assert "IMU.Frequency" not in yaml.safe_load(GYRO.to_orbslam3())


def test_px4_takes_deviations_per_filter_step():
    read = px4_values(GYRO.to_px4(accelerometer=ACCELEROMETER))
    expected = {
        "EKF2_GYR_NOISE": 2e-3,
        "EKF2_GYR_B_NOISE": 4e-5,
        "EKF2_ACC_NOISE": 1e-2,
        "EKF2_ACC_B_NOISE": 5e-4,
    }
    assert read == pytest.approx(expected, **SIX)


@pytest.mark.parametrize("export", [to_vins, to_px4])
def test_per_step_numbers_grow_the_filters_variance_as_the_walk_does(export):
    text = export(GYRO, rate=RATE)
    read = px4_values(text) if export is to_px4 else yaml.safe_load(text)
    walk = read.get("gyr_w", read.get("EKF2_GYR_B_NOISE"))
    # After T = 10 s the bias has gained K^2 T; six digits are written, and squared.
    assert 10.0 * RATE * (walk / RATE) ** 2 == pytest.approx(10.0 * 4e-6**2, rel=1e-5)


def test_px4_says_what_lies_outside_its_range():
    text = NoiseModel(1e-6, rate_random_walk=1e-6).to_px4()
    assert "# EKF2_GYR_NOISE: rad/s; outside PX4's range 0.0001 to 0.1\n" in text
    assert "# EKF2_GYR_B_NOISE: rad/s^2\n" in text


def test_ros_takes_the_variance_of_one_message():
    text = GYRO.to_ros(accelerometer=ACCELEROMETER, rate=RATE)
    read = yaml.safe_load(text)
    white, force = 2e-4**2 * RATE, 1e-3**2 * RATE
    # Six digits, squared.
    for name, variance in (("angular_velocity", white), ("linear_acceleration", force)):
        expected = [variance if i in (0, 4, 8) else 0.0 for i in range(9)]
        assert read.pop(f"{name}_covariance") == pytest.approx(expected, rel=1e-5)
    assert read == {"orientation_covariance": [-1.0, *[0.0] * 8]}
    assert "  # (rad/s)^2\n" in text
    assert "publish the compensated rate" in text


@WITH_WALK
def test_a_bound_is_written_with_a_comment_unless_it_is_unwanted(export):
    plain, bounded = (
        export(SHORT, accelerometer=ACCELEROMETER, rate=RATE, bounds=bounds)
        for bounds in (False, True)
    )
    assert export(SHORT, accelerometer=ACCELEROMETER, rate=RATE) == bounded
    assert plain.count("the record does not determine it, so not written; record ten hours") == 1
    assert "upper bound" not in plain
    assert bounded.count("upper bound at 95 %, the record does not determine it") == 1
    given = NoiseModel(1e-4, rate_random_walk=0.0)
    given_zero = export(given, accelerometer=ACCELEROMETER, rate=RATE)
    assert "upper bound" not in given_zero
    assert "unknown" not in given_zero
    assert "0.00000e+00" in given_zero


def read_as_kalibr(text):
    """Check what ``ImuParameters`` of Kalibr's ConfigReader.py checks, and return the numbers."""
    data = yaml.safe_load(text)
    assert isinstance(data["rostopic"], str)
    names = ("accelerometer_noise_density", "accelerometer_random_walk")
    names += ("gyroscope_noise_density", "gyroscope_random_walk", "update_rate")
    numbers = {name: data[name] for name in names}
    assert all(type(number) is float and number > 0.0 for number in numbers.values())
    return numbers


def read_as_orbslam3(text):
    """Read as ``Settings::readIMU`` does: each is required, and a real number."""
    data = yaml.safe_load(text)
    names = ("NoiseGyro", "NoiseAcc", "GyroWalk", "AccWalk", "Frequency")
    numbers = {name: data[f"IMU.{name}"] for name in names}
    assert all(type(number) is float for number in numbers.values())
    assert numbers["Frequency"] > 0.0
    return numbers


def read_as_vins(text):
    """Read as ``readParameters`` of VINS does, where an absent number is a silent zero."""
    data = yaml.safe_load(text)
    numbers = {name: data.get(name, 0.0) for name in ("acc_n", "acc_w", "gyr_n", "gyr_w")}
    assert all(type(number) is float and number > 0.0 for number in numbers.values())
    return numbers


def read_as_qgroundcontrol(text):
    """Read lines of five tab-separated cells; parameters lie in the ranges of PX4's sources."""
    ranges = {"EKF2_GYR_NOISE": (1e-4, 0.1), "EKF2_GYR_B_NOISE": (0.0, 0.01)}
    ranges |= {"EKF2_ACC_NOISE": (0.01, 1.0), "EKF2_ACC_B_NOISE": (0.0, 0.01)}
    numbers = px4_values(text)
    assert numbers.keys() == ranges.keys()
    for name, (low, high) in ranges.items():
        outside = f"{name}: " in text and f"outside PX4's range {low:g} to {high:g}" in text
        assert low <= numbers[name] <= high or outside
    return numbers


def read_as_ros(text):
    """Read as ``sensor_msgs/Imu``: nine float64 each, positive semidefinite or led by -1."""
    data = yaml.safe_load(text)
    names = ("orientation", "angular_velocity", "linear_acceleration")
    for name in names:
        matrix = np.array(data[f"{name}_covariance"], dtype=np.float64).reshape(3, 3)
        assert matrix[0, 0] == -1.0 or np.linalg.eigvalsh(matrix).min() > 0.0
    return data


READERS = {
    to_kalibr: read_as_kalibr,
    to_orbslam3: read_as_orbslam3,
    to_vins: read_as_vins,
    to_px4: read_as_qgroundcontrol,
    to_ros: read_as_ros,
}


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    minutes=st.floats(1.0, 20.0),
    white=st.floats(1e-5, 1e-2),
    walk=st.floats(0.0, 1e-4),
)
def test_what_a_record_tells_is_complete_for_every_reader(seed, minutes, white, walk):
    """Short and long records, with a random walk or without."""
    models = []
    for k, quantity in enumerate(("rad/s", "m/s^2")):
        noise = NoiseModel(white, rate_random_walk=walk)
        z, _ = zr.simulate(noise, 10.0, 60.0 * minutes, seed=seed + k)
        models.append(zr.allan(z, rate=10.0, unit=quantity).fit())
    for export, read in READERS.items():
        read(export(models[0], accelerometer=models[1], rate=RATE, doubtful=True))


@ALL
def test_nothing_is_exported_of_a_record_that_determines_nothing(export):
    nothing = NoiseModel(BOUNDED, rate_random_walk=BOUNDED)
    with pytest.raises(ValueError, match="determines none of the numbers: record the sensor at"):
        export(nothing, rate=RATE)
    assert "upper bound" in export(nothing, rate=RATE, doubtful=True)


@ALL
@pytest.mark.parametrize("doubted", ["gyro", "accelerometer"])
def test_a_doubt_is_refused_or_stands_in_the_file(export, tmp_path, doubted):
    doubt = "gyro_x: looks as if it moved"
    gyro, accelerometer = (
        replace(model, doubt=doubt if name == doubted else "")
        for name, model in (("gyro", GYRO), ("accelerometer", ACCELEROMETER))
    )
    given = {"accelerometer": accelerometer, "rate": RATE}
    with pytest.raises(ValueError, match=f"^{doubt}: record the sensor at rest, .*; doubtful=True"):
        export(gyro, tmp_path / "file", **given)
    assert not (tmp_path / "file").exists()
    assert f"# WARNING: {doubt}\n" in export(gyro, **given, doubtful=True)


def test_a_record_in_motion_or_too_short_has_a_doubt():
    z, _ = zr.simulate(NoiseModel(angle_random_walk=1e-4), 100.0, 60.0, seed=1)
    turning = z + 0.5 * np.sin(np.arange(6000) / 100.0)
    moved = z.copy()
    moved[3000:3300] += 0.5
    asked = {"rate": 100.0, "unit": "rad/s"}
    assert zr.allan(z, **asked).fit().doubt == zr.noise.whittle(z, **asked).doubt == ""
    for record, words in (
        (turning, "all the time"),
        (moved, "at 30 s"),
        (z[:2000], "20 s are too"),
    ):
        model = zr.allan(record, **asked).fit()
        assert words in model.doubt
        assert words in zr.noise.whittle(record, **asked).doubt
        assert FittedModel.from_json(model.to_json()) == model
        assert worst_axis([zr.allan(z, **asked).fit(), model]).doubt == model.doubt
        with pytest.raises(ValueError, match="record the sensor at rest"):
            model.to_kalibr()


@ALL
def test_what_is_unknown_is_not_written_but_named(export):
    """A data sheet states no random walk: an estimator must not take that for none."""
    text = export(NoiseModel(bias_instability=1e-4), rate=RATE)
    numbers = [line for line in text.splitlines() if not line.startswith("#")]
    assert not any("gyr" in line.lower() or "angular" in line for line in numbers)
    assert text.count("unknown, so not written") == (1 if export is to_ros else 2)


@ALL
def test_a_unit_that_is_not_known_is_refused_in_a_sentence(export):
    model = NoiseModel(1e-4, rate_random_walk=0.0, quantity="unknown")
    with pytest.raises(ValueError, match=r'cannot be written because the unit .* unit="deg/s"'):
        export(model, rate=RATE)
    with pytest.raises(ValueError, match="cannot be written"):
        export(GYRO, accelerometer=model, rate=RATE)


@ALL
def test_without_an_accelerometer_its_lines_are_left_out(export):
    left_out = "# No accelerometer was given: its lines are left out.\n"
    alone = export(GYRO, rate=RATE)
    assert left_out in alone
    assert not any("acc" in line.lower() for line in alone.splitlines() if not line.startswith("#"))
    assert left_out not in export(GYRO, accelerometer=ACCELEROMETER, rate=RATE)


@WITH_WALK
def test_inflation_is_applied_and_written_down(export):
    def values(text):
        if export is to_px4:
            return px4_values(text)
        read = yaml.safe_load(text)
        skipped = ("rostopic", "update_rate", "IMU.Frequency")
        return {name: value for name, value in read.items() if name not in skipped}

    plain, inflated = (export(GYRO, rate=RATE, inflate=factor) for factor in (1.0, 10.0))
    tenfold = {name: 10.0 * value for name, value in values(plain).items()}
    assert values(inflated) == pytest.approx(tenfold, **SIX)
    assert "# Every number is 10 times the measured one.\n" in inflated
    assert "measured" not in plain


def test_covariances_grow_with_the_square_of_inflation():
    plain, inflated = (GYRO.to_ros(rate=RATE, inflate=factor) for factor in (1.0, 10.0))
    first, tenfold = (yaml.safe_load(t)["angular_velocity_covariance"] for t in (plain, inflated))
    assert tenfold[0] == pytest.approx(100.0 * first[0], rel=1e-5)
    assert "# Deviations are 10 times the measured ones, so covariances 100 times.\n" in inflated


def test_units_stand_beside_the_numbers():
    text = GYRO.to_kalibr(accelerometer=ACCELEROMETER, rate=RATE)
    remarks = [line.split("  # ")[1] for line in text.splitlines() if "  # " in line]
    assert [remark.split(";")[0] for remark in remarks] == [
        "rad/s/sqrt(Hz)",
        "rad/s^2/sqrt(Hz)",
        "m/s^2/sqrt(Hz)",
        "m/s^3/sqrt(Hz)",
        "Hz",
    ]


@pytest.mark.parametrize("topic", ["/imu0", 'a "b"', "x: y # z", "two\nlines", "ä\t\\"])
def test_a_topic_is_quoted_whatever_it_holds(topic):
    assert yaml.safe_load(GYRO.to_kalibr(rostopic=topic))["rostopic"] == topic


def test_small_and_round_numbers_stay_numbers():
    """1e-05 without a point would be read as a string."""
    read = yaml.safe_load(NoiseModel(1e-5, rate_random_walk=1e-300).to_kalibr())
    assert read["gyroscope_noise_density"] == 1e-5
    assert read["gyroscope_random_walk"] == 1e-300


@ALL
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"model": ACCELEROMETER}, "acceleration was given where one of angular rate was expected"),
        ({"accelerometer": GYRO}, "angular rate was given where one of acceleration was expected"),
        ({"rate": 0.0}, "rate must be positive and finite, got 0.0"),
        ({"inflate": math.nan}, "inflate must be positive and finite, got nan"),
    ],
)
def test_refusals(export, change, message):
    with pytest.raises(ValueError, match=message):
        export(**({"model": GYRO, "rate": RATE} | change))


NAMES = ["to_kalibr", "to_vins", "to_orbslam3", "to_px4", "to_ros", "to_json"]


@pytest.mark.parametrize("name", NAMES)
def test_files_are_whole_and_not_replaced_unasked(name, tmp_path):
    export, path = getattr(GYRO, name), tmp_path / "imu.txt"
    if name == "to_ros":
        export = functools.partial(export, rate=RATE)
    text = export(path)
    assert path.read_text(encoding="utf-8") == text
    with pytest.raises(FileExistsError, match=r"imu.txt exists already; pass force=True"):
        export(path)
    assert export(path, force=True) == text
    with pytest.raises(FileNotFoundError, match="does not exist"):
        export(tmp_path / "nowhere" / "imu.txt")
    assert [entry.name for entry in tmp_path.iterdir()] == ["imu.txt"]


FLOATS = st.floats(0.0, 1e300)
GIVEN = st.builds(
    lambda value, sigma, known, more: Coefficient(value, sigma, known, value + more),
    FLOATS,
    FLOATS,
    st.booleans(),
    FLOATS,
)
COEFFICIENTS = st.none() | GIVEN
POSITIVE = GIVEN.filter(lambda coefficient: coefficient > 0.0)
MODELS = st.builds(
    NoiseModel,
    COEFFICIENTS,
    COEFFICIENTS,
    COEFFICIENTS,
    st.floats(-1e300, 1e300),
    COEFFICIENTS,
    markov=st.lists(st.builds(Markov, GIVEN, POSITIVE), max_size=2),
    sinusoid=st.lists(st.builds(Sinusoid, GIVEN, POSITIVE), max_size=2),
    quantity=st.sampled_from(["angular rate", "acceleration", "unknown"]),
)


@settings(derandomize=True)
@given(MODELS)
def test_json_there_and_back_is_exact(model):
    again = NoiseModel.from_json(model.to_json())
    # repr would round: the text holds every part of every coefficient.
    assert again.to_json() == model.to_json()
    assert again == model


def test_json_keeps_how_well_a_model_fits():
    model = FittedModel(
        1e-4, BOUNDED, method="oadev", chi_squared=3.0, degrees_of_freedom=7, misfit=0.1
    )
    assert FittedModel.from_json(model.to_json()) == model
    assert NoiseModel.from_json(model.to_json()) == NoiseModel(1e-4, BOUNDED)
    assert FittedModel.from_json(GYRO.to_json()) == FittedModel(*vars(GYRO).values())


def test_json_from_a_file(tmp_path):
    path = tmp_path / "model.json"
    SHORT.to_json(path)
    for source in (path, str(path)):
        again = NoiseModel.from_json(source)
        assert again == SHORT
        assert again.rate_random_walk.upper_bound == 4e-6
        assert not again.rate_random_walk.identifiable


def test_json_names_its_units():
    read = json.loads(ACCELEROMETER.to_json())
    assert (read["format"], read["version"]) == ("zerorate noise model", 1)
    assert {name: entry["unit"] for name, entry in read["coefficients"].items()} == {
        "quantization": "m/s",
        "angle_random_walk": "m/s^2/sqrt(Hz)",
        "bias_instability": "m/s^2",
        "rate_random_walk": "m/s^3/sqrt(Hz)",
        "rate_ramp": "m/s^3",
    }


def changed(*path, to):
    content = json.loads(SHORT.to_json())
    inner = content
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = to
    return json.dumps(content)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "Expecting property name"),
        ("{}", "'format' must be a string, got None"),
        (changed("version", to=2), "it is of version 2, and this zerorate reads version 1"),
        (changed("coefficients", "rate_ramp", "upper_bound", to=1.0), "be a number, got None"),
        (changed("fit", to=7), "'method' must be a string, got None"),
        (changed("quantity", to="mass"), "quantity is 'mass', expected one of"),
        (changed("quantity", to=["mass"]), r"'quantity' must be a string, got \['mass'\]"),
        (changed("coefficients", to={}), "'quantization' must be an object, got None"),
        (changed("coefficients", to=3), "'coefficients' must be an object, got 3"),
        (changed("coefficients", "rate_ramp", "unit", to="deg"), "'deg', expected 'rad/s\\^2'"),
        (changed("coefficients", "rate_random_walk", "identifiable", to="no"), "true or false"),
        (changed("coefficients", "rate_random_walk", "value", to="1"), "be a number, got '1'"),
        (changed("coefficients", "rate_random_walk", "sigma", to=-1), "must not be negative"),
        (changed("coefficients", "bias_instability", "value", to=-1), "must not be negative"),
        (changed("markov", to=7), "'markov' must be a list, got 7"),
        (changed("markov", to=[{"amplitude": 1}]), "'amplitude' must be an object, got 1"),
    ],
)
def test_other_json_is_refused_in_a_sentence(text, message, tmp_path):
    with pytest.raises(ValueError, match="^the text is not a zerorate noise model.*" + message):
        FittedModel.from_json(text)
    path = tmp_path / "other.json"
    path.write_text(text)
    with pytest.raises(ValueError, match=r"other\.json is not a zerorate noise model"):
        FittedModel.from_json(path)


def test_bytes_that_are_no_text_are_refused_in_a_sentence(tmp_path):
    path = tmp_path / "other.json"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueError, match=r"other\.json is not a zerorate noise model"):
        NoiseModel.from_json(path)
