"""How points of a curve vary together: all pairs of terms, Monte Carlo, and known limits."""

import numpy as np
import pytest

from oracle.curve_covariance import covariance, weights
from zerorate._native import allan_deviations, longest_factor
from zerorate.noise.covariance import CurveStatistics, degrees_of_freedom, variances
from zerorate.noise.kinds import KINDS
from zerorate.noise.processes import BY_EXPONENT, FLICKER, QUANTISATION, WALK, WHITE, markov
from zerorate.simulation import sequences

PLAIN = ["adev", "oadev", "mdev", "hdev", "ohdev"]
PROCESSES = {
    "quantisation": QUANTISATION,
    "white": WHITE,
    "flicker": FLICKER,
    "walk": WALK,
    "Markov, 3 samples": markov(3.0),
    "Markov, 50 samples": markov(50.0),
}
BY_KIND = pytest.mark.parametrize("kind", [KINDS[name] for name in PLAIN], ids=PLAIN)
BY_PROCESS = pytest.mark.parametrize("process", PROCESSES.values(), ids=PROCESSES)
SAMPLES = 300


def octaves(kind, n=SAMPLES):
    """Factors of a record of n samples, and terms of each."""
    m = 2 ** np.arange(longest_factor(kind.name, n).bit_length())
    return m, allan_deviations(np.zeros(n), m.tolist(), kind.name)[1]


def summed(kind, m, terms, process):
    """Covariance of a curve by all pairs of terms."""
    pairs = [(i, j) for i in range(m.size) for j in range(m.size)]
    values = [covariance(kind, m[[i, j]], terms[[i, j]], process.phase) for i, j in pairs]
    return np.reshape(values, (m.size, m.size))


@BY_KIND
@BY_PROCESS
def test_covariances_are_those_of_all_pairs_of_terms(kind, process):
    m, terms = octaves(kind)
    expected = summed(kind, m, terms, process)
    found = CurveStatistics(kind, m, terms, [process]).covariance(np.ones(1))
    # Sixteen points to an averaging time: the trapezoidal rule leaves (1/16)^2 of bends, twice.
    np.testing.assert_allclose(np.diag(found), np.diag(expected), rtol=1e-2)
    sigmas = np.sqrt(np.diag(expected))
    correlation = found / np.outer(sigmas, sigmas)
    # How many separate terms meet is taken from the lengths that they cover, wrong by up to one:
    # too much where there are not even four.
    several = terms >= (1 if kind.overlapping else 4)
    error = np.abs(correlation - expected / np.outer(sigmas, sigmas))[np.ix_(several, several)]
    assert error.max() < 0.02


@pytest.mark.parametrize(
    ("kind", "exponent"),
    [
        (KINDS[name], exponent)
        for name in PLAIN
        for exponent in BY_EXPONENT
        if exponent >= -2 or KINDS[name].order == 3
    ],
)
def test_freedoms_are_those_of_all_pairs_of_terms(kind, exponent):
    m, terms = octaves(kind)
    process = BY_EXPONENT[exponent]
    pairs = zip(m, terms, strict=True)
    scatter = [covariance(kind, (a, a), (n, n), process.phase) for a, n in pairs]
    expected = 2.0 * variances(kind, m, process) ** 2 / scatter
    # As above; flicker of phase peaks within a sample, narrower than the points lie.
    tolerance = 0.25 if exponent == 1 and kind.overlapping and not kind.modified else 1e-2
    np.testing.assert_allclose(
        degrees_of_freedom(kind, m, terms, process), expected, rtol=tolerance
    )


@BY_KIND
@BY_PROCESS
def test_variances_are_sums_over_the_weights_of_a_term(kind, process):
    for m in [1, 2, 3, 8, 50]:
        w = weights(kind, m)
        lags = np.subtract.outer(np.arange(w.size), np.arange(w.size))
        expected = w @ process.phase(lags.astype(float)) @ w
        # What the sums of flicker and Markov noise are good to at few samples.
        assert variances(kind, np.array([m]), process)[0] == pytest.approx(expected, rel=2e-3)


RECORDS, LENGTH = 1500, 512


