"""Consistency of the navigation filter with aids, in fourteen seeded scenarios.

``python examples/navigation_scenarios.py [SEEDS]`` prints three tables in Markdown. With 50 seeds
it takes some minutes on two cores. The vehicles are from ``vehicles.py`` and ``zr.simulate_drive``.
The filter has the true noise of its sensors. Its start has errors with the stated standard
deviations.
"""

import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from statistics import NormalDist

import numpy as np

import vehicles
import zerorate as zr
from tables import table
from zerorate.geometry.earth import local_ned, offset_position
from zerorate.geometry.rotations import (
    from_rotation_vectors,
    inverse,
    product,
    rotate,
    to_rotation_vectors,
)
from zerorate.navigation import OUTPUTS, Aid, find_start
from zerorate.navigation.aids import AidRows
from zerorate.navigation.alignment import Alignment
from zerorate.navigation.events import pack_fixes
from zerorate.simulation import antenna_baseline, barometer, compass_heading

SEEDS = 50
RATE, SECONDS, REST = 50.0, 150.0, 15.0
STEP_S = 1.0
SETTLED_S = 25.0
GAP_S = 5.0
"""Gap after which the filter does not trust a single fix, s."""
GRAVITY = 9.80665
COMPASS_OFFSET_RAD, COMPASS_NOISE_RAD = 0.035, 0.05
GYRO = zr.NoiseModel(angle_random_walk=2e-4, rate_random_walk=2e-6)
ACCEL = zr.NoiseModel(angle_random_walk=3e-3, rate_random_walk=2e-5, quantity="acceleration")
NOISE = {"gyro": GYRO, "accel": ACCEL}
BIASES = {"gyro_bias": 1e-3, "accel_bias": 0.02}
BAROMETER = {"barometer_sigma": 0.4, "barometer_walk": 0.02}
SIGMAS = {"level_sigma": 0.005, "heading_sigma": 0.05, "gyro_bias_sigma": 1e-4}


@dataclass
class Case:
    """A simulated vehicle with start, fixes and aids for the filter, and the filter's options."""

    drive: zr.simulation.SimulatedDrive
    start: Alignment
    fixes: zr.Fixes
    aids: dict = field(default_factory=dict)
    options: dict = field(default_factory=dict)


# Vehicles.


def simulated(kind, seed, *, motion=None, seconds=SECONDS, rest=REST, **options):
    """Return a simulated vehicle at 50 Hz; ``motion`` replaces its usual motion."""
    known = {"rest": rest, **NOISE, **BIASES, **options}
    if motion is None and kind == "car":
        return zr.simulate_drive(RATE, seconds, seed=seed, **known)
    make, usual, _ = vehicles.KINDS["drone" if motion else kind]
    random = np.random.default_rng([seed, *kind.encode()])
    at = (motion or make)(random, known.pop("speed", usual))
    sampled = partial(vehicles._sample, at, rest)
    return vehicles._simulate_with(sampled, RATE, seconds, seed=seed, **known)


def launched(random, speed):
    """Return the motion of an aeroplane that is thrown by hand with 3 g after 5 s."""
    begin, throw = 5.0, speed / (3.0 * GRAVITY)
    roll, climb = vehicles.waves(random, 0.15, 0.02, 0.08), vehicles.waves(random, 0.8, 0.01, 0.05)
    turn, heading = vehicles.turns(random, 12.0, 8.0), random.uniform(0.0, 2.0 * np.pi)

    def at(t):
        part = np.clip((t - begin) / throw, 0.0, 1.0)
        later = np.clip((t - begin - throw) / 5.0, 0.0, 1.0) ** 2
        yaw = heading + later * (turn(t) - turn(np.zeros(1)))
        tilt = np.stack([later * roll(t), 0.1 * (1.0 - 0.5 * later), yaw], axis=-1)
        return tilt, speed * part, 0.0 * t, later * climb(t)

    return at


