"""Allan covariances of gyros side by side, and the weights and gains that follow from them."""

import numpy as np
import pytest

import zerorate as zr
from support.checks import assert_covariance
from support.recordings import RECORDINGS, needs_recordings
from zerorate.array.virtual_gyro import Noise, drift_weights, fit_noise
from zerorate.record import Log

RATE = 50.0
RNG = np.random.default_rng(1)
MIXED = RNG.standard_normal((400, 3)) @ [[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.3, 2.0]]
# Sums and products of 400 numbers of about 1.
ROUNDING = {"rtol": 1e-11, "atol": 1e-13}


def naive(z, m):
    """The mean of products of differences between neighbouring means, over two, term by term."""
    total, count = np.zeros((z.shape[1],) * 2), 0
    for start in range(len(z) - 2 * m + 1):
        both = z[start : start + 2 * m]
        if np.isfinite(both).all():
            difference = both[m:].mean(axis=0) - both[:m].mean(axis=0)
            total += np.outer(difference, difference) / 2.0
            count += 1
    return (total / count if count else np.full_like(total, np.nan)), count


def walks(drift, seconds, seed, white=10.0):
    """Gyros of white noise and random walks whose increments have a covariance, at 1 Hz."""
    rng = np.random.default_rng(seed)
    steps = rng.standard_normal((seconds, len(drift))) @ np.linalg.cholesky(drift).T
    return np.cumsum(steps, axis=0) + white * rng.standard_normal(steps.shape)


def alike(sizes, correlation=0.5):
    n = len(sizes)
    return ((1.0 - correlation) * np.eye(n) + correlation) * np.outer(sizes, sizes)


def gain(weights, covariance):
    return np.sqrt(covariance.mean() / (weights @ covariance @ weights))


def least(covariance):
    weights = np.linalg.solve(covariance, np.ones(len(covariance)))
    return weights / weights.sum()


@pytest.mark.parametrize("taus", ["octave", "decade", "all", [0.02, 0.3, 2.0]])
@pytest.mark.parametrize("gaps", [[], [(0, 0)], [(60, 0), (61, 1), (150, 2)]])
def test_it_is_the_definition(taus, gaps):
    z = MIXED[:200].copy()
    for place in gaps:
        z[place] = np.nan
    z += 1e3  # an offset, which costs no precision
    r = zr.array.allan_covariance(z, RATE, taus)
    expected = [naive(z, round(tau * RATE)) for tau in r.tau]
    np.testing.assert_array_equal(r.term_count, [count for _, count in expected])
    # The offset is a thousand times the noise: of its digits three are gone in the naive means.
    np.testing.assert_allclose(r.matrix, [matrix for matrix, _ in expected], rtol=1e-8, atol=1e-10)
    assert r.seconds == (200 - len(gaps)) / RATE


def test_the_diagonal_is_that_of_allan():
    r, alone = zr.array.allan_covariance(MIXED, RATE), zr.allan(MIXED, RATE)
    np.testing.assert_array_equal(r.tau, alone.taus)
    np.testing.assert_allclose(np.einsum("tii->ti", r.matrix), alone.deviation**2, **ROUNDING)
    np.testing.assert_array_equal(r.edf, np.median(alone.edf, axis=1))
    np.testing.assert_array_equal(r.term_count, alone.term_count[:, 0])


def test_a_gap_of_one_is_a_gap_of_all():
    z = MIXED.copy()
    z[[50, 51, 300], [0, 1, 1]] = [np.nan, np.inf, -np.inf]
    common = np.where(np.isfinite(z).all(axis=1)[:, None], z, np.nan)
    r, alone = zr.array.allan_covariance(z, RATE), zr.allan(common, RATE)
    np.testing.assert_allclose(np.einsum("tii->ti", r.matrix), alone.deviation**2, **ROUNDING)
    np.testing.assert_array_equal(r.term_count, alone.term_count[:, 0])
    np.testing.assert_array_equal(r.matrix, zr.array.allan_covariance(common, RATE).matrix)
    assert r.seconds == 397 / RATE
    assert r.notes == (
        "gyro 1: 1 of 400 samples are missing",
        "gyro 2: 2 of 400 samples are missing",
        "at 3 of 400 samples a gyro is missing",
        "gaps leave no term from 2.56 s on: bridge= fills short ones",
    )
    for matrix in r.matrix[r.term_count > 0]:
        assert_covariance(matrix)


