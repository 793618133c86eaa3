"""Start, checks, axes, clocks, wheels and antenna of the navigation filter, in numbers.

``python examples/navigation_studies.py [FOLDER]`` prints a table in Markdown, in some minutes.
FOLDER has the recordings ``drive_imu_100hz.parquet`` and ``drive_gnss_4hz.parquet``, as for
``navigation_tables.py``. Default: ../shared/data next to the checkout. Without them the rows of the
recorded drive are left out.
"""

import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import zerorate as zr
from navigation_tables import GNSS, IMU, speeds
from recordings import BESIDE
from tables import table
from zerorate.geometry.earth import offset_position
from zerorate.navigation import find_start, find_time_offset
from zerorate.navigation.heading import heading_of
from zerorate.record import TimeOffset

RATE, LONG, SHORT = 100.0, 400.0, 150.0
DRIVES = 40
AXLE = (0.0, 0.0, 0.0)
"""Position of the axle, m; a simulated car rotates about its sensors."""
LENGTHS = (10.0, 30.0, 60.0)
ANTENNA = np.array([1.0, 0.3, -1.2])
Row = tuple[str, str]


def main(folder):
    """Print the table."""
    rows = [row for part in SIMULATED for row in part()]
    if (folder / IMU).exists():
        drive = recorded(folder)
        rows += [row for part in RECORDED for row in part(*drive)]
    else:
        print(f"no {IMU} in {folder}\n", file=sys.stderr)
    print(table("Studies", ("quantity", "result"), rows, markdown=True))


def many(work, cases):
    """Return the result of `work` for each case, on two threads."""
    with ThreadPoolExecutor(2) as pool:
        return list(pool.map(work, cases))


def rms(values):
    """Return the root mean square without NaN."""
    return float(np.sqrt(np.nanmean(np.square(values))))


def numbers(values, digits=2):
    """Return numbers as text with commas."""
    return ", ".join(f"{x:.{digits}f}" for x in np.atleast_1d(values))


# Rows about starts.


def starts() -> Iterator[Row]:
    """Return the rows of sixty starts of simulated drives, at rest and in motion."""
    cases = [(seed, begin) for seed in range(20) for begin in (0.0, 100.0, 200.0)]
    found = np.array(many(started, cases))
    seconds, at_once, later = found.T
    yield (
        "60 starts of simulated drives: decided",
        str(int(np.isfinite(seconds).sum())),
    )
    yield (
        "seconds to the decision, median and worst",
        f"{np.nanmedian(seconds):.0f}, {np.nanmax(seconds):.0f}",
    )
    yield (
        "heading then, deg RMS and worst",
        f"{rms(at_once):.1f}, {np.nanmax(np.abs(at_once)):.1f}",
    )
    yield (
        "a minute later",
        f"{rms(later):.2f}, {np.nanmax(np.abs(later)):.2f}",
    )


def started(case):
    """Return the time of the decision, s, and the heading errors then and a minute later, deg."""
    seed, begin = case
    drive = zr.simulate_drive(RATE, LONG, seed=seed)
    fixes = drive.fixes.between(begin)
    try:
        start = find_start(drive.recording(), fixes)
    except zr.LogError:
        return np.full(3, np.nan)
    decided = float(start.notes[-1].split(" at ")[1].split(" s")[0])
    track = zr.NavigationFilter(start).process(drive.recording(), fixes, keep="track")
    at = np.searchsorted(track.time, [decided + 0.01, decided + 60.0])
    off = heading_of(track.quaternion[at]) - heading_of(drive.truth_quaternion[at])
    return np.array(
        [decided - start.time, *np.degrees(np.remainder(off + np.pi, 2 * np.pi) - np.pi)]
    )


# Rows about checks before the filter runs.

ONE = np.eye(3)
FLIP = np.diag([1.0, -1.0, 1.0])
EXCHANGED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
FORWARD_IS_Y = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
TO_RADIANS = np.diag([np.radians(1.0), np.radians(1.0), 1.0])


def turned(imu, gyro=ONE, accel=ONE):
    """Return a recording with the sensors multiplied by matrices."""
    gyro_log, accel_log = (
        imu[name].with_data(imu[name].data @ matrix.T)
        for name, matrix in (("gyro", gyro), ("accel", accel))
    )
    return zr.Recording({"gyro": gyro_log, "accel": accel_log}, imu.source)


