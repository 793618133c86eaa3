"""The named methods of attitude: what they do by their closed forms, and what they refuse."""

import inspect
import re
from pathlib import Path

import ahrs
import numpy as np
import pytest
from scipy.linalg import solve_discrete_are
from scipy.spatial.transform import Rotation

import zerorate as zr
from support.checks import assert_same_bits
from zerorate.attitude.options import ATTITUDE_METHODS, ATTITUDE_OPTIONS, TILT_OPTIONS

NAMED = ATTITUDE_METHODS[1:]
BY_METHOD = pytest.mark.parametrize("method", NAMED)
RATE = 100.0
UP, FIELD = np.array([0.0, 0.0, 9.81]), np.array([0.0, 20.0, -40.0])
# Rounding of some thousand steps.
ROUNDING = 1e-11


def still(n, rate=(0.0, 0.0, 0.0), turned=None):
    """A body at rest whose gyro shows a rate: gyro, accel and mag, (n, 3)."""
    turned = Rotation.identity() if turned is None else turned
    vectors = [np.array(rate), turned.inv().apply(UP), turned.inv().apply(FIELD)]
    return [np.tile(v, (n, 1)) for v in vectors]


def moved(seed=3, seconds=30.0, kind="hand"):
    return zr.simulate_motion(kind, RATE, seconds, seed=seed)


def off(f, turned):
    """Rotation vector, in the axes of the earth, from what is estimated to what is."""
    return (turned * f.rotation.inv()).as_rotvec()


@BY_METHOD
@pytest.mark.parametrize("seed", range(4))
def test_the_first_sample_says_it_all(method, seed):
    turned = Rotation.random(random_state=seed)
    f = zr.Attitude(RATE, method=method)
    assert f.status == "starting"
    f.update(*(z[0] for z in still(1, turned=turned)))
    np.testing.assert_allclose(off(f, turned), 0.0, atol=ROUNDING)
    six = zr.Attitude(RATE, method=method, mag=False)
    six.update(*(z[0] for z in still(1, turned=turned)[:2]))
    np.testing.assert_allclose(six.up, turned.inv().apply(UP / 9.81), atol=ROUNDING)


@BY_METHOD
def test_upside_down(method):
    f = zr.Attitude(RATE, method=method)
    for gyro in (np.zeros((5, 3)), np.full((5, 3), 0.1)):
        f.process(gyro, np.tile(-UP, (5, 1)), np.tile(FIELD, (5, 1)))
    # It turned by 0.1 rad/s for 0.05 s about each axis, at most.
    np.testing.assert_allclose(f.up, [0.0, 0.0, -1.0], atol=0.01)


@BY_METHOD
def test_no_force_is_no_reason_to_stop(method):
    """Until the first force nothing is levelled, and a field says nothing."""
    f = zr.Attitude(RATE, method=method)
    gyro, accel, mag = still(50, rate=(0.1, 0.0, 0.0))
    f.process(gyro, np.full_like(accel, np.nan), mag)
    assert f.status == "starting"
    # Half a second, and the bias is zero before it is known.
    np.testing.assert_allclose(f.rotation.as_rotvec(), [0.05, 0.0, 0.0], atol=1e-6)
    f.process(gyro[:1], accel[:1], mag[:1])
    np.testing.assert_allclose(f.rotation.as_rotvec(), 0.0, atol=ROUNDING)
    assert f.status == "moving"


@BY_METHOD
def test_missing_sensors_are_skipped(method):
    """Without force and field the rate goes on alone."""
    f = zr.Attitude(RATE, method=method)
    f.process(*still(200))
    gyro, accel, mag = still(100, rate=(0.0, 0.0, 0.5))
    f.process(gyro, np.full_like(accel, np.nan), np.full_like(mag, np.nan))
    bias = np.nan_to_num(f.bias)
    atol = {
        # It steps by q + dq: the arc tangent of half a step for half the step.
        "madgwick": 0.5 * (0.5 * 0.01) ** 2 / 12.0 * 1.01,
        # Points on both sides of a bias that is hardly known, 0.5 deg/s: its square, in a second.
        "ukf": np.radians(0.5) ** 2,
    }.get(method, 1e-9)
    np.testing.assert_allclose(f.rotation.as_rotvec(), [0, 0, 0.5] - bias, atol=atol)