def test_short_gaps_are_bridged_as_those_of_allan():
    z = MIXED.copy()
    z[100:103, 0] = z[101:105, 1] = z[:2, 2] = np.nan
    r, alone = zr.array.allan_covariance(z, RATE, bridge=3), zr.allan(z, RATE, bridge=3)
    # What is left is the gap of the second and the beginning, as in the first and third alone.
    np.testing.assert_array_equal(r.term_count <= alone.term_count.min(axis=1), True)
    filled = z.copy()
    filled[99:104, 0] = np.linspace(z[99, 0], z[103, 0], 5)
    np.testing.assert_allclose(r.matrix, zr.array.allan_covariance(filled, RATE).matrix, **ROUNDING)
    assert r.notes[0].endswith("gaps of up to 3 are bridged")


def test_gaps_that_leave_nothing_are_said():
    z = MIXED.copy()
    z[19::20, 1] = np.nan  # stretches of 19: two means of 8 samples fit, two of 16 do not
    r = zr.array.allan_covariance(z, RATE)
    assert np.isnan(r.matrix[4:]).all()
    assert np.isnan(r.edf[4:]).all()
    assert np.isfinite(r.matrix[:4]).all()
    assert r.notes[-1] == "gaps leave no term from 0.32 s on: bridge= fills short ones"


@pytest.mark.parametrize("n", [2, 3, 5, 64, 400])
def test_matrices_are_covariances(n):
    r = zr.array.allan_covariance(MIXED[:n], RATE)
    for matrix in r.matrix:
        assert_covariance(matrix)
    assert np.nanmax(np.abs(r.correlation)) <= 1.0
    np.testing.assert_allclose(np.einsum("tii->ti", r.correlation), 1.0, rtol=1e-14)


def test_correlation_is_found():
    rng = np.random.default_rng(2)
    common, own = rng.standard_normal((20_000, 1)), rng.standard_normal((20_000, 4))
    r = zr.array.allan_covariance(common + own, RATE, [0.02, 0.1])
    off = r.correlation[:, ~np.eye(4, dtype=bool)]
    # Half the variance is common; the error of one is (1 - 0.5²) / sqrt(edf), edf above 2700.
    np.testing.assert_allclose(off, 0.5, atol=4 * 0.75 / np.sqrt(r.edf.min()))
    np.testing.assert_allclose(np.einsum("tii->ti", r.matrix)[0], 2.0, rtol=0.06)


LONG = walks(alike([1.0, 1.0, 2.0, 0.5]), 14_400, seed=1)
FOUND = zr.array.allan_covariance(LONG, 1.0)


@pytest.mark.parametrize("weights", ["drift", "white"])
def test_the_order_of_gyros_does_not_matter(weights):
    order = [2, 0, 3, 1]
    r = zr.array.allan_covariance(LONG[:, order], 1.0)
    np.testing.assert_allclose(r.matrix, FOUND.matrix[:, order][:, :, order], rtol=1e-9, atol=1e-12)
    there, here = FOUND.virtual_gyro(weights=weights), r.virtual_gyro(weights=weights)
    np.testing.assert_allclose(here.weights, there.weights[order], rtol=1e-7, atol=1e-9)
    assert here.gain == pytest.approx(there.gain, rel=1e-7)
    assert here.gain_error == pytest.approx(there.gain_error, rel=1e-6)


@pytest.mark.parametrize("factor", [-1.0, np.pi / 180.0, 1e-150, 1e150])
@pytest.mark.parametrize("weights", ["drift", "white", "mean"])
def test_units_do_not_matter(factor, weights):
    r = zr.array.allan_covariance(factor * LONG, 1.0)
    np.testing.assert_allclose(r.matrix / factor / factor, FOUND.matrix, rtol=1e-9)
    there, here = FOUND.virtual_gyro(weights=weights), r.virtual_gyro(weights=weights)
    np.testing.assert_allclose(here.weights, there.weights, rtol=1e-7, atol=1e-9)
    assert (here.gain, here.gain_error) == pytest.approx((there.gain, there.gain_error), rel=1e-6)


