"""Effect of the rules that detect rests, each in its package and exchanged.

``python examples/rests.py [RECORDINGS] [--released _native.abi3.so]`` prints tables in Markdown.
The first tables are the drift filter at starts with running motors and in motion, next to an
earlier build. The others are `replay`, `navigate` and `calibrate` with their own rule and with the
rule of `Attitude`. Without the folder, the tables of recordings are left out.
"""

import argparse
import importlib.machinery
import importlib.util
import warnings
from pathlib import Path

import numpy as np

import zerorate as zr
from attitude_outside import outside
from recordings import BESIDE
from rest_accel import DRIVE, LIMITS, MIMU, bodies, car, told
from tables import table
from zerorate.calibration.calibration import ACCEL_BIAS
from zerorate.linear.run import LinearRun
from zerorate.navigation import coarse_start
from zerorate.navigation.processing import processed
from zerorate.options import REST_LIMITS as COMMANDS
from zerorate.record.missing import without_masks
from zerorate.record.samples import Samples
from zerorate.units import convert

DEG = np.pi / 180.0
MOTIONS = ("pendulum", "arm", "vehicle", "circle", "hand")
SHAKEN = 4.0
"""Standard deviation of the rate that motors add to a motion, deg/s."""
BIAS = 4.6 * np.array([0.3, 0.5, 0.81])
SEEDS = 6


def released(path, name="Attitude"):
    """Return a filter of another build."""
    loader = importlib.machinery.ExtensionFileLoader("zerorate._native", str(path))
    spec = importlib.util.spec_from_loader("zerorate._native", loader)
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    module.register(
        convert=convert, without_masks=without_masks, linear_run=LinearRun, navigate=processed
    )
    return getattr(module, name)


def rested(seconds, shaken, seed, rate=200.0):
    """Return samples of a rest with running motors, followed by half a minute of motion."""
    rng, n = np.random.default_rng(seed), round((seconds + 30.0) * rate)
    t = np.arange(n) / rate
    way = (
        np.cumsum(rng.standard_normal((n, 3)), axis=0)
        * np.clip((t - seconds) / 2.0, 0.0, 1.0)[:, None]
    )
    return BIAS + shaken * rng.standard_normal((n, 3)) + 30.0 * np.sin(0.04 * way), rate, BIAS


def starts(folder):
    """Yield name and records of a gyro, deg/s, with rate and bias."""
    for seconds in (3.0, 10.0):
        for shaken in (1.0, 2.5, SHAKEN, 6.0):
            rests = [rested(seconds, shaken, seed) for seed in range(SEEDS)]
            yield f"rest of {seconds:g} s, shaken by {shaken:g} deg/s", rests
    flights = [outside.hover(seed, *flight) for seed, flight in enumerate(outside.FLIGHTS)]
    cases = [
        (
            np.degrees(scene.gyro),
            scene.rate,
            np.degrees(scene.gyro[: round(scene.rate)].mean(axis=0)),
        )
        for scene in flights
    ]
    yield "quadrotors, from power-on", cases
    for kind in MOTIONS:
        moved = [
            zr.simulate_motion(kind, 100.0, 90.0, seed=seed, start="motion")
            for seed in range(SEEDS)
        ]
        for words, added in (("in motion", 0.0), (f"the same, shaken by {SHAKEN:g} deg/s", SHAKEN)):
            noise = [
                np.random.default_rng(seed).standard_normal(m.gyro.shape)
                for seed, m in enumerate(moved)
            ]
            yield (
                f"{kind}, {words}",
                [
                    (np.degrees(m.gyro) + added * z, 100.0, np.degrees(m.bias.mean(axis=0)))
                    for m, z in zip(moved, noise, strict=True)
                ],
            )
    if (folder / DRIVE).exists():
        body = car(folder)
        begins = [round(second * body.rate) for second in range(60, 460, 40)]
        yield "a car's drive, ten starts", [(body.gyro[k:], body.rate, body.bias) for k in begins]


