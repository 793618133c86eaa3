"""Barometer, compass and baseline: they help, and no disturbance of theirs moves the vehicle."""

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import zerorate as zr
from support.checks import assert_same_bits
from support.drives import MODELS, NAMES, drive, rotation, start_of
from zerorate.navigation import OUTPUTS, VERDICTS, Aid

BASELINE = (0.8, 0.1, 0.0)
KINDS = ("height", "pressure", "heading", "baseline")


def made(one, **arguments):
    return zr.NavigationFilter(start_of(one), baseline=BASELINE, **MODELS, **arguments)


def aids_of(one, kinds=("pressure", "heading", "baseline"), seed=1, rate=10.0):
    """Readings by kind with noise, an offset, and times between those of the samples."""
    rng = np.random.default_rng(seed)
    at = np.arange(0, len(one.time), round(one.rate / rate))
    height, turned = one.truth_position[at, 2], rotation(one.truth_quaternion[at])
    n = len(at)
    heights = height + 30.0 + rng.normal(0.0, 0.3, n)
    made = {
        "height": (heights, 0.3),
        "pressure": (101325.0 * (1.0 - heights / 44330.77) ** 5.25588, 3.6),
        "heading": (turned.as_euler("ZYX")[:, 0] + 0.02 + rng.normal(0.0, 0.03, n), 0.03),
        "baseline": (turned.apply(BASELINE) + rng.normal(0.0, 0.02, (n, 3)), 0.02),
    }
    return {kind: Aid(one.time[at], *made[kind]) for kind in kinds}


def heading_error(track, one):
    errors = track.errors(one.truth_position, one.truth_velocity, one.truth_quaternion)
    return errors[:, 8]


def without_fixes(one, first, last):
    keep = (one.fixes.time < first) | (one.fixes.time >= last)
    fixes = one.fixes
    return zr.Fixes(
        fixes.time[keep],
        fixes.position[keep],
        fixes.velocity[keep],
        position_sigma=fixes.position_sigma[keep],
        velocity_sigma=fixes.velocity_sigma[keep],
    )


def loop(nav, one, aids):
    """The calls that ``process`` makes."""
    rows = [
        (time, KINDS.index(kind), kind, value, sigma)
        for kind, aid in aids.items()
        for time, value, sigma in zip(aid.time, aid.value, aid.sigma, strict=True)
    ]
    rows.sort(key=lambda row: row[:2])
    fixes, states, verdicts = list(range(len(one.fixes))), [], []
    for t, gyro, accel in zip(one.time, one.gyro, one.accel, strict=True):
        nav.update(t, gyro, accel)
        while rows and rows[0][0] <= t:
            time, _, kind, value, sigma = rows.pop(0)
            verdicts.append((kind, getattr(nav, f"update_{kind}")(time, value, sigma=sigma)))
        while fixes and one.fixes.time[fixes[0]] <= t:
            k = fixes.pop(0)
            told = one.fixes.position_sigma[k], one.fixes.velocity_sigma[k]
            nav.update_gnss(one.fixes.time[k], one.fixes.position[k], one.fixes.velocity[k], *told)
        usable = list(nav.usable.values())
        states.append(np.concatenate([*(getattr(nav, name) for name in NAMES), usable]))
    return np.array(states), verdicts


@pytest.mark.parametrize("arguments", [{}, {"antenna_sigma": 0.3}, {"vehicle": "wheeled"}])
def test_live_is_the_batch_to_the_bit(arguments):
    one = drive(50.0)
    aids = aids_of(one)
    batch, live = made(one, **arguments), made(one, **arguments)
    track = batch.process(one.recording(), one.fixes, **aids)
    states, verdicts = loop(live, one, aids)
    assert batch.to_bytes() == live.to_bytes()
    assert_same_bits(np.hstack([*(getattr(track, n) for n in NAMES), track.usable]), states)
    for kind, found in track.aids.items():
        expected = [verdict for name, verdict in verdicts if name == kind]
        assert [VERDICTS[k] for k in found.verdict] == expected
        assert (np.isnan(found.nis) == (np.array(expected) == "refused")).all()
    for road in (batch.copy(), pickle.loads(pickle.dumps(batch))):
        assert road.to_bytes() == batch.to_bytes()
        assert road.aid_count == batch.aid_count


