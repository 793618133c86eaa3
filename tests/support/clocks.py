"""Forms of clocks: the stamps of an even sensor as devices, hosts and loggers write them."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Stamped:
    """Which samples came, what their stamps are, and what is known of them.

    `column` holds the stamps as they are written, in `unit`. `exact` says that the log's clock has
    the rate to the last bit, so that the live answers must be those of the log. `part` is the rate
    that is stated, as a part of that of the rows.
    """

    rows: np.ndarray
    column: np.ndarray
    unit: str = "s"
    exact: bool = True
    tell: str = ""
    part: float = 1.0


def _of(stamps, **known):
    return Stamped(np.arange(len(stamps)), stamps, **known)


def _without(stamps, lost, **known):
    rows = np.setdiff1d(np.arange(len(stamps)), lost)
    return Stamped(rows, stamps[rows], **known)


def _repeats(t, some, seed):
    """Rows that repeat the one before: at the rate of the rows they are kept, else left out."""
    i = np.arange(len(t))
    at_random = np.where(np.random.default_rng(seed).random(len(t)) < 1.0 / 3.0, 0, i)
    half, third, slow = i // 2 * 2, i - (i % 3 == 2), i // 5 * 5
    there = np.setdiff1d(i, some)
    equal = half.copy()
    equal[len(t) // 6 : len(t) // 6 + 8], equal[-900:-898] = half[len(t) // 6], half[-901]
    frozen = half.copy()
    frozen[len(t) // 2 : len(t) // 2 + 200] = half[len(t) // 2]
    free = np.floor(0.473 * i + 0.2).astype(np.int64)
    left_out = {"tell": "rows left out that repeat", "part": 0.5}
    return {
        "every second repeats": Stamped(half, t),
        "every third repeats": Stamped(third, t),
        "a third repeats at random": Stamped(np.maximum.accumulate(at_random), t),
        "every second left out": Stamped(half, t, **left_out),
        "every third left out": Stamped(third, t, **{**left_out, "part": 2.0 / 3.0}),
        "four of five left out": Stamped(slow, t, **{**left_out, "part": 0.2}),
        "left out, equal samples": Stamped(equal, t, **left_out),
        "left out, some frozen": Stamped(frozen, t, **left_out),
        "left out, losses": Stamped(half[there], t[there], **left_out),
        "left out, free": Stamped(
            np.searchsorted(free, free), t, **{**left_out, "part": 0.473}, exact=False
        ),
    }


def _sent_again(t, seed):
    """Rows of which a third or so is a sample once more, with its stamp or with one of its own."""
    rng, rate, n = np.random.default_rng(seed), 1.0 / t[1], len(t)
    left_out = {"tell": "with no clock of their own", "part": 2.0 / 3.0}
    first = np.cumsum(np.append(0, rng.random(n - 1) < 2.0 / 3.0))
    first = np.searchsorted(first, first)
    stamps = np.cumsum(np.append(0, np.diff(first) > 0)) / (rate * 2.0 / 3.0)
    polled = np.cumsum(rng.uniform(0.6, 1.4, n)) / rate
    seen = np.floor(polled * rate * 2.0 / 3.0).astype(np.int64)
    return {
        "sent twice": Stamped(first, stamps, **left_out),
        "polled": Stamped(np.searchsorted(seen, seen), np.round(polled, 6), **left_out),
    }


def _blocks(t, size, digits=3):
    i = np.arange(len(t))
    return np.round(t[np.minimum(i // size * size + size - 1, len(t) - 1)], digits)


def _wrapped(t, bits, per_second, first):
    return (np.rint(t * per_second).astype(np.int64) + first) % (1 << bits)


def forms(rate, n, seed=1):
    """Return forms of the clock of n samples of a sensor, by name."""
    rng = np.random.default_rng(seed)
    i = np.arange(n)
    t, period, mid = i / rate, 1.0 / rate, n // 2
    some = np.r_[n // 6 : n // 6 + 3, mid : mid + 10, 5 * n // 6]
    noise = rng.normal(size=n)
    stall, wild, old, swapped = t.copy(), t.copy(), t.copy(), t.copy()
    stall[mid : mid + 12] = t[mid + 11]
    wild[mid] += 500.0
    old[mid] -= 5.0
    swapped[[mid, mid + 1]] = t[[mid + 1, mid]]
    late = np.maximum.accumulate(t + 0.2 * period * np.abs(noise))
    return {
        "regular": _of(t),
        "regular in us": _of(np.rint(1e6 * t).astype(np.int64), unit="us"),
        "unix time": _of(np.round(1.7e9 + t, 6)),
        "whole ms": _of(np.rint(1e3 * t).astype(np.int64), unit="ms"),
        "jittered": _of(t + 0.1 * period * noise),
        "late": _of(late),
        "blocks of 2": _of(_blocks(t, 2)),
        "blocks of 5": _of(_blocks(t, 5)),
        "blocks of 10": _of(_blocks(t, 10)),
        "blocks of 32": _of(_blocks(t, 32)),
        "blocks from amid": Stamped(
            i[3:], _blocks(np.append(t, t[-1] + t[1:4]), 10)[3:n], exact=False
        ),
        "losses": _without(t, some, tell="3 gaps; 14 samples"),
        "a twentieth lost": _without(t, np.sort(rng.choice(n - 100, n // 20, replace=False)) + 50),
        "losses among jitter": _without(t + 0.1 * period * noise, some),
        "a leap of 3 s": _of(t + 3.0 * (i > mid), tell="1 gap; "),
        "set back by 0.3 s": _of(t - 0.3 * (i > mid), tell="1 step back"),
        "a restart": _of(t - t[mid] * (i >= mid), tell="1 new beginning"),
        "two restarts": _of(t - 12.0 * (i >= n // 3) - 12.0 * (i >= 2 * n // 3)),
        "a wild stamp": _of(wild),
        "an old stamp": _of(old),
        "a stall": _of(stall),
        "two swapped": _of(swapped),
        "wraps at 2^16": _of(_wrapped(t, 16, 1e3, 60_000), unit="ms", tell="wrapped"),
        "wraps at 2^31": _of(_wrapped(t, 31, 1e6, 2**31 - 5_000_000), unit="us", tell="wrapped"),
        "wraps at 2^32": _of(_wrapped(t, 32, 1e6, 2**32 - 5_000_000), unit="us", tell="wrapped"),
        "another rate": _of(t / 1.006, exact=False, tell="not at the rate stated"),
        "a rate far off": _of(t / 1.04, exact=False, tell="not at the rate stated"),
        "wandering": _of(t + 0.05 * np.sin(2.0 * np.pi * t / 30.0), exact=False),
        **_repeats(t, some, seed),
        **_sent_again(t, seed),
    }
