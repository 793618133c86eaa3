"""Prediction of the bias at new temperatures, and the validity of its errors.

``python examples/temperature_study.py [SEEDS]`` prints two tables in Markdown. The first table has
the RMS over the seeds (default 48) of predicted minus true bias, deg/s. It covers the time from the
end of the fit to the end of a warm-up of half an hour. The warm-up has a time constant of 400 s, 20
K, random walk 2.5e-4 deg/s/sqrt(s), white noise 0.005 deg/s/sqrt(Hz), and 25 Hz.

The second table has the error of a slope, and the result with whole degrees, without two parts of
the model.
"""

import sys
from contextlib import contextmanager
from unittest import mock

import numpy as np

import zerorate as zr
from tables import table
from zerorate.calibration.temperature import fit as fitting
from zerorate.calibration.temperature import model as modelling

RATE, DURATION, TIME_CONSTANT = 25.0, 1800.0, 400.0
START, REFERENCE = 20.0, 25.0
WHITE, WALK = 0.005, 2.5e-4
SLOPE, CURVATURE = 0.03, 3e-4
# Delay of the gyro relative to the thermometer in the row of this name, s.
LAG = 35.0
# Name: span, K, slope, curvature, and part of the record that is fitted.
CASES = {
    "20 K, first half": (20.0, SLOPE, CURVATURE, 0.5),
    "20 K, first fifth": (20.0, SLOPE, CURVATURE, 0.2),
    "straight line, first fifth": (20.0, SLOPE, 0.0, 0.2),
    "no effect": (20.0, 0.0, 0.0, 0.5),
    "2 K": (2.0, SLOPE, CURVATURE, 0.5),
    "lag, up and down": (20.0, SLOPE, CURVATURE, 0.5),
    "whole degrees": (20.0, SLOPE, CURVATURE, 0.5),
}
# Results of an earlier study with eight seeds; for whole degrees, the target.
ASKED = (0.0060, 0.015, 0.0078, 0.0060, 0.0061, 0.057, 0.020)


