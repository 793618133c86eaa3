"""Simulated gyros: their parts as states and as series, and their streams."""

import math

import numpy as np
import pytest

from zerorate.simulation.models import (
    MODELS,
    GaussMarkov,
    GyroModel,
    Resonance,
    WarmUp,
    flicker,
    simulate_record,
)

RATE = 100.0
STATIONARY = [GaussMarkov(0.01, 0.1), GaussMarkov(0.02, 10.0), Resonance(0.2, 18.0, 0.3283)]


def autocovariance(part, lags):
    """Of the output, from the states of the part."""
    F, _, P, H = part.block(RATE)
    values = []
    for _ in range(lags):
        values.append(H @ P @ H)
        P = F @ P
    return np.array(values)


@pytest.mark.parametrize("part", STATIONARY)
def test_the_states_of_stationary_noise_keep_their_covariance(part):
    F, Q, P, H = part.block(RATE)
    # Rounding of a few products, with poles within 1e-3 of 1 in Q's difference.
    np.testing.assert_allclose(F @ P @ F.T + Q, P, rtol=1e-12, atol=1e-12 * P.max())
    np.testing.assert_allclose(H @ P @ H, part.deviation**2, rtol=1e-15)  # one square


@pytest.mark.every(3)
@pytest.mark.parametrize("part", STATIONARY)
@pytest.mark.parametrize("lag", [0, 1, 3])
def test_series_have_the_autocovariance_of_the_states(part, lag):
    n = 200_000
    x = part.series(n, RATE, np.random.default_rng(5))
    expected = autocovariance(part, 40_000)
    # Bartlett: a sample autocovariance has variance of at most 2/n times the sum of the squared
    # autocovariances over both signs of the lag. Five deviations fail once in a million.
    deviation = math.sqrt(2.0 / n * (2.0 * np.sum(expected**2) - expected[0] ** 2))
    assert abs(x[lag:] @ x[: n - lag] / n - expected[lag]) < 5.0 * deviation


def test_stationary_noise_has_its_deviation_from_the_first_sample_on():
    draws = 5000
    random = np.random.default_rng(1)
    first = [Resonance(0.2, 18.0, 0.3283).series(1, RATE, random)[0] for _ in range(draws)]
    # The mean square of independent draws has the relative deviation sqrt(2/draws): five of them.
    assert np.mean(np.square(first)) == pytest.approx(0.04, rel=5.0 * math.sqrt(2.0 / draws))


def test_a_resonance_has_its_peak_at_its_frequency():
    n = 1 << 16
    x = Resonance(0.2, 18.0, 0.3283).series(n, RATE, np.random.default_rng(2))
    density = np.mean(np.abs(np.fft.rfft(x.reshape(64, -1), axis=1)) ** 2, axis=0)
    # Its half width is 1/(2 pi 0.33 s) = 0.5 Hz, that of a bin 0.1 Hz.
    assert density.argmax() * RATE / 1024 == pytest.approx(18.0, abs=0.5)


def test_a_warm_up_follows_its_state():
    part = WarmUp(0.1, 300.0)
    x = part.series(1000, RATE, np.random.default_rng(3))
    F, Q, P, _ = part.block(RATE)
    assert Q[0, 0] == 0.0
    assert x[0] ** 2 == pytest.approx(P[0, 0], rel=1e-15)
    # Rounding of an exponential.
    np.testing.assert_allclose(x[1:], F[0, 0] * x[:-1], rtol=1e-12)


def test_flicker_has_its_density_over_the_middle_decades():
    frequency = np.geomspace(3e-4, 0.1, 200)
    turn = 2.0 * math.pi * frequency
    density = sum(
        2.0 * part.deviation**2 * part.time / (1.0 + (turn * part.time) ** 2)
        for part in flicker(0.002)
    )
    # The docstring's 2 %: what the processes beyond both ends would add.
    np.testing.assert_allclose(density, 0.002**2 / turn, rtol=0.02)


def test_models_are_told_apart_and_the_transient_one_is_marked():
    names = [model.name for model in MODELS]
    assert len(set(names)) == len(names) >= 12
    assert [model.name for model in MODELS if model.transient] == ["warm-up"]


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_records_depend_on_their_seed_alone(model):
    first, again, other = (simulate_record(model, RATE, 500, seed) for seed in (4, 4, 5))
    np.testing.assert_array_equal(first, again)
    assert not np.any(first[1] == other[1])


def test_models_that_differ_in_name_alone_draw_from_other_streams():
    one, other = (simulate_record(GyroModel(name), RATE, 500, 1)[0] for name in ("one", "other"))
    # Independent: the correlation of 500 pairs has deviation 1/sqrt(500), five of them.
    assert abs(np.corrcoef(one, other)[0, 1]) < 5.0 / math.sqrt(500)


def test_only_what_is_drift_is_in_the_truth():
    model = GyroModel("loud", 0.0, disturbances=(GaussMarkov(1.0, 0.1),), turn_on_bias=2.0)
    signal, truth = simulate_record(model, RATE, 5000, 1)
    assert np.ptp(truth) == 0.0
    assert abs(truth[0]) < 10.0  # five turn-on deviations
    # 50 s hold 250 independent values of it: the deviation is within 5/sqrt(500) of 1.
    assert (signal - truth).std() == pytest.approx(1.0, abs=5.0 / math.sqrt(500))


def test_a_rounded_output_stands_on_its_steps():
    model = next(model for model in MODELS if model.resolution > 0.0)
    signal, _ = simulate_record(model, RATE, 500, 1)
    steps = signal / model.resolution
    # Multiples of the step are rounded once each.
    np.testing.assert_allclose(steps, np.round(steps), rtol=1e-15)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: GaussMarkov(-0.1, 1.0), "deviation must be finite and not negative, got -0.1"),
        (lambda: GaussMarkov(0.1, 0.0), "time must be finite and positive, got 0.0"),
        (lambda: WarmUp(math.nan, 1.0), "amplitude must be finite and not negative, got nan"),
        (lambda: Resonance(0.1, math.inf, 1.0), "frequency must be finite and positive, got inf"),
        (lambda: GyroModel("x", resolution=-1.0), "resolution must be finite and not negative"),
        (
            lambda: Resonance(0.1, 50.0, 1.0).block(RATE),
            "at 50.0 Hz needs twice that, got 100.0 Hz",
        ),
    ],
)
def test_numbers_that_mean_nothing_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