@BY_METHOD
def test_after_a_gap_it_starts_again(method):
    turned = Rotation.from_euler("xyz", [0.5, -0.3, 1.0])
    f = zr.Attitude(RATE, method=method)
    f.process(*still(200))
    f.update(*(z[0] for z in still(1, turned=turned)), dt=5.0)
    np.testing.assert_allclose(off(f, turned), 0.0, atol=ROUNDING)
    # Without a magnetometer the heading stays: north is where it was.
    six = zr.Attitude(RATE, method=method, mag=False)
    six.process(*still(200)[:2])
    six.update(*(z[0] for z in still(1, turned=turned)[:2]), dt=5.0)
    np.testing.assert_allclose(six.up, turned.inv().apply(UP / 9.81), atol=ROUNDING)
    assert off(six, turned)[2] == pytest.approx(1.0, abs=0.1)


@BY_METHOD
def test_goes_on_from_a_known_orientation_and_back(method):
    turned = Rotation.from_euler("z", 1.0)
    f = zr.Attitude(RATE, method=method, mag=False)
    f.process(*still(50, rate=(0.01, 0.0, 0.0))[:2])
    f.align(turned)
    np.testing.assert_allclose(off(f, turned), 0.0, atol=ROUNDING)
    f.update([0.0, 0.0, 0.0], UP)
    assert abs(off(f, turned)[2]) < 1e-3
    f.reset()
    assert f.to_bytes() == zr.Attitude(RATE, method=method, mag=False).to_bytes()


@BY_METHOD
def test_a_field_beside_no_magnetometer_is_refused(method):
    f = zr.Attitude(RATE, method=method, mag=False)
    with pytest.raises(ValueError, match=r"^mag is given, but this Attitude has mag=False$"):
        f.process(*still(2))


@pytest.mark.parametrize("tau", [0.49, 3.0])
def test_complementary_leaves_bias_times_time_constant(tau):
    f = zr.Attitude(RATE, method="complementary", time_constant=tau)
    f.process(*still(round(40 * tau * RATE), rate=(0.05, 0.0, 0.0)))
    np.testing.assert_allclose(f.rotation.as_rotvec(), [0.05 * tau, 0.0, 0.0], atol=1e-9)
    f.reset()
    f.process(*still(round(40 * tau * RATE), rate=(0.0, 0.0, 0.05)))
    np.testing.assert_allclose(f.rotation.as_rotvec(), [0.0, 0.0, 0.05 * tau], atol=1e-9)


@pytest.mark.parametrize("axis", [0, 2])
def test_mahony_without_integral_leaves_bias_over_gain(axis):
    """Its error is a sine."""
    rate = 0.2 * np.eye(3)[axis]
    f = zr.Attitude(RATE, method="mahony", kp=0.5, ki=0.0)
    f.process(*still(8000, rate=rate))
    np.testing.assert_allclose(f.rotation.as_rotvec(), np.arcsin(rate / 0.5), atol=1e-9)
    assert_same_bits(f.bias, np.zeros(3))


def test_mahony_learns_the_bias():
    """Of second order, s^2 + kp s + ki: roots at -0.37 and -0.63 per second."""
    f = zr.Attitude(RATE, method="mahony")
    f.process(*still(8000, rate=(0.03, -0.02, 0.05)))
    np.testing.assert_allclose(f.bias, [0.03, -0.02, 0.05], atol=1e-9)
    np.testing.assert_allclose(f.rotation.as_rotvec(), 0.0, atol=1e-9)