def frozen(imu, name):
    """Return a recording with a sensor that is frozen for twenty seconds."""
    log = imu[name]
    data = log.data.copy()
    k = np.searchsorted(log.time, [log.time[0] + 0.4 * np.ptp(log.time)])[0]
    data[k : k + round(20.0 * log.rate)] = data[k]
    logs = {one: imu[one] for one in ("gyro", "accel")}
    return zr.Recording({**logs, name: log.with_data(data)}, imu.source)


def by(fixes, position=ONE, velocity=ONE):
    """Return fixes with positions or velocities multiplied by a matrix."""
    return replace(
        fixes, position=fixes.position @ position.T, velocity=fixes.velocity @ velocity.T
    )


def jumped(fixes):
    """Return fixes with a clock that jumps by 3 s in the middle."""
    middle = 0.5 * (fixes.time[0] + fixes.time[-1])
    kept = (fixes.time < middle - 3.0) | (fixes.time >= middle)
    some = fixes.chosen(kept)
    return replace(some, time=some.time - 3.0 * (some.time >= middle))


MISTAKES = {
    "gyro": (
        lambda i, f: (turned(i, np.degrees(1.0) * ONE), f),
        lambda i, f: (turned(i, np.radians(1.0) * ONE), f),
        lambda i, f: (turned(i, -ONE), f),
    ),
    "force": (lambda i, f: (turned(i, accel=-ONE), f),),
    "axes": (
        lambda i, f: (turned(i, FLIP, FLIP), f),
        lambda i, f: (turned(i, *2 * (np.diag([1.0, 1.0, -1.0]),)), f),
    ),
    "mount": (
        lambda i, f: (turned(i, *2 * (np.diag([-1.0, -1.0, 1.0]),)), f),
        lambda i, f: (turned(i, FORWARD_IS_Y, FORWARD_IS_Y), f),
    ),
    "velocity": (
        lambda i, f: (i, by(f, velocity=3.6 * ONE)),
        lambda i, f: (i, by(f, velocity=ONE / 0.514444)),
        lambda i, f: (i, by(f, velocity=EXCHANGED)),
    ),
    "position": (lambda i, f: (i, by(f, position=TO_RADIANS)),),
    "clock": (
        lambda i, f: (i, f.shifted(3.0)),
        lambda i, f: (i, f.shifted(60.0)),
        lambda i, f: (i, f.shifted(1.7e9)),
    ),
    "jump": (lambda i, f: (i, jumped(f)),),
    "frozen": (lambda i, f: (frozen(i, "gyro"), f), lambda i, f: (frozen(i, "accel"), f)),
}


def named(imu, fixes):
    """Return the number of mistakes that are detected, each alone."""
    count = 0
    for what, changes in MISTAKES.items():
        for change in changes:
            found = zr.navigation.check_navigation(*change(imu, fixes)).findings
            count += len(found) == 1 and (found[0].what, found[0].status) == (what, "mistake")
    return count


def checks() -> Iterator[Row]:
    """Return the rows of detected mistakes, false alarms, and fixes of another recording."""
    drives = {seed: zr.simulate_drive(50.0, LONG, seed=seed) for seed in range(3)}
    counts = [named(drive.recording(), drive.fixes) for drive in drives.values()]
    total = sum(map(len, MISTAKES.values()))
    words = ", ".join(f"{count} of {total}" for count in counts)
    yield "mistakes in 3 simulated drives, each named alone", words
    cases = [(seed, seconds) for seed in range(20) for seconds in (LONG, SHORT)]
    false = sum(many(lambda case: len(right(*case)), cases))
    yield f"false findings in {len(cases)} that are right", str(false)
    pairs = [(seed, seconds) for seed in range(15) for seconds in (LONG, SHORT)]
    taken = sum(many(lambda case: matched(*case), pairs))
    yield f"fixes of another recording taken for its own, of {len(pairs)}", str(int(taken))


def right(seed, seconds):
    """Return the mistakes reported for a drive without mistakes."""
    drive = zr.simulate_drive(50.0, seconds, seed=seed)
    return zr.navigation.check_navigation(drive.recording(), drive.fixes).mistakes


