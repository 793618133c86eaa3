"""The named methods of attitude beside their twins."""

import numpy as np
import pytest

import zerorate as zr
from oracle.named_attitudes import TWINS, Tilt, applied, exponential, matrix, process, times

# A record of 10 s: with and without a magnetometer 1e5 samples of each method.
BODIES, SAMPLES, RATE = 200, 250, 25.0
# Both round some tens of operations a sample to 1.1e-16, and forget what is old: 4e-14 is seen.
TOLERANCE = 1e-10

OTHER = {
    "complementary": {"time_constant": 2.0},
    "mahony": {"kp": 0.4, "ki": 0.02},
    "madgwick": {"beta": 0.3},
    "ekf": {"gyro_noise": 1e-2, "accel_noise": 0.02, "mag_noise": 0.5, "bias_walk": 1e-3},
    "ukf": {"gyro_noise": 1e-2, "accel_noise": 0.02, "mag_noise": 0.5, "bias_walk": 1e-3},
}


def tumbling(seed=1):
    """Bodies that turn about all axes, are shaken and miss samples; times that are not even."""
    rng = np.random.default_rng(seed)
    dt = rng.uniform(0.8, 1.2, SAMPLES) / RATE
    t = np.cumsum(dt)[:, None, None]
    amplitude, phase = rng.uniform(0.0, 3.0, (BODIES, 3)), rng.uniform(0.0, 6.3, (BODIES, 3))
    gyro = amplitude * np.sin(rng.uniform(0.2, 5.0, (BODIES, 3)) * t + phase)
    q = np.array([exponential(rng.uniform(-3.0, 3.0, (BODIES, 3)))])
    for rate, step in zip(gyro, dt, strict=True):
        q = np.concatenate([q, times(q[-1], exponential(rate * step))[None]])
    up, field = np.array([[0.0, 0.0, 9.81]]), np.array([[2.0, 18.0, -45.0]])
    turned = [np.swapaxes(matrix(each), 1, 2) for each in q[1:]]
    accel = np.array([applied(R, up) for R in turned]) + rng.normal(0.0, 0.5, gyro.shape)
    mag = np.array([applied(R, field) for R in turned]) + rng.normal(0.0, 0.5, gyro.shape)
    accel[rng.random((SAMPLES, BODIES)) < 0.05] = np.nan
    mag[rng.random((SAMPLES, BODIES)) < 0.3] = np.nan
    return gyro + rng.normal(0.0, 0.02, gyro.shape) + 0.02, accel, mag, dt


RECORD = tumbling()


@pytest.mark.every(3)
@pytest.mark.parametrize("constants", ["default", "other"])
@pytest.mark.parametrize("mag", [True, False])
@pytest.mark.parametrize("method", TWINS)
def test_equal_to_its_twin(method, mag, constants):
    gyro, accel, field, dt = RECORD
    chosen = OTHER[method] if constants == "other" else {}
    # Two runs of each method have a record each for the constants.
    half = slice(None, BODIES // 2) if constants == "other" else slice(BODIES // 2, None)
    gyro, accel, field = (np.ascontiguousarray(z[:, half]) for z in (gyro, accel, field))
    if not mag:
        chosen = {name: value for name, value in chosen.items() if name != "mag_noise"}
    f = zr.Attitude(RATE, method=method, mag=mag, channels=gyro.shape[1], **chosen)
    twin = TWINS[method](gyro.shape[1], mag=mag, **chosen)
    expected = process(twin, gyro, accel, field, dt)
    found = f.process(gyro, accel, field if mag else None, dt=dt)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=TOLERANCE)
    if method in ("mahony", "ekf", "ukf"):
        np.testing.assert_allclose(f.bias, twin.bias, rtol=TOLERANCE, atol=TOLERANCE)
    if method in ("ekf", "ukf"):
        variances = np.diagonal(twin.P, axis1=1, axis2=2)
        np.testing.assert_allclose(f.bias_sigma**2, variances[:, 3:], rtol=TOLERANCE)
        np.testing.assert_allclose(f.heading_sigma**2, variances[:, 2], rtol=TOLERANCE)
        np.testing.assert_allclose(f.tilt_sigma**2, variances[:, :2].sum(axis=1), rtol=TOLERANCE)


@pytest.mark.parametrize("method", ["complementary", "kalman"])
def test_tilts_are_equal_to_their_twin(method):
    rng = np.random.default_rng(2)
    gyro, angle = rng.normal(0.0, 1.0, (2, 2000, BODIES))
    angle[5::7] = np.nan
    dt = rng.uniform(0.5, 1.5, len(gyro)) / RATE
    chosen = {"time_constant": 2.0}
    if method == "kalman":
        chosen = {"q_angle": 1e-2, "q_bias": 1e-4, "r_measure": 0.5, "p_start": 0.1}
    f = zr.Tilt(RATE, method=method, channels=BODIES, **chosen)
    twin = Tilt(method, 2.0, (1e-2, 1e-4), 0.5, 0.1)
    expected = [twin.update(*sample) for sample in zip(gyro, angle, dt, strict=True)]
    np.testing.assert_allclose(f.process(gyro, angle, dt=dt), expected, rtol=0.0, atol=TOLERANCE)
    if method == "kalman":
        np.testing.assert_allclose(f.bias, twin.x[1], rtol=0.0, atol=TOLERANCE)
        np.testing.assert_allclose(f.angle_sigma**2, twin.P[0, 0], rtol=TOLERANCE)
        np.testing.assert_allclose(f.bias_sigma**2, twin.P[1, 1], rtol=TOLERANCE)
