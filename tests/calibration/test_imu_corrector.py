"""ImuCorrector: against its twin, as the inverse of a sensor, rotated, and what is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import zerorate as zr
from oracle import corrector as oracle
from support.settings import corrector_settings, some_correction

WIDTHS = [3, 6, 7]
BY_WIDTH = pytest.mark.parametrize("width", WIDTHS)
# A rounding of each of a dozen products.
TOLERANCE = 1e-13


def sensed(rng, n, width, missing=0.05):
    """Raw samples, of which some numbers miss."""
    z = 3.0 * rng.standard_normal((n, width))
    z[rng.random(z.shape) < missing] = np.nan
    return z


def parts(answers):
    """Rates, and forces or None."""
    return answers if isinstance(answers, tuple) else (answers, None)


@BY_WIDTH
@given(data=st.data())
def test_it_is_its_twin(width, data):
    arguments = data.draw(corrector_settings(width))
    z = sensed(np.random.default_rng(data.draw(st.integers(0, 2**32))), 300, width)
    got = parts(zr.ImuCorrector(**arguments).process(z))
    expected = oracle.corrected(z, **{k: arguments[k] for k in arguments if k not in CONDUCT})
    for found, twin in zip(got, expected, strict=True):
        if twin is None:
            assert found is None
        else:
            np.testing.assert_allclose(found, twin, rtol=TOLERANCE, atol=100.0 * TOLERANCE)


CONDUCT = {"inputs", "channels"}


def test_it_is_its_twin_for_long():
    """Through 10^5 samples, to the last digits of what is corrected."""
    rng = np.random.default_rng(4)
    arguments, z = some_correction(rng, 7), sensed(rng, 100_000, 7)
    got, expected = zr.ImuCorrector(**arguments).process(z), oracle.corrected(z, **arguments)
    for found, twin in zip(got, expected, strict=True):
        np.testing.assert_allclose(found, twin, rtol=TOLERANCE, atol=100.0 * TOLERANCE)


def test_what_the_sensors_make_of_motion_is_undone():
    rng = np.random.default_rng(5)
    rates, forces = rng.standard_normal((2, 500, 3))
    W, A = np.eye(3) + 0.05 * rng.standard_normal((2, 3, 3))
    G = 0.01 * rng.standard_normal((3, 3))
    b_g, b_a = rng.standard_normal((2, 3))
    raw = np.hstack([rates @ W.T + b_g + forces @ G.T, forces @ A.T + b_a])
    f = zr.ImuCorrector(
        np.linalg.inv(W), b_g, accel_matrix=np.linalg.inv(A), accel_bias=b_a, g_sensitivity=G
    )
    for found, true in zip(f.process(raw), (rates, forces), strict=True):
        assert np.abs(found - true).max() < 1e-13


def rotated(Q, arguments, z):
    """Sensors whose axes are turned: arguments and samples."""
    turned = dict(arguments)
    for name in arguments.keys() & {"gyro_matrix", "accel_matrix", "g_sensitivity"}:
        turned[name] = Q @ arguments[name] @ Q.T
    for name in arguments.keys() & {"gyro_bias", "accel_bias"}:
        turned[name] = Q @ arguments[name]
    if "temperature" in arguments:
        curve = arguments["temperature"]
        turned["temperature"] = {**curve, "coefficients": Q @ curve["coefficients"]}
    samples = z.copy()
    for first in range(0, z.shape[1] - 2, 3):
        samples[:, first : first + 3] = z[:, first : first + 3] @ Q.T
    return turned, samples


@BY_WIDTH
@given(data=st.data())
def test_rotating_the_axes_rotates_the_answer(width, data):
    arguments = data.draw(corrector_settings(width))
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    Q, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    z = sensed(rng, 50, width, missing=0.0)
    plain = parts(zr.ImuCorrector(**arguments).process(z))
    turned, samples = rotated(Q, arguments, z)
    found = parts(zr.ImuCorrector(**turned).process(samples))
    for got, expected in zip(found, plain, strict=True):
        if expected is not None:
            np.testing.assert_allclose(got, expected @ Q.T, rtol=0.0, atol=300.0 * TOLERANCE)


def test_force_and_temperature_are_held_while_they_miss():
    curve = {"reference": 20.0, "range": (10.0, 30.0), "coefficients": [[1.0, 2.0]] * 3}
    f = zr.ImuCorrector(np.eye(3), np.full(3, 5.0), g_sensitivity=np.eye(3), temperature=curve)
    gone = [np.nan] * 3
    rate, force = f.update([0.0, 0.0, 0.0, *gone, np.nan])
    assert rate.tolist() == [-5.0] * 3
    assert np.isnan(force).all()
    rate, force = f.update([0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 25.0])
    # At 25 degrees the bias is 1 + 2 (25 - 20) / 10.
    assert rate.tolist() == [-2.0, -2.0, -3.0]
    assert force.tolist() == f.force.tolist() == [0.0, 0.0, 1.0]
    rate, force = f.update([0.0, None, 0.0, 7.0, np.inf, 7.0, np.nan])
    assert np.isnan([*rate, *force]).all()
    assert f.update([0.0, 0.0, 0.0, *gone, np.inf])[0].tolist() == [-2.0, -2.0, -3.0]
    assert f.bias.tolist() == [2.0] * 3


def test_a_curve_goes_on_along_its_tangent_for_as_long_as_it_is():
    curve = {"reference": 0.0, "range": (0.0, 10.0), "coefficients": [[0.0, 0.0, 1.0]] * 3}
    f = zr.ImuCorrector(-np.eye(3), np.zeros(3), temperature=curve)
    told = {-100.0: 0.0, -10.0: 0.0, 5.0: 0.25, 10.0: 1.0, 15.0: 2.0, 20.0: 3.0, 1e9: 3.0}
    for temperature, bias in told.items():
        rate, _ = f.update([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, temperature])
        assert rate == pytest.approx([bias] * 3, rel=1e-15), temperature


def test_what_a_sample_needs_is_what_is_given():
    eye, none = np.eye(3), np.zeros(3)
    assert zr.ImuCorrector(eye, none).inputs == 3
    assert zr.ImuCorrector(eye, none, accel_bias=none).inputs == 6
    curve = {"reference": 0, "range": [0, 1], "coefficients": np.zeros((3, 1))}
    f = zr.ImuCorrector(eye, none, temperature=curve)
    assert f.inputs == 7
    assert f.temperature["range"] == (0.0, 1.0)
    assert f.temperature["coefficients"].shape == (3, 4)
    assert zr.ImuCorrector(eye, none, inputs=7).temperature is None
    assert zr.ImuCorrector(eye, none, inputs=6).process(np.zeros((0, 6)))[1].shape == (0, 3)
    assert zr.ImuCorrector(eye, none, channels=2).update(np.zeros((2, 3))).shape == (2, 3)


def test_its_own_place_and_others():
    rng = np.random.default_rng(6)
    z = rng.standard_normal((100, 3))
    f = zr.ImuCorrector(**some_correction(rng, 3))
    expected = f.process(z)
    wide = np.zeros((100, 5))
    assert f.process(z, out=wide[:, 1:4]) is not None
    np.testing.assert_array_equal(wide[:, 1:4], expected)
    assert f.process(z, out=z) is z
    np.testing.assert_array_equal(z, expected)
    both = zr.ImuCorrector(np.eye(3), np.zeros(3), inputs=6)
    with pytest.raises(ValueError, match="out= is for what returns one array"):
        both.process(np.zeros((4, 6)), out=np.zeros((4, 6)))


CURVE = {"reference": 20.0, "range": (10.0, 30.0), "coefficients": np.zeros((3, 2))}


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"gyro_matrix": np.eye(2)}, r"gyro_matrix must have shape \(3, 3\), got \(2, 2\)"),
        ({"gyro_bias": 0.0}, r"gyro_bias must have shape \(3,\), got \(\)"),
        ({"gyro_bias": [0.0, np.nan, 0.0]}, "gyro_bias must be of finite numbers, .* got NaN"),
        ({"accel_matrix": np.full((3, 3), 1e51)}, "accel_matrix must be of .* 1e50 in size"),
        ({"inputs": 4}, "inputs must be 3, 6 or 7, got 4"),
        ({"inputs": 3, "accel_bias": np.zeros(3)}, "accel_bias is for samples of 6 numbers or"),
        ({"inputs": 6, "temperature": CURVE}, "temperature is for samples of 7 numbers or more"),
        ({"temperature": {**CURVE, "range": (3.0, 1.0)}}, "range must be least and highest"),
        ({"temperature": {**CURVE, "range": (3.0,)}}, r"range must have shape \(2,\), got \(1,\)"),
        ({"temperature": {**CURVE, "reference": 1e7}}, "reference must be a temperature within"),
        (
            {"temperature": {**CURVE, "coefficients": np.zeros((3, 5))}},
            r"coefficients must have shape \(3, 1\) to \(3, 4\), got \(3, 5\)",
        ),
        ({"channels": 0}, "channels must be at least 1"),
    ],
)
def test_what_no_sensor_needs_is_refused(changed, message):
    with pytest.raises(ValueError, match=message):
        zr.ImuCorrector(**{"gyro_matrix": np.eye(3), "gyro_bias": np.zeros(3), **changed})


@pytest.mark.parametrize("wrong", [25.0, {}, {**CURVE, "more": 1}, {**CURVE, "reference": "warm"}])
def test_a_curve_that_is_none_is_refused(wrong):
    with pytest.raises(TypeError, match="temperature must be a dict of 'reference', 'range'"):
        zr.ImuCorrector(np.eye(3), np.zeros(3), temperature=wrong)


@pytest.mark.parametrize("z", [np.zeros((5, 6)), np.zeros(3), np.zeros((2, 2, 3))])
def test_samples_of_another_width_are_refused(z):
    with pytest.raises(ValueError, match=r"z must have shape \(n, 3\), got"):
        zr.ImuCorrector(np.eye(3), np.zeros(3)).process(z)
