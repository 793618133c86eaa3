"""Aids of the navigation filter beside its twin, at every sample of simulated drives."""

import numpy as np
import pytest

from oracle.aids import BAROMETER, COMPASS, SENSORS
from oracle.test_navigation_twin import ANTENNA, LEVER, Pair, between, fixes_of
from support.drives import drive, rotation, start_of

BASELINE = (0.8, 0.1, 0.0)
KINDS = ("height", "pressure", "heading", "baseline")


def readings(one, kinds, *, rate=5.0, late=0.0, seed=1):
    """Kind, time of measurement and arrival, and value of readings with noise and offsets."""
    rng = np.random.default_rng(seed)
    found = []
    turned = rotation(one.truth_quaternion)
    heading = turned.as_euler("ZYX")[:, 0]
    for k in range(0, len(one.time), round(one.rate / rate)):
        t, height = float(one.time[k]), one.truth_position[k, 2]
        values = {
            "height": height + 30.0 + rng.normal(0.0, 0.3),
            "pressure": 101325.0 * (1.0 - (height + rng.normal(0.0, 0.3)) / 44330.77) ** 5.25588,
            "heading": heading[k] + 0.05 + rng.normal(0.0, 0.04),
            "baseline": turned[k].apply(BASELINE) + rng.normal(0.0, 0.02, 3),
        }
        found += [(kind, t, t + late, values[kind]) for kind in kinds]
    return found


def changed(given, first, last, change):
    return [
        (kind, t, arrives, change(t, value) if first <= t < last else value)
        for kind, t, arrives, value in given
    ]


def run(pair, one, fixes, aids, keep=None, gyro=None):
    """Both over the drive; what arrives is given after the first sample that is not before."""
    waiting, coming = sorted(fixes, key=lambda fix: fix[1]), sorted(aids, key=lambda aid: aid[2])
    gyro = one.gyro if gyro is None else gyro
    verdicts = []
    for k, t in enumerate(one.time.tolist()):
        if keep is not None and not keep[k]:
            continue
        pair.update(t, gyro[k], one.accel[k])
        while coming and coming[0][2] <= t:
            kind, measured, _, value = coming.pop(0)
            verdict = getattr(pair.filter, f"update_{kind}")(measured, value)
            assert verdict == pair.twin.update_aid(kind, measured, value), (kind, t)
            verdicts.append((kind, measured, verdict))
        while waiting and waiting[0][1] <= t:
            measured, _, *given = waiting.pop(0)
            pair.update_gnss(measured, *given)
        assert list(pair.filter.usable.values()) == pair.twin.usable.tolist(), t
        pair.note()
    pair.assert_equal()
    assert_aids_equal(pair)
    return verdicts


def assert_aids_equal(pair):
    one, twin = pair.filter, pair.twin
    for name, sensor in zip(SENSORS, twin.sensors, strict=True):
        assert one.aid_count[name] == sensor.counts, name
        assert one.aid_disturbed[name] == sensor.disturbed, name
        np.testing.assert_allclose(one.aid_nis[name], sensor.nis, rtol=1e-7, err_msg=name)
        if sensor.count >= 10:
            shown = np.sqrt(np.max(sensor.spread))
            np.testing.assert_allclose(one.aid_sigma[name], shown, rtol=1e-8)
    if twin.P[BAROMETER, BAROMETER] > 0.0:
        np.testing.assert_allclose(one.height_reference, twin.reference, rtol=1e-9)
    if twin.P[COMPASS, COMPASS] > 0.0:
        np.testing.assert_allclose(one.compass_offset, twin.offset, rtol=1e-8, atol=1e-12)


def used(verdicts, kind, first=0.0, last=1e9):
    return [verdict for one, t, verdict in verdicts if one == kind and first <= t < last]


@pytest.mark.parametrize("adapt", ["inflate", "free", "fixed"])
@pytest.mark.parametrize("kinds", [*((kind,) for kind in KINDS), KINDS[1:]], ids="-".join)
def test_all_aids(kinds, adapt):
    one = drive(90.0)
    fixes = fixes_of(one)
    kept = [*between(fixes, 0.0, 40.0), *between(fixes, 60.0, 99.0)]
    pair = Pair(start_of(one), baseline=BASELINE, adapt=adapt)
    verdicts = run(pair, one, kept, readings(one, kinds))
    for kind in kinds:
        later = used(verdicts, kind, 15.0)
        assert later.count("used") > 0.8 * len(later), kind