def judged(kind, records, **limits):
    """Return the bias error at the end, and its largest excess over the error of zero, deg/s."""
    ends, worse = [], []
    for z, rate, bias in records:
        trace = kind(rate, channels=3, **limits).trace(np.ascontiguousarray(z))
        error = np.abs(trace.bias - bias)
        ends.append(error[-1].max())
        worse.append((error - np.abs(bias)).max())
    return f"{np.mean(ends):.2f} / {max(0.0, *worse):.2f}"


def of_drift(folder, before):
    """Print the effect of the limits on the drift filter."""
    filters = [("zerorate", zr.DriftFilter, dict(COMMANDS))]
    if before is not None:
        kinds = [
            (f"before, {r:g}", before, {"rest_limit": r, "bias_limit": 20.0}) for r in (3.0, 10.0)
        ]
        filters = kinds + filters
    rows = [
        (name, *(judged(kind, records, **limits) for _, kind, limits in filters))
        for name, records in starts(folder)
    ]
    head = ("recording", *(name for name, _, _ in filters))
    title = "Drift filter: error of the bias at the end, mean / worse than none, at worst, deg/s"
    print(table(title, head, rows, markdown=True))


def by_attitude(gyro, accel, rate):
    """Return the mask of rest by `Attitude`; rad/s and m/s^2."""
    return zr.Attitude(rate, mag=False).trace(gyro, accel)["at_rest"]


def of_replay(folder):
    """Print `replay` with its motion detector, and with the rests of `Attitude`."""
    rows = []
    for body in bodies(folder):
        size = np.nanmedian(np.linalg.norm(body.accel, axis=1))
        forces = body.accel * (1.0 if size > 5.0 else 9.80665)
        own = zr.noise.MotionDetector(body.rate).process(body.accel)
        other = ~by_attitude(np.radians(body.gyro), forces, body.rate)
        cells = [told(body, moving, **LIMITS) for moving in (own, other)]
        rows.append((body.name, *(cell for pair in zip(*cells, strict=True) for cell in pair)))
    head = ("recording", "rest", "Attitude's", "false", "Attitude's", "error", "Attitude's")
    print(table("Replay, by the detector of motion and by the rests of Attitude", head, rows, True))


def idling(seed, engine):
    """Return a drive with an engine that shakes both sensors, and the gyro bias, rad/s."""
    drive = zr.simulate_drive(duration=60.0, seed=seed)
    recording, rng = drive.recording(), np.random.default_rng(seed)
    gyro, accel = recording.gyro, recording.accel
    still = np.median(gyro.data[: round(2.0 * gyro.rate)], axis=0)
    unit = DEG if gyro.unit == "rad/s" else 1.0
    shaken = engine * rng.standard_normal((2, *gyro.data.shape))
    shaken[1] += engine * np.sin(50.0 * np.pi * accel.time + seed)[:, None]
    logs = {
        "gyro": gyro.with_data(gyro.data + unit * shaken[0]),
        "accel": accel.with_data(accel.data + shaken[1]),
    }
    return zr.Recording({**recording, **logs}), drive.fixes, still / unit * DEG


def of_navigation():
    """Print the rest from which `navigate` starts, with its means and with means of 0.1 s."""
    rows = []
    for engine in (0.0, 0.3, 1.0):
        errors = {0.5: [], 0.1: []}
        for seed in range(10):
            recording, fixes, bias = idling(seed, engine)
            samples = Samples.of(recording, mag=False, what="navigation")
            moves = coarse_start._ReceiverMotion.of(fixes)
            for seconds, found in errors.items():
                coarse_start._TICK_S, limits = seconds, coarse_start._STEADY_LIMITS
                if seconds == 0.1:
                    coarse_start._STEADY_LIMITS = (0.5 * DEG, 0.15, 0.12)
                rest = coarse_start._find_rest(samples, moves)
                coarse_start._TICK_S, coarse_start._STEADY_LIMITS = 0.5, limits
                if rest is not None:
                    first, last = np.searchsorted(samples.time, rest)
                    found.append(
                        np.abs(coarse_start._mean_sample(samples, first, last)[:3] - bias).max()
                        / DEG
                    )
        cells = [
            f"{len(found)}, {np.mean(found):.3f}" if found else "0" for found in errors.values()
        ]
        rows.append((f"{engine:g}", *cells))
    head = ("engine, deg/s and m/s²", "means of 0.5 s", "Attitude's, of 0.1 s")
    print(
        table("Navigate: rests found in ten drives, and error of the bias, deg/s", head, rows, True)
    )


