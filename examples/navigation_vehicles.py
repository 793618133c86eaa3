"""Outages, starts in motion and unstated antennas of simulated vehicles.

``python examples/navigation_vehicles.py`` prints five tables in Markdown, in some minutes. Errors
are relative to the true tracks of the cars, robots, drones and boats of ``vehicles.py``.
"""

from dataclasses import replace

import numpy as np

import zerorate as zr
from navigation_studies import many, rms
from tables import table
from vehicles import simulate_vehicle
from zerorate.geometry.rotations import inverse, product, to_rotation_vectors
from zerorate.navigation import find_beginning
from zerorate.record import TimeOffset

SECONDS = 300.0
LENGTHS = (5.0, 10.0, 30.0)
SEEDS = range(6)
ELLIPSE = 5.991
"""Squared radius of the horizontal 95 % ellipse, in standard deviations."""
SETTLED = 80.0
FINE = {"position_sigma": 0.02, "velocity_sigma": 0.05, "fixes_rate": 5.0}
RECEIVERS = {"2 m, 1 Hz": {}, "2 cm, 5 Hz": FINE}
IN_MOTION = {"drone": 14, "boat": 6, "car": 6, "robot": 6}
TRUE_START = {"level_sigma": 0.005, "heading_sigma": 0.02, "accel_bias_sigma": 0.03}
TRUE_START |= {"gyro_bias_sigma": 1e-4}
ANTENNAS = {
    "2 m, 1 Hz, velocities": {},
    "1 cm, 5 Hz, velocities": FINE | {"position_sigma": 0.01, "velocity_sigma": 0.03},
    "1 cm, 5 Hz, positions only": FINE | {"position_sigma": 0.01},
}


def outage_rows():
    """Yield errors at the ends of outages, and of the smoothed track in them, in σ."""
    everything, drive_count = [[] for _ in LENGTHS], 0
    for kind in ("car", "robot", "drone", "boat"):
        for receiver, options in RECEIVERS.items():
            drives = [simulate_vehicle(kind, SECONDS, seed=seed, **options) for seed in SEEDS]
            found = many(coasted, drives)
            cells = []
            for k in range(len(LENGTHS)):
                end, scaled, inside = (np.vstack([one[k][j] for one in found]) for j in range(3))
                distance = rms(np.hypot(*end.T))
                cells.append(
                    f"{rms(scaled):.2f}; {distance:.2g}; {inside_ellipse(scaled):.0%}; "
                    f"{rms(inside):.2f}"
                )
                everything[k].append(scaled)
            drive_count += len(drives)
            yield f"{kind}, {receiver}", *cells
    cells = (np.vstack(scaled) for scaled in everything)
    yield (
        f"all {drive_count}",
        *(f"{rms(scaled):.2f}; {inside_ellipse(scaled):.1%} of {len(scaled)}" for scaled in cells),
    )


def inside_ellipse(scaled):
    """Return the share of errors, in σ, inside the ellipse of the figures."""
    return np.mean((scaled**2).sum(axis=1) < ELLIPSE)


def coasted(drive):
    """Return the outage errors of a drive that starts as in `zr.navigate`."""
    return errors_in_outages(drive, find_beginning(drive.recording(), drive.fixes), LENGTHS)


def errors_in_outages(drive, begun, seconds):
    """Return for each length the end errors, m and in σ, and the smoothed errors in σ."""
    known, given = {"seconds": seconds, "threads": 1}, {"time_offset": begun.time_offset}
    nav = begun.filter()
    found = zr.navigation.outages(begun.recording, drive.fixes, nav=nav, **known, **given)
    moved = TimeOffset.of(begun.time_offset).applied(drive.fixes).time
    results = []
    for one in found.lengths:
        fixes = drive.fixes.chosen(~np.isin(moved, one.time))
        track = nav.copy().process(begun.recording, fixes, **given)
        end = np.searchsorted(track.time, one.spans[:, 1])
        inside = np.searchsorted(track.time, one.time)
        (error, sigma), (best, best_sigma) = (
            (some.errors(drive.truth_position)[:, :2], some.sigma[:, :2])
            for some in (track, track.smooth())
        )
        results.append((error[end], error[end] / sigma[end], best[inside] / best_sigma[inside]))
    return results


def start_rows():
    """Yield heading errors of starts in motion in σ, and outage errors relative to true starts."""
    for kind, count in IN_MOTION.items():
        drives = [simulate_vehicle(kind, SECONDS, seed=seed, rest=0.0) for seed in range(count)]
        off, sigma, found, true = np.array(many(started, drives)).T
        scaled, ratios = np.abs(off / sigma), found / true
        worst = np.argmax(scaled)
        cells = (f"{(scaled < 3.0).sum()} of {count}", f"{rms(scaled):.2f}")
        cells += (f"{abs(off[worst]):.1f} at {sigma[worst]:.1f}", f"{np.median(sigma):.1f}")
        cells += (f"{rms(found):.2f}, {rms(true):.2f}",)
        yield kind, *cells, f"{np.median(ratios):.2f}, {ratios.max():.2f}"


def started(drive):
    """Return heading error and σ, deg, and errors of 10 s outages with this and a true start."""
    begun = find_beginning(drive.recording(), drive.fixes)
    start, at = begun.start, np.searchsorted(drive.time, begun.start.time)
    truth = drive.truth_quaternion[at]
    off = to_rotation_vectors(product(truth, inverse(np.asarray(start.quaternion))))[2]
    true = replace(start, quaternion=truth, gyro_bias=drive.gyro_bias[at], **TRUE_START)
    ends = []
    for one in (start, true):
        ((end, *_),) = errors_in_outages(drive, replace(begun, start=one), (10.0,))
        ends.append(rms(np.hypot(*end.T)))
    return np.degrees(off), np.degrees(start.heading_sigma), *ends


