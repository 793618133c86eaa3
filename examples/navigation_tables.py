"""Accuracy of a track in outages on a recorded drive, and relative to the truth in simulations.

``python examples/navigation_tables.py [FOLDER]`` prints six tables in Markdown. FOLDER has the
recordings ``drive_imu_100hz.parquet`` and ``drive_gnss_4hz.parquet`` (rtklibexplorer/GNSS_IMU,
data/drive_0708). They are from a car with a consumer sensor and RTK at 4 Hz. The metadata have
mounting, antenna and clock. Default: ../shared/data next to the checkout.
"""

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import zerorate as zr
from recordings import BESIDE
from tables import table
from zerorate.geometry.earth import offset_position

IMU, GNSS = "drive_imu_100hz.parquet", "drive_gnss_4hz.parquet"
RESTED = (0.0, 36.0)
"""Span in which the car stands, s; its first curve comes later."""
AXLE = (-1.0, 0.0, 1.3)
LENGTHS = (10.0, 30.0, 60.0)
SEEDS = (0, 1, 2)
GYRO = zr.NoiseModel(angle_random_walk=1e-4, rate_random_walk=2e-6)
ACCEL = zr.NoiseModel(angle_random_walk=1e-3, rate_random_walk=2e-5, quantity="acceleration")
"""Accelerometer noise of simulated drives."""
ACCEL_BIAS = 0.02
COASTS = (5.0, 10.0, 30.0, 60.0)
COAST_RECEIVERS = {
    "2 m, 1 Hz": {},
    "2 cm, 4 Hz": {"fixes_rate": 4.0, "position_sigma": 0.02, "velocity_sigma": 0.02},
}
"""Length of outages, s, and receivers, for the table of error over sigma."""
SETTLED = 120.0
"""Time from which errors of simulated drives count, s."""


def read_drive(folder):
    """Return sensors in the body's axes, fixes, mounting, and the start from a rest."""
    mounting = zr.io.read_mounting(folder / IMU)
    imu = zr.record.body_axes(zr.read_recording(folder / IMU), mounting.body_from_sensor)
    fixes = zr.read_fixes(folder / GNSS)
    start = zr.align(imu, latitude=fixes.position[0, 0], heading="course", span=RESTED)
    return imu, fixes, mounting, start


def outages_of_the_drive(folder, seconds, **options):
    """Return the outages of the recorded drive with the inertial sensors alone."""
    imu, fixes, mounting, start = read_drive(folder)
    nav = zr.NavigationFilter(start, antenna=mounting.antenna)
    asked = {"seconds": seconds, "nav": nav, "time_offset": mounting.time_offset, **options}
    return zr.navigation.outages(imu, fixes, **asked)


def drive_rows(folder):
    """Yield the rows of the recorded drive."""
    imu, fixes, mounting, start = read_drive(folder)
    found = {}
    for name, wheels in (("INS", {}), ("INS + wheels", {"vehicle": "wheeled", "axle": AXLE})):
        nav = zr.NavigationFilter(start, antenna=mounting.antenna, **wheels)
        found[name] = zr.navigation.outages(
            imu,
            fixes,
            seconds=LENGTHS,
            nav=nav,
            smooth=True,
            time_offset=mounting.time_offset,
        )
    free, wheeled = found.values()
    own = zr.navigation.find_start(imu, fixes, antenna=mounting.antenna)
    clock = zr.navigation.find_time_offset(imu, fixes, own, antenna=mounting.antenna)
    told = {}
    for name, offset, wheels in (
        ("any start", mounting.time_offset, {}),
        ("clock", clock, {}),
        ("speed", mounting.time_offset, {"vehicle": "wheeled"}),
        ("both", clock, {"vehicle": "wheeled"}),
    ):
        later = mounting.time_offset if offset is not clock else clock.velocity_seconds
        speed = speeds(imu, fixes, later)
        begin = zr.navigation.find_start(imu, fixes, antenna=mounting.antenna, time_offset=offset)
        told[name] = zr.navigation.outages(
            imu,
            fixes,
            seconds=LENGTHS,
            nav=zr.NavigationFilter(begin, antenna=mounting.antenna, **wheels),
            smooth=True,
            wheel_speed=speed if wheels else None,
            time_offset=offset,
        )
    rows = (
        ("position held", free, "position held"),
        ("velocity held", free, "velocity held"),
        ("INS", free, "filter"),
        ("INS + wheels", wheeled, "filter"),
        ("INS, start by the motion", told["any start"], "filter"),
        ("INS, clock by the innovations", told["clock"], "filter"),
        ("INS + speed of wheels", told["speed"], "filter"),
        ("INS + speed of wheels, clock", told["both"], "filter"),
        ("INS smoothed", free, "smoothed"),
        ("INS + wheels, smoothed", wheeled, "smoothed"),
        ("INS + speed, clock, smoothed", told["both"], "smoothed"),
    )
    for label, outages, name in rows:
        yield label, *(cell(outages[length], name) for length in LENGTHS)
    yield "number of outages", *(str(free[length].n) for length in LENGTHS)


