"""Arrays of gyros: their twin, laws, faults and what is refused."""

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import oracle
import zerorate as zr
from support.checks import assert_same_bits
from zerorate.calibration import Calibration

RATE = 20.0
TURN = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
SLANTED = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])


def body(n, sensors, seed, rate=RATE, *, motion=True):
    """Return true rates (n, 3) and samples (n, sensors, 3): rest, then waves between rests."""
    rng = np.random.default_rng(seed)
    t = np.arange(n) / rate
    turning = (t % 40.0 > 20.0) & motion
    waves = 30.0 * np.sin(2.0 * np.pi * t[:, np.newaxis] * [0.7, 0.43, 0.9])
    true = np.where(turning[:, np.newaxis], waves, 0.0)
    scale = 1.0 + 0.005 * rng.standard_normal((sensors, 3))
    noise = 0.1 * (0.5 + rng.random((sensors, 3)))
    bias = rng.standard_normal((sensors, 3))
    return true, true[:, np.newaxis] * scale + bias + noise * rng.standard_normal((n, sensors, 3))


def seen_by(rotations, z):
    """Return what sensors that are mounted so give."""
    return np.einsum("sji,nsj->nsi", rotations, z)


def hostile(rng, n, sensors):
    """Return samples of which any part may be anything."""
    z = body(n, sensors, int(rng.integers(2**32)))[1]
    wild = [np.nan, np.inf, -1e150, 1e150, 1e300, 5e-324, 0.0]
    for _ in range(rng.integers(6)):
        begin, end = np.sort(rng.integers(0, n, 2))
        z[begin:end, rng.integers(sensors), rng.integers(3)] = rng.choice(wild)
    return z


