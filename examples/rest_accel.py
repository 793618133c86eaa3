"""Gain from an accelerometer for the rest detection of a gyro, on recordings and simulations.

``python examples/rest_accel.py FOLDER``, with the folder of the recordings, prints a table in
Markdown. Every gyro is filtered by ``auto``, alone and with the accelerometer, without limits and
with the limits of the commands. The numbers are:

- share of the time at rest that is detected as rest
- share of the time in motion that is wrongly detected as rest
- largest bias error after the first rest
"""

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

import zerorate as zr
from recordings import ADIS16405, BESIDE, BROAD, BROAD_RATE, ENCODER, MPU6050, Floats
from tables import table
from zerorate.io import read_log, read_recording

Flags = npt.NDArray[np.bool_]

MIMU = "mimu4444_array8_62hz_exp1.parquet"
DRIVE = "drive_imu_100hz.parquet"
GNSS = "drive_gnss_4hz.parquet"
LIMITS = {"rest_limit": 10.0, "bias_limit": 20.0}
"""Limits of the commands, deg/s."""
MIDWAY = (200.0, 260.0, 320.0)
"""Times at which a record of the drive may start, s."""
STANDS = 0.05
"""Speed below which the car stands, m/s: about five standard deviations of the receiver."""
TURNED = 1.0
"""Rate above which the array rotates, deg/s: five standard deviations of its samples."""
TURNS = ((0.5, 90.0), (2.0, 30.0), (10.0, 30.0), (50.0, 10.0))
"""Speeds, deg/s, and angles between the axis and the vertical, deg."""


@dataclass(frozen=True)
class Body:
    """Gyro, deg/s, accelerometer, (n, 3), mask of rest, and bias at rest, (3,)."""

    name: str
    rate: float
    gyro: Floats
    accel: Floats
    rests: Flags
    bias: Floats

    def since(self, seconds: float, name: str) -> "Body":
        """Return the rest of the record from a given time."""
        part = slice(round(seconds * self.rate), None)
        gyro, accel, rests = self.gyro[part], self.accel[part], self.rests[part]
        return replace(self, name=name, gyro=gyro, accel=accel, rests=rests)


def of(name: str, imu: zr.Recording, *, rests: Flags | bool, number: str = "") -> Body:
    """Return a body from a recording; without rest the bias is the mean of the whole record."""
    log, accel = imu["gyro" + number], imu["accel" + number]
    gyro = np.degrees(log.data) if log.unit == "rad/s" else log.data
    known = np.broadcast_to(rests, len(gyro))
    bias = np.nanmean(gyro[known] if known.any() else gyro, axis=0)
    return Body(name, log.rate, gyro, accel.data, known, bias)


def hand(folder: Path) -> Body:
    """Return the hand of BROAD; it starts and stops within a second of the marks."""
    moves = read_log(folder / BROAD, rate=BROAD_RATE, columns="movement").data[:, 0] > 0
    near = np.convolve(moves, np.ones(2 * round(BROAD_RATE) + 1), "same") > 0.5
    imu = read_recording(folder / BROAD, rate=BROAD_RATE)
    return of("hand (BROAD 05)", imu, rests=~near)


def car(folder: Path) -> Body:
    """Return the car of the drive; it stands where its receiver says so."""
    imu, fix = read_recording(folder / DRIVE), read_recording(folder / GNSS)
    speed = fix["velocity"]
    t = imu["gyro"].time
    at = speed.time
    stands = np.interp(t, at, np.linalg.norm(speed.data, axis=1)) < STANDS
    return of("car", imu, rests=stands)


def array(folder: Path) -> Body:
    """Return the first sensor of the array; at rest no axis has rotated for a second."""
    imu = read_recording(folder / MIMU)
    gyro = imu["gyro"].data
    level = np.nanmedian(gyro, axis=0)
    turned = (np.abs(gyro - level) > TURNED).any(axis=1)
    near = np.convolve(turned, np.ones(2 * round(imu["gyro"].rate) + 1), "same") > 0.5
    return of("array, 20 poses", imu, rests=~near)


def turn(speed: float, tilt: float, seed: int = 1) -> Body:
    """Return a simulated body that rests, rotates steadily and rests, for a minute each."""
    rng, rate = np.random.default_rng(seed), 100.0
    t = np.arange(18_000) / rate
    turning = (t >= 60.0) & (t < 120.0)
    axis = np.array([np.sin(np.radians(tilt)), 0.0, np.cos(np.radians(tilt))])
    angle = -np.radians(speed) * np.cumsum(turning)[:, np.newaxis] / rate
    up = np.array([0.0, 0.0, 9.81])
    # Formula of Rodrigues.
    accel = up * np.cos(angle) + np.cross(axis, up) * np.sin(angle)
    accel += axis * (axis @ up) * (1.0 - np.cos(angle))
    accel += 0.03 * rng.standard_normal(accel.shape)
    bias = np.array([0.5, -0.3, 0.2])
    gyro = bias + speed * turning[:, np.newaxis] * axis + 0.1 * rng.standard_normal(accel.shape)
    name = f"turn of {speed:g} deg/s, {tilt:g} deg off the vertical"
    return Body(name, rate, gyro, accel, ~turning, bias)


def bodies(folder: Path) -> list[Body]:
    """Return all bodies."""
    drive, encoder = car(folder), read_recording(folder / ENCODER)
    rest = read_recording(folder / ADIS16405, rate=100.0)
    turns = [turn(*one) for one in TURNS]
    return [
        of("ADIS16405 at rest", rest, rests=True),
        of("MPU-6050 at rest", read_recording(folder / MPU6050, rate=100.0), rests=True),
        of("MPU-6050 beside a motor", encoder, rests=True, number="_1"),
        of("shaft that never rests", encoder, rests=False),
        hand(folder),
        array(folder),
        drive,
        *(drive.since(start, f"car, from {start:g} s on") for start in MIDWAY),
        *turns,
        *(one.since(60.0, f"{one.name}, from its start") for one in turns[1:]),
    ]


def told(body: Body, moving: Flags | None, **limits: float) -> tuple[str, str, str]:
    """Return the filter's results for a body as cells."""
    filters = zr.DriftFilter(body.rate, channels=3, **limits)
    trace = filters.trace(body.gyro, moving=moving)
    began = np.maximum.accumulate(trace.bias != 0.0, axis=0)
    error = np.abs(trace.bias - body.bias)
    rest, motion = (
        f"{trace.at_rest[where].mean():.3f}" if where.any() else ""
        for where in (body.rests, ~body.rests)
    )
    return rest, motion, f"{error[began].max():.2f}" if began.any() else "no bias"


def main() -> None:
    """Print the table."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else BESIDE
    rows = []
    for body in bodies(folder):
        moving = zr.noise.MotionDetector(body.rate).process(body.accel)
        for name, limits in (("none", {}), ("commands'", LIMITS)):
            alone, both = told(body, None, **limits), told(body, moving, **limits)
            # Columns alone and with the accelerometer, next to each other.
            cells = [cell for pair in zip(alone, both, strict=True) for cell in pair]
            rows.append((body.name if not limits else "", name, *cells))
    head = ("recording", "limits", "rest", "+ accel", "false", "+ accel", "error", "+ accel")
    title = "Rest and bias, by the gyro alone and with its accelerometer"
    print(table(title, head, rows, markdown=True))


if __name__ == "__main__":
    main()