def reversing(random, speed):
    """Return the motion of a robot that drives forward and backward."""
    turn, pace = vehicles.turns(random, 8.0, 4.0), vehicles.waves(random, 0.8, 0.02, 0.06)
    roll, pitch = (vehicles.waves(random, 0.02, 0.1, 1.0) for _ in "rp")
    heading = random.uniform(0.0, 2.0 * np.pi)

    def at(t):
        ahead = speed * pace(t)
        tilt = np.stack([roll(t), pitch(t), heading + turn(t)], axis=-1)
        return tilt, ahead, 0.0 * t, -ahead * np.sin(pitch(t))

    return at


def stopping(random, speed):
    """Return the motion of a robot that stands from 40 to 110 s after its start."""
    inner = vehicles.robot(random, speed)
    ease, first, last = 4.0, 40.0, 110.0

    def at(t):
        # Time is slower near the stop, and does not advance during it.
        a, b = ((np.clip((t - x) / ease, 0.0, 1.0)) for x in (first, last))
        pace = 1.0 - a * a * (3.0 - 2.0 * a) + b * b * (3.0 - 2.0 * b)
        lost = [ease * (x**3 - 0.5 * x**4) + np.clip(t - y - ease, 0.0, None)
                for x, y in ((a, first), (b, last))]  # fmt: skip
        tilt, ahead, right, down = inner(t - lost[0] + lost[1])
        return tilt, ahead * pace, right * pace, down * pace

    return at


# Starts, fixes and aids.


def start_at(drive, seconds, seed, *, heading_known=True):
    """Return a start with random errors by its standard deviations."""
    k, random = round(seconds * RATE), np.random.default_rng([seed, 77])
    off = np.append(random.normal(0.0, 0.005, 2), SIGMAS["heading_sigma"] * drawn(seed, 2.0**0.5))
    turned = product(from_rotation_vectors(off[np.newaxis])[0], drive.truth_quaternion[k])
    return Alignment(
        time=float(drive.time[k]),
        quaternion=turned,
        latitude=48.0,
        heading_known=heading_known,
        course=False,
        gyro_bias=drive.gyro_bias[k] + random.normal(0.0, SIGMAS["gyro_bias_sigma"], 3),
        accel_bias=np.zeros(3),
        accel_bias_sigma=BIASES["accel_bias"],
        **SIGMAS,
    )


def drawn(seed, step):
    """Return a normal number that has variance one over a few seeds, for constants of a run."""
    return NormalDist().inv_cdf((0.5 + (seed + 1) * step) % 1.0)


def without(fixes, *spans):
    """Return the fixes outside some spans."""
    inside = [(fixes.time > a) & (fixes.time <= b) for a, b in spans]
    return fixes.chosen(~np.any(inside, axis=0))


def disturbed(fixes, spans, seed, sigma, *, keep=1.0, wrong=0.0, understated=1.0):
    """Return fixes with more noise in some spans; some fixes are lost, some are wrong."""
    random = np.random.default_rng([seed, 5])
    inside = np.any([(fixes.time > a) & (fixes.time <= b) for a, b in spans], axis=0)
    off = sigma * random.standard_normal((len(fixes), 3)) * inside[:, np.newaxis]
    velocity = fixes.velocity + 0.05 * off
    off[random.uniform(size=len(fixes)) < wrong] *= 5.0
    position = offset_position(fixes.position, off)
    lost = inside & (random.uniform(size=len(fixes)) > keep)
    stated = (sigma / understated) * inside[:, np.newaxis]
    sigmas = np.hypot(fixes.position_sigma, stated), np.hypot(fixes.velocity_sigma, 0.05 * stated)
    changed = {"position": position, "velocity": velocity}
    changed |= {"position_sigma": sigmas[0], "velocity_sigma": sigmas[1]}
    return replace(fixes, **changed).chosen(~lost)


def at_times(drive, values, sigma=None):
    """Return readings at the samples that have them."""
    present = np.isfinite(values.reshape(len(drive.time), -1)).all(axis=1)
    return Aid(drive.time[present], values[present], sigma)


def pressure(drive, seed, **faults):
    """Return the pressures of a barometer."""
    known = {"sigma": BAROMETER["barometer_sigma"], "walk": BAROMETER["barometer_walk"]}
    return at_times(drive, barometer(drive, seed=seed, **known, **faults))


