"""The navigation filter beside its twin, at every sample of simulated drives."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import zerorate as zr
from oracle.navigation import Navigation
from support.drives import ACCEL, GYRO, drive, matrix, noises, start_of
from zerorate.geometry.earth import offset_position, radii

# Covariances differ by 1e-11, places and velocities by 1e-13; orientations by 3e-11, by which their
# matrices are stretched between steps of the covariance, and quaternions are not.
TOLERANCE = 1e-10
PARTS = (
    "position",
    "velocity",
    "quaternion",
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
        self.twin = Navigation(start, *noises(gyro, accel), **arguments)
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

    def update_wheels(self, *told):
        assert self.filter.update_wheels(*told) == self.twin.update_wheels(*told), told

    def note(self):
        """What both know after a sample and its fixes."""
        for one, notes in ((self.filter, self.found), (self.twin, self.expected)):
            C = one.C if one is self.twin else one.quaternion
            covariance = one.P[:15, :15] if one is self.twin else one.covariance
            biases = (one.b_g, one.b_a) if one is self.twin else (one.gyro_bias, one.accel_bias)
            notes.append((one.position, one.velocity, C, *biases, one.sigma, covariance, one.nis))

    def assert_equal(self):
        found, expected = (
            [np.array(part) for part in zip(*notes, strict=True)]
            for notes in (self.found, self.expected)
        )
        # All at once, which takes a tenth of the time.
        found[2] = matrix(found[2])
        errors = {}
        for name, got, there in zip(PARTS, found, expected, strict=True):
            np.testing.assert_array_equal(np.isnan(got), np.isnan(there), err_msg=name)
            errors[name] = difference(name, got, there, expected[-2])
        assert max(errors.values()) <= TOLERANCE, errors
        assert self.filter.fix_count == self.twin.fixes
        learned = self.twin.learned_sigma
        np.testing.assert_allclose(self.filter.learned_sigma, learned, rtol=TOLERANCE)
        self.assert_constants_equal()
        return errors

    def assert_constants_equal(self):
        twin, one = self.twin, self.filter
        sigma = np.sqrt(np.diag(twin.P)[15:])
        np.testing.assert_allclose(one.antenna, twin.antenna, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(one.antenna_sigma, sigma[3:6], rtol=1e-9)
        if sigma[0] > 0.0:
            np.testing.assert_allclose(one.wheel_constants, twin.roll, rtol=1e-9, atol=1e-9)
            np.testing.assert_allclose(one.wheel_constants_sigma, sigma[:3], rtol=1e-9)


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


def fixes_of(drive):
    """Time, when it arrives, and what the receiver says."""
    fixes = drive.fixes
    nothing = np.full((len(fixes), 3), np.nan)
    velocity = nothing if fixes.velocity is None else fixes.velocity
    return [
        (fixes.time[k], fixes.time[k], fixes.position[k], velocity[k], 2.0, 0.1)
        for k in range(len(fixes))
    ]


def run(pair, drive, fixes, *, gyro=None, accel=None, rest=None, keep=None, wheels=None):
    """Both over the drive; a fix is given after the first sample not before its arrival."""
    gyro, accel = drive.gyro if gyro is None else gyro, drive.accel if accel is None else accel
    waiting = sorted(fixes, key=lambda fix: fix[1])
    for k, t in enumerate(drive.time.tolist()):
        if keep is not None and not keep[k]:
            continue
        pair.update(t, gyro[k], accel[k], bool(rest is not None and rest[k]))
        if wheels is not None:
            # Of the time since the last, whose middle is before.
            pair.update_wheels(t - 0.05, None if np.isnan(wheels[k]) else wheels[k])
        while waiting and waiting[0][1] <= t:
            measured, _, *told = waiting.pop(0)
            pair.update_gnss(measured, *told)
        pair.note()
    return pair.assert_equal()


def changed(fixes, **changes):
    """Fixes with some of time, arrival, position, velocity, deviations by functions of a fix."""
    names = ("measured", "arrives", "position", "velocity", "position_sigma", "velocity_sigma")
    table = [dict(zip(names, fix, strict=True)) for fix in fixes]
    return [
        tuple((fix | {name: change(fix) for name, change in changes.items()}).values())
        for fix in table
    ]


def between(fixes, first, last):
    return [fix for fix in fixes if first <= fix[0] < last]


LEVER = (0.4, -0.3, -1.2)
ANTENNA = {"antenna": LEVER}
SETTINGS = {
    "plain": {},
    "antenna": ANTENNA,
    "wheeled": {"vehicle": "wheeled", "axle": (-1.0, 0.1, 0.5), **ANTENNA},
    "wheels of 5 cm/s": {"vehicle": "wheeled", "axle": (0.0, 0.0, 0.0), "wheel_sigma": 0.05},
    "free": {"adapt": "free"},
    "fixed": {"adapt": "fixed", "gate": 8.0},
    "tight": {"gate": 2.0},
    "long steps": {"covariance_step": 0.5},
    "steps of a sample": {"covariance_step": 0.01},
    "increments": {"kind": "increment", "gyro_vibration": 0.3, **ANTENNA},
    "vibration": {"gyro_vibration": 1.0},
    "axes of their own": {
        "gyro": [replace(GYRO, angle_random_walk=x) for x in (1e-4, 3e-4, 1e-3)],
        "accel": [replace(ACCEL, rate_random_walk=x) for x in (1e-5, 1e-4, 1e-3)],
    },
    "consumer": {"gyro": None, "accel": None},
}


@pytest.mark.every(6)
@pytest.mark.parametrize("name", SETTINGS)
def test_settings(name):
    arguments = SETTINGS[name]
    one = drive(antenna=arguments.get("antenna", np.zeros(3)))
    pair = Pair(start_of(one), **arguments)
    per = 1.0 / one.rate if arguments.get("kind") == "increment" else 1.0
    run(pair, one, fixes_of(one), gyro=one.gyro * per, accel=one.accel * per)
    # It stayed on the way: a twin of something that was lost would say little.
    off = (pair.found[-1][0] - one.truth_position[-1]) * [1e5, 7e4, 1.0]
    assert np.linalg.norm(off) < 6.0


@pytest.mark.every(2)
@pytest.mark.parametrize("sigma", [0.05, 1.0])
@pytest.mark.parametrize("first", [0.0, 30.0], ids=["from rest", "under way"])
def test_an_antenna_that_is_learned(sigma, first):
    one = drive(antenna=LEVER)
    pair = Pair(start_of(one), antenna=(0.0, 0.0, -1.0), antenna_sigma=sigma)
    run(pair, one, between(fixes_of(one), first, 99.0))
    assert (pair.filter.antenna_sigma < sigma)[:2].all()
    assert (
        np.hypot(*(pair.filter.antenna - LEVER)[:2])
        < 3.5 * np.hypot(0.4, 0.3) * (sigma < 0.1) + 1.0
    )


@pytest.mark.parametrize("vehicle", [None, "wheeled"])
def test_an_antenna_that_is_considered(vehicle):
    one = drive(antenna=LEVER)
    arguments = {"antenna_sigma": (0.3, 0.0, 0.5), "consider_antenna": True, "vehicle": vehicle}
    pair = Pair(start_of(one), antenna=(0.2, 0.3, -1.0), **arguments)
    told = zr.simulation.wheel_speeds(one) if vehicle else None
    run(pair, one, fixes_of(one), wheels=told)
    np.testing.assert_allclose(pair.filter.antenna_sigma, (0.3, 0.0, 0.5), rtol=1e-12)


@pytest.mark.every(2)
@pytest.mark.parametrize("slips", [0, 6])
@pytest.mark.parametrize("antenna_sigma", [0.0, 1.0], ids=["", "antenna too"])
def test_wheels_that_tell_their_speed(slips, antenna_sigma):
    """Also through a gap of the sensors and an outage, and where they stand still for long."""
    one = drive(90.0, antenna=LEVER)
    axle = (-1.0, 0.1, 0.5)
    told = zr.simulation.wheel_speeds(one, scale=0.02, tick=0.03, axle=axle, slips=slips)
    told[(one.time > 60.0) & (one.time < 75.0)] *= 0.0
    arguments = {"vehicle": "wheeled", "axle": axle, "antenna_sigma": antenna_sigma, **ANTENNA}
    pair = Pair(start_of(one), **arguments)
    fixes = [*between(fixes_of(one), 0.0, 40.0), *between(fixes_of(one), 50.0, 99.0)]
    run(pair, one, fixes, keep=~((one.time > 30.0) & (one.time < 31.5)), wheels=told)
    assert pair.filter.wheel_constants_sigma[0] < 0.03


@pytest.mark.every(3)
@pytest.mark.parametrize("sensors", ["gyro", "accel", "both"])
@pytest.mark.parametrize("seconds", [0.06, 0.5])
def test_missing_samples(sensors, seconds):
    one = drive()
    given = {name: getattr(one, name).copy() for name in ("gyro", "accel")}
    for first in (4.0, 9.98, 25.0, 40.3, 66.66):
        at = (one.time >= first) & (one.time < first + seconds)
        for name, values in given.items():
            if sensors in (name, "both"):
                values[at, int(first) % 3] = [np.nan, np.inf, 2e4][int(first) % 3]
    pair = Pair(start_of(one), **ANTENNA)
    run(pair, one, fixes_of(one), **given)
    seen = pair.filter.sigma
    assert np.isfinite(seen).all()


def test_the_first_sample_is_missing():
    one = drive(40.0)
    gyro = one.gyro.copy()
    gyro[:3] = np.nan
    run(Pair(start_of(one, 0.0)), one, fixes_of(one), gyro=gyro)


@pytest.mark.every(3)
@pytest.mark.parametrize("seconds", [0.9, 2.0])
@pytest.mark.parametrize("arguments", [{}, {"vehicle": "wheeled"}], ids=["plain", "wheeled"])
def test_gaps(seconds, arguments):
    one = drive(90.0)
    keep = ~((one.time > 30.0) & (one.time < 30.0 + seconds))
    keep &= ~((one.time > 50.0) & (one.time < 50.0 + seconds))
    pair = Pair(start_of(one), **arguments)
    run(pair, one, fixes_of(one), keep=keep)


def test_late_fixes():
    """By 0.4 s, and one in seven by more than a second."""
    one = drive(antenna=LEVER)
    fixes = changed(
        fixes_of(one),
        arrives=lambda fix: fix["measured"] + (1.3 if fix["measured"] % 7 == 0 else 0.4),
    )
    pair = Pair(start_of(one), **ANTENNA)
    run(pair, one, fixes)
    assert pair.verdicts[20:].count("refused") == sum(t % 7 == 0 for t in range(20, 59))


def test_fixes_ahead_of_the_sensors():
    """Measured up to 0.1 s later than the last sample: carried there, not waited for."""
    one = drive(antenna=LEVER)
    rng = np.random.default_rng(1)
    fixes = changed(fixes_of(one), measured=lambda fix: fix["measured"] + rng.uniform(0.0, 0.105))
    pair = Pair(start_of(one), **ANTENNA)
    run(pair, one, fixes)
    assert "refused" in pair.verdicts[20:]
    assert pair.verdicts.count("used") > 40


def test_outliers():
    one = drive(120.0)
    rng = np.random.default_rng(2)

    def spoilt(fix):
        return offset_position(fix["position"], rng.normal(0.0, 100.0, 3) * (rng.random() < 0.2))

    def wild(fix):
        return fix["velocity"] + rng.normal(0.0, 10.0, 3) * (rng.random() < 0.2)

    pair = Pair(start_of(one))
    run(pair, one, changed(fixes_of(one), position=spoilt, velocity=wild))
    # A fifth of the positions are spoilt, whatever the velocities beside them are.
    assert pair.filter.fix_count["used"] > 75
    assert pair.filter.fix_count["rejected"] == pair.filter.rejected_count["positions"] > 10
    assert pair.filter.rejected_count["velocities"] > 10


@pytest.mark.every(3)
@pytest.mark.parametrize("kind", ["position", "velocity", "both"])
def test_a_filter_that_starts_wrong(kind):
    """The first fix is 200 m and 30 m/s off: ten are rejected, then it finds back."""
    one = drive(90.0)
    first = 20.0

    def far(fix):
        off = 200.0 * (fix["measured"] == first and kind != "velocity")
        return offset_position(fix["position"], [off, -off, 0.0])

    def fast(fix):
        return fix["velocity"] + 30.0 * (fix["measured"] == first and kind != "position")

    fixes = changed(between(fixes_of(one), first, 100.0), position=far, velocity=fast)
    pair = Pair(start_of(one), adapt="fixed")
    run(pair, one, fixes)
    if kind == "both":
        assert pair.filter.fix_count["rejected"] == 10


@pytest.mark.every(2)
@pytest.mark.parametrize("arguments", [{}, {"vehicle": "wheeled"}], ids=["plain", "wheeled"])
def test_outages(arguments):
    """Of 3 s and of 10 s: after it two positions are to agree."""
    one = drive(90.0)
    fixes = fixes_of(one)
    kept = [*between(fixes, 0.0, 30.0), *between(fixes, 33.0, 50.0), *between(fixes, 60.0, 99.0)]
    pair = Pair(start_of(one), gyro=replace(GYRO, angle_random_walk=1e-6), **arguments)
    run(pair, one, kept)
    assert pair.filter.fix_count["rejected"] == 1


@pytest.mark.every(2)
@pytest.mark.parametrize("wrong", [1, 2, 15], ids=["one", "two that differ", "none that agrees"])
@pytest.mark.parametrize("velocities", [True, False])
def test_wrong_fixes_after_an_outage(wrong, velocities):
    """A hundred metres off, each elsewhere; with a gyro that is far better than it is told."""
    one = drive(90.0)
    off = np.random.default_rng(3).normal(0.0, 100.0, (99, 3))

    def spoilt(fix):
        k = round(fix["measured"]) - 50
        return offset_position(fix["position"], off[k] * (0 <= k < wrong))

    kept = [*between(fixes_of(one), 0.0, 30.0), *between(fixes_of(one), 50.0, 99.0)]
    kept = changed(kept, position=spoilt, **({} if velocities else {"velocity": nothing}))
    pair = Pair(start_of(one), adapt="fixed")
    run(pair, one, kept)
    off = (pair.found[-1][0] - one.truth_position[-1]) * [1e5, 7e4, 1.0]
    assert np.linalg.norm(off) < 8.0


def test_rest_flags():
    """True where it stands, now and then where it does not, and without a gyro for a while."""
    one = drive(75.0)
    rest = np.linalg.norm(one.truth_velocity, axis=1) < 0.01
    assert rest[one.time > 60.0].any()
    rest |= (one.time > 40.0) & (one.time < 40.5)
    gyro = one.gyro.copy()
    gyro[(one.time > 11.0) & (one.time < 11.5)] = np.nan
    run(Pair(start_of(one, 5.0)), one, between(fixes_of(one), 0.0, 50.0), gyro=gyro, rest=rest)


@pytest.mark.slow
def test_rest_without_fixes():
    one = zr.simulate_drive(50.0, 100.0, seed=3, kind="rest")
    fixes = between(fixes_of(one), 0.0, 12.0)
    run(Pair(start_of(one, 5.0)), one, fixes, rest=np.ones(one.time.size, bool))


def nothing(fix):
    return np.full(3, np.nan)


def without(name, axis):
    def part(fix):
        values = fix[name].copy()
        values[axis] = np.nan
        return values

    return part


FIXES = {
    "without velocities": {"velocity": nothing},
    "without vertical velocities": {"velocity": without("velocity", 2)},
    "without heights": {"position": without("position", 2)},
    "without latitudes": {
        "position": lambda fix: (
            without("position", 0)(fix) if fix["measured"] > 30.0 else fix["position"]
        )
    },
    "of three deviations": {
        "position_sigma": lambda fix: np.array([1.0, 2.0, 4.0]),
        "velocity_sigma": lambda fix: np.array([0.05, 0.1, 0.2]),
    },
    "too sure": {
        "position_sigma": lambda fix: 1e-9,
        "velocity_sigma": lambda fix: 0.01,
    },
}


@pytest.mark.every(3)
@pytest.mark.parametrize("first", [0.0, 30.0], ids=["from rest", "under way"])
@pytest.mark.parametrize("name", FIXES)
def test_fixes(name, first):
    one = drive()
    fixes = changed(between(fixes_of(one), first, 99.0), **FIXES[name])
    pair = Pair(start_of(one))
    run(pair, one, fixes)
    # Of a receiver that is too sure many are rejected until its noise is learned.
    assert pair.filter.fix_count["used"] >= 20


@pytest.mark.every(3)
@pytest.mark.parametrize("arguments", [{}, {"vehicle": "wheeled"}], ids=["plain", "wheeled"])
@pytest.mark.parametrize("off", [0.0, 1.5, 3.0])
def test_the_heading_from_the_course(arguments, off):
    """The alignment's heading is wrong by any angle, and said to be unknown."""
    one = drive(antenna=LEVER)
    start = start_of(one, heading_known=False, course=True, heading_sigma=1.6)
    turned = Rotation.from_rotvec([0.0, 0.0, off]) * Rotation.from_quat(
        start.quaternion, scalar_first=True
    )
    start = replace(start, quaternion=turned.as_quat(scalar_first=True))
    pair = Pair(start, **arguments, **ANTENNA)
    run(pair, one, fixes_of(one))
    assert pair.filter.fix_count["used"] > 30