def test_the_unit_of_time_does_not_matter_beyond_the_shrinkage():
    """Twice the rate is half the averaging times; the mean's gain over them is the same."""
    r = zr.array.allan_covariance(LONG, 2.0)
    np.testing.assert_array_equal(r.tau, FOUND.tau / 2.0)
    np.testing.assert_array_equal(r.matrix, FOUND.matrix)
    assert r.seconds == 7200.0
    np.testing.assert_allclose(
        r.virtual_gyro(weights="white").weights, FOUND.virtual_gyro(weights="white").weights
    )


def test_exact_covariances_give_exact_noise():
    tau = 2.0 ** np.arange(12)
    R, Q = alike([3.0, 2.0, 5.0], 0.1), 1e-3 * alike([1.0, 2.0, 0.3], 0.7)
    matrix = R / tau[:, None, None] + Q * tau[:, None, None] / 3.0
    noise = fit_noise(tau, matrix, 1e4 / tau)
    # Of least squares whose two terms differ by 4^11 in size.
    np.testing.assert_allclose(noise.white, R, rtol=1e-8)
    np.testing.assert_allclose(noise.drift, Q, rtol=1e-8)
    np.testing.assert_allclose(drift_weights(noise, 0.0), least(Q), rtol=1e-7)
    np.testing.assert_allclose(drift_weights(noise, 0.0, 1e-6), least(R), rtol=1e-7)
    at = R / 60.0 + Q * 60.0 / 3.0
    np.testing.assert_allclose(drift_weights(noise, 0.0, 60.0), least(at), rtol=1e-7)
    np.testing.assert_allclose(drift_weights(noise, 1.0), least(np.diag(np.diag(Q))), rtol=1e-7)


def test_noise_at_a_horizon_keeps_its_proportions():
    noise = Noise(np.eye(2), 2.0 * np.eye(2))
    for horizon in (1e-3, 1.0, 60.0, 1e6):
        exact = np.eye(2) / horizon + 2.0 * np.eye(2) * horizon / 3.0
        ratio = noise.at(horizon)[0, 0] / exact[0, 0]
        np.testing.assert_allclose(noise.at(horizon), ratio * exact)
    np.testing.assert_array_equal(noise.at(np.inf), noise.drift)
    np.testing.assert_array_equal(noise.at(1e-300), noise.white)


def test_drift_too_weak_to_be_seen_does_not_draw_all_the_weight():
    """A gyro without drift beside three that have some: its drift is what could be seen at most."""
    drift = np.diag([1.0, 1.0, 1.0, 1e-12])
    found = zr.array.allan_covariance(walks(drift, 14_400, seed=3), 1.0).virtual_gyro(np.inf)
    assert 0.9 < found.weights[3] < 1.0
    assert np.all(np.abs(found.weights[:3]) < 0.1)


@pytest.mark.parametrize("seed", range(3))
def test_when_correlation_pays(seed):
    """Four gyros whose walks correlate by a half: by an hour all of it pays, by four nearly all."""
    drift = alike([0.6, 1.0, 1.0, 1.7])
    true = gain(least(drift), drift)
    own = gain(least(np.diag(np.diag(drift))), drift)
    assert (round(own, 2), round(true, 2)) == (1.29, 1.49)
    reached = []
    for seconds in (600, 3600, 14_400, 57_600):
        r = zr.array.allan_covariance(walks(drift, seconds, 10 + seed), 1.0)
        noise = fit_noise(r.tau, r.matrix, r.edf)
        weights = drift_weights(noise, 4 / (4 + seconds / 256.0))
        reached.append(gain(weights, drift) / true)
    # Medians of the study are 0.72, 0.96, 0.97, 0.99 of what the truth would give.
    assert np.all(np.array(reached) > [0.5, 0.87, 0.93, 0.97])
    assert reached[3] * true > own
    assert max(reached) <= 1.0