def compass(drive, seed, **faults):
    """Return the headings of a compass with a random offset."""
    offset = COMPASS_OFFSET_RAD * drawn(seed, 3.0**0.5)
    known = {"rate": 5.0, "sigma": COMPASS_NOISE_RAD, "offset": offset, "seed": seed}
    return at_times(drive, compass_heading(drive, **known, **faults), COMPASS_NOISE_RAD)


def case(kind, seed, *, begin=REST, heading_known=True, fixes=None, aids=None, options=None, **how):
    """Return a case; ``fixes`` and ``aids`` are functions of the drive."""
    drive = simulated(kind, seed, **how)
    start = start_at(drive, begin - 1.0, seed, heading_known=heading_known)
    changed = drive.fixes if fixes is None else fixes(drive)
    return Case(drive, start, changed, {} if aids is None else aids(drive, seed), options or {})


def carried(drive, seed, **faults):
    """Return a barometer and a compass without faults."""
    return {"pressure": pressure(drive, seed), "heading": compass(drive, seed, **faults)}


def start_in_motion(seed):
    """Return a drone that never rests, with an estimated start."""
    drive = simulated("drone", seed, rest=0.0)
    start = find_start(drive.recording(), drive.fixes, **NOISE)
    return Case(drive, start, drive.fixes, carried(drive, seed))


def two_antennas(seed):
    """Return a boat with two antennas, one metre apart across the boat."""
    arm = (0.2, 1.0, 0.0)
    made = case("boat", seed)
    vectors = antenna_baseline(made.drive, arm, seed=seed, sigma=0.02)
    made.aids["baseline"] = at_times(made.drive, vectors, 0.02)
    made.options["baseline"] = arm
    return made


def canyon(seed, **how):
    """Return a car among houses: half of the fixes are lost, one of twelve is wrong by 60 m."""
    known = {"sigma": 12.0, "keep": 0.5, "wrong": 0.08, **how}
    return case(
        "car", seed, aids=carried, fixes=lambda d: disturbed(d.fixes, CANYON, seed, **known)
    )


def jammed(seed, **how):
    """Return a car with a receiver that is noisy, silent for 30 s, and noisy again."""
    noisier = {"sigma": 10.0, **how}

    def fixes(drive):
        return without(disturbed(drive.fixes, NOISY, seed, **noisier), (70.0, 100.0))

    return case("car", seed, aids=carried, fixes=fixes)


MAGNET = ((60.0, 75.0, 0.7), (100.0, 103.0, -0.9))
FROZEN = ((60.0, 80.0),)
NOISY = ((60.0, 70.0), (100.0, 110.0))
CANYON = ((40.0, 65.0), (80.0, 110.0))
SCENARIOS = {
    "car, start at rest, heading by compass": partial(
        case, "car", heading_known=False, aids=carried
    ),
    "drone, start in motion": start_in_motion,
    "model aeroplane, launched by hand with 3 g": partial(
        case, "plane", motion=launched, speed=15.0, aids=carried
    ),
    "car, urban canyon": lambda seed: canyon(seed),
    "car, receiver jammed for 30 s": lambda seed: jammed(seed),
    "boat, compass frozen for 20 s": partial(
        case, "boat", aids=partial(carried, frozen=FROZEN)
    ),
    "drone, pressure step of a door, 4 m": partial(
        case, "drone", aids=lambda d, s: {"pressure": pressure(d, s, steps=((70.0, 4.0),))}
    ),
    "robot, reversing": partial(case, "robot", motion=reversing, speed=0.7, aids=carried),
    "robot, stands for 70 s": partial(case, "robot", motion=stopping, speed=0.7, aids=carried),
    "ferry": partial(case, "boat", speed=8.0, aids=carried),
    "boat, two antennas": two_antennas,
    "drone, hovers": partial(case, "drone", speed=0.3, aids=carried),
    "drone, magnet near the compass": partial(
        case, "drone", aids=partial(carried, disturbances=MAGNET)
    ),
    "drone, 60 s without fixes, barometer": lambda seed: case(
        "drone", seed, aids=carried, fixes=lambda d: without(d.fixes, (70.0, 130.0))
    ),
}  # fmt: skip


# Runs.


