"""Simulated gyros: their Allan deviation, truth, streams and refusals."""

import math

import numpy as np
import pytest
from scipy.stats import chi2

from zerorate.noise import Markov, NoiseModel, Sinusoid
from zerorate.simulation import sequences
from zerorate.simulation.devices import DEVICES
from zerorate.simulation.gyro import simulate

RATE = 10.0
DURATION = 20_000.0
FACTORS = 2 ** np.arange(4, 13)


def overlapping_allan_deviation(z, m):
    angle = np.concatenate(([0.0], np.cumsum(z)))
    second = angle[2 * m :] - 2.0 * angle[m:-m] + angle[: -2 * m]
    return math.sqrt(np.mean(second**2) / 2.0) / m


def degrees_of_freedom(term, n, m):
    """Greenhall's fits for the overlapping estimator, NIST SP 1065, table 5; n phase points."""
    if term == "quantization":
        return (n + 1) * (n - 2 * m) / (2.0 * (n - m))
    if term == "angle_random_walk":
        return (1.5 * (n - 1) / m - 2.0 * (n - 2) / n) * 4.0 * m**2 / (4.0 * m**2 + 5.0)
    if term == "bias_instability":
        return 5.0 * n**2 / (4.0 * m * (n + 3.0 * m))
    return (n - 2) / m * ((n - 1) ** 2 - 3.0 * m * (n - 1) + 4.0 * m**2) / (n - 3) ** 2


def assert_deviations_of_the_model(signal, model, term):
    """At every averaging time, within what chance leaves with the degrees of freedom of a term."""
    edf = degrees_of_freedom(term, signal.size + 1, FACTORS)
    # The variance is chi-squared over its degrees of freedom. 1 % more for what is not sampling:
    # the walk's 1/(4 m^2), flicker near the sampling rate, and edf itself, a fit.
    low, high = np.sqrt(chi2.ppf([[5e-6], [1.0 - 5e-6]], edf) / edf)
    found = np.array([overlapping_allan_deviation(signal, m) for m in FACTORS])
    ratio = found / model.allan_deviation(FACTORS / RATE)
    within = (0.99 * low < ratio) & (ratio < 1.01 * high)
    assert within.all(), (FACTORS[~within], ratio[~within], low[~within], high[~within])


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(
    "term", ["quantization", "angle_random_walk", "bias_instability", "rate_random_walk"]
)
def test_each_noise_has_the_models_allan_deviation(term, seed):
    model = NoiseModel(**{term: 1e-3})
    signal, _ = simulate(model, RATE, DURATION, seed)
    # 108 draws at 1e-5 two-sided fail by chance once in 900.
    assert_deviations_of_the_model(signal, model, term)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_markov_noise_has_the_models_allan_deviation(seed):
    model = NoiseModel(markov=[Markov(1e-3, 10.0)])
    signal, truth = simulate(model, RATE, DURATION, seed)
    np.testing.assert_array_equal(signal, truth)
    # Between a random walk and white noise, so with at least the fewer degrees of freedom of the
    # two, the walk's. 27 draws at 1e-5 fail by chance once in 3700.
    assert_deviations_of_the_model(signal, model, "rate_random_walk")


def test_a_sinusoid_has_the_models_allan_deviation():
    model = NoiseModel(sinusoid=[Sinusoid(1e-3, 0.01)])
    signal, truth = simulate(model, RATE, DURATION, 1)
    np.testing.assert_array_equal(signal, truth)
    found = [overlapping_allan_deviation(signal, m) for m in FACTORS]
    # No chance but the phase. Over 191 to 200 cycles a part of one weighs at most 1/(4 pi 191) =
    # 4e-4 of the variance; samples at 1000 a cycle average to 1 + (pi/1000)^2/6 of the curve.
    np.testing.assert_allclose(found, model.allan_deviation(FACTORS / RATE), rtol=5e-4)


def test_quantization_is_a_bounded_error_of_the_angle():
    rate, deviation = 100.0, 2e-5
    signal, truth = simulate(NoiseModel(quantization=deviation), rate, 1000.0, 7)
    np.testing.assert_array_equal(truth, 0.0)
    # The angle's error is the sum of the rate's: back to white noise, less its first value. Its
    # relative error is 1/sqrt(2e5) = 0.0022; five of them.
    angle = np.cumsum(signal) / rate
    assert angle.std() == pytest.approx(deviation, rel=0.011)
    assert np.abs(np.corrcoef(angle[1:], angle[:-1])[0, 1]) < 5.0 / math.sqrt(angle.size)