@pytest.mark.every(3)
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("horizon", [20.0, 60.0, np.inf])
def test_the_gain_is_that_of_the_weights_within_its_error(seed, horizon):
    """Also of many gyros, whose gain on the record that they were weighed on is too good."""
    rng = np.random.default_rng(seed)
    mixture = rng.standard_normal((8, 9))
    drift = mixture @ mixture.T / 9.0
    found = zr.array.allan_covariance(walks(drift, 14_400, seed), 1.0).virtual_gyro(horizon)
    noise = drift + 100.0 * np.eye(8) * 3.0 / horizon / horizon
    assert found.weights.sum() == pytest.approx(1.0, abs=1e-12)
    assert found.shrinkage == 8 / (8 + 14_400 / 256)
    assert found.horizon == horizon
    assert abs(found.gain - gain(found.weights, noise)) < 3.0 * found.gain_error
    assert found.gain_error < 0.25 * found.gain


def test_white_weights_are_those_of_the_variances():
    sizes = np.array([1.0, 2.0, 3.0, 0.5])
    z = sizes * np.random.default_rng(5).standard_normal((40_000, 4))
    found = zr.array.allan_covariance(z, RATE).virtual_gyro(1.0, weights="white")
    expected = sizes**-2.0 / np.sum(sizes**-2.0)
    # Variances of which no averaging time counts for more than 200 degrees of freedom.
    np.testing.assert_allclose(found.weights, expected, atol=0.05)
    true = np.sqrt(np.mean(sizes**2) / 4.0 / (found.weights**2 @ sizes**2))
    assert abs(found.gain - true) < 4.0 * found.gain_error
    assert found.gain_error < 0.05


def test_the_plain_mean_asks_for_nothing():
    found = zr.array.allan_covariance(np.ones((2, 5)), RATE).virtual_gyro(weights="mean")
    np.testing.assert_array_equal(found.weights, np.full(5, 0.2))
    assert (found.gain, found.gain_error, found.shrinkage) == (1.0, 0.0, 1.0)


def test_one_gyro_and_copies_of_one():
    one = zr.array.allan_covariance(LONG[:, :1], 1.0).virtual_gyro()
    np.testing.assert_array_equal(one.weights, [1.0])
    assert one.gain == 1.0
    twice = zr.array.allan_covariance(np.repeat(LONG[:, :1], 2, axis=1), 1.0)
    for weights in ("drift", "white"):
        for horizon in (1e-3, 60.0, np.inf):
            found = twice.virtual_gyro(horizon, weights)
            np.testing.assert_allclose(found.weights, 0.5, rtol=1e-9)
            assert found.gain == pytest.approx(1.0, rel=1e-9)


def test_missing_samples_shorten_the_record():
    z = LONG.copy()
    z[::200, 1] = np.nan
    r = zr.array.allan_covariance(z, 1.0, bridge=1)
    assert r.seconds == 14_399.0  # nothing is before the first sample
    np.testing.assert_allclose(r.virtual_gyro().weights, FOUND.virtual_gyro().weights, atol=0.02)
    z[5000:9000, 0] = np.nan
    r = zr.array.allan_covariance(z, 1.0, bridge=1)
    assert r.seconds == 10_399.0
    np.testing.assert_allclose(r.virtual_gyro().weights, FOUND.virtual_gyro().weights, atol=0.1)
    z[3000:, 0] = np.nan
    with pytest.raises(ValueError, match=r"need 1 h at rest \(3600 s\), this record holds 2999"):
        zr.array.allan_covariance(z, 1.0, bridge=1).virtual_gyro()


def test_a_log_brings_rate_unit_and_names():
    log = Log(np.arange(400) / RATE, RATE, MIXED, ["imu1_x", "imu2_x", "imu3_x"], "deg/s")
    r = zr.array.allan_covariance(log)
    assert (r.rate, r.unit, r.names) == (RATE, "deg/s", ("imu1_x", "imu2_x", "imu3_x"))
    np.testing.assert_array_equal(r.matrix, zr.array.allan_covariance(MIXED, RATE).matrix)
    assert zr.array.allan_covariance(log, names=list("abc")).names == ("a", "b", "c")
    assert repr(r) == "AllanCovariance(3 gyros at 8 averaging times, 0.02 to 2.56 s, 8 s of record)"