def errors_of(nav, drive, k):
    """Return the errors of a filter in the order of its covariance."""
    turned = product(nav.quaternion, inverse(drive.truth_quaternion[k]))
    return np.concatenate(
        [
            local_ned(nav.position, drive.truth_position[k]),
            nav.velocity - rotate(turned, drive.truth_velocity[k]),
            -to_rotation_vectors(turned[np.newaxis])[0],
            drive.gyro_bias[k] - nav.gyro_bias,
            drive.accel_bias[k] - nav.accel_bias,
        ]
    )


def run(made):
    """Return NEES per second, and errors, standard deviations and verdicts of the outputs."""
    drive = made.drive
    nav = zr.NavigationFilter(made.start, **{**NOISE, **BAROMETER, **made.options})
    fixes, aids = pack_fixes(made.fixes), AidRows.of(made.aids, drive.time).rows
    edges = np.arange(0, len(drive.time) + 1, round(STEP_S * RATE))
    rows = []
    for first, last in pairwise(edges.tolist()):
        part, end = slice(first, last), drive.time[last - 1]
        begin = -np.inf if first == 0 else drive.time[first - 1]
        nav.process_arrays(
            drive.time[part], drive.gyro[part], drive.accel[part],
            fixes[(fixes[:, 0] > begin) & (fixes[:, 0] <= end)],
            aids=aids[(aids[:, 1] > begin) & (aids[:, 1] <= end)],
        )  # fmt: skip
        if not np.isfinite(nav.position).all() or end < made.start.time + SETTLED_S:
            continue
        e, P = errors_of(nav, drive, last - 1), nav.covariance[:15, :15]
        nees = [e[b] @ np.linalg.solve(P[b, b], e[b]) / len(e[b]) for b in PARTS]
        usable = [nav.usable[name] for name in OUTPUTS]
        limits = [nav.limits[name] for name in OUTPUTS]
        rows.append([end, *nees, *output_errors(e, drive, last - 1, nav), *usable, *limits,
                     nav.sigma[2], nav.sigma[8]])  # fmt: skip
    return np.array(rows, dtype=float)


PARTS = [slice(0, 15), slice(0, 2), slice(2, 3), slice(3, 6), slice(6, 8), slice(8, 9)]
NEES, ERRORS, USABLE, LIMITS = (slice(1, 7), slice(7, 12), slice(12, 17), slice(17, 22))


def output_errors(e, drive, k, nav):
    """Return the errors of the five outputs: m, m, m/s, rad, rad."""
    velocity = nav.velocity - drive.truth_velocity[k]
    plane, tilt = np.hypot(*e[:2]), np.hypot(*e[6:8])
    return plane, abs(e[2]), np.linalg.norm(velocity), tilt, abs(e[8])


def settled_fixes(made):
    """Return the fixes after settling, without the first two fixes after a gap."""
    time = made.fixes.time
    gaps = np.flatnonzero(np.diff(time) > GAP_S) + 1
    dropped = np.isin(np.arange(len(time)), np.concatenate([gaps, gaps + 1]))
    return made.fixes.chosen(~dropped & (time > made.start.time + SETTLED_S))


def fix_errors(fixes, drive):
    """Return the horizontal errors of fixes, m."""
    at = np.clip(np.searchsorted(drive.time, fixes.time), 0, len(drive.time) - 1)
    off = local_ned(fixes.position, drive.truth_position[at])[:, :2]
    return np.hypot(*off.T)


def study(work, understates, name, seed):
    """Return the numbers of one run, which `work` computes from a case."""
    made = (UNDERSTATED if understates else SCENARIOS)[name](seed)
    rows = work(made)
    fixes = settled_fixes(made)
    at_fixes = np.isin(np.floor(rows[:, 0]), fixes.time.round())
    return rows, fix_errors(fixes, made.drive), at_fixes


def rms(values):
    """Return the root mean square without NaN."""
    return float(np.sqrt(np.nanmean(np.square(values))))


def summary(results):
    """Return the cells of a scenario: NEES, shares of false verdicts, RMS of track and fixes."""
    rows = np.vstack([one[0] for one in results])
    at_fixes = np.concatenate([one[2] for one in results])
    nees = rows[:, NEES].mean(axis=0)
    usable, wrong = rows[:, USABLE] == 1.0, rows[:, ERRORS] > rows[:, LIMITS]
    false, missed = (usable & wrong).mean(), (~usable & ~wrong).mean()
    track, fixes = rms(rows[at_fixes, 7]), rms(np.concatenate([one[1] for one in results]))
    return nees, false, missed, usable.mean(), track, fixes


