"""Errors over stated standard deviations, for the streams other than drift filters.

`ROWS` has each stream and platform with a function that returns its errors over σ, by quantity, for
a number of records. `examples/deviations.py` prints them. `tests/laws/test_deviations.py` tests
them as law 9.
"""

from functools import partial

import numpy as np

import zerorate as zr
from zerorate.geometry.rotations import inverse, product
from zerorate.simulation.devices import device

RATE = 100.0
EARTH_M = 6.371e6


def tilt(records):
    """Return errors of an angle and a bias that follow the filter's random walks."""
    rng = np.random.default_rng(4)
    n, dt, k = 3000, 1.0 / RATE, 8 * records
    constants = {"q_angle": 1e-4, "q_bias": 1e-5, "r_measure": 1e-2}
    walks = rng.normal(size=(2, n, k)) * np.sqrt([[[1e-4 * dt]], [[1e-5 * dt]]])
    angle, bias = np.cumsum(walks, axis=1) + rng.normal(size=(2, 1, k))
    f = zr.Tilt(RATE, method="kalman", channels=k, **constants)
    found = {"angle": [], "bias": []}
    for end in range(500, n + 1, 500):
        part = slice(f.samples_seen, end)
        f.process(bias[part], angle[part] + rng.normal(0.0, 0.1, (part.stop - part.start, k)))
        found["angle"].append((f.angle - angle[end - 1]) / f.angle_sigma)
        found["bias"].append((f.bias - bias[end - 1]) / f.bias_sigma)
    return found


def position(records, method="aided"):
    """Return errors of a receiver's position; "aided" has a slow error and a speed."""
    rng = np.random.default_rng(5)
    n, k, aided = 300, 16 * records, method == "aided"
    kept, slow_sigma = (np.exp(-1.0 / 120.0), 2.5) if aided else (0.0, 0.0)
    slow, place, speed = slow_sigma * rng.normal(size=(k, 2)), np.zeros((k, 2)), np.zeros((k, 2))
    f = zr.PositionFilter(1.0, channels=k, method=method)
    errors = []
    for i in range(n):
        last, speed = speed, speed + rng.normal(0.0, 0.5, (k, 2))
        # The filter treats the error of a mean velocity as white.
        place = place + 0.5 * (last + speed) + rng.normal(0.0, 0.1, (k, 2))
        slow = kept * slow + slow_sigma * np.sqrt(1.0 - kept**2) * rng.normal(size=(k, 2))
        fix = place + slow + rng.normal(0.0, 0.7, (k, 2))
        f.update(fix, speed if aided else None)
        if i >= 60 and i % 30 == 0:
            errors.append((f.position - place) / f.sigma[:, None])
    return {"position": errors}


def linear(records):
    """Return errors of a constant velocity that is observed by its position, as in the model."""
    rng = np.random.default_rng(7)
    n, k, q = 400, 16 * records, 0.1
    F, H = np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    Q = q**2 * np.array([[1.0 / 3.0, 0.5], [0.5, 1.0]])
    f = zr.LinearKalman(F, H, Q, [[1.0]], P0=np.eye(2), channels=k)
    x, root = rng.normal(size=(k, 2)), np.linalg.cholesky(Q)
    found = {"state": []}
    for i in range(n):
        x = x @ F.T + rng.normal(size=(k, 2)) @ root.T
        f.predict()
        f.update(x[:, :1] + rng.normal(size=(k, 1)))
        if i % 20 == 19:
            sigma = np.sqrt(np.diagonal(f.covariance, axis1=-2, axis2=-1))
            found["state"].append((f.state - x) / sigma)
    return found