def test_madgwick_never_catches_a_bias_beyond_twice_beta():
    tilts = {}
    for share in (0.5, 0.9, 1.1):
        f = zr.Attitude(RATE, method="madgwick", mag=False, beta=0.1)
        q = f.process(*still(6000, rate=(share * 0.2, 0.0, 0.0))[:2])
        tilts[share] = np.max(2.0 * np.arccos(np.abs(q[:, 0]).clip(0.0, 1.0)))
    # It chatters by the step of a sample, 2 beta dt; then the part of the gradient along q takes
    # away from its speed as the tilt grows.
    assert tilts[0.5] < 0.01
    assert tilts[0.9] < 0.5
    assert tilts[1.1] > 3.0


def test_madgwick_mends_at_twice_beta_at_most():
    f = zr.Attitude(RATE, method="madgwick", mag=False, beta=0.1)
    f.align([np.cos(0.1), np.sin(0.1), 0.0, 0.0])
    q = f.process(*still(50)[:2])
    speed = -np.diff(2.0 * np.arctan2(q[:, 1], q[:, 0])) * RATE
    assert np.all(speed <= 0.2)
    # By the cosine of half the tilt, or so.
    assert np.all(speed >= 0.2 * 0.98)


@pytest.mark.parametrize("mag", [True, False])
def test_madgwick_is_that_of_another_package(mag):
    filters = ahrs.filters
    motion = moved(seconds=4.0)
    f = zr.Attitude(RATE, method="madgwick", mag=mag, frame="nwu", beta=0.1)
    q = f.process(motion.gyro, motion.accel, *([motion.mag] if mag else []))
    peer = filters.Madgwick(frequency=RATE, gain=0.1)
    other = [q[0]]
    for gyro, accel, field in zip(motion.gyro[1:], motion.accel[1:], motion.mag[1:], strict=True):
        before = other[-1]
        step = (
            peer.updateMARG(before, gyro, accel, field)
            if mag
            else peer.updateIMU(before, gyro, accel)
        )
        other.append(step)
    np.testing.assert_allclose(q, other, atol=ROUNDING)


@pytest.mark.parametrize(("constants", "atol"), [
    ({"method": "complementary"}, ROUNDING),
    # Both turns of a step are one: what they differ by in turn, some rad/s and kp, for dt^2 / 2.
    ({"method": "mahony", "ki": 0.0}, 2e-3),
])  # fmt: skip
def test_a_magnet_turns_no_tilt(constants, atol):
    motion = moved()
    fields = [motion.mag, np.random.default_rng(1).normal(size=motion.mag.shape)]
    filters = [zr.Attitude(RATE, **constants) for _ in fields]
    found = [f.process(motion.gyro, motion.accel, m) for f, m in zip(filters, fields, strict=True)]
    ups = [Rotation.from_quat(q, scalar_first=True).inv().apply([0, 0, 1]) for q in found]
    np.testing.assert_allclose(*ups, rtol=0.0, atol=atol)


@pytest.mark.parametrize("mag", [True, False])
def test_both_kalman_filters_are_one_where_angles_are_small(mag):
    """Points and derivatives differ by squares of the errors' deviations."""
    motion = moved(seconds=60.0)
    known = {"bias_sigma": 1e-3, "gyro_noise": 1e-4, "mag": mag}
    sensors = (motion.gyro, motion.accel, *([motion.mag] if mag else []))
    ekf, ukf = (zr.Attitude(RATE, method=method, **known) for method in ("ekf", "ukf"))
    # From half a radian, of which both make something else, to what a minute leaves of it.
    q, p = ekf.process(*sensors), ukf.process(*sensors)
    late = slice(3000, None)
    apart = 2.0 * np.arccos(np.abs(np.sum(q[late] * p[late], axis=1)).clip(0.0, 1.0))
    assert np.max(apart) < 0.02 * np.hypot(ekf.tilt_sigma, ekf.heading_sigma)
    np.testing.assert_allclose(ukf.bias_sigma, ekf.bias_sigma, rtol=0.01)
    np.testing.assert_allclose(ukf.bias, ekf.bias, atol=0.1 * np.min(ekf.bias_sigma))


