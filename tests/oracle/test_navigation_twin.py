"""The navigation filter beside its twin, at every sample of simulated drives."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import zerorate as zr
from oracle.navigation import Navigation
from zerorate.navigation.earth import moved, radii
from zerorate.navigation.noise import densities

TOLERANCE = 1e-10
GYRO = zr.NoiseModel(angle_random_walk=1e-4, rate_random_walk=2e-6)
ACCEL = zr.NoiseModel(angle_random_walk=1e-3, rate_random_walk=2e-5, quantity="acceleration")
PARTS = (
    "position",
    "velocity",
    "attitude",
    "gyro_bias",
    "accel_bias",
    "sigma",
    "covariance",
    "nis",
)


class Pair:
    """A filter and its twin, which are given the same."""

    def __init__(self, start, gyro=GYRO, accel=ACCEL, **arguments):
        self.filter = zr.NavigationFilter(start, gyro=gyro, accel=accel, **arguments)
        noise = [np.array(densities(*of)) for of in (("gyro", gyro), ("accel", accel))]
        self.twin = Navigation(start, *noise, **arguments)
        self.found, self.expected = [], []
        self.verdicts = []

    def update(self, t, gyro, accel, rest=False):
        assert self.filter.update(t, gyro, accel, rest) == self.updated(t, gyro, accel, rest), t

    def updated(self, *sample):
        self.twin.update(*sample)
        return self.twin.status

    def update_gnss(self, *fix):
        verdict = self.filter.update_gnss(*fix)
        assert verdict == self.twin.update_gnss(*fix), fix
        self.verdicts.append(verdict)

    def note(self):
        """What both know after a sample and its fixes."""
        for one, notes in ((self.filter, self.found), (self.twin, self.expected)):
            C = one.C if one is self.twin else matrix(one.attitude)
            covariance = one.P if one is self.twin else one.covariance
            biases = (one.b_g, one.b_a) if one is self.twin else (one.gyro_bias, one.accel_bias)
            notes.append((one.position, one.velocity, C, *biases, one.sigma, covariance, one.nis))

    def assert_equal(self):
        found, expected = (
            [np.array(part) for part in zip(*notes, strict=True)]
            for notes in (self.found, self.expected)
        )
        errors = {}
        for name, got, there in zip(PARTS, found, expected, strict=True):
            np.testing.assert_array_equal(np.isnan(got), np.isnan(there), err_msg=name)
            errors[name] = difference(name, got, there, expected[-2])
        assert max(errors.values()) <= TOLERANCE, errors
        assert self.filter.fixes == self.twin.fixes
        learned = self.twin.learned_sigma
        np.testing.assert_allclose(self.filter.learned_sigma, learned, rtol=TOLERANCE)
        return errors


def difference(name, got, expected, covariance):
    """The largest, relative to the largest of each quantity; of a place in metres."""
    apart = np.abs(got - expected)
    if name == "position":
        origin = expected[~np.isnan(expected[:, 0])][0]
        meridian, normal = radii(np.radians(origin[0]))
        metres = np.radians([meridian, normal * np.cos(np.radians(origin[0])), 180.0 / np.pi])
        apart, expected = apart * metres, (expected - origin) * metres
    if name == "covariance":
        # Each error is of its own unit.
        deviations = np.sqrt(np.einsum("kii->ki", covariance))
        scale = deviations[:, :, None] * deviations[:, None, :]
        return np.max(apart / np.where(scale > 0.0, scale, 1.0))
    if name == "sigma":
        return np.nanmax(apart / expected)
    return np.nanmax(apart) / np.nanmax(np.abs(expected))


def matrix(q):
    return Rotation.from_quat(q, scalar_first=True).as_matrix()


def drive(duration=80.0, seed=1, **arguments):
    return zr.simulate_drive(duration, 50.0, seed=seed, rest=12.0, **arguments)


def start_of(drive, time=10.0, **changes):
    """What an alignment would have found, with errors of its size."""
    k = int(time * drive.rate)
    tilted = Rotation.from_rotvec([0.002, -0.003, 0.03]) * Rotation.from_quat(
        drive.truth_attitude[k], scalar_first=True
    )
    start = zr.Alignment(
        time=time,
        attitude=tilted.as_quat(scalar_first=True),
        latitude=drive.truth_position[0, 0],
        heading_known=True,
        course=False,
        gyro_bias=drive.gyro_bias[k] + 1e-4,
        accel_bias=np.zeros(3),
        sigma_level=0.005,
        sigma_heading=0.05,
        sigma_gyro_bias=1e-4,
        sigma_accel_bias=0.05,
    )
    return replace(start, **changes)


def fixes_of(drive):
    """Time, when it arrives, and what the receiver says."""
    fixes = drive.fixes
    nothing = np.full((len(fixes), 3), np.nan)
    velocity = nothing if fixes.velocity is None else fixes.velocity
    return [
        (fixes.time[k], fixes.time[k], fixes.position[k], velocity[k], 2.0, 0.1)
        for k in range(len(fixes))
    ]


def run(pair, drive, fixes, *, gyro=None, accel=None, rest=None, keep=None):
    """Both over the drive; a fix is given after the first sample not before its arrival."""
    gyro, accel = drive.gyro if gyro is None else gyro, drive.accel if accel is None else accel
    waiting = sorted(fixes, key=lambda fix: fix[1])
    for k, t in enumerate(drive.time.tolist()):
        if keep is not None and not keep[k]:
            continue
        pair.update(t, gyro[k], accel[k], bool(rest is not None and rest[k]))
        while waiting and waiting[0][1] <= t:
            measured, _, *told = waiting.pop(0)
            pair.update_gnss(measured, *told)
        pair.note()
    return pair.assert_equal()


def test_plain():
    one = drive()
    pair = Pair(start_of(one))
    run(pair, one, fixes_of(one))
    assert pair.filter.status == "navigating"
