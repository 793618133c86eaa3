"""Results of `zr.check` for all wrong units and axes, in recordings and simulated motions.

``python examples/check_study.py`` prints `docs/evidence/checks.md`:

- share of detected mistakes, and of wrong diagnoses, for 47 wrong signed permutations of the gyro's
  axes and two wrong units per record
- results for unchanged records, and for records with sensor errors
- results for 23 wrong classes of a magnetometer's axes
- duration of the check
"""

import time
from collections import Counter
from dataclasses import replace
from itertools import product

import numpy as np

import zerorate as zr
from recordings import BESIDE
from tables import table as aligned
from zerorate.checks.axis_permutations import SENSES, format_sense

RATE, DURATION = 100.0, 120.0
KINDS = ("hand", "circle", "arm", "spinning pendulum", "pendulum", "vehicle")
SEEDS = (1, 2, 3)
BROAD = {"rate": 2000 / 7}
OUTCOMES = ("exact", "likely, right", "likely, another first", "silent", "wrong")
RECORDS = {
    "hand, BROAD and MIMU": (
        ("broad_05_undisturbed_slow_rotation_with_breaks_B", "", BROAD),
        ("broad_32_disturbed_attached_magnet_1cm", "", BROAD),
        *(("mimu4444_array8_62hz_exp1", f"imu{k}_", {}) for k in (1, 2, 5)),
    ),
    "shoe": (
        *(
            (f"foot_vicon_{name}_200hz", "", {})
            for name in (
                "20171122112203",
                "20171122114044",
                "20171127111153",
                "20171127112512",
                "20171215180305",
            )
        ),
        *((f"foot_walk_SensorConnectData_{k}_200hz", "", {}) for k in (35, 37)),
    ),
    "drive": (("drive_imu_100hz", "", {}),),
    "at rest, turntable": (
        ("adis16405_static_100hz_run1", "", {"rate": 100.0}),
        ("mpu6050_static_100hz", "", {"rate": 100.0}),
        ("mpu6050_encoder_yaw_slow_100hz", "shaft_", {}),
        ("mpu6050_encoder_yaw_slow_100hz", "fixed_", {}),
    ),
}


def table(title, head, rows):
    """Return a table in Markdown."""
    return aligned(title, head, [list(map(str, row)) for row in rows], markdown=True).strip()


def read(name, prefix, options):
    """Return gyro, accelerometer and, if available, magnetometer of a recording."""
    found = zr.read_recording(BESIDE / f"{name}.parquet", **options)
    logs = {}
    for kind in ("gyro", "accel", "mag"):
        own = (log for log in found.of_kind(kind) if log.names[0].startswith(f"{prefix}{kind}"))
        log = next(own, None)
        if log is not None:
            logs[kind] = log
    return zr.Recording(logs, name)


def groups():
    """Yield the name of each group and its recordings."""
    for name, listed in RECORDS.items():
        yield name, [read(*one) for one in listed]
    for kind in KINDS:
        motions = (zr.simulate_motion(kind, RATE, DURATION, seed=seed) for seed in SEEDS)
        yield f"simulated {kind}", [motion.recording() for motion in motions]


def changed(recording, name, data):
    """Return a recording with other values in a log."""
    return zr.Recording({**recording, name: replace(recording[name], data=data)}, recording.source)


def outcome(found, sense):
    """Return the outcome for a gyro with known axes."""
    if not found.alarm:
        return "silent"
    if found.factor != 1.0 or found.status == "unit only":
        return "wrong"
    if format_sense(sense) not in found.alternatives:
        return "wrong"
    if found.exact:
        return "exact"
    return "likely, right" if found.likely == format_sense(sense) else "likely, another first"


def axes(recordings):
    """Return the count of each outcome over all wrong axes."""
    said = Counter()
    for recording, sense in product(recordings, SENSES[1:]):
        wrong = changed(recording, "gyro", recording["gyro"].data @ sense)
        said[outcome(zr.check(wrong, scale_errors=False).gyro, sense)] += 1
    return said


