"""Gain from correlated drifts in an array of gyros, by simulation.

``python examples/array_study.py [SEEDS]`` prints three tables in Markdown. The drifts are random
walks with known covariances. The white noise equals the drift at a known averaging time. A gain is
the drift of the plain mean divided by the drift of the weighted mean, by the true covariance. A
cell is the median over the seeds.

1. Gain from the whole estimated covariance, from its diagonal, and from the true covariance.
2. Gain reported by `virtual_gyro` with its standard error, and its RMS error in standard errors.
3. Two rules for the shrinkage of the covariance: by the length of the record, and by its degrees of
   freedom for drift.
"""

import sys
from collections.abc import Callable, Iterator

import numpy as np

import zerorate as zr
from tables import table
from zerorate.array.virtual_gyro import (
    drift_freedom,
    drift_weights,
    fit_noise,
    shrink_covariance,
    time_shrinkage,
)
from zerorate.types import Floats

RATE = 1.0
HOURS = {"10 min": 1.0 / 6.0, "1 h": 1.0, "4 h": 4.0, "16 h": 16.0}
CROSSING = 60.0
"""Averaging time at which the drift equals the white noise, s."""
CROSSINGS = (10.0, 60.0, 200.0)
SPREAD = 0.5
"""Standard deviation of the logarithm of the gyros' drifts."""

Draw = Callable[[np.random.Generator, int], Floats]


def alike(rng: np.random.Generator, n: int) -> Floats:
    """Return the covariance of drifts with a correlation of a half between all pairs."""
    sizes = np.exp(SPREAD * rng.standard_normal(n))
    return (0.5 + 0.5 * np.eye(n)) * np.outer(sizes, sizes)


def random(rng: np.random.Generator, n: int) -> Floats:
    """Return the covariance of random mixtures of n + 1 sources."""
    sources = rng.standard_normal((n, n + 1))
    sizes = np.exp(SPREAD * rng.standard_normal(n)) / np.linalg.norm(sources, axis=1)
    mixed = sources * sizes[:, np.newaxis]
    return mixed @ mixed.T


def alone(rng: np.random.Generator, n: int) -> Floats:
    """Return the covariance of independent drifts."""
    return np.diag(np.exp(2.0 * SPREAD * rng.standard_normal(n)))


ARRAYS: dict[str, tuple[Draw, int]] = {
    "4 gyros, +0.5": (alike, 4),
    "8 gyros, random": (random, 8),
    "28 gyros, random": (random, 28),
    "8 gyros, none": (alone, 8),
}


def record(rng: np.random.Generator, drift: Floats, hours: float, crossing: float) -> Floats:
    """Return samples of gyros with this covariance of their random walks."""
    n = round(3600.0 * hours * RATE)
    steps = rng.standard_normal((n, len(drift))) @ np.linalg.cholesky(drift).T
    # At the crossing R/tau = Q tau/3, for a gyro with the median drift of 1.
    white = crossing / np.sqrt(3.0) * np.sqrt(RATE)
    return np.cumsum(steps, axis=0) / np.sqrt(RATE) + white * rng.standard_normal(steps.shape)


def gain(weights: Floats, covariance: Floats) -> float:
    """Return the deviation of the mean divided by the deviation of the weighted mean."""
    return float(np.sqrt(covariance.mean() / (weights @ covariance @ weights)))


def runs(name: str, hours: float, crossing: float, seeds: int) -> Iterator[tuple[Floats, Floats]]:
    """Yield the true drift and a record for every seed."""
    draw, n = ARRAYS[name]
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        drift = draw(rng, n)
        yield drift, record(rng, drift, hours, crossing)


def gains(drift: Floats, z: Floats) -> dict[str, float]:
    """Return the gains in drift from the covariances of a record."""
    r = zr.array.allan_covariance(z, RATE)
    curves = (r.tau, r.matrix, r.edf)
    noise, n = fit_noise(*curves), len(drift)
    found = {
        "full": time_shrinkage(n, r.seconds),
        "freedom": n / (n + drift_freedom(*curves)),
        "diagonal": 1.0,
    }
    return {
        **{rule: gain(drift_weights(noise, shrinkage), drift) for rule, shrinkage in found.items()},
        "true": gain(least(drift), drift),
    }


def least(covariance: Floats) -> Floats:
    """Return the weights with the smallest variance."""
    weights = np.linalg.solve(shrink_covariance(covariance, 0.0), np.ones(len(covariance)))
    return weights / weights.sum()


def median(name: str, hours: float, crossing: float, seeds: int) -> dict[str, float]:
    """Return the gains of an array as medians over the seeds."""
    all_of_them = [gains(*run) for run in runs(name, hours, crossing, seeds)]
    return {rule: float(np.median([g[rule] for g in all_of_them])) for rule in all_of_them[0]}


def pays(seeds: int) -> str:
    """Return the first table."""
    rows = []
    for name in ARRAYS:
        cells = [median(name, hours, CROSSING, seeds) for hours in HOURS.values()]
        shown = [f"{c['full']:.2f} / {c['diagonal']:.2f}" for c in cells]
        rows.append((name, *shown, f"{cells[0]['true']:.2f}"))
    title = f"When correlation pays: full / diagonal (crossing at {CROSSING:g} s)"
    return table(title, ("sensor", *HOURS, "true"), rows, markdown=True)


def reported(name: str, horizon: float, seeds: int) -> tuple[str, ...]:
    """Return a row of the second table, for records of twice the minimum length."""
    hours = ARRAYS[name][1] / 2.0
    told, true, errors = [], [], []
    for drift, z in runs(name, hours, CROSSING, seeds):
        found = zr.array.allan_covariance(z, RATE).virtual_gyro(horizon)
        noise = 0.0 if np.isinf(horizon) else (CROSSING / horizon) ** 2
        told.append(found.gain)
        errors.append(found.gain_error)
        true.append(gain(found.weights, drift + noise * np.eye(len(drift))))
    apart = np.sqrt(np.mean(((np.array(told) - true) / errors) ** 2))
    shown = "infinite" if np.isinf(horizon) else f"{horizon:g} s"
    known = f"{np.median(told):.2f} ± {np.median(errors):.2f}"
    return name, f"{hours:g} h", shown, known, f"{np.median(true):.2f}", f"{apart:.1f}"


def reports(seeds: int) -> str:
    """Return the second table."""
    rows = [reported(name, horizon, seeds) for name in ARRAYS for horizon in (60.0, 600.0, np.inf)]
    head = ("sensor", "record", "horizon", "reported", "true", "errors apart")
    return table("Gain as virtual_gyro reports it", head, rows, markdown=True)


def rules(seeds: int) -> str:
    """Return the third table."""
    rows = []
    for name in ARRAYS:
        for crossing in CROSSINGS:
            cells = [median(name, hours, crossing, seeds) for hours in HOURS.values()]
            shown = [f"{c['full']:.2f} / {c['freedom']:.2f}" for c in cells]
            rows.append((name, f"{crossing:g} s", *shown))
    title = "Moved to the diagonal by length of record / by degrees of freedom"
    return table(title, ("sensor", "crossing", *HOURS), rows, markdown=True)


def main() -> None:
    """Print the tables."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    for part in (pays, reports, rules):
        print(part(seeds), flush=True)


if __name__ == "__main__":
    main()
