"""Wu & Ran's robust filter: what their paper's numbers say, and what the filter does with dirt."""

import numpy as np
import pytest

import zerorate as zr

RATE = 200.0
NOISE = 0.1
A = 0.0299  # The paper's AR(1) coefficient.

# Bias instability in deg/h of raw, Kalman filter, VisuShrink and the paper's whole method; and its
# claims in percent, over the Kalman filter and over VisuShrink.
PUBLISHED = {
    "x": ((3.936395, 1.259665, 0.137148, 0.040733), (31.0, 2.4)),
    "y": ((6.082270, 1.982798, 0.936515, 0.198316), (29.3, 12.1)),
    "z": ((4.115378, 1.359070, 0.614795, 0.102585), (30.5, 12.4)),
}


@pytest.mark.parametrize("axis", PUBLISHED)
def test_the_published_percentages_are_points_of_raw(axis):
    (raw, kalman, visushrink, whole), claims = PUBLISHED[axis]
    points = [100.0 * (other - whole) / raw for other in (kalman, visushrink)]
    assert np.round(points, 1) == pytest.approx(claims)


@pytest.mark.parametrize(("ratio", "expected"), [(1.0, 0.508), (0.5, 0.340)])
def test_the_published_model_is_a_gain(ratio, expected):
    """AR(1) around zero pulls every level towards zero: the filter multiplies it by g < 1."""
    start = known(walk=np.sqrt(ratio) * NOISE, slope=A)
    f = zr.DriftFilter.started(
        start, rate=RATE, order=(1, 0), method="kf", adapt_for=0.0, output="estimate"
    )
    level = f.process(np.full(500, 0.2))[-1]
    gain = f.gain[0] / (1.0 - A * (1.0 - f.gain[0]))
    assert gain == pytest.approx(expected, abs=5e-4)
    assert level / 0.2 == pytest.approx(expected, abs=2e-3)


def test_that_gain_lowers_every_allan_deviation_alike():
    """So a third of the bias instability is no sign of a filter: a true rate shrinks as much."""
    z = NOISE * np.random.default_rng(1).standard_normal(400_000)
    f = zr.DriftFilter.started(
        known(NOISE, A), rate=RATE, method="kf", order=(1, 0), adapt_for=0.0, output="estimate"
    )
    taus = np.array([1.0, 10.0, 100.0])
    before, after = zr.allan(z, RATE, taus=taus), zr.allan(f.process(z), RATE, taus=taus)
    np.testing.assert_allclose(after.deviation / before.deviation, 0.508, atol=0.01)


@pytest.mark.parametrize(("unit", "share"), [(1.0, 0.915), (1000.0, 0.0)])
def test_the_published_radius_has_a_unit(unit, share):
    """A variance against an innovation: nearly all clean samples in deg/s, none in mdeg/s."""
    z = unit * NOISE * np.random.default_rng(2).standard_normal(20_000)
    f = zr.DriftFilter(RATE, method="robust", zones="published", damping=1.0, output="estimate")
    f.process(z)
    assert f.outlier_count / len(z) == pytest.approx(share, abs=0.02)


def known(walk, slope=1.0):
    """A start with a drift of so much a sample, and noise of 0.1 deg/s."""
    # A small scale: the process noise has a floor, in its squares.
    return {
        "offset": 0.0,
        "scale": NOISE / 100.0,
        "coefficients": np.array([slope, 0.0]),
        "covariance": np.zeros((2, 2)),
        "measurement_noise": NOISE**2,
        "process_noise": walk**2,
        "state_covariance": np.diag([NOISE**2, 0.0]),
    }


def filtered(z, walk, rate=RATE, **options):
    f = zr.DriftFilter.started(
        known(walk), rate=rate, output="estimate", **{"order": (1, 0), "adapt_for": 0.0, **options}
    )
    return f.process(z), f


def rms(x):
    return np.sqrt(np.mean(np.square(x)))


# An hour at 200 Hz: a walk of 3e-4 deg/s in a root second under noise of 0.1 deg/s.
WALK = 3e-4 / np.sqrt(RATE)
FILTERS = {
    "plain": {"method": "kf"},
    "published": {
        "method": "robust", "zones": "published", "damping": 0.1, "correction": 0.1,
    },
    "corrected": {"method": "robust", "correction": 0.1},
    "robust": {"method": "robust"},
}  # fmt: skip


@pytest.fixture(scope="module")
def errors():
    """RMSE to the true drift, deg/s: clean, 1 % at 10 sigma, 5 % at 100 sigma of one sign."""
    rng = np.random.default_rng(1)
    n = 720_000
    truth = np.cumsum(WALK * rng.standard_normal(n))
    clean = truth + NOISE * rng.standard_normal(n)
    either = 10.0 * NOISE * rng.choice([-1.0, 1.0], n)
    records = [
        clean,
        clean + np.where(rng.random(n) < 0.01, either, 0.0),
        clean + np.where(rng.random(n) < 0.05, 100.0 * NOISE, 0.0),
    ]
    return {
        name: [rms((filtered(z, WALK, **options)[0] - truth)[20_000:]) for z in records]
        for name, options in FILTERS.items()
    }


