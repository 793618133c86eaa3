"""Speed of the deviations relative to peers, all in one run.

Run ``python benches/allan_ratios.py``, or with ``--no-allantools`` for the comparison with C only.

Each row is a kind of deviation on a grid of averaging factors. The time is the minimum of several
rounds. Every round times each peer once, so that a disturbance of the machine affects all equally.
zerorate uses one thread, except in the last column, and also identifies the noise types.
"""

import subprocess
import sys
import time
import warnings

import numpy as np

import peers
from versions import print_versions
from zerorate._native import allan_deviations, longest_factor

ROUNDS = 7

MEMORY = """
import resource, sys
import numpy as np
from zerorate._native import allan_deviations
z = np.random.default_rng(1).standard_normal(10_000_000)
allan_deviations(z[:1000], [1], sys.argv[1], threads=1)
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
allan_deviations(z, [1 << i for i in range(22)], sys.argv[1], threads=1)
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024 / z.nbytes)
"""


def octaves(n):
    return [1 << i for i in range((n // 4).bit_length())]


def ten_per_decade(n):
    return sorted({round(10 ** (i / 10)) for i in range(int(10 * np.log10(n // 4)) + 1)})


def even_octaves(n):
    return [m for m in octaves(n) if m >= 16]


def within(kind, factors, n):
    return [m for m in factors if m <= longest_factor(kind, n)]


def zerorate(kind, threads):
    return lambda z, factors: allan_deviations(z, factors, kind, threads=threads)[0]


def allantools(kind):
    import allantools as peer

    def run(z, factors):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return getattr(peer, kind)(z, rate=1.0, data_type="freq", taus=factors)[1]

    return run


def rows():
    """Return kind, grid name, factors, samples, name in C, and True if allantools takes seconds."""
    for n in (1_000_000, 10_000_000):
        for kind, c in [("oadev", "oadev_fused"), ("oadev", "oadev_plain")]:
            yield kind, "octave", octaves(n), n, c
            yield kind, "10 a decade", ten_per_decade(n), n, c
        for kind in ("ohdev", "mdev", "totdev"):
            yield kind, "octave", octaves(n), n, f"{kind}_plain"
    yield "theo1", "octave", even_octaves(10_000), 10_000, "theo1_plain"
    for kind in ("adev", "hdev", "pdev"):
        yield kind, "octave", octaves(100_000), 100_000, None
    for kind in ("mtotdev", "htotdev"):
        yield kind, "decade", [1, 10, 100], 2_000, None


def seconds(run, z, factors):
    start = time.perf_counter()
    run(z, factors)
    return time.perf_counter() - start


def timed(peers_of_row, z, factors, rounds):
    """Return the minimum time of each peer, s; a peer that takes seconds runs once."""
    best = [np.inf] * len(peers_of_row)
    for _ in range(rounds):
        for i, run in enumerate(peers_of_row):
            if run is not None and not 2.0 < best[i] < np.inf:
                best[i] = min(best[i], seconds(run, z, factors))
    return best


def print_row(kind, grid, n, c, times):
    one, many, native, python = times
    ratios = [one / native, python / one, one / many]
    cells = [f"{r:.2f}" if np.isfinite(r) and r > 0.0 else "-" for r in ratios]
    line = f"{kind:8}{grid:13}{n:>12,}{one * 1e3:11.2f}  {c or '':13}"
    print(f"{line}{cells[0]:>10}{cells[1]:>12}{cells[2]:>10}", flush=True)


def print_memory():
    print("memory at its peak beyond the input, in sizes of the input, 10,000,000 samples")
    for kind in ("oadev", "ohdev", "mdev", "totdev"):
        command = [sys.executable, "-c", MEMORY, kind]
        answer = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        print(f"{kind:8}{float(answer):8.2f}")


def main():
    print_versions("allantools", "cc")
    # This comes first: a child's peak memory starts at the peak of the process that forks it.
    print_memory()
    slow = "--no-allantools" not in sys.argv
    c_deviations = peers.c_deviations()
    heads = f"{'to C':>10}{'allantools':>12}{'threads':>10}"
    print(f"\n{'':33}{'one thread':>11}  {'C':13}{heads}")
    units = f"{'times':>10}{'times':>12}{'gain':>10}"
    print(f"{'kind':8}{'grid':13}{'samples':>12}{'ms':>11}  {'':13}{units}")
    for kind, grid, factors, n, c in rows():
        z = np.random.default_rng(1).standard_normal(n)
        factors = within(kind, factors, n)
        native = c_deviations(c) if c else None
        python = allantools(kind) if slow else None
        runs = [zerorate(kind, 1), zerorate(kind, None), native, python]
        print_row(kind, grid, n, c, timed(runs, z, factors, ROUNDS))


if __name__ == "__main__":
    main()