@pytest.mark.every(2)
@pytest.mark.parametrize("weights", ["auto", "mean", "white"])
@pytest.mark.parametrize("rotated", [False, True])
@settings(max_examples=settings.default.max_examples // 5)
@given(st.integers(0, 2**32), st.integers(2, 5))
def test_the_twin_agrees(rotated, weights, seed, sensors):
    rng = np.random.default_rng(seed)
    _, z = body(900, sensors, seed)
    rotations = np.stack([(np.eye(3), TURN, SLANTED)[k % 3] for k in range(sensors)])
    arguments = {"limit": 60.0, "weights": weights}
    if rotated:
        arguments["rotations"], z = rotations, seen_by(rotations, z)
    fault = rng.integers(4)
    if fault == 1:
        z[600:, 0] *= -1.0
    elif fault == 2:
        z[rng.random(len(z)) < 0.05, -1, 0] += 40.0
    elif fault == 3:
        z[rng.random(z.shape) < 0.1] = np.nan
    twin = oracle.GyroArray(RATE, sensors, **arguments)
    trace = zr.GyroArray(RATE, sensors, **arguments).trace(z)
    expected = np.array([twin.update(one) for one in z])
    # The twin's filters are the same, and sums have rounding only.
    np.testing.assert_allclose(trace["rate"], expected, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(trace["weights"][-1], twin.weights, rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(trace["excluded"][-1], twin.excluded)
    assert bool(trace["disputed"][-1]) == twin.disputed


@given(st.integers(0, 2**32), st.integers(1, 4), st.integers(0, 700))
def test_one_by_one_in_pieces_and_saved_are_the_same(seed, sensors, cut):
    z = hostile(np.random.default_rng(seed), 700, sensors)
    whole, split, single = (zr.GyroArray(RATE, sensors, limit=50.0) for _ in range(3))
    expected = whole.process(z)
    first = split.process(z[:cut])
    saved = pickle.loads(pickle.dumps(split))
    assert_same_bits(np.concatenate([first, saved.process(z[cut:])]), expected)
    assert_same_bits(np.array([single.update(one) for one in z]), expected)
    assert whole.to_bytes() == saved.to_bytes() == single.to_bytes()
    whole.reset()
    assert whole.to_bytes() == zr.GyroArray(RATE, sensors, limit=50.0).to_bytes()


@given(st.integers(0, 2**32), st.integers(1, 5))
def test_finite_or_missing(seed, sensors):
    """NaN only where no sensor has a sample."""
    z = hostile(np.random.default_rng(seed), 900, sensors)
    array = zr.GyroArray(RATE, sensors)
    trace = array.trace(z)
    assert np.isfinite(trace["bias"]).all()
    assert np.isfinite(trace["weights"]).all()
    assert np.isfinite(array.covariance()[0]).all()
    lost = ~(np.isfinite(z) & ~trace["excluded"][:, :, np.newaxis]).any(axis=1)
    assert np.isnan(trace["rate"][lost]).all()
    used = trace["used"].any(axis=1)
    np.testing.assert_array_equal(np.isfinite(trace["rate"]), used | np.isfinite(trace["rate"]))
    sums = trace["weights"].sum(axis=1)
    np.testing.assert_allclose(sums[used], 1.0, rtol=1e-12)
    assert zr.GyroArray.from_bytes(array.to_bytes()).to_bytes() == array.to_bytes()


@given(st.integers(0, 2**32), st.sampled_from([2.0**-30, 2.0**20]))
def test_units_do_not_matter(seed, unit):
    z = body(800, 4, seed)[1]
    plain, scaled = zr.GyroArray(RATE, 4, limit=40.0), zr.GyroArray(RATE, 4, limit=40.0 * unit)
    # A power of two rounds nothing.
    assert_same_bits(scaled.process(z * unit), plain.process(z) * unit)


@given(st.integers(0, 2**32))
def test_the_order_of_sensors_changes_nothing_but_rounding(seed):
    z = body(1200, 5, seed)[1]
    z[700:, 2, 1] += 5.0
    order = np.random.default_rng(seed).permutation(5)
    plain, other = zr.GyroArray(RATE, 5).trace(z), zr.GyroArray(RATE, 5).trace(z[:, order])
    np.testing.assert_allclose(other["rate"], plain["rate"], rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(other["excluded"], plain["excluded"][:, order])


@given(st.integers(0, 2**32))
def test_rotations_turn_the_answer(seed):
    """Signed permutations round nothing but the order of sums."""
    z = body(600, 3, seed)[1]
    plain = zr.GyroArray(RATE, 3).process(z)
    turned = zr.GyroArray(RATE, rotations=[TURN] * 3).process(seen_by([TURN] * 3, z))
    np.testing.assert_allclose(turned, plain, rtol=1e-12, atol=1e-12)


def calibration(matrix, unit="deg/s"):
    """Return what calibrate may have found of a gyro in deg/s that makes so of its input."""
    values = np.zeros(33)
    values[[0, 4, 8]] = 1.0
    values[12:21] = np.ravel(matrix)
    units = {"accel_units": ("g", "g"), "gyro_units": (unit, "rad/s")}
    known = {"covariance": np.zeros((33, 33)), "identifiable": np.ones(33, dtype=bool)}
    return Calibration(values, **known, **units, gravity=9.81, rate=RATE)


# The twin is slow.
@settings(max_examples=settings.default.max_examples // 5)
@given(st.integers(0, 2**32))
def test_calibrations_correct_scale_and_misalignment(seed):
    rng = np.random.default_rng(seed)
    z = body(700, 3, seed)[1]
    matrices = np.eye(3) + 0.1 * (2.0 * rng.random((3, 3, 3)) - 1.0)
    corrections = np.linalg.inv(matrices)
    turned = zr.GyroArray(RATE, rotations=[TURN] * 3, calibrations=corrections, limit=40.0)
    twin = oracle.GyroArray(RATE, 3, rotations=TURN @ corrections, limit=40.0)
    expected = np.array([twin.update(one) for one in z])
    np.testing.assert_allclose(turned.process(z), expected, rtol=1e-10, atol=1e-10)
    # From deg/s to rad/s: the array stays in the unit of its samples.
    found = [calibration(np.rad2deg(matrix)) for matrix in matrices]
    same = zr.GyroArray(RATE, rotations=[TURN] * 3, calibrations=found, limit=40.0)
    np.testing.assert_allclose(same.process(z), expected, rtol=1e-9, atol=1e-9)


def test_a_calibrated_array_has_no_scale_error_of_its_own():
    """Five per cent of scale, which at 30 deg/s are fifteen times the noise, are gone."""
    true, z = body(1600, 2, 7)
    matrices = [np.diag([1.05, 0.95, 1.05]), np.diag([1.05, 1.05, 0.95])]
    z = np.einsum("sij,nsj->nsi", matrices, z)
    known = zr.GyroArray(RATE, calibrations=[calibration(np.rad2deg(m)) for m in matrices])
    plain = zr.GyroArray(RATE, sensors=2)
    error = [np.std((array.process(z) - true)[800:], axis=0) for array in (known, plain)]
    assert (error[0] < 0.15).all()
    assert (error[1] > 0.15).any()


@pytest.mark.parametrize("axes", [1, 3])
def test_one_sensor_is_a_drift_filter(axes):
    z = hostile(np.random.default_rng(3), 3000, 1)[..., :axes]
    z[100:400] = z[100]
    got = zr.GyroArray(RATE, 1, axes=axes, limit=50.0).process(z[..., 0] if axes == 1 else z)
    alone = zr.DriftFilter(RATE, channels=axes, limit=50.0).process(z[:, 0])
    assert_same_bits(got, alone[:, 0] if axes == 1 else alone)


def test_one_axis_is_the_first_of_three():
    z = body(2000, 4, 5)[1]
    z[..., 1:] = 0.0
    one = zr.GyroArray(RATE, 4, axes=1).process(z[..., 0])
    np.testing.assert_allclose(one, zr.GyroArray(RATE, 4).process(z)[:, 0], rtol=1e-12, atol=1e-12)


def test_noise_falls_by_the_root_of_the_number():
    """Sixteen alike: a quarter of the deviation, to a tenth."""
    rng = np.random.default_rng(6)
    z = 0.1 * rng.standard_normal((12_000, 16, 3))
    rate = zr.GyroArray(100.0, 16).process(z)
    np.testing.assert_allclose(rate[2000:].std(axis=0), 0.1 / 4.0, rtol=0.1)


def test_weights_are_those_of_the_noise():
    rng = np.random.default_rng(7)
    deviations = np.array([0.05, 0.1, 0.2, 0.4])
    z = rng.standard_normal((30_000, 4, 1)) * deviations[:, np.newaxis] * np.ones(3)
    array = zr.GyroArray(100.0, 4)
    rate = array.process(z + rng.standard_normal((4, 3)))
    best = deviations**-2.0 / np.sum(deviations**-2.0)
    # Variances of a hundred differences are known to a seventh.
    np.testing.assert_allclose(array.weights, np.stack([best] * 3, axis=1), rtol=0.35)
    assert rate[15_000:].std() < 1.05 * np.sum(deviations**-2.0) ** -0.5


def test_in_motion_scale_errors_count_alike():
    true, z = body(4000, 4, 8, rate=100.0)
    trace = zr.GyroArray(100.0, 4).trace(z)
    fast = np.linalg.norm(true, axis=1) > 20.0
    np.testing.assert_allclose(trace["weights"][fast][-200:], 0.25, atol=0.03)


FAULTS = {
    "sign": lambda z, rng: -z,
    "scale": lambda z, rng: 1.3 * z,
    "axes": lambda z, rng: z[:, [1, 0, 2]],
    "offset": lambda z, rng: z + 5.0,
    "stuck": lambda z, rng: np.full_like(z, z[0, 0]),
    "spikes": lambda z, rng: z + 50.0 * (rng.random(z.shape) < 0.01),
    "missing": lambda z, rng: np.full_like(z, np.nan),
}
SAID = {"stuck": "stuck", "missing": "missing", "spikes": "good"}
"""Single spikes are left out, the sensor is not."""


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_of_one_of_five(name):
    """From 60 s on, during motion. What is left of it is a few times the error of scale."""
    true, z = body(12_000, 5, 9, rate=100.0)
    rng, begin = np.random.default_rng(10), 6500
    clean = zr.GyroArray(100.0, 5).process(z)
    faulty = z.copy()
    faulty[begin:, 2] = FAULTS[name](z[begin:, 2], rng)
    array = zr.GyroArray(100.0, 5)
    trace = array.trace(faulty)
    wrong = np.abs(trace["rate"] - true)
    usual = np.abs(clean - true)
    settled = slice(begin + 100, None)
    assert np.sqrt(np.mean(wrong[settled] ** 2)) < 1.5 * np.sqrt(np.mean(usual[settled] ** 2))
    assert wrong[settled].max() < 3.0
    others = np.delete(trace["excluded"], 2, axis=1)
    assert not others.any()
    assert array.health[2] == SAID.get(name, "excluded")
    plain = np.abs(np.nanmean(faulty - z.mean(axis=0), axis=1) - true + z.mean(axis=(0, 1)))
    assert name in ("missing",) or np.nanmax(plain[settled]) > wrong[settled].max()


def test_the_way_back():
    """An offset that goes is forgiven 10 s later; a wrong scale not before the body turns."""
    _, z = body(30_000, 5, 11, rate=100.0)
    z[4500:4600, 1] += 5.0
    trace = zr.GyroArray(100.0, 5).trace(z)
    out = np.flatnonzero(trace["excluded"][:, 1]) / 100.0
    assert 45.0 < out[0] < 45.6
    assert 55.0 < out[-1] < 62.0
    # In motion from 60 s on; right again in the middle of a rest.
    true, z = body(30_000, 5, 12, rate=100.0)
    z[6000:9000, 1] += 0.4 * true[6000:9000]
    out = np.flatnonzero(zr.GyroArray(100.0, 5).trace(z)["excluded"][:, 1]) / 100.0
    assert out[0] < 61.5
    assert 109.0 < out[-1] < 112.0


def test_of_two_nobody_knows():
    _, z = body(9000, 2, 13, rate=100.0)
    z[7000:, 0] *= -1.0
    array = zr.GyroArray(100.0, 2)
    trace = array.trace(z)
    assert not trace["excluded"].any()
    assert not trace["disputed"][:7000].any()
    assert trace["disputed"][7100:8000].mean() > 0.9
    assert trace["used"].all()
    array.process(z[6500:7600])
    assert array.health == ("disputed", "disputed")


def test_covariances_are_those_of_the_definition():
    """White noise at rest, of which two share a part."""
    rng = np.random.default_rng(14)
    shared = rng.standard_normal((200_000, 1))
    z = np.concatenate([rng.standard_normal((200_000, 2)), shared], axis=1)
    z[:, :2] += 0.5 * shared
    array = zr.GyroArray(100.0, 3, axes=1)
    array.process(z)
    taus, matrices, counts = array.covariance()
    assert taus[0] == 0.25
    np.testing.assert_array_equal(taus[1:], 2.0 * taus[:-1])
    expected = np.array([[1.25, 0.25, 0.5], [0.25, 1.25, 0.5], [0.5, 0.5, 1.0]])
    for k in range(5):
        # Four deviations of a mean of so many products.
        within = 4.0 * 1.25 * np.sqrt(3.0 / counts[k].min())
        np.testing.assert_allclose(matrices[k] * taus[k] * 100.0, expected, atol=within)
    assert np.all(counts[0] > 7000)


def test_switched_off_and_on():
    z = body(6000, 3, 15, rate=100.0, motion=False)[1]
    array = zr.GyroArray(100.0, 3)
    array.process(z)
    array.power_on()
    shifted = array.process(z + np.array([[2.0], [-3.0], [1.0]]))
    assert np.abs(shifted[500:].mean(axis=0)).max() < 0.1
    assert not array.trace(z[:10])["excluded"].any()


def test_the_published_one_lags():
    """At rest a tenth of the deviation of one; in motion it is of no use."""
    rng = np.random.default_rng(16)
    z = 0.1 * rng.standard_normal((20_000, 4, 3))
    rest = zr.GyroArray(200.0, 4, method="centralised").process(z)
    assert 9.0 < 0.1 / rest[2000:].std() < 15.0
    true, z = body(8000, 4, 17, rate=100.0)
    lagging = zr.GyroArray(100.0, 4, method="centralised").process(z - z[:1500].mean(axis=0))
    moving = np.linalg.norm(true, axis=1) > 1.0
    error = np.sqrt(np.mean((lagging - true)[moving] ** 2))
    assert error > 0.5 * np.sqrt(np.mean(true[moving] ** 2))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"sensors": 0}, "sensors must be at least 1, got 0"),
        ({"sensors": 257}, "sensors must be from 1 to 256, got 257"),
        ({"sensors": 2, "axes": 2}, "axes must be 1 or 3, got 2"),
        ({"sensors": 2, "limit": 0.0}, "limit must be a positive number"),
        ({"sensors": 2, "scale_error": -0.1}, "scale_error must be from 0 to 1"),
        (
            {"sensors": 2, "weights": "median"},
            "weights must be 'auto', 'mean', 'white' or an array",
        ),
        ({"sensors": 2, "weights": "drift"}, "needs a long record at rest"),
        ({"sensors": 2, "weights": [1.0, 1.0, 1.0]}, r"weights must have shape \(2,\) or \(2, 3\)"),
        ({"sensors": 2, "weights": [0.0, 0.0]}, "sum is above zero on every axis"),
        ({"sensors": 2, "weights": [1.0, -1.0]}, "sum is above zero on every axis"),
        ({"sensors": 2, "weights": [1.0, np.inf]}, "weights must be finite"),
        ({"sensors": 2, "method": "kalman"}, "method must be 'auto' or 'centralised'"),
        ({"sensors": 2, "labels": ["a"]}, "labels must be one a sensor"),
        ({"rotations": np.eye(3)}, r"rotations must have shape \(sensors, 3, 3\), got \(3, 3\)"),
        ({"rotations": [np.eye(3), 1.1 * np.eye(3)]}, "orthonormal to 1e-6 .* got 2"),
        ({"sensors": 3, "rotations": [np.eye(3)] * 2}, "rotations must be one matrix a sensor"),
        (
            {"sensors": 3, "calibrations": [np.eye(3)] * 2},
            "calibrations must be one a sensor, got 2",
        ),
        (
            {"calibrations": [np.eye(3), 2.0 * np.eye(3)]},
            "within 0.5 of the unit matrix .* got 2",
        ),
        ({"calibrations": [np.full((3, 3), np.nan)]}, "calibrations"),
        ({"calibrations": [np.eye(2)]}, r"calibration 1 must have shape \(3, 3\), got \(2, 2\)"),
        ({"calibrations": calibration(np.eye(3))}, "one a sensor, got a single Calibration"),
        ({"calibrations": [calibration(np.eye(3), "LSB")]}, "1 is for samples in LSB.*apply each"),
    ],
)
def test_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        zr.GyroArray(RATE, **arguments)


def test_refused_samples():
    array = zr.GyroArray(RATE, 4)
    with pytest.raises(ValueError, match=r"must have shape \(n, 4, 3\)"):
        array.process(np.zeros((5, 3, 3)))
    with pytest.raises(TypeError, match="sensors must be given"):
        zr.GyroArray(RATE)


def test_repr_makes_it_anew():
    corrections = [np.eye(3), np.diag([1.1, 1.0, 0.9])]
    array = zr.GyroArray(
        RATE,
        rotations=[TURN, SLANTED],
        calibrations=corrections,
        weights=[0.25, 0.75],
        limit=40.0,
    )
    again = eval(repr(array), {"GyroArray": zr.GyroArray})
    assert again.to_bytes() == array.to_bytes()
    assert repr(zr.GyroArray(RATE, 2)) == "GyroArray(rate=20.0, sensors=2)"