@pytest.mark.parametrize("arguments", [{"antenna_sigma": 0.5}, {"vehicle": "wheeled"}])
def test_with_other_constants(arguments):
    one = drive(60.0, antenna=LEVER)
    pair = Pair(start_of(one), baseline=BASELINE, **ANTENNA, **arguments)
    run(pair, one, fixes_of(one), readings(one, KINDS[1:]))


def test_an_antenna_that_is_considered():
    one = drive(60.0, antenna=LEVER)
    considered = {"antenna_sigma": 0.3, "consider_antenna": True}
    pair = Pair(start_of(one), baseline=BASELINE, **ANTENNA, **considered)
    run(pair, one, fixes_of(one), readings(one, KINDS[1:]))


def test_late_readings_and_a_gap():
    one = drive(90.0)
    late = readings(one, KINDS[1:], late=0.4)
    late = [(kind, t, t + 1.2 if t % 3.0 < 0.1 else at, value) for kind, t, at, value in late]
    pair = Pair(start_of(one), baseline=BASELINE)
    keep = ~((one.time > 50.0) & (one.time < 51.5))
    verdicts = run(pair, one, fixes_of(one), late, keep=keep)
    assert used(verdicts, "heading", 20.0).count("refused") > 10


@pytest.mark.parametrize("kind", KINDS)
def test_disturbances(kind):
    """A step that stays, and spikes; the twin's own decisions are the filter's."""
    one = drive(120.0)
    step = {"height": 4.0, "pressure": 60.0, "heading": 0.7, "baseline": [0.3, -0.3, 0.0]}[kind]
    rng = np.random.default_rng(3)
    spoilt = changed(readings(one, [kind]), 40.0, 75.0, lambda t, x: x + np.array(step))
    spoilt = changed(
        spoilt, 90.0, 110.0, lambda t, x: x + np.array(step) * 3.0 * (rng.random() < 0.3)
    )
    pair = Pair(start_of(one), baseline=BASELINE)
    verdicts = run(pair, one, fixes_of(one), spoilt)
    assert used(verdicts, kind, 40.0, 43.0).count("rejected") > 8
    # A constant of the sensor is another one; a baseline of another length is none.
    assert ("used" in used(verdicts, kind, 60.0, 75.0)) == (kind != "baseline")


@pytest.mark.parametrize("kind", KINDS)
def test_frozen_sensors(kind):
    one = drive(90.0)
    given = readings(one, [kind])
    held = next(value for _, t, _, value in given if t >= 40.0)
    pair = Pair(start_of(one), baseline=BASELINE)
    verdicts = run(pair, one, fixes_of(one), changed(given, 40.0, 60.0, lambda t, x: held))
    # Where it stands a value may stay the same.
    speed = np.linalg.norm(one.truth_velocity, axis=1)
    moving = {float(t) for t, v in zip(one.time, speed, strict=True) if v > 1.5}
    assert any(t in moving for _, t, _ in verdicts)
    assert not [t for _, t, said in verdicts if 43.0 < t < 60.0 and said == "used" and t in moving]


@pytest.mark.parametrize("vehicle", [None, "wheeled"])
@pytest.mark.parametrize("sigma", [0.0, 0.035])
def test_a_heading_that_begins(sigma, vehicle):
    one = drive(60.0)
    pair = Pair(start_of(one, heading_known=False), compass_sigma=sigma, vehicle=vehicle)
    run(pair, one, fixes_of(one), readings(one, ["heading"]))
    assert pair.filter.status == "navigating"


def test_missing_and_impossible_readings():
    one = drive(40.0)
    rng = np.random.default_rng(5)
    values = (np.nan, np.inf, 1e150, -1e150, 1e-150, 5e-324, 0.0, -3.0, 1013.25)

    def wild(t, x):
        return np.full(np.shape(x), rng.choice(values)) if rng.random() < 0.3 else x

    pair = Pair(start_of(one), baseline=BASELINE)
    run(pair, one, fixes_of(one), changed(readings(one, KINDS), 0.0, 99.0, wild))
