"""Tilt about one axis: closed forms, published constants, missing samples, refusals."""

import re

import numpy as np
import pytest

import zerorate as zr
from support.checks import assert_same_bits
from zerorate.attitude.options import TILT_OPTIONS

RATE = 100.0
BY_METHOD = pytest.mark.parametrize("method", ["complementary", "kalman"])


@pytest.mark.parametrize("tau", [0.49, 0.1, 5.0])
@pytest.mark.parametrize("rate", [20.0, 100.0, 1000.0])
def test_complementary_leaves_bias_times_time_constant(tau, rate):
    f = zr.Tilt(rate, time_constant=tau)
    n = int(40 * tau * rate)
    assert f.process(np.full(n, 0.05), np.zeros(n))[-1] == pytest.approx(0.05 * tau, rel=1e-9)


def test_complementary_is_that_of_every_tutorial():
    rng = np.random.default_rng(1)
    gyro, angle = rng.normal(size=(2, 500))
    expected = [angle[0]]
    for rate, seen in zip(gyro, angle, strict=True):
        expected.append(0.98 * (expected[-1] + rate * 0.01) + 0.02 * seen)
    f = zr.Tilt(RATE, time_constant=0.49)
    np.testing.assert_allclose(f.process(gyro, angle), expected[1:], rtol=1e-12, atol=1e-12)


def gains(f, n=20_000):
    """Steady gains, by what one more angle of 1 does to a filter at zero."""
    f.process(np.zeros(n), np.zeros(n))
    f.update(0.0, 1.0)
    return f.angle, f.bias


def test_gains_of_the_well_known_constants():
    np.testing.assert_allclose(
        gains(zr.Tilt(RATE, method="kalman")), [0.0305992, -0.0311352], rtol=2e-6
    )


def test_gains_of_honest_noise():
    """0.005 deg/sqrt(s), a walk of 3e-4 deg/s/sqrt(s), a tilt of one degree: 22 s."""
    f = zr.Tilt(
        RATE, method="kalman", q_angle=0.005**2, q_bias=3e-4**2, r_measure=1.0, p_start=1e-3
    )
    np.testing.assert_allclose(gains(f, 200_000), [9.2153e-4, -2.9986e-5], rtol=1e-4)


def test_a_constant_rate_is_a_bias():
    f = zr.Tilt(RATE, method="kalman")
    f.process(np.full(100, 0.05), np.zeros(100))
    assert f.angle == pytest.approx(8.894e-5, rel=1e-4)
    assert f.bias == pytest.approx(0.0497807, rel=1e-6)


def test_sigmas_cover():
    """Of an angle and a bias that walk as the filter takes them to: within three sigma or so."""
    rng = np.random.default_rng(4)
    k, n, dt = 200, 1000, 1.0 / RATE
    q_angle, q_bias, r = 1e-4, 1e-5, 1e-2
    bias = np.cumsum(rng.normal(0.0, np.sqrt(q_bias * dt), (n, k)), axis=0) + rng.normal(size=k)
    turned = rng.normal(0.0, np.sqrt(q_angle * dt), (n, k))
    angle = np.cumsum(turned, axis=0) + rng.normal(size=k)
    seen = angle + rng.normal(0.0, np.sqrt(r), (n, k))
    constants = {"q_angle": q_angle, "q_bias": q_bias, "r_measure": r}
    f = zr.Tilt(RATE, method="kalman", channels=k, **constants)
    f.process(bias, seen)
    # The mean of 200 squares of normal numbers: 0.7 to 1.3 are three of its deviations.
    for error in ((f.angle - angle[-1]) / f.angle_sigma, (f.bias - bias[-1]) / f.bias_sigma):
        assert 0.7 < np.mean(error**2) < 1.3


@BY_METHOD
def test_before_the_first_angle_it_is_unknown(method):
    f = zr.Tilt(RATE, method=method)
    assert np.isnan(f.process(np.ones(10), np.full(10, np.nan))).all()
    assert np.isnan(f.angle)
    assert f.update(0.0, 0.3) == pytest.approx(0.3)


@BY_METHOD
def test_a_missing_angle_corrects_nothing(method):
    f = zr.Tilt(RATE, method=method)
    f.update(0.0, 0.0)
    f.process(np.full(50, 0.2), np.full(50, np.nan))
    assert f.angle == pytest.approx(0.1, rel=1e-12)
    assert f.samples_seen == 51


