"""The measures gathered block by block are those of whole arrays."""

import numpy as np
import pytest

from zerorate import metrics
from zerorate._native import ReplayScores

RATE = 50.0


def record(seed, n=5000, offset=0.0, gaps=True):
    rng = np.random.default_rng(seed)
    raw = offset + rng.standard_normal((2, n)) + np.cumsum(0.01 * rng.standard_normal((2, n)), 1)
    if gaps:
        raw[0, rng.random(n) < 0.002] = np.nan
        raw[1, n // 3 : n // 2] = np.inf
    return raw, offset + 0.1 * rng.standard_normal((2, n))


def scored(raw, estimate, horizons, rows, **options):
    scores = ReplayScores(len(raw), 1, horizons, options.get("delay"))
    for first in range(0, raw.shape[1], rows):
        part = np.s_[:, first : first + rows]
        beside = [options[name][part] if name in options else None for name in ("at_rest", "truth")]
        scores.take(raw[part], [estimate[part]], *beside)
    return scores.finish()


@pytest.mark.parametrize("offset", [0.0, 1e6])
@pytest.mark.parametrize("gaps", [False, True])
def test_they_are_the_public_metrics(offset, gaps):
    raw, estimate = record(1, offset=offset, gaps=gaps)
    found = scored(raw, estimate, [7, 200], 999, truth=estimate + 0.25)
    for i in range(2):
        there = np.isfinite(raw[i])
        for j, series in enumerate((raw[i], estimate[i])):
            # Sums of n terms round to n eps of their largest, at an offset of 1e6 to 1e-10.
            assert found["mean"][i, j] == pytest.approx(series[there].mean(), rel=1e-12)
            assert found["deviation"][i, j] == pytest.approx(series[there].std(), rel=1e-9)
            known = np.where(there, raw[i], np.nan)
            expected = [
                RATE * metrics.coasting_error(known, series, RATE, m / RATE) for m in (7, 200)
            ]
            np.testing.assert_allclose(found["coasting"][i, j], expected, rtol=1e-8)
        # 0.25 is exact, its sum with a number of 1e6 is not: eps of 1e6 over 0.25.
        assert found["error"][i, 1] == pytest.approx(0.25, rel=1e-9)
        assert found["missing"][i] == np.isnan(raw[i]).sum()
        assert found["present"][i] == there.sum()
        assert (found["least"][i], found["most"][i]) == (raw[i][there].min(), raw[i][there].max())


def test_blocks_do_not_change_a_digit():
    raw, estimate = record(2)
    at_rest = np.random.default_rng(3).random(raw.shape) < 0.999
    options = {"delay": 25, "at_rest": at_rest}
    whole = scored(raw, estimate, [100, 2600], 10_000, **options)
    for rows in (1, 100, 256, 3001):
        parts = scored(raw, estimate, [100, 2600], rows, **options)
        for name, values in whole.items():
            np.testing.assert_array_equal(parts[name], values, err_msg=name)


def test_no_digit_is_lost_in_a_long_record():
    """A hundred million samples of mean 1000.5 and deviation 0.5, exactly."""
    scores = ReplayScores(1, 0, [], None)
    block = np.tile([1000.0, 1001.0], 1 << 17)[np.newaxis]
    for _ in range(381):
        scores.take(block, [])
    found = scores.finish()
    assert found["present"][0] == 381 * block.size
    assert (found["mean"][0, 0], found["deviation"][0, 0]) == (1000.5, 0.5)


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ((np.zeros((1, 5)), [np.zeros((2, 5))]), "raw must have shape"),
        ((np.zeros((2, 5)), []), "estimates must have shape"),
        ((np.zeros((2, 5)), [np.zeros((2, 4))]), "an estimate must have shape"),
        ((np.zeros((5, 2)).T, [np.zeros((2, 5))]), "rows without gaps"),
    ],
)
def test_blocks_of_another_shape_are_refused(arguments, match):
    with pytest.raises(ValueError, match=match):
        ReplayScores(2, 1, [], None).take(*arguments)