UNDERSTATED = {
    "car, urban canyon": partial(canyon, understated=2.5),
    "car, receiver jammed for 30 s": partial(jammed, understated=2.5),
}
"""Receivers that suddenly state 2/5 of their noise."""


OUTAGES_S = (10.0, 30.0, 60.0)


def heights(options, seed):
    """Return σ and error of a drone's height after outages, without and with a barometer."""
    rows = []
    for seconds in OUTAGES_S:
        end = 80.0 + seconds
        made = case("drone", seed, fixes=lambda d, t=end: without(d.fixes, (80.0, t + 0.5)),
                    options=options)  # fmt: skip
        for aids in ({}, {"pressure": pressure(made.drive, seed)}):
            found = run(replace(made, aids=aids))
            at = np.argmin(np.abs(found[:, 0] - end))
            rows += [found[at, 22], found[at, 8]]
    return rows


def headings(seed):
    """Return errors and σ of a standing robot's heading with a compass, every 10 s."""
    made = SCENARIOS["robot, stands for 70 s"](seed)
    found = run(made)
    stands = (found[:, 0] > 60.0) & (found[:, 0] < 115.0)
    alone = run(replace(made, aids={}))[stands]
    found = found[stands]
    return np.column_stack([found[:, 11], found[:, 23], alone[:, 11], alone[:, 23]])[::10]


def main(seeds=SEEDS, work=run):
    """Print the tables of a filter that `work` runs."""
    head = ("scenario", "ANEES", "position", "height", "velocity", "tilt", "heading")
    head += ("usable", "usable, but off", "not, but within", "track, m", "fixes, m")
    rows = []
    with ProcessPoolExecutor(2) as pool:
        for name in SCENARIOS:
            rows.append(row_of(pool, name, work, seeds))
        title = f"Fourteen scenarios, {seeds} seeds each"
        print(table(title, head, rows, markdown=True), flush=True)
        if work is not run:
            return
        rows = [row_of(pool, name, work, seeds, True) for name in UNDERSTATED]
        print(table("Receivers that understate", head, rows, markdown=True), flush=True)
        print_aids(pool, seeds)


def row_of(pool, name, work, seeds, understates=False):
    """Return the cells of a scenario."""
    found = summary(list(pool.map(partial(study, work, understates, name), range(seeds))))
    nees, false, missed, usable, track, fixes = found
    cells = [*(f"{x:.2f}" for x in nees), f"{usable:.1%}", f"{false:.2%}", f"{missed:.2%}"]
    row = (name, *cells, f"{track:.2f}", f"{fixes:.2f}")
    print(*row, sep=" | ", file=sys.stderr, flush=True)
    return row


def print_aids(pool, seeds):
    """Print the effect of a barometer on the height without fixes, and of a compass at rest."""
    rows = []
    noises = {"true noise": {}, "default noise": {"gyro": None, "accel": None}}
    for name, options in noises.items():
        found = np.array(list(pool.map(partial(heights, options), range(seeds))))
        for k, seconds in enumerate(OUTAGES_S):
            bare, _, held, error = found[:, 4 * k : 4 * k + 4].T
            rows.append(
                (f"height, drone, {seconds:g} s, {name}: σ, m", *compared(bare, held, error))
            )
    found = np.degrees(np.vstack(list(pool.map(headings, range(seeds)))))
    error, held, _, bare = found.T
    rows.append(("heading, robot at rest, compass: σ, deg", *compared(bare, held, error)))
    head = ("quantity", "without", "with", "ratio", "error / σ")
    print(table("Barometer and compass", head, rows, markdown=True), flush=True)


def compared(bare, held, error):
    """Return the cells of σ without and with an aid, their ratio, and the error over σ."""
    ratio = rms(held) / rms(bare)
    return f"{rms(bare):.2f}", f"{rms(held):.2f}", f"{ratio:.2f}", f"{rms(error / held):.2f}"


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
