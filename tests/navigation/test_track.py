"""Tracks: their errors, the smoother, logs."""

import pickle
import re
from dataclasses import replace

import numpy as np
import pytest

import zerorate as zr
from zerorate.geometry.earth import offset_position
from zerorate.geometry.rotations import from_rotation_vectors, inverse, product
from zerorate.navigation import STATUSES, VERDICTS

GYRO = zr.NoiseModel(angle_random_walk=1e-4, rate_random_walk=2e-6)
ACCEL = zr.NoiseModel(angle_random_walk=1e-3, rate_random_walk=2e-5, quantity="acceleration")


def driven(seed=3, duration=150.0, **options):
    """A drive, a filter that is told its noise, and the track."""
    drive = zr.simulate_drive(50.0, duration, seed=seed)
    start = zr.align(
        drive.recording(), latitude=48.0, heading="course", accel_bias_sigma=0.02, span=(0.0, 29.0)
    )
    nav = zr.NavigationFilter(start, gyro=GYRO, accel=ACCEL, **options)
    return drive, nav, nav.process(drive.recording(), drive.fixes)


def horizontal(track, drive, where=slice(None)):
    errors = track.errors(drive.truth_position)[where, :2]
    return np.sqrt(np.nanmean((errors**2).sum(axis=1)))


def test_errors_are_what_was_added():
    drive, _, track = driven(duration=60.0)
    random = np.random.default_rng(1)
    n = track.n
    truth = np.tile(drive.truth_position[:1], (n, 1))
    shift, turn = random.standard_normal((n, 3)), 0.01 * random.standard_normal((n, 3))
    quaternion = np.tile([0.5, 0.5, -0.5, 0.5], (n, 1))
    from dataclasses import replace

    known = replace(
        track,
        position=offset_position(truth, shift),
        velocity=shift + 1.0,
        quaternion=product(inverse(from_rotation_vectors(turn)), quaternion),
    )
    found = known.errors(truth, np.ones((n, 3)), quaternion)
    np.testing.assert_allclose(found, np.hstack([shift, shift, turn]), atol=1e-6)


def test_the_smoother_is_better_before_the_end_and_equal_at_it():
    drive, _, track = driven()
    best = track.smooth()
    known = track.navigating
    assert horizontal(best, drive) < 0.75 * horizontal(track, drive)
    np.testing.assert_allclose(best.position[-1], track.position[-1], rtol=0, atol=1e-12)
    assert (best.sigma[known][:, :2] <= track.sigma[known][:, :2] * 1.001).mean() > 0.98
    np.testing.assert_array_equal(best.navigating, known)
    assert best.smoothed
    with pytest.raises(ValueError, match="this track is smoothed"):
        best.smooth()
    # Its deviations hold.
    errors = best.errors(drive.truth_position, drive.truth_velocity, drive.truth_quaternion)[known]
    consistency = (errors**2 / best.sigma[known][:, :9] ** 2).mean(axis=0)
    assert (consistency < 5.0).all()
    assert 0.2 < consistency.mean() < 2.5


def test_the_smoother_of_exact_fixes_is_the_truth():
    drive = zr.simulate_drive(
        50.0, 120.0, gyro=None, accel=None, position_sigma=0.0, velocity_sigma=0.0
    )
    fixes = drive.fixes
    exact = zr.Fixes(
        fixes.time,
        fixes.position,
        fixes.velocity,
        np.full((len(fixes), 3), 0.001),
        np.full((len(fixes), 3), 0.001),
    )
    start = zr.align(drive.recording(), latitude=48.0, heading="course", span=(0.0, 29.0))
    tiny = zr.NoiseModel(angle_random_walk=1e-6, rate_random_walk=1e-9)
    force = zr.NoiseModel(1e-5, 0.0, 1e-8, quantity="acceleration")
    track = zr.NavigationFilter(start, gyro=tiny, accel=force).process(drive.recording(), exact)
    best = track.smooth()
    inside = (track.time > 60.0) & (track.time < 115.0)
    assert horizontal(best, drive, inside) < 0.02
    off = (best.gyro_bias - drive.gyro_bias)[inside]
    assert np.abs(off).max() < 2e-5


def test_a_track_of_nothing_can_be_smoothed():
    drive = zr.simulate_drive(50.0, 60.0)
    start = zr.align(drive.recording(), latitude=48.0, heading=0.0, span=(0.0, 29.0))
    nav = zr.NavigationFilter(start)
    track = nav.process(drive.recording())
    assert not track.navigating.any()
    assert np.isnan(track.smooth().position).all()
    assert STATUSES[track.status[-1]] == nav.status == "waiting"


