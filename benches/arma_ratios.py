"""Speed of the ARMA fits relative to peers, all in one run.

Run ``python benches/arma_ratios.py``, or with ``--no-statsmodels`` for the comparison with C only.

A grid has all orders p, q = 0 to 3. Each row is a record, and its time is the minimum of several
rounds. Every round runs each peer once. C uses the same start values except Hannan and Rissanen's,
and Gauss-Newton steps with analytic derivatives. `gain` is the decrease of N ln sigma^2 relative to
C, at the order with the largest difference.
"""

import sys
import time
from functools import partial

import numpy as np

import peers
from versions import print_versions
from zerorate.identification.arma import arma_grid, fit_arma

ROUNDS = 5


def filtered(phi, theta, n, seed):
    """Return n samples of an ARMA process, computed sample by sample."""
    a = np.random.default_rng(seed).standard_normal(n + 1000)
    z = np.convolve(a, [1.0, *theta])[: a.size]
    for t in range(len(phi), z.size):
        for i, coefficient in enumerate(phi):
            z[t] += coefficient * z[t - 1 - i]
    return z[1000:]


def records(n):
    """Return names and records: typical gyros, and a process beyond all orders up to (1, 1)."""
    white, steps = np.random.default_rng(1).standard_normal((2, n))
    yield "white", white
    yield "drift", filtered([0.999], [-0.99], n, 2)
    yield "walk", white + 0.003 * np.cumsum(steps)
    yield "ARMA(2,2)", filtered([0.6, -0.4], [0.5, 0.3], n, 3)


def seconds(run, z):
    start = time.perf_counter()
    answer = run(z)
    return time.perf_counter() - start, answer


def statsmodels_grid(z):
    import warnings

    from statsmodels.tsa.arima.model import ARIMA

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return [ARIMA(z, order=(p, 0, q)).fit().aic for p in range(4) for q in range(4)]


def print_grid(name, z, c, peer):
    best = [np.inf, np.inf]
    for _ in range(ROUNDS):
        (one, grid), (other, (sigma2, passes)) = (
            seconds(lambda z: arma_grid(z, 3, 3), z),
            seconds(c, z),
        )
        best = [min(best[0], one), min(best[1], other)]
    gain = np.max(grid.n * np.log(sigma2 / grid.sigma2))
    times = f"{best[0] * 1e3:10.1f}{best[1] / best[0]:8.2f}"
    counts = f"{int(grid.evaluations.sum()):10}{passes:10}{gain:10.2f}"
    python = f"{seconds(statsmodels_grid, z)[0] / best[0]:12.0f}" if peer else f"{'-':>12}"
    print(f"{name:12}{z.size:>10,}{times}{counts}{python}", flush=True)


def print_exact(n):
    z = filtered([0.9], [-0.5], n, 4)
    for p, q in [(1, 1), (2, 1), (3, 3)]:
        conditional = min(seconds(partial(fit_arma, p=p, q=q), z)[0] for _ in range(3))
        exact = min(seconds(partial(fit_arma, p=p, q=q, method="exact"), z)[0] for _ in range(3))
        print(f"ARMA({p},{q}) {n:>12,}{conditional * 1e3:12.1f}{exact * 1e3:12.1f}", flush=True)


def main():
    print_versions("statsmodels", "cc")
    c, peer = peers.c_arma_grid(), "--no-statsmodels" not in sys.argv
    heads = f"{'ms':>10}{'to C':>8}{'passes':>10}{'in C':>10}{'gain':>10}{'statsmodels':>12}"
    print(f"{'grid':12}{'samples':>10}{heads}")
    for n in (15_000, 100_000):
        for name, z in records(n):
            print_grid(name, z, c, peer and n == 15_000 and name == "drift")
    print(f"\n{'fit':10}{'samples':>12}{'css ms':>12}{'exact ms':>12}")
    for n in (15_000, 1_000_000):
        print_exact(n)


if __name__ == "__main__":
    main()