def test_readings_at_samples_are_those_of_their_times():
    one = drive(30.0)
    aids = aids_of(one, KINDS[1:], rate=one.rate)
    plain = {kind: Aid(aid.time, aid.value) for kind, aid in aids.items()}
    at_samples = {kind: aid.value for kind, aid in aids.items()}
    at_samples["heading"] = np.where(np.arange(len(one.time)) % 3, np.nan, at_samples["heading"])
    keep = np.isfinite(at_samples["heading"])
    plain["heading"] = Aid(one.time[keep], at_samples["heading"][keep])
    first, second = made(one), made(one)
    first.process(one.recording(), one.fixes, **plain)
    second.process(one.recording(), one.fixes, **at_samples)
    assert first.to_bytes() == second.to_bytes()


@given(k=st.integers(1, 2499))
def test_it_goes_on_from_any_sample(k):
    one = drive(50.0)
    rows = zr.navigation.aids.AidRows.of(aids_of(one), one.time).rows
    fixes = zr.navigation.events.pack_fixes(one.fixes)
    whole, part = made(one), made(one)
    samples = (one.time, one.gyro, one.accel)
    whole.process_arrays(*samples, fixes, aids=rows)
    for piece, at in ((slice(0, k), -np.inf), (slice(k, None), one.time[k - 1])):
        until = one.time[piece][-1]
        due = (fixes[:, 0] > at) & (fixes[:, 0] <= until)
        read = (rows[:, 1] > at) & (rows[:, 1] <= until)
        part = zr.NavigationFilter.from_bytes(part.to_bytes())
        part.process_arrays(*(x[piece] for x in samples), fixes[due], aids=rows[read])
    assert part.to_bytes() == whole.to_bytes()


def test_a_barometer_holds_the_height_of_an_outage():
    one = drive(120.0)
    fixes = without_fixes(one, 80.0, 90.0)
    consumer = {"gyro": None, "accel": None}
    bare, held = (zr.NavigationFilter(start_of(one), **consumer) for _ in range(2))
    aids = aids_of(one, ["pressure"])
    end = np.searchsorted(one.time, 89.9)
    sigmas = [
        nav.process(one.recording(), fixes, **given).sigma[end, 2]
        for nav, given in ((bare, {}), (held, aids))
    ]
    assert sigmas[1] < sigmas[0] / 3.0
    # The standard atmosphere of the test's own formula is a metre off in hundreds.
    assert abs(held.height_reference - 30.0) < 4.0 * held.height_reference_sigma + 0.2


def test_a_compass_holds_the_heading_of_a_long_stop():
    """An offset of the compass is learned while fixes show the heading."""
    one = drive(120.0)
    track = made(one).process(one.recording(), one.fixes, **aids_of(one, ["heading"]))
    error = heading_error(track, one)[one.time > 60.0]
    assert np.abs(error / track.sigma[one.time > 60.0, 8]).max() < 4.0


@pytest.mark.parametrize("kind", ["step", "ramp", "frozen", "jumps", "turned away", "degrees"])
def test_a_compass_that_is_disturbed_does_not_turn_the_track(kind):
    one = drive(150.0)
    aid = aids_of(one, ["heading"])["heading"]
    time, value = aid.time, aid.value.copy()
    at = (time > 60.0) & (time < 120.0)
    rng = np.random.default_rng(2)
    value[at] = {
        "step": value[at] + 0.7,
        "ramp": value[at] + 0.7 * np.clip((time[at] - 60.0) / 30.0, 0.0, 1.0),
        "frozen": np.full(at.sum(), value[at][0]),
        "jumps": value[at] + np.pi * (rng.random(at.sum()) < 0.5),
        "turned away": value[at] + 0.5 * np.sin(0.2 * time[at]),
        "degrees": np.degrees(value[at]),
    }[kind]
    spoilt = {"heading": Aid(time, value, 0.03)}
    bare = made(one).process(one.recording(), one.fixes)
    track = made(one).process(one.recording(), one.fixes, **spoilt)
    after = one.time > 60.0
    error, usual = heading_error(track, one)[after], heading_error(bare, one)[after]
    assert np.abs(error).max() < np.abs(usual).max() + 0.015
    assert np.abs(error / track.sigma[after, 8]).max() < 5.0


