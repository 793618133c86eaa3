"""Gain of an array on the recording of eight IMUs, and the effect of a fault of one.

``python examples/array_recording.py RECORDING`` (``mimu4444_array8_62hz_exp1.parquet``) prints
three tables in Markdown. The gyros with even numbers are mounted upside down, with x and y
exchanged.

1. Noise at rest, from the fourth rest. The rows compare the fused rate, the plain mean and one
   sensor. Values are Allan deviations (RMS over the axes), and the angle error after 10 s with all
   biases held.
2. Faults of the third gyro from 200 s; stuck and full-scale faults last 60 s. Values are the RMS
   changes of the rate in motion and at rest. The rows are the array, the median and the plain mean.
3. The published filter with two stages.
"""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

import zerorate as zr
from tables import table
from zerorate.types import Booleans, Floats

LIMIT = 1997.9
TURNED = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
TAUS = (0.1, 1.0, 8.0)
FOURTH = 3
HORIZON = 10.0
FAULTY, BEGIN, LASTS = 2, 200.0, 60.0


def read(path: str) -> tuple[Floats, float, Floats]:
    """Return samples (n, 8, 3) in deg/s, their rate and the rotations."""
    log = zr.array.array_log(zr.read_recording(Path(path)))
    rotations = np.stack([np.eye(3) if k % 2 == 0 else TURNED for k in range(8)])
    return log.data, 62.5, rotations