def antenna_rows():
    """Yield track errors of cars with estimated and with stated antenna and clock."""
    for name, options in ANTENNAS.items():
        cases = [drive_of_antenna(seed, "only" in name, options) for seed in SEEDS]
        found = np.array(many(lambda case: settled_errors(*case[:2]), cases))
        stated = np.array(many(lambda case: settled_errors(*case[:2], **case[2]), cases))
        sizes = (f"{rms(x[:, 0]):.3f}, {rms(x[:, 1]):.2f}" for x in (found, stated))
        ratio = rms(found[:, 0]) / rms(stated[:, 0])
        scaled = ", ".join(f"{rms(x):.2f}" for x in found[:, 2:].T)
        yield name, *sizes, f"{ratio:.2f}", scaled


def drive_of_antenna(seed, positions_only, options):
    """Return a drive, its fixes, and its random antenna and clock."""
    random = np.random.default_rng([seed, 5])
    antenna, clock = random.uniform((-1, -1, -2), (1, 1, 0)), random.uniform(-0.5, 0.5)
    known = {"antenna": antenna, "time_offset": clock}
    drive = simulate_vehicle("car", SECONDS, seed=seed, **known, **options)
    none = {"velocity": None, "velocity_sigma": None} if positions_only else {}
    return drive, replace(drive.fixes, **none), known


def settled_errors(drive, fixes, **known):
    """Return RMS errors, horizontal and of the height, m and in σ, and the heading error in σ."""
    track = zr.navigate(drive.recording(), fixes, **known).track
    late, truth = track.time > SETTLED, (drive.truth_position, drive.truth_velocity)
    error, sigma = track.errors(*truth, drive.truth_quaternion)[late, :9], track.sigma[late, :9]
    scaled = error / sigma
    plane = rms(np.hypot(*error[:, :2].T))
    return plane, rms(error[:, 2]), rms(scaled[:, :2]), rms(scaled[:, 2]), rms(scaled[:, 8])


def stated_antenna_rows():
    """Yield errors with an antenna stated wrong by 5 cm per axis, estimated and considered."""
    cases = {
        "cars, 1 cm at 5 Hz": ("car", 1.0, ANTENNAS["1 cm, 5 Hz, velocities"]),
        "robots at 0.4 m/s, 2 cm at 5 Hz": ("robot", 0.3, {"speed": 0.4, **FINE}),
    }
    for name, (kind, size, options) in cases.items():
        drives = []
        for seed in SEEDS[:5]:
            random = np.random.default_rng([seed, 7])
            antenna = size * random.uniform((-1, -1, -2), (1, 1, 0))
            drive = simulate_vehicle(kind, SECONDS, seed=seed, antenna=antenna, **options)
            drives.append((drive, antenna + 0.05 * random.standard_normal(3)))
        found = np.array(many(lambda case: stated_antenna_errors(*case), drives))
        for k, treated in enumerate(("estimated", "considered")):
            track, heading, scaled, outage = (rms(column) for column in found[:, k].T)
            yield (
                f"{name}, {treated}",
                f"{track:.3f}",
                f"{heading:.2f}; {scaled:.2f}",
                f"{outage:.2f}",
            )


def stated_antenna_errors(drive, antenna):
    """Return errors of track, m, heading, deg and in σ, and 10 s outage, m, for both treatments."""
    begun = find_beginning(drive.recording(), drive.fixes, antenna=antenna)
    rows = []
    for considered in (False, True):
        one = replace(begun, consider_antenna=considered)
        track = one.filter().process(one.recording, drive.fixes, time_offset=one.time_offset)
        late, truth = track.time > SETTLED, (drive.truth_position, drive.truth_velocity)
        error = track.errors(*truth, drive.truth_quaternion)[late]
        heading, sigma = error[:, 8], track.sigma[late, 8]
        ((end, *_),) = errors_in_outages(drive, one, (10.0,))
        plane = rms(np.hypot(*error[:, :2].T))
        rows.append((plane, np.degrees(rms(heading)), rms(heading / sigma), rms(np.hypot(*end.T))))
    return rows


def robot_rows():
    """Yield heading errors in σ of slow robots without a stated antenna."""
    known = {"speed": 0.4, "antenna": (0.2, -0.1, -0.3), **FINE}
    drives = [simulate_vehicle("robot", SECONDS, seed=seed, **known) for seed in range(12)]
    heading = np.array(many(lambda drive: settled_errors(drive, drive.fixes), drives))[:, 4]
    yield "12", f"{rms(heading):.2f}", f"{heading.min():.2f} to {heading.max():.2f}"


def main():
    """Print the tables."""
    head = ("vehicle", *(f"{length:g} s" for length in LENGTHS))
    title = "Outages: error over σ; RMS, m; share in the 95 % ellipse; smoothed error over σ"
    print(table(title, head, outage_rows(), markdown=True), flush=True)
    head = ("vehicle", "within 3 σ", "error over σ", "worst, deg", "median σ, deg")
    head += ("after 10 s, m: found, true start", "ratio: median, largest")
    print(table("Starts in motion", head, start_rows(), markdown=True), flush=True)
    head = ("receiver", "track, height, m", "stated", "ratio", "in σ: track, height, heading")
    print(table("Antenna and clock not stated", head, antenna_rows(), markdown=True), flush=True)
    head = ("antenna stated 5 cm wrong", "track, m", "heading, deg; in σ", "10 s outage, m")
    print(table("Antenna stated", head, stated_antenna_rows(), markdown=True), flush=True)
    head = ("slow robots", "heading error over σ", "of one robot")
    print(table("Robots at 0.4 m/s", head, robot_rows(), markdown=True), flush=True)


if __name__ == "__main__":
    main()
