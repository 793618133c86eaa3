"""The crate fusion-nav on the scenarios of ``examples/navigation_scenarios.py``.

``python benches/navigation_peer.py [SEEDS]`` builds ``benches/fusion_nav`` with cargo, and prints
the table of the scenarios for its filter. The filter gets the same samples, fixes, start and noise.
A compass heading becomes a field, which the filter levels with its own tilt. A vector between two
antennas becomes a heading.
"""

import subprocess
import sys
from pathlib import Path

import numpy as np

BENCH = Path(__file__).resolve().parent / "fusion_nav"
ROOT = BENCH.parents[1]
TARGET = ROOT / "target" / "fusion_nav"
sys.path.insert(0, str(ROOT / "examples"))

import navigation_scenarios as scenarios  # noqa: E402
from zerorate.geometry.earth import local_ned, normal_gravity  # noqa: E402
from zerorate.geometry.rotations import inverse, product, rotate, to_rotation_vectors  # noqa: E402
from zerorate.navigation.events import pack_fixes  # noqa: E402

LIMITS = (0.05, 0.17, 10.0, 1.0)
SEA_LEVEL_PA, TROPOSPHERE_M, EXPONENT = 101_325.0, 44_330.769, 0.190_263_24


def lines_of(made):
    """Yield the input lines of a scenario in time order."""
    drive, start = made.drive, made.start
    latitude = np.radians(drive.truth_position[0, 0])
    gravity = float(normal_gravity(latitude, drive.truth_position[0, 2]))
    noise = [scenarios.GYRO.angle_random_walk, scenarios.ACCEL.angle_random_walk]
    walks = [scenarios.GYRO.rate_random_walk, scenarios.ACCEL.rate_random_walk]
    yield (
        "config",
        [float(x) for x in (*noise, *walks, scenarios.BAROMETER["barometer_walk"])]
        + [gravity, *LIMITS],
    )
    fixes = pack_fixes(made.fixes)
    fixes = fixes[fixes[:, 0] >= start.time]
    first = fixes[0]
    begin = first[0]
    tilt, yaw = start.level_sigma, start.heading_sigma if start.heading_known else np.pi
    # The peer's attitude errors are about the body's axes. These vehicles start level.
    sigmas = [*first[7:13], tilt, tilt, yaw]
    sigmas += [start.accel_bias_sigma] * 3 + [start.gyro_bias_sigma] * 3
    yield "seed", [begin, *first[1:7], *start.quaternion, *start.gyro_bias, *sigmas]
    events = [(t, 0, "imu", x) for t, x in samples_after(drive, begin)]
    events += [(row[0], 3, "fix", row[1:13]) for row in fixes]
    events += [(t, 2, *event) for t, event in aids_after(made, begin)]
    edges = range(0, len(drive.time) + 1, round(scenarios.STEP_S * scenarios.RATE))
    events += [(drive.time[k - 1], 9, "out", []) for k in edges if k and drive.time[k - 1] > begin]
    for time, _, word, values in sorted(events, key=lambda event: event[:2]):
        yield word, [time, *values]


def samples_after(drive, begin):
    """Yield the mean rates and forces of each interval after a time."""
    for k in range(int(np.searchsorted(drive.time, begin)) + 1, len(drive.time)):
        part = slice(k - 1, k + 1)
        means = drive.gyro[part].mean(axis=0), drive.accel[part].mean(axis=0)
        yield drive.time[k], [drive.time[k] - drive.time[k - 1], *means[0], *means[1]]


def aids_after(made, begin):
    """Yield the heights, fields and headings after a time."""
    drive, arm = made.drive, made.options.get("baseline")
    for kind, aid in made.aids.items():
        for t, value, sigma in zip(aid.time, aid.value, aid.sigma, strict=True):
            if t <= begin:
                continue
            if kind == "pressure":
                height = TROPOSPHERE_M * (1.0 - (value / SEA_LEVEL_PA) ** EXPONENT)
                yield t, ("height", [height, scenarios.BAROMETER["barometer_sigma"]])
            elif kind == "heading":
                k = int(np.searchsorted(drive.time, t))
                total = np.hypot(sigma, scenarios.COMPASS_OFFSET_RAD)
                yield t, ("field", [*field_of(drive.truth_quaternion[k], value), total])
            else:
                angle = np.arctan2(value[1], value[0]) - np.arctan2(arm[1], arm[0])
                yield t, ("heading", [angle, float(sigma[0]) / np.hypot(*arm[:2])])


def field_of(quaternion, heading):
    """Return the field of a magnetometer, gauss, for a heading."""
    forward = rotate(quaternion, np.array([1.0, 0.0, 0.0]))
    off = heading - np.arctan2(forward[1], forward[0])
    north = np.array([np.cos(off), -np.sin(off), 0.0]) * 0.21
    return rotate(inverse(quaternion), north + np.array([0.0, 0.0, 0.44]))


def run(made):
    """Return the rows of `navigation_scenarios.run` for the peer."""
    text = "\n".join(f"{word} {' '.join(map(repr, map(float, x)))}" for word, x in lines_of(made))
    done = subprocess.run(
        [str(TARGET / "release" / "fusion-nav-peer")], input=text, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    rows = []
    for line in done.stdout.splitlines():
        x = np.array(line.split(), dtype=float)
        if x[0] >= made.start.time + scenarios.SETTLED_S:
            rows.append(row_of(made.drive, x))
    return np.array(rows)


def row_of(drive, x):
    """Return NEES, errors, verdicts and limits for one second."""
    k = int(np.argmin(np.abs(drive.time - x[0])))
    position, velocity, q, accel_bias, gyro_bias = np.split(x[1:17], [3, 6, 10, 13])
    P = x[17:242].reshape(15, 15)
    place = -local_ned(position, drive.truth_position[k])
    turn = to_rotation_vectors(product(inverse(q), drive.truth_quaternion[k])[np.newaxis])[0]
    biases = drive.accel_bias[k] - accel_bias, drive.gyro_bias[k] - gyro_bias
    e = np.concatenate([place, drive.truth_velocity[k] - velocity, turn, *biases])
    to_ned = np.column_stack([rotate(q, axis) for axis in np.eye(3)])
    level, P_level = to_ned @ turn, to_ned @ P[6:9, 6:9] @ to_ned.T
    parts = [(e, P)] + [(e[b], P[b, b]) for b in scenarios.PARTS[1:4]]
    parts += [(level[b], P_level[b, b]) for b in (slice(0, 2), slice(2, 3))]
    nees = [part @ np.linalg.solve(cov, part) / len(part) for part, cov in parts]
    errors = np.hypot(*e[:2]), abs(e[2]), np.linalg.norm(e[3:6]), np.hypot(*level[:2])
    limits = LIMITS[2], LIMITS[2], LIMITS[3], LIMITS[0], LIMITS[1]
    end = np.sqrt([P[2, 2], P_level[2, 2]])
    return [x[0], *nees, *errors, abs(level[2]), *x[242:247], *limits, *end]


def main(seeds=scenarios.SEEDS):
    """Build the peer and print its table."""
    build = ["cargo", "build", "--release", "--quiet", "--target-dir", str(TARGET)]
    subprocess.run(build, cwd=BENCH, check=True)
    scenarios.main(seeds, run)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