def test_a_track_knows_what_became_of_each_fix():
    drive, nav, track = driven(duration=60.0)
    nav.reset()
    late = nav.process(drive.recording(), drive.fixes.shifted(10.0))
    beyond = late.fixes[:, 0] > drive.time[-1]
    assert beyond.any()
    np.testing.assert_array_equal(late.verdict == VERDICTS.index("not reached"), beyond)
    np.testing.assert_array_equal(np.isnan(late.taken), beyond)
    assert np.isnan(late.nis()[beyond]).all()
    for name, count in track.fix_count.items():
        assert (track.verdict == VERDICTS.index(name)).sum() == count
    # Each is taken after the first sample that is not before it.
    at = np.searchsorted(drive.time, drive.fixes.time)
    reached = at < len(drive.time)
    np.testing.assert_array_equal(track.taken[reached], drive.time[at[reached]])


def test_a_pickled_track_is_smoothed_alike():
    _, _, track = driven(duration=60.0)
    other = pickle.loads(pickle.dumps(track))
    np.testing.assert_array_equal(other.nis(), track.nis())
    best, same = track.smooth(), other.smooth()
    np.testing.assert_array_equal(same.position, best.position)
    np.testing.assert_array_equal(same.sigma, best.sigma)


def test_without_its_steps_a_track_is_not_smoothed():
    drive, nav, _ = driven(duration=60.0)
    nav.reset()
    track = nav.process(drive.recording(), drive.fixes, keep="track")
    assert np.isfinite(track.nis()).any()
    with pytest.raises(
        ValueError, match=r"only the track was kept: use process\(..., keep='all'\)"
    ):
        track.smooth()
    with pytest.raises(ValueError, match="keep must be 'all' or 'track', got 'state'"):
        nav.process(drive.recording(), keep="state")


def test_a_gap_divides_the_smoother():
    drive, nav, _ = driven()
    keep = (drive.time < 80.0) | (drive.time > 85.0)
    imu = {
        "time_s": drive.time[keep],
        "gyro_radps": drive.gyro[keep],
        "accel_mps2": drive.accel[keep],
    }
    rows = nav.copy()
    rows.reset()
    from zerorate.navigation.events import Events
    from zerorate.navigation.track import Inputs, run_navigation

    inputs = Inputs(
        imu["time_s"], imu["gyro_radps"], imu["accel_mps2"], Events.of(drive.fixes), None
    )
    track = run_navigation(rows, inputs, source="a drive with a gap")
    best = track.smooth()
    truth = drive.truth_position[keep]
    errors = np.hypot(*best.errors(truth)[best.navigating, :2].T)
    assert np.sqrt((errors**2).mean()) < 0.8
    assert errors.max() < 4.0
    assert track.navigating[track.time > 86.0].all()


def test_a_log_holds_what_is_known(tmp_path):
    _, _, track = driven(duration=60.0)
    log = track.to_log()
    path = tmp_path / "track.parquet"
    pytest.importorskip("pyarrow")
    zr.write_log(log, path)
    again = zr.read_log(path, columns=["height_m"])
    np.testing.assert_array_equal(again.data[:, 0], track.position[:, 2])
    assert log.n == track.n
    np.testing.assert_array_equal(log.data, track.position)
    assert {"velocity_north_mps", "quat_w", "gyro_bias_x_radps", "position_sigma_north_m"} <= set(
        log.extra
    )