def matched(seed, seconds):
    """Return True if fixes of another drive are accepted for this drive."""
    drive, other = (zr.simulate_drive(50.0, seconds, seed=k) for k in (seed, 1000 + seed))
    return np.isfinite(zr.navigation.check_navigation(drive.recording(), other.fixes).lag)


# Rows about axes.


def axes() -> Iterator[Row]:
    """Return the rows of sensors with random mounting."""
    found = np.array(many(axes_off, range(DRIVES)))
    yaw, tilt, sigma, certain = found.T
    worst = np.abs(yaw).max()
    yield (
        f"axes of {DRIVES} random mounts: yaw deg RMS, worst; tilt; certain",
        f"{rms(yaw):.2f}, {worst:.2f}; {rms(tilt):.2f}; {certain.sum():.0f}",
    )
    within = np.mean(np.abs(yaw) < sigma)
    yield "yaw within one deviation", f"{within:.2f}"


def axes_off(seed):
    """Return errors of yaw and tilt, deg, sigma of the yaw, and True if it is certain."""
    drive = zr.simulate_drive(50.0, LONG, seed=seed, body_from_sensor="random")
    axes = zr.navigation.check_navigation(drive.recording(), drive.fixes, mounted=False).axes
    turn = Rotation.from_matrix(axes.body_from_sensor @ drive.body_from_sensor.T)
    x, y, z = turn.as_rotvec(degrees=True)
    return z, np.hypot(x, y), np.degrees(axes.yaw_sigma), axes.certain


# Rows about clocks.


def clocks() -> Iterator[Row]:
    """Return the rows of two offsets and a rate, for receivers of 2 m and of RTK."""
    for name, options in (
        ("clock", {}),
        (
            "clock, RTK of 2 cm at 4 Hz",
            {"position_sigma": 0.02, "velocity_sigma": 0.05, "fixes_rate": 4.0},
        ),
        ("clock, 150 s alone", {"duration": 150.0}),
    ):
        found = np.array(many(lambda seed, given=options: clock_off(seed, **given), range(DRIVES)))
        off, sigma = found[:, :3], found[:, 3:]
        known = np.isfinite(off[:, 0])
        # An uncertain rate is reported as zero, with its standard deviation.
        p, v, r = (rms(errors) for errors in off[known].T)
        yield (
            f"{name}, {DRIVES} drives: position, velocity s RMS, rate",
            f"{p:.4f}, {v:.4f}, {r:.0e}",
        )
        within = np.mean(np.abs(off[known]) < sigma[known], axis=0)
        yield "within one deviation", numbers(within)
        yield "not identifiable", str(int((~known).sum()))


def clock_off(seed, duration=LONG, **options):
    """Return the errors of both offsets and of the rate, with their standard deviations."""
    random = np.random.default_rng(seed)
    true = TimeOffset(
        random.uniform(-0.3, 0.3),
        0.0,
        random.uniform(-0.3, 0.3),
        0.0,
        random.uniform(-4e-4, 4e-4),
        0.0,
        0.5 * duration,
    )
    drive = zr.simulate_drive(RATE, duration, seed=seed, time_offset=true, **options)
    imu = drive.recording()
    found = find_time_offset(imu, drive.fixes, find_start(imu, drive.fixes))
    if not found.identifiable:
        return np.full(6, np.nan)
    drift = true.rate * (found.middle - true.middle)
    off = (
        found.seconds - true.seconds - drift,
        found.velocity_seconds - true.velocity_seconds - drift,
        found.rate - true.rate,
    )
    return (*off, found.sigma, found.velocity_sigma, found.rate_sigma)


# Rows about wheels.


def wheels() -> Iterator[Row]:
    """Return the rows of the wheels' scale, and of outages relative to the truth."""
    for name, slips in (
        ("clean", 0),
        ("6 slips", 6),
    ):
        found = np.array(many(lambda seed, count=slips: scale_off(seed, count), range(DRIVES)))
        off, sigma, end = found.T
        label = f"wheels 2 % wrong, ticks of 3 cm, {DRIVES} drives, {name}"
        yield f"{label}: scale RMS, worst", f"{rms(off):.4f}, {np.abs(off).max():.4f}"
        yield "within one deviation", f"{np.mean(np.abs(off) < sigma):.2f}"
        yield "60 s outage against the truth, m", f"{rms(end):.1f}"


