"""Tables and figures of the pages on calibration, from simulated sessions and recordings.

python examples/calibration_study.py [FOLDER OF THE RECORDINGS]
"""

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

import zerorate as zr
from tables import table
from zerorate.calibration import Turn
from zerorate.calibration.calibration import ACCEL_BIAS, ACCEL_MATRIX, GYRO_MATRIX
from zerorate.show import save_figure
from zerorate.show.calibration_panels import draw_poses
from zerorate.show.style import FONT_PT, new_figure

Floats = npt.NDArray[np.float64]

FOLDER = Path(__file__).parents[1] / "docs" / "figures"
RECORDINGS = Path(__file__).parents[2] / "shared" / "data"
ARRAY = "mimu4444_array8_62hz_exp1.parquet"
BROAD = "broad_05_undisturbed_slow_rotation_with_breaks_B.parquet"
UNITS = range(1, 9)
POSES = (9, 12, 20, 40)
SEEDS = range(1, 41)
LEARNED = 300.0
"""Part of the array's record that calibrates its units, s; later rotations are compared."""


def main(recordings: Path = RECORDINGS) -> None:
    """Print the tables and draw the figures."""
    simulated()
    poses()
    session()
    warm_up()
    if recordings.is_dir():
        units(recordings)
        angles(recordings)
        refused(recordings)
    else:
        print(f"no recordings in {recordings}: their tables are left out")


def simulated() -> None:
    """Print the errors of simulated sessions, and the share within two standard deviations."""
    rows = []
    for count in POSES:
        errors, scores, seconds, valid = [], [], [], 0
        for seed in SEEDS:
            session = zr.simulation.simulate_session(count, seed=seed)
            begin = time.perf_counter()
            found = zr.calibrate(session.recording, gravity=9.80665)
            seconds.append(time.perf_counter() - begin)
            valid += found.valid
            error, sigma = found.values - session.truth.values, _sigmas(found)
            errors.append(_kinds(error))
            scores.append([_z(error, sigma, part) for part in (slice(0, 12), GYRO_MATRIX)])
        root = np.sqrt(np.mean(np.square(errors), axis=0))
        shares = [np.mean(np.abs(np.concatenate(z)) < 2) for z in zip(*scores, strict=True)]
        rows.append(
            (
                str(count),
                f"{100 * root[0]:.3f}, {1e3 * root[1]:.2f}",
                f"{100 * root[2]:.3f}, {1e3 * root[3]:.2f}",
                f"{shares[0]:.2f}, {shares[1]:.2f}",
                f"{valid} of {len(SEEDS)}",
                f"{min(seconds):.2f}",
            )
        )
    head = ("poses", "accel scale %, bias mg", "gyro scale %, cross mrad")
    head = (*head, "z < 2: accel, gyro", "valid", "seconds")
    print(table("errors of simulated sessions, RMS of forty runs", head, rows, markdown=True))


def _sigmas(found: zr.Calibration) -> Floats:
    return np.sqrt(np.diagonal(found.covariance))


def _kinds(error: Floats) -> list[float]:
    """Return the RMS of accelerometer scale and bias, and of gyro scale and misalignment."""
    diagonal = np.eye(3, dtype=bool).ravel()
    accel, gyro = error[ACCEL_MATRIX], error[GYRO_MATRIX]
    parts = (accel[diagonal], error[ACCEL_BIAS], gyro[diagonal], gyro[~diagonal])
    return [float(np.sqrt(np.mean(part**2))) for part in parts]


def _z(error: Floats, sigma: Floats, part: slice) -> Floats:
    known = sigma[part] > 0
    return np.asarray(error[part][known] / sigma[part][known])


def poses() -> None:
    """Draw the poses of a good session, and of a session without -z up."""
    good = zr.simulation.simulate_session(20, seed=32)
    up = good.quaternion[good.rests[:, 0]]
    # The third row of a quaternion's matrix is the vertical in the axes of the body.
    below = 1.0 - 2.0 * (up[:, 1] ** 2 + up[:, 2] ** 2) < -0.2
    gap = zr.simulation.simulate_session(up[~below], seed=32)
    figure = new_figure(170.0, 50.0)
    panels = figure.subplots(1, 2)
    figure.subplots_adjust(left=0.01, right=0.99, bottom=0.0, top=0.9, wspace=0.04)
    named = {"twenty poses": good, "without the poses that have −z up": gap}
    for axes, (name, session) in zip(panels, named.items(), strict=True):
        draw_poses(axes, zr.calibrate(session.recording, gravity=9.80665))
        axes.set_title(name, fontsize=FONT_PT, loc="left")
    save_figure(figure, FOLDER / "calibration_poses.png")