def units(recordings, factor):
    """Return the number of wrong units that are detected, and of wrong diagnoses."""
    right = wrong = 0
    for recording in recordings:
        gyro = recording["gyro"]
        data = zr.units.convert(gyro.data, gyro.unit, "rad/s") * factor
        named = replace(gyro, data=data, unit="rad/s")
        found = zr.check(zr.Recording({**recording, "gyro": named}), scale_errors=False).gyro
        axes_right = found.status == "unit only" or "x,y,z" in found.alternatives
        unit_right = found.unit == "deg/s" if factor > 1 else np.isclose(found.factor, 1 / factor)
        right += found.alarm and unit_right and axes_right
        wrong += found.alarm and not (unit_right and axes_right)
    return right, wrong


def fields(recordings):
    """Return the counts of exact, silent and wrong outcomes for a magnetometer's axes."""
    said = Counter()
    for recording, sense in product(recordings, SENSES[1:24]):
        wrong = changed(recording, "mag", recording["mag"].data @ sense)
        found = zr.check(wrong, scale_errors=False).magnetometer
        there = format_sense(sense) in found.alternatives
        exact = "exact" if len(found.alternatives) == 2 else "several left"
        said["silent" if not found.alarm else exact if there else "wrong"] += 1
    return said


TRIAL = {
    "hand, BROAD and MIMU": (235, 0, 0, 0, 5, 5),
    "shoe": (180, 28, 17, 104, 6, 1),
    "drive": (0, 1, 16, 30, 1, 0),
    "at rest, turntable": (0, 0, 0, 188, 2, 0),
    "simulated hand and circle": (282, 0, 0, 0, 5, 6),
    "simulated arm": (90, 41, 5, 5, 3, 0),
    "simulated spinning pendulum": (0, 74, 49, 18, 2, 2),
    "simulated pendulum": (0, 0, 0, 141, 3, 0),
    "simulated vehicle": (0, 3, 59, 79, 3, 0),
}
"""Results of the method's first implementation in NumPy, by outcome and unit; other motions."""

ERRORS = {
    "as they are": {},
    "bias of 10 deg/s": {"gyro_bias": np.radians([6.0, -6.0, 5.3])},
    "scale 0.9, 1.1, 0.9": {"scale": [0.9, 1.1, 0.9]},
    "50 ms late, bias of 10 deg/s": {"late": 5, "gyro_bias": np.radians([6.0, -6.0, 5.3])},
    "misaligned by 10 %, accelerometer's bias 0.3 m/s²": {
        "gyro_misalignment": 0.1,
        "accel_bias": [0.3, -0.3, 0.3],
    },
    "clipped at 250 deg/s, 1 % lost": {"clip": np.radians(250.0), "lost": 0.01},
    "wandering bias, 0.1 deg/s/√s": {"gyro_walk": np.radians(0.1)},
}


def faulty(kind, seed, duration, scale=1.0, late=0, clip=np.inf, **errors):
    """Return a simulated recording with errors of its gyro."""
    sensors = zr.simulation.MotionErrors(**errors)
    motion = zr.simulate_motion(kind, RATE, duration, seed=seed, errors=sensors).recording()
    data = np.roll(motion.gyro.data * scale, late, axis=0).clip(-clip, clip)
    return changed(motion, "gyro", data)


def alarms(errors):
    """Return the number of records with errors, and the number of false alarms."""
    cases = list(product(KINDS, range(11, 17), (60.0, 120.0)))
    found = [zr.check(faulty(*case, **errors), scale_errors=False) for case in cases]
    return len(cases), sum(bool(one.alarms) for one in found)