def scale_off(seed, slips):
    """Return error and sigma of the scale, and the error after the last minute without fixes, m."""
    drive = zr.simulate_drive(RATE, LONG, seed=seed)
    imu = drive.recording()
    count = zr.simulation.wheel_ticks(drive, scale=0.02, axle=AXLE, slips=slips, seed=seed)
    told = zr.navigation.Wheels.of_ticks(drive.time, count, tick=0.03)
    nav = zr.NavigationFilter(find_start(imu, drive.fixes), vehicle="wheeled", axle=AXLE)
    run = nav.copy()
    run.process(imu, drive.fixes, wheel_speed=told, keep="track")
    fixes = drive.fixes.between(stop=LONG - 60.5)
    track = nav.process(imu, fixes, wheel_speed=told, keep="track")
    end = np.hypot(*track.errors(drive.truth_position)[-1, :2])
    return run.wheel_constants[0] - 0.02, run.wheel_constants_sigma[0], end


# Rows about the antenna.


def antennas() -> Iterator[Row]:
    """Return the rows of an antenna that is stated correctly, stated wrongly, and estimated."""
    found = np.array(many(antenna_found, range(20)))
    errors, off, sigma = found[:, :3], found[:, 3:6], found[:, 6:]
    yield (
        "antenna 1.6 m off, 20 drives, m RMS: given, wrong, found",
        numbers([rms(column) for column in errors.T], 3),
    )
    yield (
        "its place: forward, right, down, m RMS; stated",
        f"{numbers([rms(column) for column in off.T])}; {numbers(sigma.mean(axis=0))}",
    )


def antenna_found(seed):
    """Return horizontal RMS errors, the error of the estimated antenna, and its sigma, m."""
    drive = zr.simulate_drive(RATE, LONG, seed=seed, antenna=ANTENNA)
    imu = drive.recording()
    start = find_start(imu, drive.fixes)
    found = []
    for lever, spread in ((ANTENNA, 0.0), (np.zeros(3), 0.0), (np.zeros(3), 1.0)):
        nav = zr.NavigationFilter(start, antenna=lever, antenna_sigma=spread)
        track = nav.process(imu, drive.fixes, keep="track")
        error = track.errors(drive.truth_position)[track.time > 120.0, :2]
        found.append(rms(np.hypot(*error.T)))
    return (*found, *(nav.antenna - ANTENNA), *nav.antenna_sigma)


SIMULATED = (starts, checks, axes, clocks, wheels, antennas)


# Rows about the recorded drive.


def recorded(folder):
    """Return recording, fixes and the metadata on the mounting."""
    mounting = zr.io.read_mounting(folder / IMU)
    imu = zr.record.body_axes(zr.read_recording(folder / IMU), mounting.body_from_sensor)
    return imu, zr.read_fixes(folder / GNSS), mounting


def drive_checks(imu, fixes, mounting) -> Iterator[Row]:
    """Return the rows of mistakes and axes of the recorded drive."""
    total = sum(map(len, MISTAKES.values()))
    yield "drive: mistakes, each named alone", f"{named(imu, fixes)} of {total}"
    parts = ((0.0, 600.0), (0.0, 270.0), (270.0, 600.0), (150.0, 350.0))
    found = [zr.navigation.check_navigation(imu, fixes.between(*span)).findings for span in parts]
    yield "drive and three parts of it: false findings", str(sum(map(len, found)))
    turn = Rotation.from_matrix(zr.navigation.check_navigation(imu, fixes).axes.body_from_sensor)
    x, y, z = turn.as_rotvec(degrees=True)
    yield (
        "axes of the drive against its metadata, yaw and tilt, deg",
        f"{abs(z):.2f}, {np.hypot(x, y):.2f}",
    )


def drive_starts(imu, fixes, mounting) -> Iterator[Row]:
    """Return the rows of 10 s outages after starts at any time of the drive."""
    lever, offset = mounting.antenna, mounting.time_offset
    found = []
    for begin in (0.0, 100.0, 140.0, 230.0, 300.0):
        some = fixes.between(begin)
        start = find_start(imu, some, antenna=lever, time_offset=offset)
        nav = zr.NavigationFilter(start, antenna=lever, gate=1e12)
        one = zr.navigation.outages(imu, some, seconds=10.0, nav=nav, time_offset=offset)
        found.append(one[10.0].rms())
    yield (
        "drive, 10 s outages begun at 0, 100, 140, 230, 300 s, m RMS",
        numbers(found, 1),
    )


