"""Recordings for the studies in this folder: their files, and functions that read them.

python examples/recordings.py FOLDER lists the files that are present, and checks their contents.
"""

import argparse
import hashlib
import math
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from zerorate.io import read_log
from zerorate.record import Log

Floats = npt.NDArray[np.float64]

BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"

ADIS16405 = "adis16405_static_100hz_run1.parquet"
MPU6050 = "mpu6050_static_100hz.parquet"
ENCODER = "mpu6050_encoder_yaw_slow_100hz.parquet"
BROAD = "broad_05_undisturbed_slow_rotation_with_breaks_B.parquet"

SHA256 = {
    ADIS16405: "e05d6cf43d6bfe2c7c9c31dc9abb38c7e33374acbb54cd9309a05e59ee16171a",
    MPU6050: "007e1d7c2bc0016b2a157a9d200a3381c57994c3ba9087a6120f027a02959e28",
    ENCODER: "c81a5038d6e2d3f9a22edf0413169b34e25fc6088e0a25934103f2bd56400bce",
    BROAD: "89f5e523b06fd2b57db0658b4efaeb92fdb99984ca06114a28e0c6aeeb627b6c",
}
"""Hashes of the files used in the documentation."""

# Leave room for the start-up, and for coasting over 10 s.
SHORTEST = 20.0

BROAD_RATE = 2000.0 / 7.0
# The file marks 35.4 s of rest, but the hand starts earlier.
BROAD_REST = 34.5


@dataclass(frozen=True)
class Recording:
    """Gyro axes, deg/s, shape (n, k)."""

    name: str
    rate: float
    axes: tuple[str, ...]
    z: Floats


@dataclass(frozen=True)
class Turning:
    """A gyro axis, deg/s, and the angle of an encoder on the same shaft, deg."""

    name: str
    rate: float
    z: Floats
    angle: Floats


def parser(description: str | None) -> argparse.ArgumentParser:
    """Return a parser for the options that all studies share."""
    options = argparse.ArgumentParser(description=description)
    options.add_argument(
        "folder",
        nargs="?",
        type=Path,
        default=BESIDE,
        help="folder of the recordings (default: ../shared/data beside the checkout)",
    )
    options.add_argument(
        "--seconds",
        type=_length,
        default=math.inf,
        help="use only the beginning of each recording, at least 20",
    )
    return options


def _length(text: str) -> float:
    seconds = float(text)
    if not seconds >= SHORTEST:
        raise argparse.ArgumentTypeError(f"must be at least {SHORTEST:g}, got {text}")
    return seconds


def check_folder(folder: Path) -> None:
    """End the program with a clear message if a recording is missing."""
    absent = [name for name in SHA256 if not (folder / name).exists()]
    if absent:
        print(f"no recording {absent[0]} in {folder}; give the folder they are in", file=sys.stderr)
        raise SystemExit(1)


def state(path: Path) -> str:
    """Return the state of a recording: missing, identical or different."""
    if not path.exists():
        return "absent"
    with path.open("rb") as file:
        found = hashlib.file_digest(file, "sha256").hexdigest()
    return "identical" if found == SHA256[path.name] else f"other bytes: sha256 {found}"


def sensors_alone(folder: Path, seconds: float = math.inf) -> list[Recording]:
    """Return the recordings of undisturbed sensors at rest."""
    return [
        _at_rest("ADIS16405", read_log(folder / ADIS16405, rate=100.0), seconds),
        _at_rest("MPU-6050", read_log(folder / MPU6050, rate=100.0), seconds),
    ]


def at_rest(folder: Path, seconds: float = math.inf) -> list[Recording]:
    """Return all recordings at rest, including rest near a running motor and before a motion."""
    fixed = read_log(folder / ENCODER, columns=[f"fixed_gyro_{axis}_dps" for axis in "xyz"])
    myon = read_log(folder / BROAD, rate=BROAD_RATE)
    return [
        *sensors_alone(folder, seconds),
        _at_rest("MPU-6050 beside a motor", fixed, seconds),
        _at_rest("myon aktos-t", myon, min(seconds, BROAD_REST)),
    ]


def turning(folder: Path, seconds: float = math.inf) -> Turning:
    """Return the axis with an encoder."""
    gyro = read_log(folder / ENCODER, columns="shaft_gyro_z_dps")
    encoder = read_log(folder / ENCODER, columns="encoder_deg")
    n = _samples(gyro, seconds)
    return Turning("MPU-6050 on a shaft", gyro.rate, gyro.data[:n, 0], _filled(encoder.data[:n, 0]))


def _at_rest(name: str, log: Log, seconds: float) -> Recording:
    z = log.data[: _samples(log, seconds)]
    if log.unit == "rad/s":
        z = np.degrees(z)
    return Recording(name, log.rate, tuple("xyz"), z)


def _samples(log: Log, seconds: float) -> int:
    return round(min(seconds, log.duration) * log.rate)


def _filled(angle: Floats) -> Floats:
    """Return the angle with missing samples interpolated (one of 149 828)."""
    there, k = np.isfinite(angle), np.arange(len(angle))
    return np.interp(k, k[there], angle[there])


def main() -> None:
    """Print the recordings in a folder; the exit code is 1 if one is missing or different."""
    options = argparse.ArgumentParser(description="Which recordings are in a folder.")
    options.add_argument("folder", nargs="?", type=Path, default=BESIDE, help="of the recordings")
    folder = options.parse_args().folder
    found = {name: state(folder / name) for name in SHA256}
    for name, text in found.items():
        print(f"{name:56}  {text}")
    raise SystemExit(set(found.values()) != {"identical"})


if __name__ == "__main__":
    main()
