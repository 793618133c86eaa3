"""The partition and the joint fit of a magnetometer's record against their slow twins."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from oracle import magnetometer as twin
from zerorate._native import magnet_covariance, magnet_fit, magnet_partition
from zerorate.calibration.magnet.fit import BASIS


def ticks(n, seed=0):
    """Number, e, B and y of a sensor that turns; another iron from the middle on, and a gap."""
    rng = np.random.default_rng(seed)
    number = np.delete(np.arange(n + 15), np.arange(40, 55))
    t = 0.1 * number
    angles = np.column_stack([0.9 * t, 0.8 * np.sin(0.5 * t), 0.7 * np.sin(0.33 * t)])
    turn = Rotation.from_euler("ZYX", angles).as_matrix()
    y = turn.transpose(0, 2, 1) @ np.array([0.0, 0.45, -0.9]) + [0.3, -0.2, 0.4]
    y[n // 2 :] += [0.4, 0.1, -0.3]
    y[n // 4 : n // 4 + 20] += rng.normal(0.0, 0.6, (20, 3))
    y += rng.normal(0.0, 0.01, y.shape)
    e = (turn @ y[:, :, None])[:, :, 0] + rng.normal(0.0, 0.002, y.shape)
    return number, e, turn, y


@pytest.mark.parametrize("walk", [0.5, 8.0])
def test_partition(walk):
    number, e, turn, _ = ticks(220)
    ((cost, spans),) = magnet_partition(number, e, turn, 1e-4, [walk])
    least, expected = twin.partition(number, e, turn, 1e-4, walk)
    assert cost == pytest.approx(least, rel=1e-9)
    assert spans == expected
    assert len(spans) > 1


@pytest.mark.parametrize("soft", [(), (0, 1), tuple(range(8))])
def test_fit_and_covariance(soft):
    number, e, turn, y = ticks(440)
    group, window = (
        (np.arange(440) >= 220).astype(int),
        np.unique(number // 50, return_inverse=True)[1],
    )
    found = magnet_fit(turn, y, e, group, window, BASIS[list(soft)])
    expected = twin.fit(turn, y, e, group, window, BASIS[list(soft)])
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-7, atol=1e-9)
    values = np.zeros(8)
    values[list(soft)] = found[1]
    whole, doubt = (found[0], values, *found[2:]), np.full(8, 0.05)
    matrix = magnet_covariance(turn, y, group, window, BASIS, whole, doubt)
    slow = twin.covariance(turn, group, window, BASIS, whole, doubt)
    np.testing.assert_allclose(matrix, slow, rtol=1e-7, atol=1e-12)


def test_arguments_are_checked():
    number, e, turn, y = ticks(60)
    group = np.zeros(60, dtype=int)
    with pytest.raises(ValueError, match="number must increase"):
        magnet_partition(number[::-1], e, turn, 1e-4, [1.0])
    with pytest.raises(ValueError, match="turned must be finite"):
        magnet_partition(number, e * np.nan, turn, 1e-4, [1.0])
    with pytest.raises(ValueError, match="noise must be positive"):
        magnet_partition(number, e, turn, 0.0, [1.0])
    with pytest.raises(ValueError, match="windows never decrease"):
        magnet_fit(turn, y, e, group, np.arange(60)[::-1], BASIS)
    with pytest.raises(ValueError, match="numbered from 0"):
        magnet_fit(turn, y, e, group + 10**9, group, BASIS)
    with pytest.raises(ValueError, match="group must be int64"):
        magnet_fit(turn, y, e, group - 1, group, BASIS)
    nothing = np.zeros((0, 3))
    assert magnet_partition(group[:0], nothing, np.zeros((0, 3, 3)), 1.0, [1.0]) == [(0.0, [])]