def drive_clock(imu, fixes, mounting) -> Iterator[Row]:
    """Return the rows of its clocks, its antenna, and the gain from wheels with these clocks."""
    lever = mounting.antenna
    clock = find_time_offset(imu, fixes, find_start(imu, fixes, antenna=lever), antenna=lever)
    yield (
        "clock of the drive: position, velocity, s, rate",
        f"{-clock.seconds:.3f}, {-clock.velocity_seconds:.3f}, {-clock.rate:.1e}",
    )
    start = find_start(imu, fixes, antenna=lever, time_offset=clock)
    nav = zr.NavigationFilter(start, antenna=lever)
    nis = np.nanmean(nav.process(imu, fixes, time_offset=clock, keep="track").nis(), axis=0)
    yield "its mean NIS of positions and velocities with that", numbers(nis, 1)
    for name, offset, later in (
        ("metadata's clock", mounting.time_offset, mounting.time_offset),
        ("clocks found", clock, clock.velocity_seconds),
    ):
        begin = find_start(imu, fixes, antenna=lever, time_offset=offset)
        found = zr.navigation.outages(
            imu,
            fixes,
            seconds=LENGTHS,
            nav=zr.NavigationFilter(begin, antenna=lever, vehicle="wheeled"),
            wheel_speed=speeds(imu, fixes, later),
            time_offset=offset,
        )
        ends = [one.rms() for one in found.lengths]
        yield f"wheels, drive, {name}: 10, 30, 60 s, m RMS", numbers(ends)
    ends = []
    for wrong, spread in (((1.0, 0.0, 0.0), 0.0), ((1.0, 0.0, 0.0), 1.0)):
        nav = zr.NavigationFilter(start, antenna=np.add(lever, wrong), antenna_sigma=spread)
        one = zr.navigation.outages(imu, fixes, seconds=10.0, nav=nav, time_offset=clock)
        ends.append(one[10.0].rms())
    yield "antenna 1 m wrong, and then found: 10 s, m RMS", numbers(ends)


def drive_returns(imu, fixes, mounting) -> Iterator[Row]:
    """Return the rows of positions after outages of 30 s, right and wrong."""
    for name, wrong in (
        ("right", 0),
        ("the first 100 m off", 1),
        ("two that differ", 2),
    ):
        worst = returned(imu, fixes, mounting, wrong)
        yield (
            f"drive, after 30 s outages, fixes {name}: worst in 0-1, 1-2, 2-5, 5-30 s, m",
            numbers(worst, 1),
        )


def returned(imu, fixes, mounting, wrong):
    """Return the largest errors after outages of 30 s that end with wrong fixes."""
    lever, offset = mounting.antenna, mounting.time_offset
    start = find_start(imu, fixes, antenna=lever, time_offset=offset)
    starts = np.arange(100.0, fixes.time[-1] - 62.0, 75.0)
    kept = np.ones(len(fixes), bool)
    off = np.zeros((len(fixes), 3))
    for begin in starts:
        kept &= (fixes.time <= begin) | (fixes.time > begin + 30.0)
        first = int(np.searchsorted(fixes.time, begin + 30.0, side="right"))
        off[first : first + wrong] = 100.0 * np.array([[1.0, 0, 0], [0, -1.0, 0]])[:wrong]
    some = replace(fixes, position=offset_position(fixes.position, off)).chosen(kept)
    track = zr.NavigationFilter(start, antenna=lever).process(
        imu, some, time_offset=offset, keep="track"
    )
    time = fixes.time + offset
    place = np.column_stack([np.interp(time, track.time, axis) for axis in track.position.T])
    error = np.hypot(*zr.geometry.earth.local_ned(place, fixes.position)[:, :2].T)
    worst = []
    for low, high in ((0.0, 1.0), (1.0, 2.0), (2.0, 5.0), (5.0, 30.0)):
        inside = [(fixes.time > b + 30.0 + low) & (fixes.time <= b + 30.0 + high) for b in starts]
        worst.append(error[np.logical_or.reduce(inside)].max())
    return worst


RECORDED = (drive_checks, drive_starts, drive_clock, drive_returns)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else BESIDE)
