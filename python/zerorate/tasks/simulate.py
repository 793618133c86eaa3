"""Simulated logs of the commands: a gyro at rest with its drift, or an IMU to calibrate."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from zerorate.io import write_log
from zerorate.noise import LowPass
from zerorate.record import Log
from zerorate.simulation.devices import Device
from zerorate.simulation.devices import device as find_device
from zerorate.simulation.gyro import simulate
from zerorate.simulation.session import GyroErrors, SimulatedSession, simulate_session
from zerorate.types import Floats
from zerorate.units import convert

DURATION_S: Final = 600.0
"""Default length of a simulated log, s."""

GYRO_FORMATS: Final = (".csv", ".tsv", ".npz", ".parquet")
"""Suffixes for the log of a gyro."""

SESSION_FORMATS: Final = (".csv", ".tsv", ".parquet")
"""Suffixes for the log of an IMU; other formats cannot contain a gyro with other sensors."""

_AXES: Final = ("x", "y", "z")
_SESSION_DEVICE: Final = "MPU-6050"
_BIAS_BY_TEMPERATURE_DEG_S: Final = ((0.2, -0.1, 0.15), (0.02, 0.01, -0.01))
"""Bias of each axis, deg/s per 10 K from 25 degC, and per square of this."""


def simulated_gyro(
    gyro: Device,
    rate: float,
    duration: float | None = None,
    seed: int = 1,
    axes: int | None = None,
    low_pass: LowPass | None = None,
) -> tuple[Log, Log]:
    """Return the log of a gyro at rest and the log of its true drift, rad/s.

    Parameters
    ----------
    gyro : Device
        The gyro.
    rate : float
        Samples per second, Hz.
    duration : float, optional
        Length, s; default `DURATION_S`.
    seed : int
        Seed, not negative. The same arguments give the same signal.
    axes : int, optional
        Number of axes; default 3.
    low_pass : LowPass, optional
        Filter of the sensor; default none.

    Raises
    ------
    ValueError
        If a number is out of range.
    """
    length = DURATION_S if duration is None else duration
    count = len(_AXES) if axes is None else axes
    values = simulate(gyro, rate, length, seed, axes=count, low_pass=low_pass)
    signal, drift = (_log(x, n, rate, gyro) for x, n in zip(values, ("gyro", "drift"), strict=True))
    return signal, drift


def simulated_demo(gyro: Device, rate: float, duration: float, seed: int) -> tuple[Log, Floats]:
    """Return the log of a gyro at rest on three axes and its true drift, deg/s, shape (n, 3)."""
    signal, drift = (
        convert(values, "rad/s", "deg/s")
        for values in simulate(gyro, rate, duration, seed, axes=len(_AXES))
    )
    names = tuple(f"gyro_{axis}_dps" for axis in _AXES)
    meta = {"source": f"simulated {gyro.name}", "sensor": f"simulated {gyro.name}"}
    return Log(np.arange(len(signal)) / rate, rate, signal, names, "deg/s", meta), drift


def simulated_session(
    device: str | None,
    poses: int,
    rate: float,
    seed: int,
    temperature: tuple[float, float] | None = None,
) -> SimulatedSession:
    """Return an IMU that is static in several poses, with a bias that depends on temperature.

    The default gyro is the MPU-6050. The temperature changes from the first to the second number,
    degC. Raises ValueError for an unknown device or a number out of range.
    """
    by_temperature = () if temperature is None else np.radians(_BIAS_BY_TEMPERATURE_DEG_S)
    noise = find_device(device or _SESSION_DEVICE)
    errors = GyroErrors(noise=noise, temperature=by_temperature)
    return simulate_session(poses, seed=seed, rate=rate, gyro=errors, temperature=temperature)


def write_session(session: SimulatedSession, log: Path, truth: Path) -> None:
    """Write the sensors of a session into one table, and its true parameters as JSON."""
    gyro, *others = session.recording.values()
    extra = {n: x for one in others for n, x in zip(one.names, one.data.T, strict=True)}
    write_log(replace(gyro, extra=extra), log)
    truth.write_text(session.truth.to_json() + "\n", encoding="utf-8")


def _log(values: Floats, stem: str, rate: float, gyro: Device) -> Log:
    axes = range(values.shape[1])
    labels = _AXES[: len(axes)] if len(axes) <= len(_AXES) else [str(i + 1) for i in axes]
    names = tuple(f"{stem}_{label}_radps" for label in labels)
    meta = {"sensor": f"simulated {gyro.name}"}
    return Log(np.arange(len(values)) / rate, rate, values, names, "rad/s", meta)