def session() -> None:
    """Draw a session with its calibration."""
    recording = zr.simulation.simulate_session(20, seed=4).recording
    figure = zr.calibrate(recording, gravity=9.80665).plot(recording)
    save_figure(figure, FOLDER / "calibration_session.png")


def warm_up() -> None:
    """Draw the temperature model from the first part of a warm-up."""
    rng = np.random.default_rng(1)
    t = np.arange(6000) / 10.0
    temperature = 20.0 + 20.0 * (1.0 - np.exp(-t / 400.0))
    z = 0.5 + 0.03 * (temperature - 25.0) + 3e-4 * (temperature - 25.0) ** 2
    z += 0.015 * rng.standard_normal(t.size) + 8e-5 * np.cumsum(rng.standard_normal(t.size))
    figure = zr.TemperatureModel.fit(z, temperature, rate=10.0, unit="deg/s").plot()
    save_figure(figure, FOLDER / "temperature_model.png")


def units(recordings: Path) -> None:
    """Print the errors of the array's eight units before and after calibration, on unused data."""
    rows = []
    for unit in UNITS:
        found = of_unit(recordings, unit)
        norms = 1e3 * found.norm_error_raw, 1e3 * found.norm_error
        carried = np.degrees([found.carry_error_raw, found.carry_error])
        lost = int(np.count_nonzero(~found.identifiable))
        used = f"{sum(rest.used for rest in found.rests)}, {sum(t.used for t in found.turns)}"
        rows.append(
            (
                str(unit),
                used,
                f"{norms[0]:.1f} -> {norms[1]:.2f}",
                f"{carried[0]:.2f} -> {carried[1]:.2f}",
                f"{lost}",
            )
        )
    head = ("unit", "rests, turns", "norm error, mg", "carry error, deg", "not identifiable")
    print(table("eight units, held out", head, rows, markdown=True))


def of_unit(recordings: Path, unit: int, stop: float | None = None) -> zr.Calibration:
    """Return the calibration of a unit of the array, from the record until `stop` seconds."""
    gyro, accel = _logs(recordings, unit, stop)
    return zr.calibrate(gyro=gyro, accel=accel)


def _logs(recordings: Path, unit: int, stop: float | None = None) -> Iterator[zr.Log]:
    for sensor, unit_name in (("gyro", "dps"), ("accel", "g")):
        columns = [f"imu{unit}_{sensor}_{axis}_{unit_name}" for axis in "xyz"]
        yield zr.read_log(recordings / ARRAY, columns=columns, stop=stop)


def angles(recordings: Path) -> None:
    """Print the differences between the units' rotation angles, which do not depend on mounting.

    The units are calibrated on the first half, with gravity alone. The rotations are from the
    second half.
    """
    whole = of_unit(recordings, 1)
    late = [turn for turn in whole.turns if turn.start > LEARNED and turn.used]
    found: dict[str, list[list[float]]] = {"bias alone removed": [], "calibrated": []}
    for unit in UNITS:
        gyro, accel = _logs(recordings, unit)
        calibration = of_unit(recordings, unit, LEARNED)
        corrected = calibration.apply_gyro(gyro.data, calibration.apply_accel(accel.data))
        for name, rates in zip(found, (gyro.data, corrected), strict=True):
            found[name].append([_angle(rates, gyro.rate, whole, turn) for turn in late])
    rows = []
    for name, measured in found.items():
        apart = np.array(measured) - np.mean(measured, axis=0)
        share = apart / np.mean(measured, axis=0)
        rows.append(
            (name, f"{np.degrees(np.sqrt(np.mean(apart**2))):.3f}", f"{100 * share.std():.3f}")
        )
    size = np.degrees(np.mean(found["calibrated"]))
    title = f"angles of {len(late)} turns of {size:.0f} deg on average, from their mean over units"
    print(table(title, ("gyro", "deg", "% of the angle"), rows, markdown=True))


def _angle(rates: Floats, rate: float, whole: zr.Calibration, turn: Turn) -> float:
    """Return the angle between the orientations before and after a rotation."""
    before, after = (whole.rests[place] for place in turn.rests)
    still = [rates[rest.first : rest.last].mean(axis=0) for rest in (before, after)]
    turned = zr.integrate(np.radians(rates[turn.first : turn.last] - np.mean(still, axis=0)), rate)
    return float(2.0 * np.arccos(min(1.0, abs(turned.quaternion[-1, 0]))))


def refused(recordings: Path) -> None:
    """Print the messages for a record with too few rotations."""
    recording = zr.read_recording(recordings / BROAD, rate=2000 / 7)
    try:
        found = zr.calibrate(recording)
    except zr.LogError as error:
        print(error)
    else:
        print(found)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
