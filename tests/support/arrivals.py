"""Logs stamped by their host as samples arrive: in bursts, late by what the host was busy with."""

from dataclasses import dataclass, field

import numpy as np

from zerorate.types import Floats, Integers

TRANSFER = 0.002
"""Time between the arrivals of two samples that wait in the queue, s."""


@dataclass(frozen=True, eq=False)
class Arrivals:
    """Stamps of arrival of samples on a regular clock, s, and what is true of them.

    ``made`` are the places of the samples on that clock, and ``delays`` how late they came.
    """

    stamps: Floats
    made: Integers
    delays: Floats = field(repr=False)


def packets(rng, size):
    """A device sends so many samples at once; the host takes them after a heavy-tailed delay."""

    def wake(times):
        last = np.minimum(np.arange(len(times)) // size * size + size - 1, len(times) - 1)
        return times[last] + 0.01 * rng.pareto(2.5, len(times))[last]

    return wake


def polls(rng, shortest=0.05, longest=0.5):
    """A host looks for samples every now and then and takes all that there are."""

    def wake(times):
        pauses = rng.uniform(shortest, longest, int(2 + (times[-1] - times[0]) / shortest))
        looks = times[0] + np.cumsum(pauses)
        return looks[np.searchsorted(looks, times)]

    return wake


def stalls(rng, wake, every=20.0, mean=1.0, most=5.0):
    """A host that besides stands still now and then, for a heavy-tailed time."""

    def later(times):
        woken = wake(times)
        count = int((times[-1] - times[0]) / every)
        begins = np.sort(rng.uniform(times[0], times[-1] - 2 * most, count))
        lengths = np.minimum(0.5 * mean * (1 + rng.pareto(2.0, count)), most)
        for begin, length in zip(begins, lengths, strict=True):
            woken[(woken > begin) & (woken < begin + length)] = begin + length
        return woken

    return later


def arrived(rng, wake, n=20_000, rate=99.3, gaps=(), drift=0.0, jitter=0.2):
    """Return samples that wait until the host wakes and then come one by one.

    Parameters
    ----------
    wake : callable
        Gives the time at which the host takes each sample at the earliest, of the times at which
        they were made.
    gaps : sequence of (int, int)
        Rows before which so many samples were lost.
    drift : float
        Change of the sensor's rate over the log, relative.
    jitter : float
        Standard deviation of the time of a transfer, relative.
    """
    made = np.arange(n)
    for row, lost in gaps:
        made[row:] += lost
    part = made / made[-1]
    times = made / rate * (1 + drift * (part - 0.5))
    woken = np.maximum(times, wake(times))
    transfers = TRANSFER * np.maximum(0.1, 1 + jitter * rng.standard_normal(n))
    # Each comes no sooner than the one before has come: the running maximum of a queue.
    through = np.cumsum(transfers)
    stamps = through + np.maximum.accumulate(woken - through)
    return Arrivals(stamps, made, stamps - times)
