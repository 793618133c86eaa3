"""Positions beside their twins."""

import numpy as np
import pytest

import zerorate as zr
from oracle.position import TWINS

# Of 20 receivers 5 have each set of constants: 1.2e5 fixes in all.
RECEIVERS, FIXES = 20, 2500
# Both round some tens of operations a fix to 1.1e-16 of what they hold: 2e-13 is seen.
TOLERANCE = 1e-10

OTHER = {
    "aided": {
        "sigma": 2.0,
        "error_sigma": 0.3,
        "error_time": 7.0,
        "speed_sigma": 0.5,
        "acceleration": 0.1,
    },
    "moving_average": {"window": 64},
    "kalman": {"sigma": 3.0, "process_noise": 0.01},
    "heading": {"step": 1.0, "turn": 0.4},
    "strength": {"sigma": 0.2, "process_noise": 5.0},
}


def wandering(seed=1):
    """Receivers that stand, walk and lose fixes, Doppler and signals; times that are not even."""
    rng = np.random.default_rng(seed)
    shape = (FIXES, RECEIVERS)
    rest = np.repeat(rng.random((FIXES // 50, RECEIVERS)) < 0.5, 50, axis=0)
    dt = rng.uniform(0.2, 2.0, FIXES)
    velocity = np.where(rest[..., None], 0.0, np.cumsum(rng.normal(0.0, 0.3, (*shape, 2)), axis=0))
    place = np.cumsum(velocity * dt[:, None, None], axis=0)
    fixes = place + rng.normal(0.0, 1.0, place.shape)
    speed = velocity + rng.normal(0.0, 0.1, place.shape)
    cn0 = rng.uniform(-5.0, 60.0, shape)
    fixes[rng.random(shape) < 0.1] = np.nan
    speed[np.repeat(rng.random((FIXES // 10, RECEIVERS)) < 0.2, 10, axis=0)] = np.nan
    cn0[rng.random(shape) < 0.1] = np.nan
    return fixes, speed, cn0, rest, dt


RECORD = wandering()


def of_twins(method, chosen, fixes, speed, cn0, rest, dt):
    twins = [TWINS[method](**chosen) for _ in range(fixes.shape[1])]
    found = np.empty(fixes.shape)
    for k, T in enumerate(dt.tolist()):
        for i, twin in enumerate(twins):
            found[k, i] = twin.update(fixes[k, i], speed[k, i], cn0[k, i], rest[k, i], T)
    return twins, found


@pytest.mark.every(4)
@pytest.mark.parametrize("constants", ["default", "other"])
@pytest.mark.parametrize("method", TWINS)
def test_equal_to_its_twin(method, constants):
    chosen = OTHER[method] if constants == "other" else {}
    half = slice(None, RECEIVERS // 4) if constants == "other" else slice(-RECEIVERS // 4, None)
    *given, dt = RECORD
    given = [np.ascontiguousarray(part[:, half]) for part in given]
    twins, expected = of_twins(method, chosen, *given, dt)
    f = zr.PositionFilter(1.0, method=method, channels=given[0].shape[1], **chosen)
    found = f.process(*given, dt=dt)
    scale = np.nanmax(np.abs(expected))
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=TOLERANCE * scale)
    if hasattr(twins[0], "P"):
        np.testing.assert_allclose(f.sigma, [t.deviation for t in twins], rtol=TOLERANCE)
        second = f.receiver_error if method == "aided" else f.velocity
        held = np.array([twin.x[1] for twin in twins])
        np.testing.assert_allclose(second, held, rtol=0.0, atol=TOLERANCE * scale)