def speeds(imu, fixes, offset):
    """Return the receiver's speed as wheel speed at 10 Hz, with additional noise of 0.1 m/s."""
    time = imu.gyro.time
    at = np.arange(0, len(time), 10)
    told = np.full(len(time), np.nan)
    told[at] = np.interp(time[at], fixes.time + offset, np.hypot(*fixes.velocity[:, :2].T))
    told[at] += 0.1 * np.random.default_rng(1).standard_normal(len(at))
    return told


def cell(one, name):
    """Return RMS, median and maximum; for the filter also the error over sigma."""
    values = (one.rms(name), one.median(name), one.largest(name))
    over = f"; {one.error_over_sigma():.1f}" if name == "filter" else ""
    return " / ".join(f"{x:.1f}" if x < 100.0 else f"{x:.0f}" for x in values) + over


def coasting_rows(folder):
    """Yield error over sigma, RMS and share in the ellipse on the drive, for three series."""
    imu, fixes = zr.read_recording(folder / IMU), zr.read_fixes(folder / GNSS)
    for name, noise in (("default", "stated"), ("bank", "stated"), ("by coasting", "auto")):
        begun = zr.navigation.find_beginning(imu, fixes, noise=noise)
        series = [
            zr.navigation.outages(
                begun.recording,
                fixes,
                seconds=COASTS,
                nav=bank(begun) if name == "bank" else begun.filter(),
                between=10.0,
                first=first,
                time_offset=begun.time_offset,
            )
            for first in (60.0, 66.0, 73.0)
        ]
        cells = (ratio_cell([one[length] for one in series]) for length in COASTS)
        yield f"drive, {name}", *cells


def bank(begun):
    """Return a bank of four filters with a start and the stated noise."""
    known = {"antenna": begun.antenna, "antenna_sigma": begun.antenna_sigma}
    return zr.navigation.NavigationBank(
        begun.start, consider_antenna=begun.consider_antenna, **known
    )


def vibration_rows(folder):
    """Yield errors after 10 s with the default noise, by fifths of the gyro's vibration."""
    imu, fixes = zr.read_recording(folder / IMU), zr.read_fixes(folder / GNSS)
    begun = zr.navigation.find_beginning(imu, fixes, noise="stated")
    known = {"nav": begun.filter(), "time_offset": begun.time_offset, "seconds": 10.0}
    changes = np.diff(begun.recording.gyro.data, axis=0)
    total = np.cumsum(changes**2, axis=0)
    found = []
    for first in np.arange(60.0, 75.0):
        one = zr.navigation.outages(begun.recording, fixes, between=5.0, first=first, **known)[10.0]
        last = np.flatnonzero(np.diff(one.outage, append=-1))
        begin, end = np.searchsorted(begun.recording.gyro.time, one.spans.T) - 1
        mean = np.sqrt((total[end] - total[begin]) / (end - begin)[:, np.newaxis])
        way = one.errors["position held"][last]
        way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
        error = one.errors["filter"][last]
        along, across = (error * way).sum(axis=1), error[:, 1] * way[:, 0] - error[:, 0] * way[:, 1]
        found.append(np.column_stack([mean, along, across]))
    found = np.vstack(found)
    for part in np.array_split(found[np.argsort(found[:, 1])], 5):
        yield tuple(f"{rms:.2g}" for rms in np.sqrt((part**2).mean(axis=0)))