def runs(flags: Booleans, least: int) -> list[slice]:
    """Return the runs of set flags with at least `least` samples."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(int), [0]))))
    pairs = zip(edges[::2], edges[1::2], strict=True)
    return [slice(a, b) for a, b in pairs if b - a >= least]


def inner(rest: slice, rate: float) -> slice:
    """Return a rest without its first two seconds and its end."""
    return slice(rest.start + round(2.0 * rate), rest.stop - round(2.0 * rate))


def certain(flags: Booleans, rate: float) -> Booleans:
    """Return the mask of certain rest."""
    sure = np.zeros_like(flags)
    for rest in runs(flags, round(5.0 * rate)):
        sure[inner(rest, rate)] = True
    return sure


def rms(values: Floats) -> float:
    """Return the root mean square of the values that are not NaN."""
    return float(np.sqrt(np.nanmean(values**2)))


def differences(x: Floats, m: int) -> Floats:
    """Return the differences between successive means of m samples, with overlap."""
    sums = np.concatenate((np.zeros((1, *x.shape[1:])), np.cumsum(x, axis=0)))
    means: Floats = (sums[m:] - sums[:-m]) / m
    return (means[m:] - means[:-m]) / np.sqrt(2.0)


def settled_rests(trace: dict[str, Floats], rate: float) -> list[slice]:
    """Return the rests from the fourth, without their ends."""
    rests = runs(trace["at_rest"].all(axis=1), round(15.0 * rate))
    return [inner(r, rate) for r in rests[FOURTH:]]


def deviations(
    trace: dict[str, Floats], turned: Floats, rate: float, settled: list[slice], tau: float
) -> list[float]:
    """Return the Allan deviations at rest of the fused rate, the mean and one sensor."""
    m = round(tau * rate)
    long = [r for r in settled if r.stop - r.start > 2 * m]
    return [
        rms(np.concatenate([differences(x[r], m) for r in long]))
        for x in (trace["rate"], turned.mean(axis=1), turned)
    ]


def noise(trace: dict[str, Floats], turned: Floats, rate: float) -> list[list[str]]:
    """Return the rows of the first table."""
    settled = settled_rests(trace, rate)
    rows = [
        row(f"Allan deviation at {tau:g} s, deg/s", deviations(trace, turned, rate, settled, tau))
        for tau in TAUS
    ]
    return [*rows, row(f"angle lost in {HORIZON:g} s, deg", coasted(trace, turned, rate, settled))]


def coasted(
    trace: dict[str, Floats], turned: Floats, rate: float, settled: list[slice]
) -> list[float]:
    """Return the angle errors of the fused rate, the mean and one sensor, with biases held."""
    m = round(HORIZON * rate)
    lost: list[list[Floats]] = [[], [], []]
    for rest in settled:
        for begin in range(rest.start, rest.stop - m, m // 4):
            angles = (turned[begin : begin + m] - trace["bias"][begin]).sum(axis=0) / rate
            weights = trace["weights"][begin]
            for kind, angle in enumerate(((weights * angles).sum(0), angles.mean(0), angles)):
                lost[kind].append(angle)
    return [rms(np.stack(kind)) for kind in lost]


def row(name: str, three: list[float]) -> list[str]:
    """Return a row: value of the fusion, and its ratios to the mean and to one sensor."""
    fused, mean, one = three
    return [name, f"{fused:.4f}", f"{mean:.4f}", f"{one:.4f}", *_over(fused, mean, one)]


def _over(fused: float, *others: float) -> list[str]:
    return [f"{other / fused:.2f}" for other in others]


def held(z: Floats, value: Floats | float, rate: float) -> Floats:
    """Return samples with a constant value for a while."""
    z = z.copy()
    z[: round(LASTS * rate)] = value
    return z


def faults(rate: float) -> dict[str, Callable[[Floats], Floats]]:
    """Return possible faults of the samples (n, 3) of a gyro."""
    rng = np.random.default_rng(1)
    return {
        "stuck for 60 s": lambda z: held(z, z[0], rate),
        "full scale for 60 s": lambda z: held(z, 1999.0, rate),
        "sign": lambda z: -z,
        "x and y exchanged": lambda z: z[:, [1, 0, 2]],
        "scale 1.3": lambda z: 1.3 * z,
        "1 % spikes of 50 deg/s": lambda z: z + 50.0 * (rng.random(z.shape) < 0.01),
        "offset 5 deg/s": lambda z: z + 5.0,
    }


class Study:
    """The recording with the results of the array."""

    def __init__(self, path: str) -> None:
        self.z, self.rate, self.rotations = read(path)
        self.clean = self.fused(self.z)
        # The biases are in the axes of the body, too.
        self.clean["bias"] = self.turned(self.clean["bias"])
        self.begin = round(BEGIN * self.rate)
        later = np.arange(len(self.z)) >= self.begin
        at_rest = self.clean["at_rest"].all(axis=1)
        self.rest, self.moving = later & certain(at_rest, self.rate), later & ~at_rest

    def fused(self, samples: Floats) -> dict[str, Floats]:
        """Return the fused samples, and the state of the filter."""
        return zr.GyroArray(self.rate, rotations=self.rotations, limit=LIMIT).trace(samples)

    def turned(self, samples: Floats) -> Floats:
        """Return samples in the axes of the body."""
        return np.einsum("sij,nsj->nsi", self.rotations, samples)

    def changes(self, before: Floats, after: Floats) -> str:
        """Return the RMS change in motion and at rest."""
        change = after - before
        return f"{rms(change[self.moving]):.3f} / {rms(change[self.rest]):.3f}"

    def gain(self, tau: float) -> float:
        """Return one sensor's Allan deviation at rest, divided by the array's."""
        rests = settled_rests(self.clean, self.rate)
        fused, _, one = deviations(self.clean, self.turned(self.z), self.rate, rests, tau)
        return one / fused

    def noise(self) -> str:
        """Return the first table."""
        head = ["at rest", "fused", "mean", "one", "over the mean", "over one"]
        rows = noise(self.clean, self.turned(self.z), self.rate)
        excluded = self.clean["excluded"].any(axis=0).sum()
        title = f"Noise of eight gyros; {excluded} ever excluded"
        return table(title, head, rows, markdown=True)

    def faults(self) -> str:
        """Return the second table."""
        rows = []
        for name, fault in faults(self.rate).items():
            samples = self.z.copy()
            samples[self.begin :, FAULTY] = fault(self.z[self.begin :, FAULTY])
            found = self.fused(samples)
            cells = [self.changes(self.clean["rate"], found["rate"])]
            for of_all in (np.median, np.mean):
                cells.append(
                    self.changes(*(of_all(self.turned(x), axis=1) for x in (self.z, samples)))
                )
            others = np.delete(found["excluded"], FAULTY, axis=1).any(axis=0).sum()
            rows.append([name, *cells, str(others)])
        head = ["fault of the third", "fused", "median", "mean", "others excluded"]
        return table("RMS change in motion / at rest, deg/s", head, rows, markdown=True)

    def published(self) -> str:
        """Return the third table."""
        z = self.z[:, ::2]
        array = zr.GyroArray(self.rate, 4, limit=LIMIT, method="centralised")
        rests = runs(self.rest, 4 * round(self.rate))
        rows = []
        for name, x in (
            ("one", z[:, 0]),
            ("mean", z.mean(axis=1)),
            ("two stages", array.process(z)),
        ):
            bias = x[self.rest].mean(axis=0)
            error = (x - bias - self.clean["rate"])[self.moving, 2]
            rests_of = [x[r, 2] for r in rests]
            deviation = rms(np.concatenate([one - one.mean() for one in rests_of]))
            allan = rms(np.concatenate([differences(one, round(self.rate)) for one in rests_of]))
            rows.append([name, f"{deviation:.4f}", f"{allan:.4f}", f"{rms(error):.0f}"])
        speed = rms(self.clean["rate"][self.moving, 2])
        title = f"Axis z of gyros 1, 3, 5, 7; {speed:.0f} deg/s RMS in motion"
        head = ["rate", "deviation at rest", "Allan deviation at 1 s", "difference in motion"]
        return table(title, head, rows, markdown=True)


def main(path: str) -> None:
    """Print the tables."""
    study = Study(path)
    for told in (study.noise(), study.faults(), study.published()):
        print(told)


if __name__ == "__main__":
    main(sys.argv[1])