def test_without_a_heading():
    one = drive(40.0)
    pair = Pair(start_of(one, heading_known=False))
    for k in range(one.time.size):
        pair.update(one.time[k], one.gyro[k], one.accel[k])
        if k % 50 == 0:
            pair.update_gnss(one.time[k], one.truth_position[k])
    assert pair.filter.status == "no heading"
    np.testing.assert_allclose(matrix(pair.filter.quaternion), pair.twin.C, atol=TOLERANCE)
    np.testing.assert_allclose(pair.filter.covariance, pair.twin.P[:15, :15], rtol=TOLERANCE)


def test_the_date_line():
    one = drive(longitude=179.9995, seed=5)
    assert np.ptp(one.truth_position[:, 1]) > 300.0
    run(Pair(start_of(one)), one, fixes_of(one))


def test_lost():
    """A gyro that fails for good: nothing is known in the end."""
    one = drive()
    gyro, accel = one.gyro.copy(), one.accel.copy()
    gyro[one.time > 30.0] = 0.0
    accel[one.time > 30.0] = 9e3
    # A step of the covariance a sample: at such speeds the matrix of the orientation is stretched
    # between them, and no quaternion is.
    pair = Pair(start_of(one), covariance_step=0.01)
    run(pair, one, between(fixes_of(one), 0.0, 30.0), gyro=gyro, accel=accel)
    assert pair.filter.status == "waiting"


