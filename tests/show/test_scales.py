"""Limits of panels, and long series cut down to what one can show."""

import numpy as np
import pytest

from zerorate.show.scales import MAX_BUCKETS, bucket_extremes, robust_limits, trace_outline


def test_every_peak_is_inside():
    z = np.random.default_rng(3).standard_normal(12_345)
    t, least, most = bucket_extremes(z, 10.0)
    assert len(t) == MAX_BUCKETS
    assert (least.min(), most.max()) == (z.min(), z.max())
    _, y = trace_outline(z, 10.0)
    assert (y.min(), y.max()) == (z.min(), z.max())


def test_short_series_stay_as_they_are():
    z = np.array([3.0, np.inf, 1.0])
    t, least, most = bucket_extremes(z, 2.0)
    np.testing.assert_array_equal(t, [0.0, 0.5, 1.0])
    np.testing.assert_array_equal(least, [3.0, np.nan, 1.0])
    np.testing.assert_array_equal(most, least)


def test_a_gap_stays_a_gap():
    z = np.ones(10_000)
    z[4000:6000] = np.nan
    _, least, _ = bucket_extremes(z, 1.0)
    assert np.isnan(least).sum() == pytest.approx(0.2 * MAX_BUCKETS, abs=1)


@pytest.mark.parametrize("z", [[np.nan], [0.0], [5.0, 5.0], [1e300, 1e300], [1.0, 2.0]])
def test_limits_are_apart(z):
    low, high = robust_limits(np.array(z))
    assert np.isfinite([low, high]).all()
    assert low < high


def test_an_outlier_does_not_flatten_the_rest():
    z = np.append(np.random.default_rng(4).standard_normal(10_000), 1e9)
    assert robust_limits(z)[1] < 10.0