def array(records, model="MPU-6050"):
    """Return errors of the biases of four gyros, as means over the next 10 s."""
    sensors, rate, duration = 4, 100.0, 600.0
    found = []
    for seed in range(max(records // 2, 1)):
        z, truth = zr.simulate(device(model), rate, duration, seed, axes=3 * sensors)
        f = zr.GyroArray(rate, sensors)
        done, n = 0, round(10.0 * rate)
        for end in (np.arange(120.0, duration - 15.0, 40.0) * rate).astype(int):
            f.process(z[done:end].reshape(-1, sensors, 3))
            mean = truth[end : end + n].mean(axis=0).reshape(sensors, 3)
            found.append((f.bias - mean) / f.bias_sigma)
            done = end
    return {"bias": found}


def alignment(records):
    """Return errors of a navigation's alignment at rest."""
    found = {"tilt": [], "gyro bias": []}
    for seed in range(4 * records):
        drive = zr.simulate_drive(50.0, 30.0, seed=seed, kind="rest")
        w, x, y, z = drive.truth_quaternion[-1]
        yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        start = zr.align(drive.recording(), latitude=48.0, heading=yaw, accel_bias_sigma=0.02)
        q = product(start.quaternion, inverse(drive.truth_quaternion[-1]))
        found["tilt"].append(2.0 * q[1:3] * np.sign(q[0]) / start.level_sigma)
        found["gyro bias"].append((start.gyro_bias - drive.gyro_bias[-1]) / start.gyro_bias_sigma)
    return found


def temperature(records, white=0.01, slope=0.02, walk=0.0, flicker=0.0):
    """Return errors of bias and slope of gyros that warm up by 10 K in twenty minutes."""
    rate, duration, k = 25.0, 1200.0, 4 * records
    noise = zr.NoiseModel(
        angle_random_walk=white, bias_instability=flicker or None, rate_random_walk=walk or None
    )
    z, drift = zr.simulate(noise, rate, duration, seed=6, axes=k)
    warmth = 20.0 + 10.0 * (1.0 - np.exp(-np.arange(len(z)) / rate / 300.0))
    z = z + slope * (warmth - 25.0)[:, None]
    f = zr.TemperatureFilter(rate, channels=k)
    found = {"bias": [], "slope": []}
    ahead = round(10.0 * rate)
    for end in (np.arange(120.0, duration - 15.0, 60.0) * rate).astype(int):
        part = slice(f.samples_seen, end)
        f.process(z[part], warmth[part])
        mean = drift[end : end + ahead].mean(axis=0) + slope * (warmth[end - 1] - 25.0)
        found["bias"].append((f.bias - mean) / f.bias_sigma)
        if end >= 300.0 * rate:
            found["slope"].append((f.slope - slope) / f.slope_sigma)
    return found


def attitude(records, kind, start):
    """Return errors of tilt, heading and bias in a simulated motion, after settling."""
    found = {"tilt": [], "heading": [], "bias": []}
    for seed in range(20, 20 + 2 * records):
        motion = zr.simulate_motion(kind, RATE, 60.0, seed=seed, start=start)
        trace = zr.Attitude(RATE).trace(motion.gyro, motion.accel, motion.mag)
        w, x, y, z = product(trace["quaternion"], inverse(motion.quaternion)).T
        part = slice(round((10.0 if start == "rest" else 15.0) * RATE), None, 50)
        # The angle is about two axes.
        angle = 2.0 * np.arctan2(np.hypot(x, y), np.hypot(w, z))
        found["tilt"].append((angle / trace["tilt_sigma"])[part])
        found["heading"].append((2.0 * np.arctan(z / w) / trace["heading_sigma"])[part])
        found["bias"].append(((trace["bias"] - motion.bias) / trace["bias_sigma"])[part])
    return found


def rested(records, span=None):
    """Return errors in motion of an attitude with a bias that a drift filter learned at rest."""
    found = {"bias": [], "tilt": []}
    for seed in range(2 * records):
        noise = zr.NoiseModel(angle_random_walk=0.005, bias_instability=0.003)
        z, drift = zr.simulate(noise, RATE, 180.0, seed=seed, axes=3)
        motion = zr.simulate_motion(
            "hand", RATE, 60.0, seed=seed, start="motion", errors=zr.simulation.MotionErrors.none()
        )
        learned = zr.DriftFilter(RATE, channels=3, output="estimate")
        learned.process(z[:12_000])
        later = np.radians(z[12_000:])
        sigma = None if span is None else learned.bias_sigma_over(span)
        body = zr.Attitude(RATE, bias=learned, bias_sigma=sigma, gyro_unit="deg/s")
        trace = body.trace(np.degrees(motion.gyro + later), motion.accel, motion.mag)
        truth = drift[12_000:]
        part = slice(0, None, 50)
        found["bias"].append(((trace["bias"] - truth) / trace["bias_sigma"])[part])
        _, x, y, _ = product(trace["quaternion"], inverse(motion.quaternion)).T
        found["tilt"].append((2.0 * np.hypot(x, y) / trace["tilt_sigma"])[part][20:])
    return found


def navigation(records, receiver, stated=True):
    """Return errors of navigation with fixes, after the first minute of a simulated drive."""
    position_sigma, velocity_sigma, fixes_rate = receiver
    gyro = zr.NoiseModel(angle_random_walk=1e-4, rate_random_walk=2e-6)
    accel = zr.NoiseModel(angle_random_walk=1e-3, rate_random_walk=2e-5, quantity="acceleration")
    options = {"gyro": gyro, "accel": accel} if stated else {}
    names = ("position", "velocity", "orientation", "gyro bias", "accelerometer bias")
    found = {name: [] for name in names}
    for seed in range(records):
        drive = zr.simulate_drive(
            50.0,
            300.0,
            seed=seed,
            position_sigma=position_sigma,
            velocity_sigma=velocity_sigma,
            fixes_rate=fixes_rate,
        )
        imu = drive.recording()
        start = zr.align(imu, latitude=48.0, heading="course", accel_bias_sigma=0.05)
        track = zr.NavigationFilter(start, **options).process(imu, drive.fixes)
        errors = np.hstack(list(_track_errors(track, drive))) / track.sigma
        rows = np.flatnonzero(np.isfinite(errors).all(axis=1) & (track.time > 90.0))[
            :: round(2.5 * 50.0)
        ]
        for name, block in zip(names, np.split(errors[rows], 5, axis=1), strict=True):
            found[name].append(block)
    return found


def _track_errors(track, drive):
    """Yield errors of position, velocity, orientation and biases, each (n, 3)."""
    scale = np.radians(EARTH_M) * np.stack(
        [
            np.ones(len(track.time)),
            np.cos(np.radians(drive.truth_position[:, 0])),
            np.zeros(len(track.time)),
        ],
        axis=1,
    )
    scale[:, 2] = -1.0
    yield (track.position - drive.truth_position) * scale
    yield track.velocity - drive.truth_velocity
    q = product(track.quaternion, inverse(drive.truth_quaternion))
    yield 2.0 * q[:, 1:] * np.sign(q[:, :1])
    yield track.gyro_bias - drive.gyro_bias
    yield track.accel_bias - drive.accel_bias


def foot(records, noise=1e-4, bias=3e-3):
    """Return errors at the ends of walks: position, horizontal, and height."""
    found = {"level position": [], "height": []}
    for seed in range(4 * records):
        walk = zr.simulate_walk(100.0, strides=40, seed=seed, gyro_noise=noise, gyro_bias=bias)
        f = zr.FootFilter(100.0)
        f.process(walk.gyro, walk.accel)
        error = f.position - walk.position[-1]
        found["level position"].append(np.hypot(*error[:2]) / np.hypot(*f.sigma[:2]))
        found["height"].append(error[2] / f.sigma[2])
    return found


RECEIVERS = {"2 m, 1 Hz": (2.0, 0.1, 1.0), "2 cm, 4 Hz": (0.02, 0.02, 4.0)}
MOTIONS = ("pendulum", "spinning pendulum", "arm", "vehicle", "circle", "hand")

ROWS = {
    "`LinearKalman`, its own model": linear,
    "`Tilt`, its own constants": tilt,
    '`PositionFilter`, "aided"': position,
    '`PositionFilter`, "kalman"': partial(position, method="kalman"),
    '`PositionFilter`, "strength"': partial(position, method="strength"),
    "`GyroArray`, four MPU-6050": array,
    "`GyroArray`, four ADIS16405": partial(array, model="ADIS16405"),
    "`TemperatureFilter`, white": temperature,
    "`TemperatureFilter`, walk": partial(temperature, walk=2e-4),
    "`TemperatureFilter`, strong walk": partial(temperature, walk=1e-3),
    "`TemperatureFilter`, flicker": partial(temperature, flicker=0.005),
    "`TemperatureFilter`, strong flicker": partial(temperature, flicker=0.02),
    **{
        f"`Attitude`, {kind}, from {start}": partial(attitude, kind=kind, start=start)
        for kind in MOTIONS
        for start in ("rest", "motion")
    },
    "`Attitude`, bias of a `DriftFilter`": rested,
    "`align`, at rest": alignment,
    **{
        f"`NavigationFilter`, {name}, noise {'stated' if stated else 'of the default'}": partial(
            navigation, receiver=receiver, stated=stated
        )
        for name, receiver in RECEIVERS.items()
        for stated in (True, False)
    },
    "`FootFilter`, still stances": foot,
}
"""Function for each row: errors over standard deviations, by quantity."""
