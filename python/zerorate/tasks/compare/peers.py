"""Attitude filters of other packages with their defaults, if they are installed."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np

from zerorate.geometry.frames import in_enu
from zerorate.geometry.rotations import inverse, product
from zerorate.tasks.compare.imu import Imu
from zerorate.types import Floats
from zerorate.units import UNITS

_DEG_PER_RAD: Final = math.degrees(1.0)
_G_M_S2: Final = UNITS["g"].amount


class Run(NamedTuple):
    """Output of a filter: orientations from sensor to east, north, up, (n, 4)."""

    quaternions: Floats
    seconds: float


class Peer(NamedTuple):
    """Filter of another package: import name, function, and a flag if it looks ahead."""

    package: str
    run: Callable[[Imu], Run]
    causal: bool = True


def is_missing(peer: str) -> bool:
    """Return True if the package of a peer is not installed."""
    return find_spec(PEERS[peer].package) is None


def _run_vqf(imu: Imu) -> Run:
    from vqf import VQF

    filled = imu.fill_missing()
    # vqf needs the rates of accelerometer and magnetometer.
    vqf = VQF(1.0 / imu.rate, 1.0 / imu.accel_rate, 1.0 / imu.mag_rate)
    start = time.perf_counter()
    output = vqf.updateBatch(filled.gyro, filled.accel, filled.mag)
    seconds = time.perf_counter() - start
    return Run(output["quat6D" if imu.mag is None else "quat9D"], seconds)


def _run_vqf_offline(imu: Imu) -> Run:
    """Run vqf forward and backward; it has no result if samples are missing."""
    from vqf import offlineVQF

    sensors = [imu.gyro, imu.accel] if imu.mag is None else [imu.gyro, imu.accel, imu.mag]
    if not all(np.isfinite(samples).all() for samples in sensors):
        return Run(np.full((len(imu.gyro), 4), np.nan), math.nan)
    start = time.perf_counter()
    output = offlineVQF(imu.gyro, imu.accel, imu.mag, 1.0 / imu.rate)
    seconds = time.perf_counter() - start
    return Run(output["quat6D" if imu.mag is None else "quat9D"], seconds)


def _run_imufusion(imu: Imu) -> Run:
    """Run imufusion's filter with its bias estimate, as in its examples."""
    import imufusion

    ahrs, bias = imufusion.Ahrs(), imufusion.Bias()
    ahrs_settings, bias_settings = imufusion.AhrsSettings(), imufusion.BiasSettings()
    ahrs_settings.sample_rate = bias_settings.sample_rate = imu.rate
    ahrs_settings.convention = imufusion.CONVENTION_ENU
    ahrs.set_settings(ahrs_settings)
    bias.set_settings(bias_settings)

    def step(_: Floats, gyro: Floats, accel: Floats, mag: Floats | None) -> Floats:
        rate = bias.update(gyro)
        if mag is None:
            ahrs.update_no_magnetometer(rate, accel)
        else:
            ahrs.update(rate, accel, mag)
        quaternion: Floats = ahrs.get_quaternion()
        return quaternion

    filled = imu.fill_missing()
    scaled = replace(filled, gyro=filled.gyro * _DEG_PER_RAD, accel=filled.accel / _G_M_S2)
    return _run_steps(step, scaled, np.array([1.0, 0.0, 0.0, 0.0]))


def _run_ahrs_madgwick(imu: Imu) -> Run:
    from ahrs.filters import Madgwick

    # With a magnetometer, its earth axes are north, west, up; without, any heading is valid.
    turn = np.array([math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)])
    start = product(inverse(turn), imu.first_orientation())
    run = _run_steps(_make_ahrs_step(Madgwick(frequency=imu.rate)), imu.fill_missing(), start)
    return run._replace(quaternions=in_enu(run.quaternions, "nwu"))


def _run_ahrs_mahony(imu: Imu) -> Run:
    from ahrs.filters import Mahony

    step = _make_ahrs_step(Mahony(frequency=imu.rate))
    return _run_steps(step, imu.fill_missing(), imu.first_orientation())


Step: TypeAlias = Callable[[Floats, Floats, Floats, Floats | None], Floats]
"""Function of an orientation and the samples after it; it returns the next orientation."""


def _make_ahrs_step(ahrs: Any) -> Step:  # noqa: ANN401
    def step(q: Floats, gyro: Floats, accel: Floats, mag: Floats | None) -> Floats:
        quaternion: Floats = (
            ahrs.updateIMU(q, gyro, accel) if mag is None else ahrs.updateMARG(q, gyro, accel, mag)
        )
        return quaternion

    return step


def _run_steps(step: Step, imu: Imu, q: Floats) -> Run:
    quaternions = np.empty((len(imu.gyro), 4))
    mags = [None] * len(quaternions) if imu.mag is None else imu.mag
    start = time.perf_counter()
    for i, (gyro, accel, mag) in enumerate(zip(imu.gyro, imu.accel, mags, strict=True)):
        q = quaternions[i] = step(q, gyro, accel, mag)
    return Run(quaternions, time.perf_counter() - start)


PEERS: Final = {
    "vqf": Peer("vqf", _run_vqf),
    "imufusion": Peer("imufusion", _run_imufusion),
    "ahrs-madgwick": Peer("ahrs", _run_ahrs_madgwick),
    "ahrs-mahony": Peer("ahrs", _run_ahrs_mahony),
    "vqf-offline": Peer("vqf", _run_vqf_offline, causal=False),
}
"""Filters by their names in a comparison."""
