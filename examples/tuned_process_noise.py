"""Regret of the published filters on simulated gyros, over their initial process noise.

python examples/tuned_process_noise.py [--seeds N] [--markdown]

No recording is needed. `zerorate compare --simulated` runs the same gyros with the default of 0.1.
"""

import argparse
from collections.abc import Sequence

import numpy as np

import zerorate as zr
from published_tables import Method
from recordings import Floats
from tables import table
from zerorate.tasks.compare.methods import Method as Judged
from zerorate.tasks.compare.simulated import Regret, run

METHODS: tuple[Method, ...] = ("kf", "fading")
STARTS = tuple(10.0**power for power in range(-1, -11, -1))
HEAD = ("process noise G0", *(f"{name} {what}" for name in METHODS for what in ("mean", "worst")))


def started(method: Method, process_noise: float) -> Judged:
    """Return a filter of the paper with this process noise, as a method for the comparison."""

    def judged(signal: Floats, rate: float) -> Floats:
        bank = zr.DriftFilter(
            rate,
            method=method,
            process_noise=process_noise,
            output="estimate",
            channels=signal.shape[1],
        )
        return np.asarray(bank.process(signal))

    judged.__name__ = f"{method} from {process_noise:g}"
    return judged


def rows(found: Regret) -> list[Sequence[str]]:
    """Return a row for each start, then a row with the best start of each gyro."""
    kept = found.regret[found.lasting_mask, :-1].reshape(-1, len(METHODS), len(STARTS))
    listed = [(f"{start:.0e}", kept[:, :, i]) for i, start in enumerate(STARTS)]
    listed.append(("the best of each gyro", kept.min(axis=2)))
    return [(label, *_summary(values)) for label, values in listed]


def _summary(values: Floats) -> list[str]:
    """Return mean and maximum of each method, from regrets of shape (gyros, methods)."""
    pairs = zip(values.mean(axis=0), values.max(axis=0), strict=True)
    return [f"{value:.2f}" for pair in pairs for value in pair]


def main() -> None:
    """Run from the command line."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seeds", type=int, default=12, help="records of each gyro (default: 12)")
    options.add_argument("--markdown", action="store_true", help="print tables in Markdown")
    given = options.parse_args()
    judged = [started(method, start) for method in METHODS for start in STARTS]
    found = run([*judged, "auto"], seeds=given.seeds)
    auto = f"{found.mean[-1]:.2f}, worst {found.worst[-1]:.2f}"
    title = f"Regret on {found.lasting_mask.sum()} simulated gyros at rest; auto: mean {auto}"
    print(table(title, HEAD, rows(found), given.markdown))


if __name__ == "__main__":
    main()
