"""Numbers of README's table "How good?", by the names of their tags.

``python examples/readme_numbers.py [FOLDER] [NAME ...]`` prints all rows, or some rows, next to the
numbers in README. In README a comment such as ``<!--=drift.auto-->`` names the number before it.
FOLDER has the recordings. Times in nanoseconds depend on the processor: ``make bench`` prints them,
and docs/evidence/benchmarks.md names the machine.
"""

import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

import zerorate as zr
from array_recording import Study
from attitude_tables import VQF
from attitude_tables import errors as attitude_errors
from attitude_tables import own as own_attitude
from attitude_tables import theirs as vqf_attitude
from calibration_study import UNITS, of_unit
from navigation_tables import outages_of_the_drive
from recordings import BESIDE, BROAD, BROAD_RATE
from self_tuning import learner
from tuned_process_noise import started
from zerorate.tasks.compare.imu import Imu
from zerorate.tasks.compare.orientation import turning_speed
from zerorate.tasks.compare.simulated import run
from zerorate.tasks.compare.trial import Trial

README = Path(__file__).parents[1] / "README.md"
TAGGED = re.compile(r"([\d.]+)<!--=([\w.]+)-->")
BEST_START = 1e-7
"""Best process noise for all simulated gyros, from `tuned_process_noise.py`."""
ARRAY = "mimu4444_array8_62hz_exp1.parquet"
HORIZON, OUTAGE = 60.0, 10.0


def drift(folder: Path) -> dict[str, float]:
    """Return the regrets on simulated gyros, as means over the models."""
    tuned = {name: started(name, BEST_START) for name in ("kf", "fading")}
    found = run(["auto", "kf", "akf", "fading", *tuned.values()])
    mean = dict(
        zip(("auto", "kf", "akf", "fading", "tuned_kf", "tuned_fading"), found.mean, strict=True)
    )
    published = [mean[name] for name in ("kf", "akf", "fading")]
    return {
        "drift.auto": mean["auto"],
        "drift.published_least": min(published),
        "drift.published_most": max(published),
        "drift.tuned_kf": mean["tuned_kf"],
        "drift.tuned_fading": mean["tuned_fading"],
    }


def hand(folder: Path) -> dict[str, float]:
    """Return the orientation error after a minute with the gyro alone, deg."""
    log = zr.read_log(folder / BROAD, rate=BROAD_RATE)
    truth = zr.read_log(folder / BROAD, rate=BROAD_RATE, columns=[f"ref_quat_{a}" for a in "wxyz"])
    bias = learner(BROAD_RATE, channels=3).trace(log.data).bias
    found = {}
    for name, rate in (("hand.auto", log.data - bias), ("hand.raw", log.data)):
        error = zr.metrics.orientation_error_growth(rate, truth.data, BROAD_RATE, (HORIZON,))
        found[name] = float(np.degrees(np.ravel(error)[0]))
    return found


def calibration(folder: Path) -> dict[str, float]:
    """Return the errors of gravity at rests that were not fitted, mg."""
    units = [of_unit(folder, unit) for unit in UNITS]
    after = [1e3 * unit.norm_error for unit in units]
    before = [1e3 * unit.norm_error_raw for unit in units]
    return {
        "calibration.least": min(after),
        "calibration.most": max(after),
        "calibration.raw_least": min(before),
        "calibration.raw_most": max(before),
    }


def attitude(folder: Path) -> dict[str, float]:
    """Return errors of inclination, and of heading without a magnetometer, in motion, deg."""
    trial = Trial.of(zr.read_recording(folder / BROAD, BROAD_RATE))
    imu, truth = Imu.of(trial), trial.orientation.quaternions
    moving = turning_speed(truth, imu.rate, 0.5) > np.radians(3.0)
    sensors = imu.gyro, imu.accel, imu.mag
    found = {}
    for name, method in (("own", own_attitude), *([("vqf", vqf_attitude)] if VQF else [])):
        _, _, inclination, heading = attitude_errors(method, sensors, imu.rate, truth, moving)
        found |= {f"attitude.{name}_inclination": inclination, f"attitude.{name}_heading": heading}
    return found


def array(folder: Path) -> dict[str, float]:
    """Return the noise of one gyro over the noise of eight at 1 s, and the root of eight."""
    return {"array.gain": Study(str(folder / ARRAY)).gain(1.0), "array.root": float(np.sqrt(8.0))}


def navigation(folder: Path) -> dict[str, float]:
    """Return errors after ten seconds without fixes, RMS, m."""
    free = outages_of_the_drive(folder, seconds=(OUTAGE,))[OUTAGE]
    return {"navigation.filter": free.rms(), "navigation.velocity": free.rms("velocity held")}


ROWS: Mapping[str, Callable[[Path], dict[str, float]]] = {
    "drift": drift,
    "hand": hand,
    "calibration": calibration,
    "attitude": attitude,
    "array": array,
    "navigation": navigation,
}


def written() -> dict[str, str]:
    """Return the tagged numbers of README by their tags."""
    return {tag: number for number, tag in TAGGED.findall(README.read_text(encoding="utf-8"))}


def agrees(number: str, measured: float) -> bool:
    """Return True if a number equals the measurement, to 1 % or to its digits."""
    half = 0.5 * 10.0 ** -len(number.partition(".")[2])
    return abs(float(number) - measured) <= max(0.01 * abs(measured), half)


def main() -> None:
    """Print the numbers."""
    given = sys.argv[1:]
    folder = Path(given.pop(0)) if given and given[0] not in ROWS else BESIDE
    for name in given or ROWS:
        for tag, measured in ROWS[name](folder).items():
            said = written().get(tag, "nothing")
            verdict = "" if said != "nothing" and agrees(said, measured) else "  DIFFERS"
            print(f"{tag:28}{measured:10.4g}  README: {said}{verdict}")


if __name__ == "__main__":
    main()
