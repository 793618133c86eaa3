"""Effect of a magnetometer calibration with the gyro on headings.

``python examples/magnetometer_study.py [RECORDINGS]`` prints tables in Markdown, and draws
``docs/figures/magnetometer.png``. The tables are about simulated motion with hard and soft iron,
calibrated and learned live, and about the duration. With the folder of recordings, two trials of
BROAD are added.

Heading errors of `zerorate.Attitude` with nine axes are RMS in degrees. The sphere is fitted to all
samples. Its centre is subtracted even if the samples do not cover all directions.
"""

import math
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import zerorate as zr
from recordings import BESIDE, BROAD_RATE
from tables import table
from zerorate.calibration.magnet.sphere import fit_sphere
from zerorate.metrics.orientation import orientation_errors
from zerorate.record.samples import Samples
from zerorate.show import save_figure

SOFT = np.array([[1.08, 0.04, -0.02], [0.04, 0.95, 0.03], [-0.02, 0.03, 0.97]])
KINDS = ("hand", "arm", "spinning pendulum", "vehicle")
TRIALS = {
    5: "broad_05_undisturbed_slow_rotation_with_breaks_B",
    32: "broad_32_disturbed_attached_magnet_1cm",
}
DRAWN = 32
FIGURE = Path(__file__).resolve().parents[1] / "docs" / "figures" / "magnetometer.png"


def with_mag(recording, data):
    """Return the recording with other magnetometer samples."""
    logs = dict(recording)
    logs["mag"] = logs["mag"].with_data(data)
    return replace(recording, logs=logs)


def by_sphere(recording):
    """Return the recording with the centre of a sphere subtracted from its field."""
    log = recording.mag
    found = fit_sphere(log.data[np.isfinite(log.data).all(axis=1)], len(log.data) / log.rate)
    return with_mag(recording, log.data - found.iron * found.norm)


def heading(recording, where=None):
    """Return the heading error relative to the reference's north, deg."""
    quaternion, truth, known = estimated(recording)
    known = known if where is None else known & where
    return error(quaternion, truth, known)


def estimated(recording, **arguments):
    """Return the orientations, the reference orientations, and the mask of known references."""
    samples = Samples.of(recording)
    truth = samples.align(recording["reference"])
    attitude = zr.Attitude(samples.log.rate, **arguments)
    found = attitude.process(samples.gyro, samples.accel, samples.mag, samples.dt)
    return found, truth, np.isfinite(truth).all(axis=1)


def error(quaternion, truth, where):
    """Return the root mean square of the heading's error, deg."""
    errors = orientation_errors(quaternion, truth, where=where, heading="absolute")
    return float(np.degrees(errors.heading))


def learned(recording):
    """Return the heading errors over all and over the second half, and the time of learning.

    The last value is the time at which the hard iron is first subtracted, s; NaN if never.
    """
    quaternion, truth, known = estimated(recording, learn_magnetometer=True)
    raw = estimated(recording)[0]
    late = np.arange(len(truth)) >= len(truth) // 2
    apart = np.flatnonzero((quaternion != raw).any(axis=1))
    first = apart[0] / recording.gyro.rate if len(apart) else math.nan
    return error(quaternion, truth, known), error(quaternion, truth, known & late), first


def large(seed):
    """Return a hard iron of 15 uT per axis."""
    return np.random.default_rng(seed).normal(0.0, 15.0, 3)


def small(seed):
    """Return a hard iron of 2 to 5 uT, as small as the variation in a room."""
    direction = np.random.default_rng(50 + seed).normal(size=3)
    return (2.0 + 3.0 * seed / 7.0) * direction / np.linalg.norm(direction)


IRONS = {
    "hard": (np.eye(3), large),
    "hard and soft": (SOFT, large),
    "2 to 5 uT": (np.eye(3), small),
    "none": (np.eye(3), lambda _: np.zeros(3)),
}


def of_learning(seeds):
    """Print the table of hard irons that are learned live."""
    rows = []
    for kind in KINDS:
        for name, (matrix, iron) in IRONS.items():
            found = []
            for seed in range(seeds):
                errors = zr.simulation.MotionErrors(field_wander=math.radians(4.5))
                seeded = {"seed": 100 + seed, "errors": errors}
                true = zr.simulate_motion(kind, 100.0, 120.0, **seeded).recording()
                moved = with_mag(true, true.mag.data @ matrix.T + iron(seed))
                found.append([*heads(moved), heads(true)[1], *learned(moved)])
            values = np.array(found)
            raw, raw_late, target, live, late = root_mean_square(values[:, :5])
            times = values[np.isfinite(values[:, 5]), 5]
            when = f"{np.median(times):.0f}" if len(times) else "never"
            worse = int(np.sum(values[:, 3] > 1.02 * values[:, 0]))
            rows.append([kind, name, f"{raw:.1f}", f"{live:.1f}", f"{raw_late:.1f}"])
            rows[-1] += [f"{late:.2f}", f"{target:.2f}", f"{len(times)} of {seeds}", when]
            rows[-1].append(str(worse))
    head = ["motion", "iron", "raw", "live", "raw, second minute", "live", "true field"]
    head += ["learned", "after, s", "worse than raw"]
    print(table(f"Learned live, 120 s at 100 Hz, {seeds} seeds:", head, rows, True), end="\n\n")


def heads(recording):
    """Return the heading errors over all and over the second half, without learning."""
    quaternion, truth, known = estimated(recording)
    late = np.arange(len(truth)) >= len(truth) // 2
    return error(quaternion, truth, known), error(quaternion, truth, known & late)


