"""Speed of the count of reversals relative to peers, all in one run.

Run ``python benches/reversals_ratios.py``. Every round times each peer once, and the table has the
minimum.
"""

import ctypes
import time

import numpy as np
from scipy.stats import kendalltau
from zerorate.identification.reverse_arrangements import reverse_arrangements

import peers
from versions import print_versions
from zerorate._native import reversals

ROUNDS = 7
SOURCE = peers.SOURCE.with_name("reversals.c")


def c_reversals():
    """Return the count of reversals in C."""
    flags = ["-O3", "-march=native"]
    library = ctypes.CDLL(str(peers.compile_library("reversals.so", *flags, source=SOURCE)))
    function = library.reversals
    function.argtypes = [np.ctypeslib.ndpointer(np.float64, flags="C"), ctypes.c_size_t]
    function.restype = ctypes.c_uint64
    return lambda z: function(z, z.size)


def seconds(run, z):
    start = time.perf_counter()
    run(z)
    return time.perf_counter() - start


def main():
    print_versions("scipy", "cc")
    runs = {
        "zerorate, count alone": reversals,
        "zerorate, whole test": lambda z: reverse_arrangements(z, segments=None),
        "C": c_reversals(),
        "scipy kendalltau": lambda z: kendalltau(np.arange(z.size), z),
    }
    noise = np.random.default_rng(1).standard_normal(1_000_000)
    for name, z in {"noise": noise, "coarse noise": np.round(5.0 * noise)}.items():
        best = dict.fromkeys(runs, np.inf)
        for _ in range(ROUNDS):
            for peer, run in runs.items():
                best[peer] = min(best[peer], seconds(run, z))
        print(f"{name}, {z.size:,} samples")
        for peer, least in best.items():
            print(f"  {peer:24}{least * 1e3:8.1f} ms{least / best['C']:8.2f} of C")


if __name__ == "__main__":
    main()