@pytest.mark.every(3)
@pytest.mark.parametrize("seconds", [1.5, 2.5, 12.0])
def test_a_gyro_that_is_missing_for_long(seconds):
    one = drive()
    gyro = one.gyro.copy()
    gyro[(one.time > 20.0) & (one.time < 20.0 + seconds)] = np.nan
    run(Pair(start_of(one)), one, fixes_of(one), gyro=gyro)


@pytest.mark.every(2)
@pytest.mark.parametrize("adapt", ["inflate", "fixed"])
def test_a_first_fix_that_is_far_away(adapt):
    """The earth is that of another place after the way back."""
    one = drive(position_sigma=30.0)
    fixes = changed(
        between(fixes_of(one), 15.0, 99.0),
        position=lambda fix: offset_position(
            fix["position"], [4e3 * (fix["measured"] == 15.0), 0.0, 0.0]
        ),
        position_sigma=lambda fix: 30.0,
    )
    run(Pair(start_of(one), adapt=adapt), one, fixes)


@pytest.mark.slow
def test_the_course_of_positions_alone():
    one = drive(position_sigma=0.5)
    fixes = changed(fixes_of(one), velocity=nothing, position_sigma=lambda fix: 0.5)
    pair = Pair(start_of(one, heading_known=False, course=True, heading_sigma=1.6))
    run(pair, one, fixes)
    assert pair.filter.fix_count["used"] > 30