def simulated(kind, matrix, seeds):
    """Return heading errors (raw, sphere, calibrated, true field), iron errors, and decisions.

    The iron errors have the RMS of the known elements, uT, and the number of elements within two
    standard deviations. The decisions are True for applied calibrations.
    """
    rows, apart, z, applied = [], [], [], []
    for seed in range(seeds):
        errors = zr.simulation.MotionErrors(field_wander=math.radians(4.5))
        true = zr.simulate_motion(kind, 100.0, 120.0, seed=100 + seed, errors=errors).recording()
        iron = np.random.default_rng(seed).normal(0.0, 15.0, 3)
        moved = with_mag(true, true.mag.data @ matrix.T + iron)
        found = zr.calibrate_magnetometer(moved)
        rows.append([heading(one) for one in (moved, by_sphere(moved), found.apply(moved), true)])
        applied.append(found.applied)
        for one, b in zip(found.hard_iron, iron, strict=True):
            if one.identifiable:
                apart.append(one.value - b)
                z.append(abs(one.value - b) / one.sigma)
    return np.array(rows), (np.array(apart), np.array(z)), np.array(applied)


def root_mean_square(values):
    """Return the root mean square of each column."""
    return np.sqrt(np.mean(np.square(values), axis=0))


def of_simulation(seeds):
    """Print the table of simulated motion."""
    rows = []
    for kind in KINDS:
        for name, matrix in (("hard", np.eye(3)), ("hard and soft", SOFT)):
            found, (apart, z), applied = simulated(kind, matrix, seeds)
            told = [f"{one:.1f}" for one in root_mean_square(found)[:2]]
            told += [f"{one:.2f}" for one in root_mean_square(found)[2:]]
            told.append(f"{applied.sum()} of {seeds}")
            told.append("/".join(f"{one:.2f}" for one in root_mean_square(found[applied])[2:]))
            told.append(f"{root_mean_square(apart):.2f}" if len(z) else "none known")
            told.append(f"{np.mean(z < 2.0):.2f}" if len(z) else "none known")
            rows.append([kind, name, *told])
    head = ["motion", "iron", "raw", "sphere", "calibrated", "true field", "applied"]
    head += ["of these", "iron off by, uT", "within 2 sigma"]
    print(table(f"Simulated, 120 s at 100 Hz, {seeds} seeds:", head, rows, True), end="\n\n")


def of_trials(folder):
    """Print the table of recordings."""
    import pyarrow.parquet as pq

    rows = []
    for number, name in TRIALS.items():
        path = folder / f"{name}.parquet"
        recording = zr.read_recording(path, rate=BROAD_RATE)
        moving = pq.read_table(path, columns=["movement"])["movement"].to_numpy() > 0
        found = zr.calibrate_magnetometer(recording)
        if number == DRAWN and FIGURE.parent.is_dir():
            save_figure(found.plot(), FIGURE)
        corrected = found.apply(recording)
        same = np.array_equal(corrected.mag.data, recording.mag.data, equal_nan=True)
        after = "equal to the bit" if same else f"{heading(corrected, moving):.2f}"
        irons = "; ".join(
            f"{span.start:.0f} to {span.stop:.0f} s "
            + (
                f"({', '.join(f'{b:.1f}' for b in found.groups[span.group].hard_iron)})"
                if found.groups[span.group].applied
                else "nothing"
            )
            for span in found.spans
            if span.kind != "disturbed"
        )
        before = [f"{heading(one, moving):.2f}" for one in (recording, by_sphere(recording))]
        quaternion, truth, known = estimated(recording, learn_magnetometer=True)
        live = f"{error(quaternion, truth, known & moving):.2f}"
        if np.array_equal(quaternion, estimated(recording)[0]):
            live = "equal to the bit"
        rows.append([f"BROAD {number}", *before, after, live, irons])
    head = ["recording", "raw", "sphere", "calibrated", "learned live", "taken off, uT"]
    print(table("Recorded, heading in movement:", head, rows, True), end="\n\n")


def of_speed():
    """Print the duration of a calibration for ten minutes of data."""
    rows = []
    for kind in ("hand", "vehicle"):
        recording = zr.simulate_motion(kind, 100.0, 600.0, seed=5).recording()
        times = []
        for _ in range(7):
            before = np.array([time.perf_counter(), time.process_time()])
            zr.calibrate_magnetometer(recording)
            times.append(np.array([time.perf_counter(), time.process_time()]) - before)
        rows.append([kind, *(f"{one:.2f}" for one in np.min(times, axis=0))])
    head = ["motion", "wall s", "processor s"]
    print(table("Ten minutes at 100 Hz, best of seven:", head, rows, True), end="\n\n")
    of_live_speed()


def of_live_speed():
    """Print the duration of a sample with and without learning."""
    samples = Samples.of(zr.simulate_motion("hand", 100.0, 120.0, seed=5).recording())
    costs = {}
    for learns in (False, True, False, True, False, True):
        for _ in range(7):
            attitude = zr.Attitude(100.0, learn_magnetometer=learns)
            before = time.process_time()
            attitude.process(samples.gyro, samples.accel, samples.mag)
            cost = (time.process_time() - before) / len(samples.gyro) * 1e9
            costs[learns] = min(cost, costs.get(learns, math.inf))
    print(f"A sample of nine axes: {costs[False]:.0f} ns, learning {costs[True]:.0f} ns.")


if __name__ == "__main__":
    given = Path(sys.argv[1]) if len(sys.argv) > 1 else BESIDE
    of_simulation(8)
    of_learning(8)
    if given.is_dir():
        of_trials(given)
    of_speed()