@pytest.mark.parametrize("step", [1e-7, 1e-3, 0.1, 2.0, 1e3])
def test_markov_noise_is_the_plain_recursion(step):
    white = np.random.default_rng(5).standard_normal(2000)
    decay, drive = math.exp(-step), math.sqrt(-math.expm1(-2.0 * step))
    plain = [white[0]]
    for w in white[1:]:
        plain.append(decay * plain[-1] + drive * w)
    # 2000 roundings of numbers of order 1 in the recursion, 11 in the doubling.
    np.testing.assert_allclose(sequences.markov(white, step), plain, rtol=0.0, atol=2000 * 2.3e-16)


@pytest.mark.slow
def test_markov_noise_is_stationary_from_the_start():
    model = NoiseModel(markov=[Markov(2.0, 50.0)])
    _, truth = simulate(model, 100.0, 0.02, 3, axes=20_000)
    # Variance q_c^2 T_c / 2 = 100. Deviations of 2e4 axes are known to 1/sqrt(4e4) = 0.5 %; five.
    assert truth.std(axis=1) == pytest.approx([10.0, 10.0], rel=0.025)


@pytest.mark.slow
def test_the_phase_of_a_sinusoid_is_uniform():
    model = NoiseModel(sinusoid=[Sinusoid(1.0, 25.0)])
    _, truth = simulate(model, 100.0, 0.02, 3, axes=20_000)
    phase = np.arctan2(truth[0], truth[1])
    # Means of sines and cosines of 2e4 uniform phases have deviation sqrt(1/4e4) = 0.005; five.
    assert np.abs([np.cos(phase).mean(), np.sin(phase).mean()]).max() < 0.025
    # A quarter of a cycle a sample: both lie on the unit circle, to rounding.
    np.testing.assert_allclose(np.hypot(*truth), 1.0, rtol=1e-15)


def test_new_terms_leave_old_seeds_their_signals():
    """Each axis spawns its streams in order, and spawning more leaves the first as they were."""
    bias, white, _, walk = (
        np.random.default_rng(child).standard_normal(500)
        for child in np.random.SeedSequence(7).spawn(1)[0].spawn(4)
    )
    signal, truth = simulate(NoiseModel(0.1, 0.0, 0.5), 25.0, 20.0, 7, turn_on_bias=2.0)
    walk[0] = 0.0
    # Sums of a few numbers up to 10.
    np.testing.assert_allclose(truth, 2.0 * bias[0] + 0.1 * np.cumsum(walk), atol=1e-14, rtol=0.0)
    np.testing.assert_allclose(signal - truth, 0.5 * white, atol=1e-14, rtol=0.0)


def test_flicker_meets_its_floor_without_chance():
    """Drive the filter by one unit impulse: its Allan variance is a sum of squares, exact."""
    response = sequences.flicker(np.eye(1, 64 * FACTORS[-1])[0])
    for m in FACTORS:
        angle = np.concatenate((np.zeros(2 * m), np.cumsum(response[: 64 * m])))
        second = angle[2 * m :] - 2.0 * angle[m:-m] + angle[: -2 * m]
        deviation = math.sqrt(np.sum(second**2) / 2.0) / m
        expected = float(NoiseModel(bias_instability=1.0).allan_deviation(m))
        # Left out: all beyond 64 m, and the discrete spectrum's departure near the sampling rate.
        assert deviation == pytest.approx(expected, rel=1e-2), m


def test_flicker_is_the_plain_convolution():
    white = np.random.default_rng(5).standard_normal(300)
    lags = np.arange(1.0, 300.0)
    response = np.cumprod(np.concatenate(([1.0], (lags - 0.5) / lags)))
    plain = np.convolve(white, response)[:300]
    # Rounding of a transform of 1024 numbers of order 1.
    np.testing.assert_allclose(sequences.flicker(white), plain, rtol=0.0, atol=1e-13)


def test_flicker_is_causal():
    model = NoiseModel(bias_instability=2.0)
    short, _ = simulate(model, RATE, 30.0, 5)
    longer, _ = simulate(model, RATE, 60.0, 5)
    np.testing.assert_allclose(longer[:300], short, rtol=0.0, atol=1e-13)


