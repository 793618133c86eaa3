"""Detection rate of `zr.report` for faults in simulated logs, one fault at a time.

``python examples/report_study.py`` prints `docs/evidence/report.md`. For each fault, at its limit
and at a third of it, it has the share of logs in which the fault is found. For clean logs of ten
device classes it has the number of findings beyond a limit. ``--logs N`` sets the number of logs,
and ``--cores N`` the number of processes.
"""

import argparse
import copy
import functools
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np

import zerorate as zr
from tables import table as aligned
from zerorate.findings.gyro_comparison import compare_gyros
from zerorate.findings.imus import find_imus

GRAVITY = 9.80665
DURATION = 120.0
SPANS = ((20.0, 50.0), (65.0, 100.0))
"""Spans of the two moves, s; the device rests before, between and after them."""


@dataclass(frozen=True)
class Device:
    """Rate, noise (deg/s/√Hz, µg/√Hz), steps (deg/s, m/s²), and bias (deg/s)."""

    rate: float
    gyro: float
    accel: float
    gyro_step: float
    accel_step: float
    bias: float


DEVICES = {
    "phone, 100 Hz": Device(100.0, 0.007, 180, 1 / 16.4, GRAVITY / 4096, 0.5),
    "consumer, 100 Hz": Device(100.0, 0.005, 300, 1 / 131, GRAVITY / 16384, 1.5),
    "consumer, 200 Hz": Device(200.0, 0.01, 400, 1 / 32.8, GRAVITY / 8192, 1.0),
    "consumer, noisy": Device(100.0, 0.03, 450, 1 / 16.4, GRAVITY / 2048, 2.0),
    "autopilot, 250 Hz": Device(250.0, 0.004, 120, 1 / 16.4, GRAVITY / 2048, 0.5),
    "autopilot, 200 Hz": Device(200.0, 0.0038, 70, 0.0, 0.0, 0.3),
    "industrial, 100 Hz": Device(100.0, 0.04, 350, 0.05, GRAVITY / 300, 0.4),
    "industrial, 250 Hz": Device(250.0, 0.002, 25, 0.0, 0.0, 0.02),
    "tactical, 200 Hz": Device(200.0, 0.001, 20, 0.0, 0.0, 0.005),
    "shoe, 200 Hz": Device(200.0, 0.03, 80, 0.0, 0.0, 0.1),
}
MOVES = ("hand", "rotor craft", "car")


def smooth(random, n, rate, hertz, size):
    """Return a random curve of three axes, slower than a given frequency."""
    t = np.arange(n) / rate
    terms = random.uniform(0.1, 1.0, (6, 3)) * hertz
    phases = random.uniform(0.0, 2.0 * np.pi, (6, 3))
    return size / np.sqrt(3.0) * np.sin(2 * np.pi * t[:, None, None] * terms + phases).sum(axis=1)


def window(n, rate):
    """Return the fraction of motion at each sample, 0 at rest and 1 in motion, without a step."""
    t = np.arange(n) / rate
    on = np.zeros(n)
    for begin, end in SPANS:
        ramp = np.clip(np.minimum(t - begin, end - t) / 2.0, 0.0, 1.0)
        on = np.maximum(on, ramp**3 * (10 - 15 * ramp + 6 * ramp**2))
    return on


def gravity_of(rates, rate):
    """Return the vertical in the body's axes during rotations, shape (n, 3)."""
    up = np.empty_like(rates)
    now = np.array([0.02, -0.03, 1.0]) / np.linalg.norm([0.02, -0.03, 1.0])
    for i, turn in enumerate(rates / rate):
        angle = np.linalg.norm(turn)
        if angle > 0.0:
            axis = -turn / angle
            now = (
                now * np.cos(angle)
                + np.cross(axis, now) * np.sin(angle)
                + axis * (axis @ now) * (1.0 - np.cos(angle))
            )
        up[i] = now
    return up


