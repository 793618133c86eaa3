"""Short simulated drives with their noise models, and alignments with errors of a known size."""

from dataclasses import replace
from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

import zerorate as zr
from zerorate.geometry.earth import earth_rate, normal_gravity

RATE = 50.0
# What simulate_drive puts in by default.
GYRO = zr.NoiseModel(angle_random_walk=1e-4, rate_random_walk=2e-6)
ACCEL = zr.NoiseModel(angle_random_walk=1e-3, rate_random_walk=2e-5, quantity="acceleration")
# White noise and walk of the bias of consumer sensors, of which nothing is known.
CONSUMER = {"gyro": (np.radians(0.05), 1e-5), "accel": (0.02, 5e-4)}
MODELS = {"gyro": GYRO, "accel": ACCEL}
NAMES = ("position", "velocity", "quaternion", "gyro_bias", "accel_bias", "sigma")


def drive(duration=60.0, seed=1, **arguments):
    """Of a car that drives off after 12 s; made once, and so not to be written in."""
    named = {"rest": 12.0, **arguments}
    lists = {name: tuple(value) for name, value in named.items() if np.ndim(value)}
    return _driven(duration, seed, **named | lists)


@cache
def _driven(duration, seed, **arguments):
    made = zr.simulate_drive(RATE, duration, seed=seed, **arguments)
    for values in (*vars(made).values(), *vars(made.fixes).values()):
        if isinstance(values, np.ndarray):
            values.flags.writeable = False
    return made


def start_of(drive, time=10.0, tilt=(0.002, -0.003, 0.03), **changes):
    """What an alignment might have found at a time, with errors of its size."""
    k = round(time * drive.rate)
    attitude = Rotation.from_rotvec(tilt) * rotation(drive.truth_quaternion[k])
    start = zr.navigation.Alignment(
        time=time,
        quaternion=attitude.as_quat(scalar_first=True),
        latitude=drive.truth_position[0, 0],
        heading_known=True,
        course=False,
        gyro_bias=drive.gyro_bias[k] + 1e-4,
        accel_bias=np.zeros(3),
        level_sigma=0.005,
        heading_sigma=0.05,
        gyro_bias_sigma=1e-4,
        accel_bias_sigma=0.05,
    )
    return replace(start, **changes)


def rotation(quaternion):
    return Rotation.from_quat(quaternion, scalar_first=True)


def densities(sensor, model):
    """White noise and walk of the bias of three axes, as a filter takes them of a model."""
    if isinstance(model, list):
        of_axes = [densities(sensor, one) for one in model]
        return tuple(zip(*((white[0], walk[0]) for white, walk in of_axes), strict=True))
    white, walk = CONSUMER[sensor] if model is None else model.__noise_densities__(sensor)
    return (white,) * 3, (CONSUMER[sensor][1] if walk is None else walk,) * 3


def matrix(quaternion):
    return rotation(quaternion).as_matrix()


def noises(gyro=GYRO, accel=ACCEL):
    """White noise and walk of the bias of three axes, of gyro and accelerometer."""
    return [np.array(densities(*of)) for of in (("gyro", gyro), ("accel", accel))]


def at_rest(time, latitude, heading=0.3, height=100.0):
    """Gyro and accelerometer without error on a level body, and an alignment without error."""
    turned = Rotation.from_euler("z", heading)
    angle = np.radians(latitude)
    gyro = turned.inv().apply(earth_rate(angle))
    accel = np.array([0.0, 0.0, -float(normal_gravity(angle, height))])
    start = zr.navigation.Alignment(
        time=float(time[0]),
        quaternion=turned.as_quat(scalar_first=True),
        latitude=latitude,
        heading_known=True,
        course=False,
        gyro_bias=np.zeros(3),
        accel_bias=np.zeros(3),
        level_sigma=0.002,
        heading_sigma=0.05,
        gyro_bias_sigma=1e-5,
        accel_bias_sigma=0.02,
    )
    return np.tile(gyro, (len(time), 1)), np.tile(accel, (len(time), 1)), start