def test_white_noise_and_walk_have_their_step_deviations():
    white, _ = simulate(NoiseModel(angle_random_walk=2.0), 100.0, 1000.0, 7)
    walk, _ = simulate(NoiseModel(rate_random_walk=2.0), 100.0, 1000.0, 7)
    # Relative error of a deviation of 1e5 samples: 1/sqrt(2e5) = 0.0022; five of them.
    assert white.std() == pytest.approx(20.0, rel=0.011)
    assert np.diff(walk).std() == pytest.approx(0.2, rel=0.011)
    assert walk[0] == 0.0


def test_ramp_is_exact():
    signal, truth = simulate(NoiseModel(rate_ramp=-0.5), 4.0, 100.0, 0)
    np.testing.assert_array_equal(signal, -0.125 * np.arange(400))
    np.testing.assert_array_equal(truth, signal)


def test_a_seed_gives_one_signal():
    gyro = DEVICES["ADIS16405"]
    first, again = (simulate(gyro, 100.0, 20.0, 11, axes=3) for _ in range(2))
    np.testing.assert_array_equal(first, again)
    other, _ = simulate(gyro, 100.0, 20.0, 12, axes=3)
    assert not np.any(np.all(first[0] == other, axis=0))


def test_an_axis_does_not_depend_on_how_many_there_are():
    model = NoiseModel(1e-3, 1e-3, 1e-3, 1e-5)
    one, one_truth = simulate(model, 50.0, 20.0, 3, turn_on_bias=0.1)
    three, _ = simulate(model, 50.0, 20.0, 3, axes=3, turn_on_bias=0.1)
    five, five_truth = simulate(model, 50.0, 20.0, 3, axes=5, turn_on_bias=0.1)
    np.testing.assert_array_equal(five[:, :3], three)
    np.testing.assert_array_equal(five[:, 0], one)
    np.testing.assert_array_equal(five_truth[:, 0], one_truth)


def test_axes_are_independent():
    signal, _ = simulate(NoiseModel(angle_random_walk=1.0), 100.0, 100.0, 4, axes=4)
    correlation = np.corrcoef(signal.T) - np.eye(4)
    # Correlations of 1e4 independent samples have deviation 0.01; five of them.
    assert np.abs(correlation).max() < 0.05


@pytest.mark.parametrize("term", ["angle_random_walk", "bias_instability", "rate_random_walk"])
def test_doubling_a_coefficient_doubles_exactly(term):
    single, _ = simulate(NoiseModel(**{term: 0.3}), 100.0, 10.0, 9)
    double, _ = simulate(NoiseModel(**{term: 0.6}), 100.0, 10.0, 9)
    np.testing.assert_array_equal(double, 2.0 * single)


@pytest.mark.parametrize("size", [0.3, 1e-5])
def test_doubling_a_correlated_term_doubles_exactly(size):
    def signal(factor):
        amplitude = factor * size
        terms = {"markov": [Markov(amplitude, 3.0)], "sinusoid": [Sinusoid(amplitude, 0.7)]}
        return [
            simulate(NoiseModel(**{name: term}), 100.0, 10.0, 9)[0] for name, term in terms.items()
        ]

    np.testing.assert_array_equal(signal(2.0), 2.0 * np.array(signal(1.0)))


def test_a_markov_term_does_not_change_the_others():
    first, second = Markov(0.1, 5.0), Markov(0.2, 0.5)
    one, _ = simulate(NoiseModel(markov=[first]), 100.0, 10.0, 6)
    both, _ = simulate(NoiseModel(markov=[first, second]), 100.0, 10.0, 6)
    added = both - one
    # The second's deviation is 0.2 sqrt(0.5/2) = 0.1; it is as it would be alone in its place.
    quiet, _ = simulate(NoiseModel(markov=[Markov(0.0, 1.0), second]), 100.0, 10.0, 6)
    np.testing.assert_allclose(added, quiet, rtol=0.0, atol=1e-15)
    assert added.std() > 0.0