def simulated_coasting_rows():
    """Yield the same values for simulated drives with scaled or unknown noise models."""
    for receiver, options in COAST_RECEIVERS.items():
        drives = [zr.simulate_drive(duration=400.0, seed=seed, **options) for seed in range(4)]
        for factor in (0.3, 1.0, 5.0, None):
            noise = {} if factor is None else scaled_noise(factor)
            series = {"stated": [], "found": [], "bank": []}
            for drive in drives:
                imu = drive.recording()
                start = zr.align(imu, latitude=48.0, heading="course", accel_bias_sigma=ACCEL_BIAS)
                found = zr.navigation.find_noise(imu, drive.fixes, start, lower=True, **noise)
                for name, kind, models in (
                    ("stated", zr.NavigationFilter, noise),
                    ("found", zr.NavigationFilter, found.models),
                    ("bank", zr.navigation.NavigationBank, noise),
                ):
                    nav = kind(start, **models)
                    series[name].append(
                        zr.navigation.outages(
                            imu, drive.fixes, seconds=COASTS, nav=nav, between=10.0
                        )
                    )
            times = "default" if factor is None else f"× {factor:g}"
            for name, all_outages in series.items():
                cells = (ratio_cell([one[length] for one in all_outages]) for length in COASTS)
                yield f"{receiver}, {times}, {name}", *cells


def ratio_cell(outages):
    """Return error over sigma, RMS, and the share of end errors in the 95 % ellipse."""
    count = np.array([one.n for one in outages])

    def mean(values):
        return float(np.average(values, weights=count))

    ratio = math.sqrt(mean([one.error_over_sigma() ** 2 for one in outages]))
    rms = math.sqrt(mean([one.rms() ** 2 for one in outages]))
    inside = mean([one.share_inside() for one in outages])
    return f"{ratio:.2f}; {rms:.3g}; {inside:.0%}"


def scaled_noise(factor):
    """Return the noise of the simulator's sensors, times a factor."""
    gyro = zr.NoiseModel(angle_random_walk=1e-4 * factor, rate_random_walk=2e-6 * factor)
    accel = zr.NoiseModel(
        angle_random_walk=1e-3 * factor, rate_random_walk=2e-5 * factor, quantity="acceleration"
    )
    return {"gyro": gyro, "accel": accel}


def simulated_rows():
    """Yield the rows of simulated drives: filter and smoother, for each seed and for all."""
    squares = []
    for seed in SEEDS:
        drive = zr.simulate_drive(duration=400.0, seed=seed)
        imu, nav = drive.recording(), told(drive)
        track = nav.copy().process(imu, drive.fixes)
        found = [*errors(track, drive), *errors(track.smooth(), drive)]
        outages = zr.navigation.outages(imu, drive.fixes, seconds=60.0, nav=nav)[60.0]
        found += [outages.rms("velocity held"), outages.rms()]
        squares.append(np.square(found))
        yield row(f"seed {seed}", found)
    yield row("all", np.sqrt(np.mean(squares, axis=0)))


def told(drive, **options):
    """Return a filter with the true noise of the sensors and bounds of their biases."""
    start = zr.align(
        drive.recording(), latitude=48.0, heading="course", accel_bias_sigma=ACCEL_BIAS
    )
    return zr.NavigationFilter(start, gyro=GYRO, accel=ACCEL, **options)


def receiver_rows():
    """Yield the effect of receivers with wrong standard deviations: horizontal RMS of all seeds."""
    drives = [zr.simulate_drive(duration=400.0, seed=seed) for seed in SEEDS]
    for name, spoilt in RECEIVERS.items():
        found = []
        for options in ADAPTS.values():
            squares = []
            for drive in drives:
                fixes = spoilt(drive.fixes, np.random.default_rng(1))
                track = told(drive, **options).process(drive.recording(), fixes)
                squares.append(errors(track, drive)[0] ** 2)
            found.append(f"{np.sqrt(np.mean(squares)):.3f}")
        yield name, *found


def says(position, velocity):
    """Return a receiver with wrong stated standard deviations."""

    def spoilt(fixes, _):
        n = len(fixes)
        return replace(
            fixes,
            position_sigma=np.full((n, 3), position),
            velocity_sigma=np.full((n, 3), velocity),
        )

    return spoilt