def simulated(name, make):
    """Squared deviations of many records: kind `name`, shape (records, t)."""
    white = np.random.default_rng(5).standard_normal((RECORDS, LENGTH))
    z = np.stack([make(row) for row in white], axis=1)
    m, terms = octaves(KINDS[name], LENGTH)
    enough = terms >= 16
    return m[enough], terms[enough], allan_deviations(z, m[enough].tolist(), name)[0].T ** 2


@pytest.mark.parametrize("name", ["oadev", "ohdev", "mdev"])
@pytest.mark.parametrize(
    ("make", "process"),
    [(np.copy, WHITE), (sequences.flicker, FLICKER), (sequences.walk, WALK)],
    ids=["white", "flicker", "walk"],
)
def test_simulated_records_vary_as_said(name, make, process):
    m, terms, squares = simulated(name, make)
    expected = CurveStatistics(KINDS[name], m, terms, [process]).covariance(np.ones(1))
    found = np.cov(squares.T)
    # A flicker or a walk sampled at points, not averaged, is another noise at a few samples.
    sampled = m >= (1 if make is np.copy else 8)
    ratio = np.sqrt(np.diag(found) / np.diag(expected))[sampled]
    # The deviation of a deviation is 1/sqrt(2 * 1500) = 1.8 % for a Gaussian variable and up to
    # twice that for chi-squared of few degrees of freedom; four of those among some 50 points.
    np.testing.assert_allclose(ratio, 1.0, atol=4 * 0.036)
    sigmas = np.sqrt(np.diag(expected))
    correlation = (expected / np.outer(sigmas, sigmas))[np.ix_(sampled, sampled)]
    # That of a correlation is at most 1/sqrt(1500) = 2.6 %; four of those.
    np.testing.assert_allclose(
        np.corrcoef(squares.T)[np.ix_(sampled, sampled)], correlation, atol=4 * 0.026
    )


def test_freedoms_reach_their_limits():
    n, m = 2**20, np.array([64, 256])
    white = degrees_of_freedom(KINDS["oadev"], m, n + 1 - 2 * m, WHITE)
    # C(k) is piecewise linear: its square sums up to 2/3 m of C(0)^2 over each of its bends.
    np.testing.assert_allclose(white * m / n, 1.5, rtol=1e-2)
    separate = degrees_of_freedom(KINDS["adev"], m, n // m - 1, WHITE)
    # Neighbours correlate by -1/2: terms / (1 + 2/4).
    np.testing.assert_allclose(separate * m / n, 1.0 / 1.5, rtol=1e-2)
    one = degrees_of_freedom(KINDS["oadev"], np.array([500]), np.array([1]), WALK)
    assert one[0] == pytest.approx(1.0, rel=1e-14)


def test_a_ramp_meets_the_noise():
    """Monte Carlo of white noise on a ramp, whose cross terms add to the scatter."""
    slope = 0.02
    white = np.random.default_rng(6).standard_normal((LENGTH, RECORDS))
    z = white + slope * np.arange(LENGTH)[:, np.newaxis]
    m, terms = octaves(KINDS["oadev"], LENGTH)
    enough = terms >= 16
    squares = allan_deviations(z, m[enough].tolist(), "oadev")[0] ** 2
    statistics = CurveStatistics(KINDS["oadev"], m[enough], terms[enough], [WHITE])
    expected = np.sqrt(np.diag(statistics.covariance(np.ones(1), slope)))
    # As of the simulated records above.
    np.testing.assert_allclose(squares.std(axis=1) / expected, 1.0, atol=4 * 0.036)


def test_processes_add_as_independent_noises():
    m, terms = octaves(KINDS["oadev"])
    both = CurveStatistics(KINDS["oadev"], m, terms, [WHITE, WALK])

    def mixed(k):
        return 3.0 * WHITE.phase(k) + 0.01 * WALK.phase(k)

    expected = [
        covariance(KINDS["oadev"], (a, a), (n, n), mixed) for a, n in zip(m, terms, strict=True)
    ]
    # As of single processes.
    found = np.diag(both.covariance(np.array([3.0, 0.01])))
    np.testing.assert_allclose(found, expected, rtol=1e-2)
