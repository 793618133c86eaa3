"""What real logs have: outliers, a stuck sensor, the end of its range, a start in motion."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import zerorate as zr
from support.checks import assert_same_bits
from support.recordings import column, needs_recordings
from support.settings import METHODS
from support.signals import white

RATE = 100.0
NOISE, BIAS = 0.1, 0.5
DEG = np.pi / 180.0


def at_rest(n, seed=1):
    return BIAS + NOISE * white(n, seed=seed)


def auto(**options):
    return zr.DriftFilter(RATE, **{"output": "estimate", **options})


def spoilt(z, share, size, *, one_sided, seed=2):
    """Return the record with a share of its samples so many deviations off."""
    random = np.random.default_rng(seed)
    hit = random.random(z.size) < share
    sign = 1.0 if one_sided else random.choice([-1.0, 1.0], z.size)
    return np.where(hit, z + sign * size * NOISE, z)


@pytest.mark.parametrize("one_sided", [False, True])
@pytest.mark.parametrize(("share", "size"), [(0.001, 100.0), (0.01, 10.0), (0.05, 100.0)])
def test_outliers_cost_little(share, size, one_sided):
    z = at_rest(60_000)
    error, spoilt_error = (
        np.sqrt(np.mean((auto().process(record)[6000:] - BIAS) ** 2))
        for record in (z, spoilt(z, share, size, one_sided=one_sided))
    )
    # A twentieth of the samples is lost, and what remains is told from outliers by four deviations.
    assert spoilt_error < 1.25 * error + 1e-4


def test_outliers_are_counted():
    z = at_rest(60_000)
    f = auto()
    f.process(spoilt(z, 0.01, 100.0, one_sided=True))
    hits = np.count_nonzero(np.random.default_rng(2).random(z.size) < 0.01)
    # None of the first quarter second, and 6e-5 of all others beyond four deviations.
    assert hits - 5 <= f.outlier_count <= hits + 15
    clean = auto()
    clean.process(z)
    assert clean.outlier_count <= 15


@pytest.mark.parametrize("method", METHODS)
def test_published_methods_reject_outliers_if_asked(method):
    z = at_rest(30_000)
    # Once a thousand samples, far from any other.
    dirty = np.where(np.arange(z.size) % 1000 == 999, z + 100.0 * NOISE, z)
    missing = np.where(dirty != z, np.nan, z)
    rejecting = zr.DriftFilter(RATE, method=method, outliers="reject", output="estimate")
    got = rejecting.process(dirty)
    keeping = zr.DriftFilter(RATE, method=method, output="estimate")
    kept = keeping.process(dirty)
    expected = zr.DriftFilter(RATE, method=method, outliers="reject", output="estimate").process(
        missing
    )
    settled = slice(3000, None)
    # Not the same: a rejected sample counts in how many lie within one deviation, so that here and
    # there one of four deviations is an outlier to one of them only.
    assert np.sqrt(np.mean((got - expected)[settled] ** 2)) < 0.05 * NOISE
    assert np.max(np.abs(kept - expected)[settled]) > NOISE
    assert (rejecting.outlier_count >= 28, keeping.outlier_count) == (True, 0)


@pytest.mark.parametrize("samples", [1, 2, 3])
def test_a_few_samples_far_off_do_not_move_the_bias(samples):
    z = at_rest(20_000)
    z[10_000:10_025] = np.nan
    z[10_010 : 10_010 + samples] = 350.0
    trace = auto().trace(z)
    assert np.ptp(trace.bias[9990:10_100]) < 5.0 * trace.bias_sigma[9990]
    # Where more of them arrive it is motion, and waits for rest.
    z[10_025:10_050] = np.nan
    z[10_030:10_033] = 350.0
    trace = auto().trace(z)
    assert np.ptp(trace.bias[9990:10_100]) < 5.0 * trace.bias_sigma[9990]


def test_a_sensor_that_gives_few_samples_is_learned_from():
    z = at_rest(60_000)
    sparse = np.full_like(z, np.nan)
    sparse[::12] = z[::12]
    f = auto()
    trace = f.trace(sparse)
    # Two or three a tick; they are judged together, at half the pace at most.
    assert abs(trace.bias[-1] - BIAS) < 4.0 * NOISE / np.sqrt(sparse[::12].size)
    sparse[30_000:] += 1.0
    moved = auto().trace(sparse)
    assert abs(moved.bias[-1] - BIAS - 1.0) < 0.05


@pytest.mark.parametrize("value", ["zero", "last"])
def test_a_stuck_sensor_is_told_and_left_out(value):
    z = at_rest(60_000)
    z[30_000:31_000] = 0.0 if value == "zero" else z[29_999]
    f = auto()
    trace = f.trace(z)
    # Four samples at least, some more while little is known of the sensor's resolution.
    assert not trace.stuck[:30_000].any()
    assert not trace.stuck[31_000:].any()
    assert trace.stuck[30_010:31_000].all()
    assert f.stuck_count >= 990
    assert f.status == "at rest"
    assert np.max(np.abs(trace.bias[30_000:] - BIAS)) < 0.01
    f.reset()
    f.process(z[:30_500])
    assert f.status == "stuck"
    assert f.stuck


@pytest.mark.parametrize("method", [*METHODS, "robust"])
def test_a_published_filter_that_holds_leaves_a_stuck_sensor_out(method):
    """Once: neither does it learn from it, nor is any sample counted as an outlier, too."""
    z = at_rest(20_000)
    z[10_000:10_300] = z[9_999] + 30.0 * NOISE
    clean, missing = z.copy(), z.copy()
    clean[10_000:10_300] = missing[10_000:10_300] = np.nan
    f = zr.DriftFilter(RATE, method=method, motion="hold", output="estimate")
    trace = f.trace(z)
    assert f.stuck_count == 300 - 25 * (f.stuck_count < 300)
    assert f.outlier_count + f.stuck_count + f.saturated_count <= 310
    assert trace.stuck[10_030:10_300].all()
    # What it took until that was known is forgotten within a second.
    other = zr.DriftFilter(RATE, method=method, motion="hold", output="estimate").trace(missing)
    assert np.max(np.abs(trace.bias[10_500:] - other.bias[10_500:])) < NOISE


def test_a_filter_that_keeps_outliers_counts_none():
    z = spoilt(at_rest(20_000), 0.02, 100.0, one_sided=False)
    for outliers in ("keep", "reject"):
        f = zr.DriftFilter(RATE, method="kf", motion="hold", outliers=outliers)
        f.process(z)
        assert (f.outlier_count > 0) == (outliers == "reject")


@pytest.mark.parametrize("step", [0.02, 0.1, 0.3, 1.0, 3.0])
@pytest.mark.parametrize("offset", [0.0, 0.31, 0.5])
def test_a_coarse_sensor_is_not_stuck(step, offset):
    z = step * np.round((at_rest(120_000) - BIAS) / step + offset)
    trace = auto().trace(z)
    assert not trace.stuck.any()
    assert trace.at_rest[1000:].all()


@pytest.mark.parametrize("method", [*METHODS, "auto"])
def test_a_saturated_sample_is_missing(method):
    z = at_rest(6000)
    z[2000:2100] = 250.0
    z[3000] = -250.0
    options = {"method": method, "output": "compensated", "channels": 1}
    f = zr.DriftFilter(RATE, limit=250.0, **options)
    beyond = np.abs(z) >= 250.0
    got = f.process(z[:, np.newaxis])
    expected = zr.DriftFilter(RATE, limit=1e9, **options).process(
        np.where(beyond, np.nan, z)[:, np.newaxis]
    )
    assert_same_bits(got, expected)
    assert np.isnan(got[beyond, 0]).all()
    assert f.saturated_count[0] == 101
    trace = zr.DriftFilter(RATE, limit=250.0, **options).trace(z[:, np.newaxis])
    np.testing.assert_array_equal(trace.saturated[:, 0], beyond)
    np.testing.assert_array_equal(trace.missing[:, 0], beyond)


@pytest.mark.parametrize("name", ["limit", "rest_limit", "bias_limit"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_a_limit_is_a_positive_number(name, value):
    with pytest.raises(ValueError, match=f"^{name} must be a positive number, got"):
        auto(**{name: value})


def test_a_level_beyond_the_limit_is_no_bias():
    z = at_rest(60_000)
    z[20_000:50_000] -= 90.0
    taken, refused = auto().trace(z), auto(bias_limit=20.0).trace(z)
    assert np.min(taken.bias) < -80.0
    assert np.max(np.abs(refused.bias - BIAS)) < 0.1
    assert not refused.at_rest[20_100:49_900].any()


def test_a_steady_turn_from_the_start():
    z = 30.0 + at_rest(12_000)
    unlimited, limited = auto().trace(z), auto(bias_limit=20.0).trace(z)
    error = np.abs(unlimited.bias - BIAS)
    # Nothing tells it from a bias; for a minute the deviation says so.
    assert error.max() > 29.0
    assert np.all(unlimited.bias_sigma[:5900] >= error[:5900])
    assert np.all(limited.bias == 0.0)
    assert np.all(limited.bias_sigma >= 29.0)


def test_rest_is_provisional_until_something_else_is_seen():
    z = at_rest(12_000)
    f = auto()
    statuses = []
    for begin in range(0, z.size, 100):
        f.process(z[begin : begin + 100])
        statuses.append(f.status)
    assert statuses[1:58] == ["provisional"] * 57
    assert set(statuses[62:]) == {"at rest"}
    z[2000:2500] += 30.0 * np.sin(np.arange(500) / 10.0)
    f.reset()
    f.process(z[:3500])
    assert f.status == "at rest"


def test_what_is_learned_while_provisional_is_what_was_learned_before():
    z = at_rest(12_000)
    bias, ignored = auto().process(z), auto(motion="ignore").process(z)
    assert_same_bits(bias, ignored)
    sigma = auto().trace(z).bias_sigma, auto(motion="ignore").trace(z).bias_sigma
    proven = np.flatnonzero(sigma[0] < BIAS)[0]
    assert 5900 <= proven <= 6200
    assert_same_bits(sigma[0][proven:], sigma[1][proven:])


def test_a_quieter_level_is_believed_at_once():
    """A record that begins on a shaking vehicle which then stops."""
    z = at_rest(6000)
    z[:2000] += 30.0 + 5.0 * white(2000, seed=3)
    trace = auto().trace(z)
    assert trace.bias[1900] == pytest.approx(30.5, abs=1.0)
    assert np.all(np.abs(trace.bias[2400:] - BIAS) < 0.1)


def swings():
    """Motions of sensors that are never still, by name, deg/s at 100 Hz for a minute."""
    t = np.arange(6000) / RATE
    tremor = np.convolve(white(6050, seed=5), np.ones(51) / np.sqrt(51.0), "valid")
    return {
        "rate table": 2.0 * np.sin(0.6 * t + 1.0),
        "fast table": 100.0 * np.sin(1.6 * t + 1.0),
        "hand": 60.0 * tremor,
        "slow hand": 10.0 * tremor,
        "walking": 40.0 * np.sin(11.3 * t) + 15.0 * np.sin(5.65 * t + 1.0) + 4.0 * tremor,
    }


@pytest.mark.parametrize("name", swings())
def test_a_start_in_motion(name):
    motion = swings()[name]
    z = at_rest(motion.size + 3000)
    z[: motion.size] += motion
    trace = auto(rest_limit=10.0).trace(z)
    moving, resting = slice(None, motion.size), slice(motion.size, None)
    assert trace.at_rest[moving].mean() <= 0.02
    assert np.max(np.abs(trace.bias - BIAS)) <= BIAS + 0.5
    assert np.flatnonzero(trace.at_rest[resting])[0] <= 3.0 * RATE
    assert abs(trace.bias[-1] - BIAS) < 0.01


def test_a_start_at_rest_within_limits():
    z = at_rest(6000)
    f = auto(rest_limit=10.0, bias_limit=20.0)
    trace = f.trace(z)
    # Nothing is taken off until it has been still for nine ticks.
    assert np.all(trace.bias[:224] == 0.0)
    assert not trace.at_rest[:224].any()
    assert trace.at_rest[225:].all()
    assert f.status == "at rest"
    assert np.all(np.abs(trace.bias[225:] - BIAS) < 5.0 * trace.bias_sigma[225:])
    assert np.all(trace.bias_sigma[:224] >= BIAS)


def test_a_scale_proved_wrong_within_limits_is_learned_anew():
    """A rest of far too little noise: the sensor was not yet on."""
    z = at_rest(30_000)
    z[:2000] = 1e-9 * white(2000, seed=4)
    f = auto(rest_limit=10.0)
    f.process(z)
    assert f.status == "at rest"
    assert abs(f.bias - BIAS) < 0.01


def broad():
    """Return rates in deg/s, whether the sensor moves, and the samples a second."""
    name = "broad_05_undisturbed_slow_rotation_with_breaks_B"
    rates = np.column_stack([column(name, f"gyro_{axis}_radps") for axis in "xyz"])
    return rates.astype(float) / DEG, column(name, "movement").astype(bool), 2000.0 / 7.0


@needs_recordings
def test_starts_in_the_middle_of_hand_motion():
    z, moves, rate = broad()
    bias = z[: int(34 * rate)].mean(axis=0)
    edges = np.flatnonzero(np.diff(moves.astype(int))) + 1
    for first, last in edges.reshape(-1, 2):
        start = (first + last) // 2
        f = zr.DriftFilter(rate, method="auto", channels=3, rest_limit=10.0)
        trace = f.trace(z[start:])
        assert np.all(trace.at_rest[moves[start:]].mean(axis=0) <= 0.02)
        assert np.all(np.abs(trace.bias - bias) <= np.abs(bias) + 0.5)
        found = [np.flatnonzero(axis)[0] for axis in trace.at_rest[last - start :].T]
        assert max(found) <= 3.0 * rate
        assert np.all(np.abs(trace.bias[-1] - bias) < 0.02)


@needs_recordings
@pytest.mark.parametrize("start", range(50, 1400, 150))
def test_starts_on_a_shaft_that_never_rests(start):
    z = column("mpu6050_encoder_yaw_slow_100hz", "shaft_gyro_z_dps")[start * 100 :]
    trace = auto(rest_limit=10.0).trace(z)
    assert trace.at_rest.mean() <= 0.02
    assert np.max(np.abs(trace.bias)) <= 0.5


@given(
    kind=st.sampled_from(["step", "ramp", "slow", "fast", "noise"]),
    size=st.sampled_from([0.3, 1.0, 5.0, 50.0]),
    share=st.sampled_from([0.0, 0.01, 0.05]),
    seed=st.integers(0, 1000),
    limits=st.sampled_from([{}, {"rest_limit": 10.0}, {"bias_limit": 100.0}]),
)
def test_it_always_comes_back(kind, size, share, seed, limits):
    n, t = 12_000, np.arange(6000) / RATE
    z = at_rest(n + 12_000, seed=seed)
    level = BIAS
    if kind in ("step", "ramp"):
        level += size
        z[n:] += size * (1.0 if kind == "step" else np.minimum(np.arange(12_000) / 1000.0, 1.0))
    elif kind == "noise":
        z[n : n + 6000] += size * white(6000, seed=seed + 1)
    else:
        z[n : n + 6000] += size * np.sin((0.3 if kind == "slow" else 9.0) * t)
    f = auto(**limits)
    f.process(spoilt(z, share, 30.0, one_sided=bool(seed % 2), seed=seed))
    assert abs(f.bias - level) < 0.1