@BY_METHOD
def test_a_missing_rate_is_the_last_one_for_a_while(method):
    f = zr.Tilt(RATE, method=method)
    f.update(0.2, 0.0)
    before = f.angle
    f.process(np.full(50, np.inf), np.full(50, np.nan))
    # 50 ms, less the bias that one sample has shown.
    rate = 0.2 - (f.bias if method == "kalman" else 0.0)
    assert f.angle - before == pytest.approx(0.05 * rate, rel=1e-12)


@BY_METHOD
def test_times_of_its_own(method):
    rng = np.random.default_rng(1)
    gyro, angle = rng.normal(size=(2, 100))
    slow, fast = zr.Tilt(50.0, method=method), zr.Tilt(RATE, method=method)
    assert_same_bits(slow.process(gyro, angle), fast.process(gyro, angle, dt=0.02))
    fast.reset()
    each = [fast.update(*sample, dt=0.02) for sample in zip(gyro, angle, strict=True)]
    assert_same_bits(slow.angle, each[-1])


@BY_METHOD
def test_axes_side_by_side(method):
    rng = np.random.default_rng(1)
    gyro, angle = rng.normal(size=(2, 100, 3))
    f = zr.Tilt(RATE, method=method, channels=3)
    found = f.process(gyro, angle, threads=2)
    for axis in range(3):
        alone = zr.Tilt(RATE, method=method)
        assert_same_bits(found[:, axis], alone.process(gyro[:, axis], angle[:, axis]))
    g = zr.Tilt(RATE, method=method, channels=3)
    assert_same_bits(found, np.array([g.update(*s) for s in zip(gyro, angle, strict=True)]))


def test_what_a_complementary_filter_does_not_know():
    f = zr.Tilt(RATE)
    f.update(0.1, 0.2)
    assert np.isnan([f.bias, f.bias_sigma, f.angle_sigma]).all()


@pytest.mark.parametrize("method", ["complementary", "kalman"])
@pytest.mark.parametrize("name", [name for name in TILT_OPTIONS if name != "method"])
def test_a_constant_is_used_or_refused(method, name):
    option = TILT_OPTIONS[name]
    if method in option.methods:
        assert f"{name}=0.07" in repr(zr.Tilt(RATE, method=method, **{name: 0.07}))
        with pytest.raises(ValueError, match=re.escape(f"{name} must be {option.expected}, got")):
            zr.Tilt(RATE, method=method, **{name: -1.0})
        return
    message = f"^{name} has no effect on method '{method}', only on '{option.methods[0]}'$"
    with pytest.raises(ValueError, match=message):
        zr.Tilt(RATE, method=method, **{name: 0.07})


@pytest.mark.parametrize(("call", "told"), [
    (lambda: zr.Tilt(RATE, method="mahony"),
     "method must be 'complementary' or 'kalman', got 'mahony'"),
    (lambda: zr.Tilt(0.0), "rate must be a positive number of samples a second, got 0.0"),
    (lambda: zr.Tilt(RATE, channels=0), "channels must be at least 1, got 0"),
    (lambda: zr.Tilt(RATE).update(0.0, 0.0, dt=-1.0), "dt must not be negative, got -1.0 s"),
    (lambda: zr.Tilt(RATE).process(np.zeros(3), np.zeros(4)), r"angle must have shape \(3,\)"),
    (lambda: zr.Tilt(RATE).process(np.zeros(3), np.zeros(3), dt=np.zeros(2)), "dt must have shape"),
    (lambda: zr.Tilt(RATE, channels=2).process(np.zeros((3, 2)), np.zeros(3)),
     r"angle must have shape \(3, 2\)"),
])  # fmt: skip
def test_refusals(call, told):
    with pytest.raises(ValueError, match=f"^{told}"):
        call()


@pytest.mark.parametrize("text", [
    "Tilt(rate=100.0)",
    "Tilt(rate=100.0, time_constant=2.0, channels=3)",
    "Tilt(rate=50.0, method='kalman', q_bias=1e-5)",
])  # fmt: skip
def test_the_text_is_the_call(text):
    assert repr(eval(text, {"Tilt": zr.Tilt})) == text