def test_a_door_does_not_lift_the_vehicle():
    """A step of pressure by 1.5 m."""
    one = drive(120.0)
    aid = aids_of(one, ["height"])["height"]
    steps = Aid(aid.time, aid.value + 1.5 * (aid.time > 60.0), 0.3)
    tracks = [made(one).process(one.recording(), one.fixes, height=given) for given in (aid, steps)]
    apart = tracks[1].position[:, 2] - tracks[0].position[:, 2]
    assert np.nanmax(np.abs(apart)) < 0.5


@pytest.mark.parametrize("known", ["heading", "baseline"])
def test_a_standing_vehicle_knows_its_heading(known):
    """The rest before the drive, without a heading at first."""
    one = drive(60.0, rest=40.0)
    given = start_of(one, heading_known=False, course=False)
    nav = zr.NavigationFilter(given, baseline=BASELINE, **MODELS)
    assert nav.status == "no heading"
    track = nav.process(one.recording(), one.fixes, **aids_of(one, ["heading", known]))
    stands = (one.time > 20.0) & (one.time < 40.0)
    assert track.navigating[stands].all()
    error = heading_error(track, one)[stands]
    assert np.abs(error / track.sigma[stands, 8]).max() < 3.5
    assert track.sigma[stands, 8].max() < 0.05


def test_the_smoother_takes_aids():
    one = drive(120.0)
    fixes = without_fixes(one, 60.0, 90.0)
    track = made(one).process(one.recording(), fixes, **aids_of(one))
    best = track.smooth()
    errors = [
        each.errors(one.truth_position, one.truth_velocity, one.truth_quaternion)
        for each in (track, best)
    ]
    at = (one.time > 30.0) & (one.time < 110.0)
    rms = [np.sqrt(np.mean(error[at] ** 2, axis=0)) for error in errors]
    assert rms[1][8] < rms[0][8]
    assert np.hypot(*rms[1][:2]) < np.hypot(*rms[0][:2])
    for k in (0, 1, 2, 8):
        ratio = np.sqrt(np.mean((errors[1][at, k] / best.sigma[at, k]) ** 2))
        assert ratio < 2.0, k
    assert (best.sigma[at] <= track.sigma[at] * 1.001).all()
    assert best.usable.shape == track.usable.shape


REFUSED = {
    "hPa": ("pressure", 1013.25),
    "kPa": ("pressure", 101.3),
    "beyond": ("pressure", 2e5),
    "NaN": ("height", np.nan),
    "infinite": ("height", np.inf),
    "high": ("height", 1e150),
    "a heading in degrees": ("heading", 270.0),
    "no heading": ("heading", None),
    "no vector": ("baseline", None),
    "a vector of NaN": ("baseline", (np.nan, 1.0, 0.0)),
}


@pytest.fixture
def running():
    one = drive(20.0)
    nav = made(one)
    nav.process(one.recording(), one.fixes)
    return nav


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_is_refused(running, name):
    kind, value = REFUSED[name]
    before = [getattr(running, each) for each in NAMES]
    assert getattr(running, f"update_{kind}")(running.time, value) == "refused"
    for old, each in zip(before, NAMES, strict=True):
        assert_same_bits(old, getattr(running, each))