def test_a_term_does_not_change_the_others():
    correlated = {"markov": [Markov(0.5, 2.0)], "sinusoid": [Sinusoid(0.6, 0.2)]}
    all_terms = NoiseModel(0.1, 0.2, 0.3, 0.4, 0.5, **correlated)
    _, truth = simulate(all_terms, 100.0, 10.0, 6, turn_on_bias=1.0)
    parts = [
        simulate(model, 100.0, 10.0, 6, turn_on_bias=bias)[1]
        for model, bias in [
            (NoiseModel(), 1.0),
            (NoiseModel(bias_instability=0.2), 0.0),
            (NoiseModel(rate_random_walk=0.3), 0.0),
            (NoiseModel(rate_ramp=0.4), 0.0),
            (NoiseModel(markov=correlated["markov"]), 0.0),
            (NoiseModel(sinusoid=correlated["sinusoid"]), 0.0),
        ]
    ]
    np.testing.assert_array_equal(truth, sum(parts))


def test_signal_is_truth_plus_white_noise():
    signal, truth = simulate(NoiseModel(0.1, 0.2, 0.3, 0.4), 100.0, 10.0, 6, turn_on_bias=1.0)
    white, nothing = simulate(NoiseModel(0.1), 100.0, 10.0, 6)
    # A sum and a difference of numbers up to 10.
    np.testing.assert_allclose(signal - truth, white, rtol=0.0, atol=1e-14)
    np.testing.assert_array_equal(nothing, 0.0)


def test_rounding_leaves_whole_steps_and_the_truth_alone():
    model, step = NoiseModel(0.1, 0.2), 0.125
    exact, exact_truth = simulate(model, 100.0, 10.0, 6)
    signal, truth = simulate(model, 100.0, 10.0, 6, resolution=step)
    np.testing.assert_array_equal(signal % step, 0.0)
    np.testing.assert_array_equal(truth, exact_truth)
    assert np.abs(signal - exact).max() <= step / 2.0


def test_a_device_brings_its_bias_and_resolution():
    gyro = DEVICES["ADIS16405"]
    signal, truth = simulate(gyro, 100.0, 1.0, 8, axes=400)
    steps = signal / gyro.resolution
    np.testing.assert_allclose(steps, np.round(steps), rtol=0.0, atol=1e-9)
    # The deviation of 400 biases is known to 1/sqrt(800) = 3.5 %; five of them.
    assert truth[0].std() == pytest.approx(gyro.turn_on_bias, rel=0.18)
    plain, _ = simulate(gyro, 100.0, 1.0, 8, axes=400, resolution=0.0, turn_on_bias=0.0)
    same, _ = simulate(gyro.noise, 100.0, 1.0, 8, axes=400)
    np.testing.assert_array_equal(plain, same)


@pytest.mark.parametrize("axes", [None, 1, 2])
@pytest.mark.parametrize(("rate", "duration", "n"), [(100.0, 0.01, 1), (3.0, 1.5, 4), (1, 7, 7)])
def test_shapes(axes, rate, duration, n):
    model = NoiseModel(1.0, 1.0, 1.0, 1.0)
    signal, truth = simulate(model, rate, duration, 1, axes=axes)
    assert signal.shape == truth.shape == ((n,) if axes is None else (n, axes))
    assert signal.dtype == truth.dtype == np.float64


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"model": 0.1}, "model must be a NoiseModel or a Device"),
        ({"rate": 0.0}, "rate must be positive"),
        ({"rate": math.nan}, "rate must be positive"),
        ({"duration": -1.0}, "duration must be positive"),
        ({"duration": math.inf}, "duration must be positive"),
        ({"duration": 1e-3}, "samples: it must be 1 to"),
        ({"duration": 1e12}, "samples: it must be 1 to"),
        ({"seed": -1}, "seed must be a whole number from 0"),
        ({"seed": 1.5}, "seed must be a whole number from 0"),
        ({"seed": None}, "seed must be a whole number from 0"),
        ({"axes": 0}, "axes must be a whole number from 1"),
        ({"axes": True}, "axes must be a whole number from 1"),
        ({"resolution": -0.1}, "resolution must be finite and not negative"),
        ({"turn_on_bias": math.nan}, "turn_on_bias must be finite and not negative"),
    ],
)
def test_refusals(change, message):
    arguments = {"model": NoiseModel(0.1), "rate": 100.0, "duration": 1.0, "seed": 1} | change
    with pytest.raises(ValueError, match=message):
        simulate(**arguments)