def spikes(fixes, random):
    """Return fixes with an error of 30 m in one of twenty."""
    which = random.random(len(fixes)) < 0.05
    off = random.standard_normal((len(fixes), 3))
    off *= 30.0 / np.linalg.norm(off, axis=1, keepdims=True)
    return replace(fixes, position=offset_position(fixes.position, which[:, np.newaxis] * off))


def louder(fixes, random):
    """Return fixes with five times the noise for 100 s."""
    which = ((fixes.time > 200.0) & (fixes.time < 300.0))[:, np.newaxis]
    more = np.sqrt(24.0) * which * random.standard_normal((2, len(fixes), 3))
    return replace(
        fixes,
        position=offset_position(fixes.position, 2.0 * more[0]),
        velocity=fixes.velocity + 0.1 * more[1],
    )


RECEIVERS = {
    "as it says, 2 m and 0.1 m/s": lambda fixes, _: fixes,
    "says 0.4 and 0.02": says(0.4, 0.02),
    "says 10 and 0.5": says(10.0, 0.5),
    "says 0.4 and 0.5": says(0.4, 0.5),
    "says 10 and 0.02": says(10.0, 0.02),
    "one fix in twenty 30 m off": spikes,
    "noise five times for 100 s": louder,
}
ADAPTS = {
    "fixed, no gate": {"adapt": "fixed", "gate": 1e9},
    "fixed, gate 16.27": {"adapt": "fixed", "gate": 16.27},
    "fixed, gate 50": {"adapt": "fixed"},
    "free, gate 50": {"adapt": "free"},
    "inflate, gate 50": {},
}


def errors(track, drive):
    """Return the RMS errors: horizontal, m, velocity, m/s, and gyro bias, deg/h."""
    there = track.time > SETTLED
    off = track.errors(drive.truth_position, drive.truth_velocity)[there]
    bias = (track.gyro_bias - drive.gyro_bias)[there]
    return (
        np.sqrt((off[:, :2] ** 2).sum(axis=1).mean()),
        np.sqrt((off[:, 3:] ** 2).mean()),
        3600.0 * np.degrees(np.sqrt((bias**2).mean())),
    )


def row(name, found):
    """Return a row of the simulated table."""
    position, velocity, bias, best, best_velocity, best_bias, held, outage = found
    numbers = f"{position:.3f}", f"{velocity:.4f}", f"{bias:.1f}"
    smoothed = f"{best:.3f}", f"{best_velocity:.4f}", f"{best_bias:.1f}"
    return (name, *numbers, *smoothed, f"{held:.0f}", f"{outage:.1f}")


def main(folder):
    """Print the tables."""
    head = ("filter", *(f"{length:g} s" for length in LENGTHS))
    title = (
        "Recorded drive, end of outages, horizontal error in m: rms / median / largest; over sigma"
    )
    coast = ("filter", *(f"{length:g} s" for length in COASTS))
    coasting = "Error over sigma; RMS, m; ends in the ellipse of 95 %"
    if (folder / IMU).exists():
        print(table(title, head, drive_rows(folder), markdown=True))
        print(table(coasting, coast, coasting_rows(folder), markdown=True))
        head = ("change of roll rate, rad/s", "pitch", "yaw", "error along, m", "across, m")
        title = "Coasts of 10 s by the gyro's change from sample to sample, RMS"
        print(table(title, head, vibration_rows(folder), markdown=True))
    else:
        print(f"no {IMU} in {folder}\n", file=sys.stderr)
    head = (
        "recording",
        "position, m",
        "velocity, m/s",
        "gyro bias, deg/h",
        "smoothed, m",
        "m/s",
        "deg/h",
        "60 s held, m",
        "60 s filter, m",
    )
    title = f"Simulated drives of 400 s, RMS after {SETTLED:g} s; fixes of 2 m and 0.1 m/s at 1 Hz"
    print(table(title, head, simulated_rows(), markdown=True))
    print(table(coasting, coast, simulated_coasting_rows(), markdown=True))
    title = "The same with receivers that are not as they say, RMS in the plane, m"
    print(table(title, ("receiver", *ADAPTS), receiver_rows(), markdown=True))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else BESIDE)