def test_the_record_of_the_caller_stays_as_it_is():
    z = MIXED.copy()
    z[5, 0] = np.inf
    before = z.tobytes()
    zr.array.allan_covariance(z, RATE, bridge=2)
    assert z.tobytes() == before


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: zr.array.allan_covariance(np.ones((9, 2, 3)), RATE),
            r"one axis at a time, z\[:, :, 0\]",
        ),
        (
            lambda: zr.array.allan_covariance(np.ones(9), RATE),
            r"shape \(n, N\), a column .*got \(9,\)",
        ),
        (lambda: zr.array.allan_covariance(np.ones((9, 0)), RATE), r"got \(9, 0\)"),
        (lambda: zr.array.allan_covariance(MIXED[:1], RATE), "needs 2 samples"),
        (lambda: zr.array.allan_covariance(MIXED, 0.0), "rate must be a positive finite number"),
        (lambda: zr.array.allan_covariance(MIXED, RATE, [9.0]), "tau 9 s is beyond this record"),
        (lambda: zr.array.allan_covariance(MIXED, RATE, bridge=-1), "bridge must not be negative"),
        (lambda: zr.array.allan_covariance(MIXED, RATE, unit="m"), "unknown unit"),
        (
            lambda: zr.array.allan_covariance(MIXED, RATE, names=["a", "b"]),
            "one entry a gyro: 3, got 2",
        ),
        (lambda: zr.array.allan_covariance(MIXED * [1, np.nan, 1], RATE), "gyro 2 holds no finite"),
        (
            lambda: zr.array.allan_covariance([[1.0, None], [None, 1.0]], RATE),
            "no sample time has data of every gyro",
        ),
        (lambda: FOUND.virtual_gyro(0.0), "horizon must be a positive time"),
        (lambda: FOUND.virtual_gyro(np.nan), "horizon must be a positive time"),
        (lambda: FOUND.virtual_gyro(weights="auto"), "known: drift, white, mean"),
        (
            lambda: zr.array.allan_covariance(LONG[:3599], 1.0).virtual_gyro(),
            r"drift weights of 4 gyros need 1 h at rest \(3600 s\), this record holds 3599 s: "
            "drift is slow, and weights from the chance correlations of a shorter record",
        ),
        (
            lambda: zr.array.allan_covariance(LONG, 1.0, [600.0]).virtual_gyro(),
            "two averaging times",
        ),
        (
            lambda: zr.array.allan_covariance(LONG, 1.0, [2000.0, 4000.0]).virtual_gyro(),
            "fit twice into an eighth of the record",
        ),
        (
            lambda: zr.array.allan_covariance(LONG * [1, 0, 1, 1], 1.0).virtual_gyro(),
            "gyro 2 does not vary",
        ),
        (
            lambda: zr.array.allan_covariance(LONG[:, :1] * [1, -1], 1.0).virtual_gyro(),
            "the mean of the gyros does not vary",
        ),
    ],
)
def test_what_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@needs_recordings
def test_the_array_on_one_board():
    """White noise of eight gyros has nothing in common; ten minutes are too few for their drift."""
    recording = zr.read_recording(RECORDINGS / "mimu4444_array8_62hz_exp1.parquet")
    logs = [log for name, log in recording.items() if name.startswith("gyro")]
    # Those below the board read x, y, z of the first as -y, -x, -z.
    z = np.stack([-log.data[:, [1, 0, 2]] if i % 2 else log.data for i, log in enumerate(logs)], 1)
    moves = np.any(np.abs(z - np.nanmedian(z, axis=0)) > 2.0, axis=(1, 2))
    moves = np.convolve(moves, np.ones(125), "same") > 0.5
    z[moves] = np.nan
    for axis in range(3):
        r = zr.array.allan_covariance(z[:, :, axis], logs[0].rate)
        off = ~np.eye(8, dtype=bool)
        assert np.abs(np.median(r.correlation[0][off])) < 0.03
        found = r.virtual_gyro(0.1, weights="white")
        # What the deviations at 0.1 s say of these weights, which were found on the same record.
        there = np.argmin(np.abs(r.tau - 0.1))
        expected = gain(found.weights, r.matrix[there])
        assert abs(found.gain - expected) < 3.0 * found.gain_error + 0.03
        assert found.gain > 1.08
        with pytest.raises(ValueError, match="8 gyros need 2 h"):
            r.virtual_gyro()
