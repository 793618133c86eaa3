"""Speed of the identification relative to peers, all in one run.

Run ``python benches/identify_ratios.py``, or with ``--no-peers`` for the comparison with C only.

Each row is a task on white noise, and its time is the minimum of several rounds. Every round times
each peer once, so that a disturbance of the machine affects all equally. The time of zerorate is
the time of the public function.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

import peers
from versions import print_versions
from zerorate.identification import fit_ar, select_order

ROUNDS = 15
SIZES = (15_000, 1_000_000)

# In a round, a fast task is called often enough for the resolution of the clock.
LEAST_SECONDS = 2e-3
LONGEST_SECONDS = 2.0


@dataclass
class Row:
    """A task for a number of samples, with the functions that do it."""

    name: str
    n: int
    zerorate: Callable
    c: Callable | None = None
    others: dict[str, Callable] = field(default_factory=dict)


def order_with_criteria(z):
    """Compute three criteria for the orders 0 to 10, and return the best order."""
    selection = select_order(z)
    return selection.fpe, selection.aic, selection.bic, selection.order


def statsmodels_order():
    from statsmodels.tsa.ar_model import ar_select_order

    return {"statsmodels": lambda z: ar_select_order(z, 10, "aic", trend="c")}


def statsmodels_fit():
    from statsmodels.tsa.ar_model import AutoReg

    return {"statsmodels": lambda z: AutoReg(z, 10, trend="c").fit()}


def statsmodels_burg():
    from statsmodels.regression.linear_model import burg

    return {"statsmodels": lambda z: burg(z, 10)}


def integrated_twice(z):
    """Return a record for which the normal equations would lose all precision."""
    return np.cumsum(np.cumsum(z))


def autoregression_rows():
    for n in SIZES:
        for c in ("order_fused", "order_plain"):
            others = statsmodels_order() if c == "order_fused" else {}
            yield Row(f"AR order <= 10, {c}", n, order_with_criteria, peers.c_order(c), others)
        yield Row("fit_ar, p = 10", n, lambda z: fit_ar(z, 10), None, statsmodels_fit())
        burg = partial(fit_ar, p=10, method="burg")
        yield Row("fit_ar, p = 10, Burg", n, burg, None, statsmodels_burg())
        smooth = integrated_twice(record(n))
        by_rows, peer = (lambda _, f=f, z=smooth: f(z, 10) for f in (fit_ar, lstsq_fit))
        yield Row("fit_ar, p = 10, by rows", n, by_rows, None, {"lstsq": peer})


def lstsq_fit(z, p):
    windows = np.lib.stride_tricks.sliding_window_view(z - z.mean(), p + 1)
    design = np.column_stack([np.ones(len(windows)), windows[:, :-1]])
    return np.linalg.lstsq(design, windows[:, -1], rcond=None)


def record(n):
    return np.random.default_rng(1).standard_normal(n)


def seconds(run, z, calls):
    start = time.perf_counter()
    for _ in range(calls):
        run(z)
    return (time.perf_counter() - start) / calls


def timed(runs, z):
    """Return the minimum time of each function, s; a function that takes seconds runs once."""
    best = [seconds(run, z, 1) for run in runs]
    calls = [max(1, int(LEAST_SECONDS / first)) for first in best]
    for _ in range(ROUNDS):
        for i, run in enumerate(runs):
            if best[i] < LONGEST_SECONDS:
                best[i] = min(best[i], seconds(run, z, calls[i]))
    return best


def print_row(row, with_peers):
    others = row.others if with_peers else {}
    runs = [row.zerorate, *([row.c] if row.c else []), *others.values()]
    own, *rest = timed(runs, record(row.n))
    to_c = f"{own / rest.pop(0):.2f}" if row.c else "-"
    slower = [f"{name} {time / own:.3g}x" for name, time in zip(others, rest, strict=True)]
    print(f"{row.name:30}{row.n:>11,}{own * 1e3:>11.4f}{to_c:>8}  {', '.join(slower)}", flush=True)


def main():
    print_versions("statsmodels", "cc")
    print(f"{'task':30}{'samples':>11}{'ms':>11}{'to C':>8}  times zerorate's")
    for row in autoregression_rows():
        print_row(row, with_peers="--no-peers" not in sys.argv)


if __name__ == "__main__":
    main()