@pytest.mark.parametrize("kind", KINDS)
def test_times(running, kind):
    value = {"height": 400.0, "pressure": 96000.0, "heading": 0.1, "baseline": BASELINE}[kind]
    update = getattr(running, f"update_{kind}")
    now = running.time
    assert update(now - 1.01, value) == update(now + 0.11, value) == "refused"
    assert update(np.nan, value) == "refused"
    assert update(now - 0.5, value) != "refused"
    assert update(now - 0.5, value) == update(now - 0.6, value) == "refused"
    assert update(now - 0.4, value) != "refused"


@pytest.mark.parametrize("sigma", [0.0, -1.0, np.nan])
@pytest.mark.parametrize("kind", KINDS[:3])
def test_a_deviation_is_positive(running, kind, sigma):
    with pytest.raises(ValueError, match="sigma must be positive"):
        getattr(running, f"update_{kind}")(running.time, 1.0, sigma)


def test_a_baseline_is_needed_and_has_its_length(running):
    bare = zr.NavigationFilter(start_of(drive(20.0)))
    with pytest.raises(ValueError, match=r"baseline must be from 0\.01 to 1000 m long"):
        bare.update_baseline(1.0, BASELINE)
    long = np.array(BASELINE) * 1.5
    assert running.update_baseline(running.time, long) == "rejected"


def test_outputs_are_usable_up_to_their_limits():
    one = drive(120.0)
    fixes = without_fixes(one, 70.0, 100.0)
    track = made(one, limits={"position": 4.0}).process(one.recording(), fixes)
    assert track.limits == {
        "position": 4.0,
        "height": 10.0,
        "velocity": 1.0,
        "attitude": 0.05,
        "heading": 0.17,
    }
    assert not track.usable[~track.navigating].any()
    size = np.hypot(*track.sigma[:, :2].T)
    usable = track.usable[:, 0]
    known = track.navigating
    assert (size[known & usable] <= 4.0 + 1e-12).all()
    assert (size[known & ~usable] > 2.8 - 1e-12).all()
    changes = np.flatnonzero(np.diff(usable.astype(int)))
    assert 1 <= len(changes) <= 5
    log = track.to_log()
    for k, name in enumerate(OUTPUTS):
        np.testing.assert_array_equal(log.extra[f"{name}_usable"], track.usable[:, k])


@pytest.mark.parametrize("limits", [{"position": 0.0}, {"height": -1.0}, {"heading": np.nan}])
def test_limits_are_positive(limits):
    with pytest.raises(ValueError, match="limits must be positive"):
        zr.NavigationFilter(start_of(drive(20.0)), limits=limits)


def test_limits_have_names():
    with pytest.raises(ValueError, match=r"limits must be 'position', 'height', 'velocity'"):
        zr.NavigationFilter(start_of(drive(20.0)), limits={"roll": 1.0})


def test_a_filter_without_aids_has_none():
    one = drive(20.0)
    nav = made(one)
    nav.process(one.recording(), one.fixes)
    assert np.isnan([nav.height_reference, nav.compass_offset]).all()
    assert np.isnan(list(nav.aid_nis.values())).all()
    assert all(
        count == {"used": 0, "rejected": 0, "refused": 0} for count in nav.aid_count.values()
    )


@pytest.mark.parametrize(
    ("time", "value", "sigma"),
    [
        ([0.0, 1.0], [1.0], None),
        ([1.0, 0.0], [1.0, 1.0], None),
        ([0.0, np.nan], [1.0, 1.0], None),
        ([0.0, 1.0], [1.0, 1.0], 0.0),
        ([0.0, 1.0], [1.0, 1.0], [[1.0]]),
        ([0.0, 1.0], np.ones((2, 2)), None),
    ],
)
def test_readings_are_checked(time, value, sigma):
    with pytest.raises(ValueError, match=r"^(value|time|sigma) must"):
        Aid(time, value, sigma)


def test_kinds_have_their_numbers():
    one = drive(20.0)
    for wrong in ({"heading": Aid([1.0], [[1.0, 0.0, 0.0]])}, {"baseline": Aid([1.0], [1.0])}):
        with pytest.raises(ValueError, match=r"^(heading|baseline) must have"):
            made(one).process(one.recording(), one.fixes, **wrong)