def motion(move, device, random):
    """Return true rates, rad/s, and forces, m/s²."""
    n, rate = round(DURATION * device.rate), device.rate
    on = window(n, rate)[:, None]
    if move == "hand":
        rates, pushed = smooth(random, n, rate, 0.6, 1.5), smooth(random, n, rate, 1.0, 1.5)
    elif move == "rotor craft":
        rates, pushed = smooth(random, n, rate, 0.5, 0.4), smooth(random, n, rate, 0.3, 0.8)
        t = np.arange(n) / rate
        pushed += 2.5 * np.sin(2 * np.pi * rotor_hertz(random, rate) * t)[:, None]
        pushed += 0.5 * random.standard_normal((n, 3))
    else:
        rates = smooth(random, n, rate, 0.15, 0.3) * [0.1, 0.1, 1.0]
        pushed = smooth(random, n, rate, 0.2, 1.0) + 0.4 * random.standard_normal((n, 3))
    rates = on * rates
    return rates, GRAVITY * gravity_of(rates, rate) + on * pushed


def rotor_hertz(random, rate):
    """Return a rotor frequency, Hz, that the sampling rate can show."""
    return random.uniform(0.15, 0.45) * rate


def sensed(truth, density, step, bias, rate, random):
    """Return samples of a sensor with white noise, a bias and rounding."""
    noisy = truth + bias + density * np.sqrt(rate / 2.0) * random.standard_normal(truth.shape)
    return np.round(noisy / step) * step if step else noisy


class Simulated:
    """Times, and the samples of two IMUs: gyro, deg/s, and accelerometer, m/s²."""

    def __init__(self, device, move, seed):
        random = self.random = np.random.default_rng([seed, 7])
        self.device, self.rate = device, device.rate
        rates, forces = motion(move, device, random)
        self.moving = window(len(rates), device.rate) > 0.5
        self.time = np.arange(len(rates)) / device.rate
        micro = 1e-6 * GRAVITY
        self.gyro, self.accel = [], []
        for _ in range(2):
            bias = device.bias * random.standard_normal(3).clip(-1.5, 1.5) / 2.0
            self.gyro.append(
                sensed(np.degrees(rates), device.gyro, device.gyro_step, bias, self.rate, random)
            )
            off = random.uniform(-0.02, 0.02, 3)
            self.accel.append(
                sensed(forces, micro * device.accel, device.accel_step, off, self.rate, random)
            )
        self.keep = np.ones(len(self.time), dtype=bool)

    def recording(self):
        """Return the recording."""
        names = {"gyro": "dps", "accel": "mps2"}
        columns = {"time_s": self.time[self.keep]}
        for kind, unit in names.items():
            for k, data in enumerate(getattr(self, kind)):
                for axis, column in zip("xyz", data[self.keep].T, strict=True):
                    columns[f"imu{k + 1}_{kind}_{axis}_{unit}"] = column
        return zr.read_recording(columns)

    def middle(self):
        """Return a random sample index in motion."""
        return int(self.random.choice(np.flatnonzero(self.moving)[500:-500]))


def clip(log, kind, share):
    """Clip the axis with the most motion, so that a share of all samples is at the limit."""
    column, off = widest(log, kind)
    clip_at(column, np.quantile(off, 1.0 - share))


def widest(log, kind):
    """Return the axis with the most motion, and the distance of its samples from the middle."""
    data = getattr(log, kind)[0]
    column = data[:, int(np.argmax(np.ptp(data, axis=0)))]
    return column, np.abs(column - np.median(column))


def clip_at(column, limit):
    """Clip an axis at a distance from its middle."""
    middle = np.median(column)
    np.clip(column, middle - limit, middle + limit, out=column)


def fault_clip_gyro(log, size):
    """Add: gyro clipped at 0.1 % of the samples, times a size."""
    clip(log, "gyro", 0.001 * size)


def fault_clip_accel(log, size):
    """Add: accelerometer clipped at 0.1 % of the samples, times a size."""
    clip(log, "accel", 0.001 * size)


def fault_clip_gyro_longer(log, size):
    """Add: gyro clipped for 0.2 s without a break, times a size."""
    column, off = widest(log, "gyro")
    low, high = 0.0, off.max()
    for _ in range(40):
        middle = 0.5 * (low + high)
        enough = longest(off >= middle) >= 0.202 * size * log.rate
        low, high = (middle, high) if enough else (low, middle)
    clip_at(column, low)