def true_temperature(name, span):
    """Return the time, and the readings of an exact thermometer at the gyro."""
    t = np.arange(int(DURATION * RATE)) / RATE
    warming = 1.0 - np.exp(-t / TIME_CONSTANT)
    if name == "lag, up and down":
        top = warming[t.size // 2]
        falling = top * np.exp(-(t - DURATION / 2.0) / TIME_CONSTANT)
        warming = np.where(t < DURATION / 2.0, warming, falling)
    return t, START + span * warming


def delayed(values):
    """Return values that follow the given values with the time constant of the lag."""
    samples = values[:: int(RATE)]
    followed = np.empty_like(samples)
    followed[0] = samples[0]
    for i in range(1, samples.size):
        followed[i] = followed[i - 1] + (samples[i] - followed[i - 1]) / LAG
    seconds = np.arange(values.size) / RATE
    return np.interp(seconds, np.arange(samples.size), followed)


def record(name, seed):
    """Return samples, thermometer readings, the true bias, and the end of the fit."""
    span, slope, curvature, part = CASES[name]
    rng = np.random.default_rng(seed)
    _, T = true_temperature(name, span)
    d = (delayed(T) if name == "lag, up and down" else T) - REFERENCE
    walk = np.cumsum(rng.standard_normal(T.size)) * WALK / np.sqrt(RATE)
    bias = 0.5 + slope * d + curvature * d**2 + walk
    z = bias + WHITE * np.sqrt(RATE) * rng.standard_normal(T.size)
    shown = np.round(T) if name == "whole degrees" else T
    return z, shown, bias, int(part * T.size)


def hold(z, T, rest):
    """Return the mean of the last thirty seconds."""
    return np.full(rest.size, z[-int(30.0 * RATE) :].mean())


def seconds_of(values):
    """Return means over a second; a cubic fits them as well as all samples."""
    return values[: values.size // int(RATE) * int(RATE)].reshape(-1, int(RATE)).mean(axis=1)


def cubic(z, T, rest):
    """Return a least-squares cubic with its extrapolation."""
    found = np.polynomial.Polynomial.fit(seconds_of(T), seconds_of(z), 3)
    return found(rest)


def clamped(z, T, rest):
    """Return a cubic that is constant beyond the range, as in PX4 and ArduPilot."""
    return cubic(z, T, np.clip(rest, T.min(), T.max()))


def published(z, T, rest, slope=0.1, by_force=0.0, force=0.0):
    """Return the model of Chen et al. 2013: bias = A + 0.1 (T - 25), and optionally 0.1 a.

    A comes from its Kalman filter, with transition, output and first variance 1, without process
    noise.
    """
    known = slope * (T - REFERENCE) + by_force * force
    A, P, R = 0.0, 1.0, np.var(np.diff(z)) / 2.0
    # Process all samples at once: for a constant, the filter's result is the mean with the start.
    A = (A / P + np.sum(z - known) / R) / (1.0 / P + z.size / R)
    return A + slope * (rest - REFERENCE) + by_force * force


def model(z, T, rest):
    """Return the prediction of zr.TemperatureModel."""
    return zr.TemperatureModel.fit(z, T, RATE).predict(rest).value


def kalman(z, T, rest):
    """Return the prediction of zr.TemperatureFilter while the samples are missing."""
    f = zr.TemperatureFilter(RATE)
    f.process(z, T)
    return f.process(np.full(rest.size, np.nan), rest)


METHODS = {
    "hold": hold,
    "cubic clamped": clamped,
    "cubic free": cubic,
    "published": published,
    "TemperatureModel": model,
    "TemperatureFilter": kalman,
}


def error(method, name, seed):
    """Return the RMS of predicted minus true bias."""
    z, T, bias, end = record(name, seed)
    return rms(method(z[:end], T[:end], T[end:]) - bias[end:])


def rms(values):
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def predictions(seeds):
    """Return the first table."""
    rows = []
    for name, asked in zip(CASES, ASKED, strict=True):
        found = [rms([error(one, name, seed) for seed in seeds]) for one in METHODS.values()]
        rows.append([name, *(f"{x:.2g}" for x in found), f"{asked:.2g}"])
    head = ["recording", *METHODS, "aim"]
    return table(f"RMS of the predicted bias, deg/s, {len(seeds)} seeds", head, rows, True)


def slope_errors(name, seeds):
    """Return the slope's errors divided by its standard error."""
    _, slope, curvature, _ = CASES[name]
    found = []
    for seed in seeds:
        z, T, _, end = record(name, seed)
        one = zr.TemperatureModel.fit(z[:end], T[:end], RATE)
        truth = slope + 2.0 * curvature * (one.reference - REFERENCE)
        found.append((float(one.slope) - truth) / one.slope.sigma)
    return np.array(found)


@contextmanager
def flat_in_logarithm():
    """Use equal prior probabilities for random walks of all strengths."""
    with mock.patch.object(fitting, "_WALK_PRIOR", np.ones_like(fitting._WALK_PRIOR)):
        yield


@contextmanager
def as_shown():
    """Treat whole degrees as the temperature."""
    with mock.patch.object(modelling, "between_steps", lambda _, T: (T, 0.0)):
        yield


@contextmanager
def through_the_middles():
    """Interpolate between the middles of the constant spans, without values outside them."""

    def joined(t, T):
        edges = np.flatnonzero(np.diff(T)) + 1
        ends = np.concatenate(([0], edges, [T.size]))
        middles = (ends[:-1] + ends[1:] - 1) // 2
        return np.interp(t, t[middles], T[middles]), 1.0

    with mock.patch.object(modelling, "between_steps", joined):
        yield


def predicted_on_whole_degrees(seeds):
    """Return the error of the model's prediction."""
    return rms([error(model, "whole degrees", seed) for seed in seeds])


def ablations(seeds):
    """Return the second table."""
    rows = []
    for name in ("straight line, first fifth", "no effect", "20 K, first half", "whole degrees"):
        z = slope_errors(name, seeds)
        with flat_in_logarithm():
            flat = slope_errors(name, seeds)
        cells = (f"{rms(z):.2f}", f"{rms(flat):.2f}")
        rows.append([f"slope, error over sigma: {name}", *cells, "", ""])
    found = [predicted_on_whole_degrees(seeds)]
    for variant in (as_shown, through_the_middles):
        with variant():
            found.append(predicted_on_whole_degrees(seeds))
    first, *others = (f"{x:.2g}" for x in found)
    rows.append(["whole degrees, RMS [deg/s]", first, "", *others])
    head = ["recording", "as it is", "walks flat in log", "degrees as shown", "middles joined"]
    return table(f"What makes the difference, {len(seeds)} seeds", head, rows, True)


def main():
    """Print both tables."""
    seeds = range(int(sys.argv[1]) if len(sys.argv) > 1 else 48)
    print(predictions(seeds))
    print(ablations(seeds))


if __name__ == "__main__":
    main()