def rotorcraft(seed, tilt=0.15, drag=0.3):
    """Return a flight in which the force is along the body's z axis, except for drag."""
    rng = np.random.default_rng(seed)
    n = int(DURATION * RATE)
    kernel = np.hanning(300)
    roll, pitch, yaw = (
        np.convolve(rng.standard_normal(n + 299), kernel, "valid") for _ in range(3)
    )
    roll, pitch = (tilt * angle / angle.std() for angle in (roll, pitch))
    # Rotation within a sample, where the orientation is a product of three rotations.
    from scipy.spatial.transform import Rotation

    turns = Rotation.from_euler("ZYX", np.stack([yaw / yaw.std(), pitch, roll], axis=1))
    rates = np.zeros((n, 3))
    rates[1:] = (turns[:-1].inv() * turns[1:]).as_rotvec() * RATE
    velocity, force = np.zeros(3), np.zeros((n, 3))
    for k, matrix in enumerate(turns.as_matrix()):
        own = np.array([0.0, 0.0, 9.81]) - drag * (matrix.T @ velocity) * [1.0, 1.0, 0.0]
        force[k] = own
        velocity += (matrix @ own - [0.0, 0.0, 9.81]) / RATE
        velocity[2] = 0.0
    seconds = np.arange(n) / RATE
    rates += 1e-3 * rng.standard_normal((n, 3)) + 0.01
    force += 0.05 * rng.standard_normal((n, 3))
    gyro = zr.Log(seconds, RATE, rates, [f"gyro_{a}" for a in "xyz"], "rad/s")
    accel = zr.Log(seconds, RATE, force, [f"accel_{a}" for a in "xyz"], "m/s^2")
    return zr.Recording({"gyro": gyro, "accel": accel})


def seconds():
    """Return the duration of a check of ten minutes: gyro and magnetometer, and with scale."""
    recording = zr.simulate_motion("hand", RATE, 600.0).recording()
    times = []
    for scale in (False, True):
        started = time.perf_counter()
        zr.check(recording, scale_errors=scale)
        times.append(time.perf_counter() - started)
    return times


def main():
    """Print the page."""
    print("# The check of recordings: every mistake put in\n")
    print("Made by `python examples/check_study.py`; *silent* is right where motion shows nothing.")
    print("What is meant by the columns stands in [the explanation](../explanation/checks.md).\n")
    rows, magnetic = [], []
    for name, recordings in groups():
        said, count = axes(recordings), len(recordings)
        given = sum(bool(zr.check(one, scale_errors=False).alarms) for one in recordings)
        named = [units(recordings, factor) for factor in (180 / np.pi, np.pi / 180)]
        wrong = said["wrong"] + sum(bad for _, bad in named)
        counts = (said[one] for one in OUTCOMES[:-1])
        rows.append([name, count, *counts, *(good for good, _ in named), wrong, given])
        if all("mag" in one for one in recordings[:2]) and name != "shoe":
            own = fields([one for one in recordings if "mag" in one])
            magnetic.append([name, *(own[k] for k in ("exact", "several left", "silent", "wrong"))])
    head = ["", "records", *OUTCOMES[:-1], "deg/s as rad/s", "rad/s as deg/s", "wrong", "false"]
    print(table("47 wrong permutations and two wrong units a record", head, rows))
    print()
    tried = [[name, *numbers] for name, numbers in TRIAL.items()]
    print(table("The trial of the method in NumPy, before", [head[0], *head[2:-2]], tried))
    print("\n*wrong*: a name that is not right. *false*: an alarm of the record as it is.\n")
    head = ["", "exact", "several left", "silent", "wrong"]
    print(table("23 wrong classes of a magnetometer's axes a record", head, magnetic))
    print("\nSix kinds of simulated motion, six seeds each, of 60 and 120 s, as they are:\n")
    print(
        table(
            "Errors of sensors",
            ["", "records", "false alarms"],
            [[n, *alarms(e)] for n, e in ERRORS.items()],
        )
    )
    flights = [rotorcraft(seed) for seed in SEEDS]
    said = axes(flights)
    given = sum(bool(zr.check(one).alarms) for one in flights)
    print(f"\nA rotor craft, three flights: {given} false alarms; of 141 wrong permutations")
    print(f"{said['silent']} silent, {said['wrong']} named wrongly.")
    plain, full = seconds()
    print(
        f"\nTen minutes at 100 Hz, gyro and magnetometer: {plain:.2f} s, with scale {full:.2f} s."
    )


if __name__ == "__main__":
    main()