def longest(marks):
    """Return the longest run of marks."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marks, [False]])))
    return int(np.diff(edges)[::2].max()) if edges.size else 0


def fault_gaps(log, size):
    """Remove samples in motion in 12 gaps; the rates show the error: 1.05 deg at the limit."""
    seconds = np.concatenate([np.arange(begin + 2, end - 3, 2) for begin, end in SPANS])
    places = np.round(log.rate * log.random.choice(seconds, 12, replace=False)).astype(int)
    for length in range(2, round(0.9 * log.rate)):
        errors = []
        for at in places:
            inside = log.gyro[0][at - 1 : at + length + 1]
            errors.append(
                np.linalg.norm(0.5 * (inside[0] + inside[-1]) * length - inside[1:-1].sum(axis=0))
            )
        if np.sqrt(np.square(errors).sum()) / log.rate >= 1.05 * size:
            break
    for at in places:
        log.keep[at : at + length] = False


def fault_jitter(log, size):
    """Add: jitter of 10 % of a period, times a size."""
    log.time = log.time + 0.1 * size / np.sqrt(2.0) / log.rate * log.random.standard_normal(
        len(log.time)
    )


def fault_late(log, size):
    """Add: 0.3 % of time stamps late, times a size."""
    count = round(0.003 * size * len(log.time))
    places = 10 + 20 * log.random.choice(len(log.time) // 20 - 2, count, replace=False)
    log.time[places] += 0.75 / log.rate


def fault_break(log, size):
    """Add: a gap of 3 s, times a size."""
    first = log.middle()
    log.keep[first : first + round(3.0 * size * log.rate)] = False


def fault_repeated(log, size):
    """Add: 3 repeated time stamps, times a size."""
    for _ in range(round(3 * size)):
        at = log.middle()
        log.time[at] = log.time[at - 1]


def fault_stuck_axis(log, size):
    """Add: accelerometer axis constant for 100 samples, times a size."""
    at = log.middle()
    log.accel[0][at : at + round(100 * size), 0] = log.accel[0][at, 0]


def fault_stuck(log, size):
    """Add: gyro constant for 100 samples, times a size."""
    at = log.middle()
    log.gyro[0][at : at + round(100 * size)] = log.gyro[0][at]


def fault_spikes(log, size):
    """Add: 12 spikes of 40 standard deviations, times a size."""
    column = log.gyro[0][:, 1]
    scatter = np.median(np.abs(np.diff(column)[log.moving[1:]])) + np.std(np.diff(column))
    places = log.random.choice(np.flatnonzero(log.moving), round(12 * size), replace=False)
    column[places] += 40.0 * scatter


def fault_step(log, size):
    """Add: accelerometer step of 3.4 standard deviations, times a size."""
    data = log.accel[0]
    step = 3.4 * size * data[: round(15 * log.rate)].std(axis=0).max()
    log.accel[0] = np.round(data / step) * step


def fault_vibration(log, size):
    """Add: vibration of 60 m/s², times a size."""
    t = log.time[:, None]
    shake = 61.0 * size * np.sqrt(2.0 / 3.0) * np.sin(2 * np.pi * 0.31 * log.rate * t + [0, 1, 2])
    log.accel[0] = log.accel[0] + log.moving[:, None] * shake


def fault_folded(log, size):
    """Add: aliased second harmonic of 3 m/s², times a size."""
    hertz = (
        log.random.uniform(0.28, 0.42) * log.rate * (1 + 0.06 * np.sin(2 * np.pi * log.time / 17))
    )
    phase = 2 * np.pi * np.cumsum(hertz) / log.rate
    shake = 6.0 * np.sin(phase) + 3.1 * size * np.sin(2 * phase + 1.0)
    log.accel[0][:, 2] += log.moving * shake


def fault_bias(log, size):
    """Add: gyro bias of 5 deg/s, times a size."""
    for data in log.gyro:
        data[:, 2] += 5.05 * size - data[: round(15 * log.rate), 2].mean()


def fault_moving_bias(log, size):
    """Add: bias change of 0.17 deg/s, times a size."""
    log.gyro[0][log.time > 60.0, 0] += 0.17 * size


def fault_norm(log, size):
    """Add: norm error of 0.4 m/s², times a size."""
    for data in log.accel:
        rest = data[: round(15 * log.rate)].mean(axis=0)
        data *= (GRAVITY + 0.41 * size) / np.linalg.norm(rest)


def fault_gyros(log, size):
    """Add: difference of 5 deg/s between the gyros, times a size."""
    off = np.median(log.gyro[0] - log.gyro[1], axis=0)
    log.gyro[0] = log.gyro[0] - off
    log.gyro[1] = log.gyro[1] + 5.05 * size * np.array([0.0, 1.0, 0.0])


def fault_accels(log, size):
    """Add: difference of 0.75 m/s² between the accelerometers, times a size."""
    off = np.median(log.accel[0] - log.accel[1], axis=0)
    log.accel[0] = log.accel[0] - off
    log.accel[1] = log.accel[1] + 0.76 * size * np.array([1.0, 0.0, 0.0])


def fault_gyro_noise(log, size):
    """Add: gyro noise of 0.15 deg/s/√Hz, times a size."""
    more = 0.155 * size * np.sqrt(log.rate / 2.0)
    log.gyro[0] = log.gyro[0] + more * log.random.standard_normal(log.gyro[0].shape)


def fault_accel_noise(log, size):
    """Add: accelerometer noise of 1500 µg/√Hz, times a size."""
    more = 1550e-6 * size * GRAVITY * np.sqrt(log.rate / 2.0)
    log.accel[0] = log.accel[0] + more * log.random.standard_normal(log.accel[0].shape)


LONG = "gyro clipped for 0.2 s on end"
"""Found means *act* here: a third of the limit exceeds 0.058 % of some logs, which is *look*."""
FAULTS = {
    "12 gaps that cost 1.05 deg": (fault_gaps, "gaps"),
    "jitter of 10 % of a period": (fault_jitter, "jitter"),
    "0.3 % of stamps late": (fault_late, "late stamps"),
    "a break of 3 s": (fault_break, "break"),
    "3 repeated stamps": (fault_repeated, "repeated stamps"),
    "gyro clipped at 0.1 % of samples": (fault_clip_gyro, "at its limit"),
    LONG: (fault_clip_gyro_longer, "at its limit"),
    "accelerometer clipped at 0.1 %": (fault_clip_accel, "at its limit"),
    "accelerometer axis equal 100 times": (fault_stuck_axis, "equal samples"),
    "gyro equal 100 times": (fault_stuck, "equal samples"),
    "12 spikes of 40 scatters": (fault_spikes, "spikes"),
    "accelerometer's step of 3.4 scatters": (fault_step, "coarse step"),
    "vibration of 60 m/s²": (fault_vibration, "vibration"),
    "second harmonic folded, 3 m/s²": (fault_folded, "aliased peak"),
    "gyro bias of 5 deg/s": (fault_bias, "gyro bias"),
    "bias moves by 0.17 deg/s": (fault_moving_bias, "bias moves"),
    "norm off by 0.4 m/s²": (fault_norm, "gravity"),
    "gyros 5 deg/s apart": (fault_gyros, "gyros differ"),
    "accelerometers 0.75 m/s² apart": (fault_accels, "accels differ"),
    "gyro noise of 0.15 deg/s/√Hz": (fault_gyro_noise, "gyro noise"),
    "accelerometer noise of 1500 µg/√Hz": (fault_accel_noise, "accel noise"),
}


def log_of(number):
    """Return the simulated log of a number, to add a fault."""
    return copy.deepcopy(_simulated(number))


@functools.lru_cache(maxsize=32)
def _simulated(number):
    """Return the log of a number; devices and moves alternate."""
    names = list(DEVICES)
    device = DEVICES[names[number % len(names)]]
    return Simulated(device, MOVES[number % len(MOVES)], number)


def of_fault(job):
    """Return True if a fault is found in a log, and the other kinds with *act*."""
    name, size, number = job
    put, kind = FAULTS[name]
    log = log_of(number)
    put(log, size)
    found = zr.report(log.recording()).findings
    bad = ("act",) if name == LONG else ("look", "act")
    hit = any(one.kind == kind and one.severity in bad for one in found)
    return hit, {one.kind for one in found if one.severity == "act"} - {kind}


DELAY, SCALES, TURN = 0.008, np.array([1.02, 0.99, 1.0]), np.radians([0.6, -0.4, 0.8])
"""Second gyro relative to the first: delay, s, scale factors, and rotation, rad."""


def rotation(vector):
    """Return the rotation matrix of a vector."""
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def of_pair(job):
    """Return errors and standard errors of delay, ms, rotation, deg, and scale of two gyros."""
    size, rates, number = job
    random = np.random.default_rng([number, 9])
    terms, phases = random.uniform(0.06, 0.6, (6, 3)), random.uniform(0.0, 6.28, (6, 3))
    logs = {}
    for k, rate in enumerate(rates):
        t = np.arange(round(DURATION * rate)) / rate + 0.003 * k
        waves = 2 * np.pi * terms * (t - k * DELAY)[:, None, None] + phases
        true = size / np.sqrt(3.0) * np.sin(waves).sum(axis=1)
        true = (true / SCALES) @ rotation(TURN) if k else true
        seen = sensed(np.degrees(true), 0.01, 1 / 32.8, random.standard_normal(3), rate, random)
        force = [0.0, 0.0, GRAVITY] + 0.02 * random.standard_normal(seen.shape)
        columns = {"time_s": t}
        for axis, turn, push in zip("xyz", seen.T, force.T, strict=True):
            columns |= {f"gyro_{axis}_dps": turn, f"accel_{axis}_mps2": push}
        for name, log in zr.read_recording(columns).items():
            logs[f"{name}_1" if k else name] = log
    first, second = find_imus(zr.Recording(logs))
    found = compare_gyros(first.gyro, second.gyro)
    off = found.matrix @ rotation(TURN).T
    turns = np.degrees(0.5 * (off - off.T)[[2, 0, 1], [1, 2, 0]])
    errors = [1e3 * (found.delay - DELAY), *turns, *(found.scale - SCALES)]
    sigmas = [1e3 * found.delay_sigma, *np.degrees(found.turn_sigma), *found.scale_sigma]
    return errors, sigmas


PAIRS = {
    "hand, both 100 Hz": (1.5, (100.0, 100.0)),
    "hand, 250 and 100 Hz": (1.5, (250.0, 100.0)),
    "rotor craft, both 200 Hz": (0.3, (200.0, 200.0)),
}
"""Size of the rotations, rad/s, and rates of both gyros, Hz."""


def print_pairs(pool, count):
    """Print the errors of the comparison of two gyros."""
    rows = []
    for name, (size, rates) in PAIRS.items():
        told = np.array(list(pool.map(of_pair, [(size, rates, k) for k in range(count)])))
        for what, part in (("delay, ms", slice(0, 1)), ("rotation, deg", slice(1, 4)),
                           ("scale", slice(4, 7))):  # fmt: skip
            errors, sigmas = told[:, 0, part], told[:, 1, part]
            sizes = [np.sqrt(np.mean(np.square(one))) for one in (errors, sigmas)]
            inside = np.mean(np.abs(errors) < 2.2 * sigmas)
            rows.append([name, what, *(f"{one:.2g}" for one in sizes), f"{inside:.2f}"])
    head = ["turns", "quantity", "error, RMS", "its standard error", "within 2.2 of them"]
    print(aligned(f"{count} pairs each", head, rows, markdown=True).strip(), "\n")


def of_clean(number):
    """Return the kinds of findings with *act* and with *look* in a clean log."""
    found = zr.report(log_of(number).recording()).findings
    return tuple(
        [f"{o.kind}: {o.text}" for o in found if o.severity == how] for how in ("act", "look")
    )


def main():
    """Print the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, default=20)
    parser.add_argument("--clean", type=int, default=200)
    parser.add_argument("--pairs", type=int, default=60)
    parser.add_argument("--cores", type=int, default=2)
    asked = parser.parse_args()
    began = time.perf_counter()
    print("# The report: faults put into simulated logs\n")
    print("Made by `python examples/report_study.py`.\n")
    with ProcessPoolExecutor(asked.cores) as pool:
        rows = []
        for name in FAULTS:
            shares, others = [], set()
            for size in (1.0, 1.0 / 3.0):
                jobs = [(name, size, 1000 + k) for k in range(asked.logs)]
                hits = list(pool.map(of_fault, jobs))
                shares.append(np.mean([hit for hit, _ in hits]))
                others |= set().union(*(more for _, more in hits))
            rows.append([name, *(f"{share:.2f}" for share in shares), ", ".join(sorted(others))])
        head = ["fault", "found at its limit", "at a third of it", "others that then ask to act"]
        print(aligned(f"{asked.logs} logs each", head, rows, markdown=True).strip(), "\n")
        clean = list(pool.map(of_clean, range(asked.clean)))
        print_pairs(pool, asked.pairs)
    acts, looks = sum(bool(a) for a, _ in clean), sum(bool(b) for _, b in clean)
    print(f"Clean logs: {asked.clean}; with an *act*: {acts}; with a *look*: {looks}.\n")
    for number, (act, look) in enumerate(clean):
        for text in (*act, *look):
            print(f"- log {number}: {text}")
    print(f"\n{len(DEVICES)} device classes, {time.perf_counter() - began:.0f} s.")


if __name__ == "__main__":
    main()