def spans(flags, rate):
    """Return start and end of each rest, half a second before its detection, s."""
    edges = np.flatnonzero(np.diff(flags, prepend=False, append=False)).reshape(-1, 2) / rate
    found, last = [], 0.0
    for begin, end in edges.tolist():
        first, end = max(begin - 0.4, last), end - 0.2
        if end - first >= 1.0:
            found.append((first, end))
            last = end
    return found


def calibrated(gyro, accel, rests):
    """Return a calibration; None if there are too few rests."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return zr.calibrate(gyro=gyro, accel=accel, gravity=9.80665, rests=rests)
    except ValueError:
        return None


def of_calibration(folder):
    """Print calibrations with their own rests, with given rests, and with rests of `Attitude`."""
    rows = []
    for tremor in (0.0, 0.3, 1.0):
        errors = [[], [], []]
        for seed in range(1, 9):
            session = zr.simulation.simulate_session(20, seed=seed, tremor=tremor * DEG)
            gyro, accel = session.recording.gyro, session.recording.accel
            flags = by_attitude(np.radians(gyro.data), 9.80665 * accel.data, 100.0)
            given = [(first / 100.0, last / 100.0 - 0.01) for first, last in session.rests]
            for found, rests in zip(errors, (None, given, spans(flags, 100.0)), strict=True):
                made = calibrated(gyro, accel, rests)
                if made is not None:
                    found.append(1e3 * (made.values - session.truth.values)[ACCEL_BIAS])
        cells = [f"{np.sqrt(np.mean(np.square(e))):.3f}" if e else "none" for e in errors]
        rows.append((f"session, a hand trembles by {tremor:g} deg/s: bias", *cells))
    if (folder / MIMU).exists():
        errors = []
        for unit in range(1, 9):
            columns = [[f"imu{unit}_{kind}_{x}" for x in "xyz"] for kind in ("gyro", "accel")]
            names = [
                [f"{one}_{u}" for one in c] for c, u in zip(columns, ("dps", "g"), strict=True)
            ]
            gyro, accel = (zr.read_log(folder / MIMU, columns=one) for one in names)
            flags = by_attitude(np.radians(gyro.data), 9.80665 * accel.data, gyro.rate)
            made = [calibrated(gyro, accel, rests) for rests in (None, spans(flags, gyro.rate))]
            errors.append([1e3 * one.norm_error for one in made])
        own, other = np.mean(errors, axis=0)
        rows.append(("array of eight: norm error, held out", f"{own:.3f}", "", f"{other:.3f}"))
    head = ("recording", "own", "given", "Attitude's")
    print(table("Calibrate: errors by the rests that are used, mg", head, rows, True))


def main():
    """Print all tables."""
    options = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    options.add_argument("folder", nargs="?", type=Path, default=BESIDE)
    options.add_argument("--released", type=Path, help="compiled module of an earlier build")
    chosen = options.parse_args()
    before = None if chosen.released is None else released(chosen.released, "DriftFilter")
    of_drift(chosen.folder, before)
    if chosen.folder.is_dir():
        of_replay(chosen.folder)
    of_navigation()
    of_calibration(chosen.folder)


if __name__ == "__main__":
    main()