@pytest.mark.parametrize("method", ["ekf", "ukf"])
def test_variances_at_rest_are_those_of_the_riccati_equation(method):
    """Of each axis alone: an angle and a bias, the angle measured."""
    noises = {"gyro_noise": 1e-3, "accel_noise": 0.05, "mag_noise": 0.02, "bias_walk": 1e-3}
    f = zr.Attitude(RATE, method=method, **noises)
    f.process(*still(6000))
    dt = 1.0 / RATE
    F, H = np.array([[1.0, -dt], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    Q = np.diag([1e-3**2, 1e-3**2]) * dt
    sigmas = {}
    for name, noise in (("tilt", 0.05 / 9.81), ("heading", 0.02)):
        R = np.array([[noise**2 / dt]])
        P = solve_discrete_are(F.T, H.T, Q, R)
        sigmas[name] = np.sqrt(np.diag(P - P @ H.T @ H @ P / (P[0, 0] + R)))
    # What the start leaves after a minute; of the points also squares of half a degree.
    rtol = 1e-6 if method == "ekf" else 1e-3
    assert f.tilt_sigma == pytest.approx(np.sqrt(2.0) * sigmas["tilt"][0], rel=rtol)
    assert f.heading_sigma == pytest.approx(sigmas["heading"][0], rel=rtol)
    expected = [sigmas["tilt"][1], sigmas["tilt"][1], sigmas["heading"][1]]
    np.testing.assert_allclose(f.bias_sigma, expected, rtol=rtol)


@pytest.mark.parametrize("method", ["mahony", "ekf", "ukf"])
def test_a_bias_that_is_known_is_where_it_starts(method):
    f = zr.Attitude(RATE, method=method, bias=[1.0, 2.0, -3.0], gyro_unit="deg/s")
    np.testing.assert_allclose(f.bias, [1.0, 2.0, -3.0], rtol=1e-15)
    f.process(*still(10, rate=(1.0, 2.0, -3.0)))
    np.testing.assert_allclose(f.rotation.as_rotvec(), 0.0, atol=ROUNDING)
    f.reset()
    np.testing.assert_allclose(f.bias, [1.0, 2.0, -3.0], rtol=1e-15)


@pytest.mark.parametrize("method", ["ekf", "ukf"])
def test_what_is_not_known_grows(method):
    f = zr.Attitude(RATE, method=method, mag=False)
    f.process(*still(3000)[:2])
    tilt, heading = f.tilt_sigma, f.heading_sigma
    f.process(np.full((50, 3), np.nan), np.full((50, 3), np.nan))
    # 1 rad^2/s but for the first 50 ms, on each axis.
    assert f.heading_sigma**2 - heading**2 == pytest.approx(0.45, rel=1e-3)
    assert f.tilt_sigma**2 - tilt**2 == pytest.approx(0.9, rel=1e-3)
    assert f.status == "rate missing"


KNOWN = {
    "complementary": set(),
    "mahony": {"bias"},
    "madgwick": set(),
    "ekf": {"bias", "bias_sigma", "tilt_sigma", "heading_sigma"},
    "ukf": {"bias", "bias_sigma", "tilt_sigma", "heading_sigma"},
}


@BY_METHOD
def test_what_a_method_does_not_know_is_nan(method):
    f = zr.Attitude(RATE, method=method)
    f.process(*still(10))
    for name in ("bias", "bias_sigma", "gyro_matrix", "tilt_sigma", "heading_sigma"):
        assert np.isnan(getattr(f, name)).all() == (name not in KNOWN[method]), name
    assert (f.at_rest, f.disturbed, f.method) == (False, False, method)
    with pytest.raises(ValueError, match=f"^smooth is for method 'auto', .* has '{method}'$"):
        f.smooth(*still(10))


TABLES = [(zr.Attitude, ATTITUDE_OPTIONS), (zr.Tilt, TILT_OPTIONS)]


@pytest.mark.parametrize(("kind", "table"), TABLES)
def test_the_tables_are_what_the_classes_take(kind, table):
    signature = inspect.signature(kind).parameters
    for name, option in table.items():
        assert option.default == signature[name].default, name
    others = {"rate", "mag", "frame", "gyro_unit", "accel_unit", "channels"}
    others |= {"bias", "bias_sigma", "bias_limit"}
    others |= {"gyro_range", "magnetometer", "learn_magnetometer"} if kind is zr.Attitude else set()
    assert set(signature) - others == set(table)


@pytest.mark.parametrize("table", [ATTITUDE_OPTIONS, TILT_OPTIONS])
def test_the_reference_has_the_tables(table):
    page = Path(__file__).parents[2] / "docs/reference/attitude-methods.md"
    rows = [line.split(" | ") for line in page.read_text(encoding="utf-8").splitlines()]
    known = [row for row in rows if len(row) == 5]
    for name, option in table.items():
        if name == "method":
            assert all(f"`{method}`" in page.read_text(encoding="utf-8") for method in NAMED)
            continue
        users = ", ".join(option.methods)
        found = [row for row in known if row[0] == f"| `{name}`" and row[3] == users]
        assert {row[2] for row in found} == {option.unit}, name
        assert option.default is None or float(found[0][1]) == option.default, name


def constants(table):
    return [(name, option) for name, option in table.items() if name != "method"]


@pytest.mark.parametrize(("name", "option"), constants(ATTITUDE_OPTIONS))
@pytest.mark.parametrize("method", ATTITUDE_METHODS)
def test_a_constant_is_used_or_refused(method, name, option):
    value = 0.07
    if method in option.methods:
        f = zr.Attitude(RATE, method=method, **{name: value})
        assert f"{name}=0.07" in repr(f)
        assert f.to_bytes() != zr.Attitude(RATE, method=method).to_bytes()
        assert zr.Attitude(RATE, method=method, **{name: None}) is not None
        with pytest.raises(ValueError, match=re.escape(f"{name} must be {option.expected}, got")):
            zr.Attitude(RATE, method=method, **{name: -1.0})
        return
    message = f"^{name} has no effect on method '{method}', only on '{option.methods[0]}'"
    with pytest.raises(ValueError, match=message):
        zr.Attitude(RATE, method=method, **{name: value})


@pytest.mark.parametrize(("arguments", "told"), [
    ({"method": "kalman"}, "method must be 'auto', 'complementary', .* or 'ukf', got 'kalman'"),
    ({"method": "madgwick", "bias": [0.0] * 3}, "bias has no effect on method 'madgwick', only on "
     "'auto', 'mahony', 'ekf' and 'ukf'"),
    ({"method": "mahony", "bias_sigma": 0.1}, "bias_sigma has no effect on method 'mahony', only"),
    ({"method": "ekf", "mag": False, "mag_noise": 1.0}, "mag_noise has no effect with mag=False"),
    ({"method": "ekf", "bias": [20.0, 0.0, 0.0]}, "bias must be a rate of at most 10 rad/s"),
])  # fmt: skip
def test_refusals(arguments, told):
    with pytest.raises(ValueError, match=f"^{told}"):
        zr.Attitude(RATE, **arguments)


def test_an_argument_that_there_is_not():
    with pytest.raises(TypeError, match=r"^Attitude\(\) got an unexpected keyword argument 'gain'"):
        zr.Attitude(RATE, gain=1.0)
    with pytest.raises(TypeError, match=r"^kp must be a number, got 'high'$"):
        zr.Attitude(RATE, method="mahony", kp="high")


@pytest.mark.parametrize("text", [
    "Attitude(rate=100.0)",
    "Attitude(rate=100.0, mag=False, frame='ned', channels=3)",
    "Attitude(rate=50.0, method='mahony', kp=2.0, ki=0.0)",
    "Attitude(rate=50.0, method='madgwick', gyro_unit='deg/s', accel_unit='g', beta=0.1)",
    "Attitude(rate=50.0, method='ukf', gyro_unit='deg/s', bias=[0.1, 0.2, -0.3], "
    "bias_sigma=[0.1, 0.1, 0.1], mag_noise=0.5)",
])  # fmt: skip
def test_the_text_is_the_call(text):
    f = eval(text, {"Attitude": zr.Attitude})
    assert repr(f) == repr(f.copy()) == text