def test_wrong_input_is_refused():
    drive, nav, _ = driven(duration=60.0)
    fresh = nav.copy()
    fresh.reset()
    before = fresh.to_bytes()
    with pytest.raises(TypeError, match=r"gnss must be Fixes, as zr.read_fixes returns them, got"):
        fresh.process(drive.recording(), [1, 2])
    with pytest.raises(ValueError, match=r"rest must be an array of bool, shape \(3000,\)"):
        fresh.process(drive.recording(), rest=np.zeros(3000))
    with pytest.raises(ValueError, match="time_offset must be a number of seconds, got nan"):
        fresh.process(drive.recording(), drive.fixes, time_offset=np.nan)
    with pytest.raises(ValueError, match=r"fixes.*\(m, 13\)"):
        fresh.process_arrays(drive.time, drive.gyro, drive.accel, np.zeros((2, 4)))
    back = drive.time.copy()
    back[100] = back[99]
    with pytest.raises(ValueError, match="t must be later than that of the sample before"):
        fresh.process_arrays(back, drive.gyro, drive.accel, np.empty((0, 13)))
    assert fresh.to_bytes() == before


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"vehicle": "boat"}, "vehicle must be None or 'wheeled', got 'boat'"),
        ({"axle": (0, 0, 0)}, "axle is used by vehicle='wheeled' only"),
        ({"wheel_sigma": 0.1}, "wheel_sigma is used by vehicle='wheeled' only"),
        ({"vehicle": "wheeled", "wheel_sigma": 0.0}, "wheel_sigma must be from 0.001 to 1000 m/s"),
        ({"adapt": "up"}, "adapt must be 'inflate', 'free' or 'fixed', got 'up'"),
        ({"kind": "delta"}, "kind must be 'rate' or 'increment', got 'delta'"),
        ({"gate": 0.0}, "gate must be a positive number, got 0.0"),
        ({"covariance_step": 5.0}, "covariance_step must be from 0.0001 to 1 s, got 5.0"),
        ({"antenna": (0.0, 0.0)}, r"antenna.*\(3,\)"),
        ({"antenna": (0.0, np.nan, 0.0)}, "antenna must be within 1000 m, got NaN"),
        ({"gyro": ACCEL}, "gyro must be a NoiseModel of angular rate, got one of acceleration"),
        ({"accel": GYRO}, "accel must be a NoiseModel of acceleration"),
        (
            {"gyro": zr.NoiseModel(bias_instability=1e-4)},
            "gyro: the model has no angle_random_walk",
        ),
    ],
)
def test_wrong_parameters_are_refused(options, message):
    drive = zr.simulate_drive(50.0, 40.0)
    start = zr.align(drive.recording(), latitude=48.0, span=(0.0, 29.0))
    with pytest.raises(ValueError, match=message):
        zr.NavigationFilter(start, **options)


def test_a_start_is_an_alignment():
    with pytest.raises(
        ValueError, match=r"start must be an Alignment, as zr.align returns it, got"
    ):
        zr.NavigationFilter((48.0, 11.0))
    drive = zr.simulate_drive(50.0, 40.0)
    start = zr.align(drive.recording(), latitude=48.0, span=(0.0, 29.0))
    with pytest.raises(TypeError, match="gyro must be a NoiseModel or three of them"):
        zr.NavigationFilter(start, gyro=[GYRO, GYRO])
    assert zr.NavigationFilter(start, gyro=[GYRO] * 3).status == "no heading"


def test_fixes_on_another_clock_are_told():
    drive = zr.simulate_drive(50.0, 40.0, seed=1)
    start = zr.align(drive.recording(), latitude=48.0, heading="course", span=(0.0, 20.0))
    track = zr.NavigationFilter(start).process(drive.recording(), drive.fixes.shifted(1.7e9))
    assert track.notes[0].startswith("none of the fixes is used: they are from 1700000000")
    assert "time_offset= moves them" in track.notes[0]


def at_null_island(fixes, count, first=40):
    """Fixes of a receiver that has lost its position, and writes 0, 0, but knows its velocity."""
    position = fixes.position.copy()
    position[first : first + count, :2] = 0.0
    return replace(fixes, position=position)


def test_a_fix_whose_position_is_rejected_is_not_used():
    drive, nav, track = driven()
    nav.reset()
    spoilt = nav.process(drive.recording(), at_null_island(drive.fixes, 10))
    assert spoilt.fix_count["rejected"] == track.fix_count["rejected"] + 10
    assert spoilt.fix_count["used"] == track.fix_count["used"] - 10
    assert spoilt.rejected_count == {"positions": 10, "velocities": 0}
    assert (nav.rejected_count, nav.move_count, nav.last_move) == (spoilt.rejected_count, 0, None)
    assert re.search(r"positions rejected +10\n", spoilt.table())
    assert not any("in a row" in note for note in spoilt.notes)
    assert horizontal(spoilt, drive, drive.time > 60.0) < 3.0


def test_a_filter_that_gives_way_says_so():
    drive, nav, _ = driven()
    nav.reset()
    track = nav.process(drive.recording(), at_null_island(drive.fixes, 12))
    assert nav.move_count == 2  # there and back
    assert track.rejected_count["positions"] >= 20
    (note,) = [note for note in track.notes if "in a row" in note]
    assert "ten positions in a row were rejected" in note
    assert re.search(r"moved to them, 5\d{3} km away, the last of 2 times", note)
    assert note in track.table().replace("\n  ", " ")