def test_the_safe_law_costs_nothing_and_leaves_outliers_out(errors):
    clean = errors["plain"][0]
    assert clean == pytest.approx(0.00146, rel=0.2)
    assert errors["robust"][0] <= 1.005 * clean
    assert errors["robust"][1] <= 1.02 * clean
    assert errors["robust"][2] <= 1.04 * clean


def test_the_other_laws_pay(errors):
    """The figures of the page on robust methods, each of another seed."""
    clean = errors["plain"][0]
    assert errors["plain"][1] > 1.1 * clean
    assert errors["plain"][2] == pytest.approx(0.504, rel=0.02)
    assert errors["published"] == pytest.approx([0.0101, 0.0205, 0.0529], rel=0.2)
    assert errors["corrected"] == pytest.approx([0.0226, 0.0230, 0.0228], rel=0.2)


@pytest.mark.parametrize(
    ("rate", "samples", "expected"), [(100.0, 3, 22.0), (167.0, 5, 31.0), (1e9, None, 355.0)]
)
def test_an_exit_ends_every_row_of_outliers(rate, samples, expected):
    """Steps of 50 deg/s: RMSE over that of the samples; without an exit it stays where it was."""
    level = np.repeat(50.0 * (np.arange(40) % 2), 1000)
    noise = NOISE * np.random.default_rng(3).standard_normal(len(level))
    x, f = filtered(level + noise, walk=0.01 * NOISE, rate=rate, method="robust")
    assert rms(x - level) / rms(noise) == pytest.approx(expected, rel=0.03)
    assert f.exit_count == (39 if samples else 0)
    x, _ = filtered(level + noise, walk=0.01 * NOISE, method="kf")
    assert rms(x - level) / rms(noise) == pytest.approx(110.0, rel=0.03)


def motions(rate):
    t = np.arange(round(10 * rate)) / rate
    return {
        "step": np.where(t > 1.0, 50.0, 0.0),
        "steps": 50.0 * (np.floor(3.0 * t) % 2),
        "ramp": 20.0 * t,
        "steep": 2000.0 * t,
        "slow": 30.0 * np.sin(0.2 * np.pi * t),
        "fast": 30.0 * np.sin(10.0 * np.pi * t),
        "alternating": 30.0 * (-1.0) ** np.arange(len(t)),
        "loud": 3.0 * np.random.default_rng(9).standard_normal(len(t)),
    }


@pytest.mark.parametrize("share", [0.0, 0.02])
@pytest.mark.parametrize("motion", motions(10.0))
@pytest.mark.parametrize("rate", [100.0, 1000.0])
def test_the_filter_always_comes_back(rate, motion, share):
    """Whatever came, and with outliers of 100 deviations in all of it: to the level of the rest."""
    rng = np.random.default_rng(4)
    parts = np.zeros(round(20 * rate)), motions(rate)[motion], np.full(round(120 * rate), 7.0)
    z = np.concatenate(parts) + NOISE * rng.standard_normal(round(150 * rate))
    z = z + np.where(rng.random(len(z)) < share, 100.0 * NOISE, 0.0)
    f = zr.DriftFilter(rate, method="robust", output="estimate")
    late = f.process(z)[-round(20 * rate) :]
    assert np.mean(late) == pytest.approx(7.0, abs=0.02)
    assert rms(late - 7.0) < NOISE


def test_an_outlier_moves_nothing():
    """Of estimate, noise and model; the flag says so, and the next sample counts again."""
    z = NOISE * np.random.default_rng(6).standard_normal(4000)
    dirty, missing = z.copy(), z.copy()
    dirty[3000], missing[3000] = 50.0, np.nan
    f, twin = (zr.DriftFilter(RATE, method="robust") for _ in range(2))
    got, expected = f.trace(dirty), twin.trace(missing)
    np.testing.assert_array_equal(got.estimate, expected.estimate)
    np.testing.assert_array_equal(got.measurement_noise, expected.measurement_noise)
    np.testing.assert_array_equal(got.coefficients, expected.coefficients)
    assert got.guarded[3000]
    assert not got.missing[3000]
    assert f.outlier_count == twin.outlier_count + 1


def test_holding_and_compensating():
    """As the other published methods do, the zones kept; and through a checkpoint."""
    z = 0.3 + NOISE * np.random.default_rng(7).standard_normal(8000)
    z[4000:4400] += 30.0 * np.sin(np.arange(400) / 9.0)
    options = {"motion": "hold", "output": "compensated", "zones": (3.0, 0.5)}
    f = zr.DriftFilter(RATE, method="robust", **options)
    answers = f.process(z)
    np.testing.assert_allclose(answers[-1], z[-1] - f.bias, atol=1e-15)
    assert not np.all(f.copy().trace(30.0 * np.sin(np.arange(400) / 9.0)).at_rest)
    twin = zr.DriftFilter.from_bytes(f.to_bytes())
    assert twin.params == f.params
    assert {name: twin.params[name] for name in options} == options
    assert twin.outlier_count == f.outlier_count


@pytest.mark.parametrize("zones", ["pink", 4.0, (4.0,), (0.0, 0.5), (4.0, 0.0), (4.0, 1.5), None])
def test_zones_that_are_none(zones):
    with pytest.raises(ValueError, match=r"zones must be 'published' or \(kappa, beta\)"):
        zr.DriftFilter(RATE, method="robust", zones=zones)
