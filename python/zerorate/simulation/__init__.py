"""Simulated sensors: devices from data sheets, records with known errors, and faults."""

from typing import TYPE_CHECKING, Final

from zerorate.lazy import lazy_exports

if TYPE_CHECKING:
    from zerorate.simulation.aids import (
        antenna_baseline,
        barometer,
        compass_heading,
        magnetometer,
        with_aids,
    )
    from zerorate.simulation.contamination import Contamination
    from zerorate.simulation.devices import DEVICES, Device, device
    from zerorate.simulation.drive import SimulatedDrive, simulate_drive
    from zerorate.simulation.gyro import simulate
    from zerorate.simulation.motion import MotionErrors, SimulatedMotion, simulate_motion
    from zerorate.simulation.session import (
        AccelErrors,
        GyroErrors,
        SimulatedSession,
        simulate_session,
    )
    from zerorate.simulation.walk import SimulatedWalk, simulate_feet, simulate_walk
    from zerorate.simulation.wheels import wheel_speeds, wheel_ticks

__all__ = [
    "DEVICES",
    "AccelErrors",
    "Contamination",
    "Device",
    "GyroErrors",
    "MotionErrors",
    "SimulatedDrive",
    "SimulatedMotion",
    "SimulatedSession",
    "SimulatedWalk",
    "antenna_baseline",
    "barometer",
    "compass_heading",
    "device",
    "magnetometer",
    "simulate",
    "simulate_drive",
    "simulate_feet",
    "simulate_motion",
    "simulate_session",
    "simulate_walk",
    "wheel_speeds",
    "wheel_ticks",
    "with_aids",
]

_LAZY_EXPORTS: Final = {
    "aids": "antenna_baseline barometer compass_heading magnetometer with_aids",
    "contamination": "Contamination",
    "devices": "DEVICES Device device",
    "drive": "SimulatedDrive simulate_drive",
    "gyro": "simulate",
    "motion": "MotionErrors SimulatedMotion simulate_motion",
    "session": "AccelErrors GyroErrors SimulatedSession simulate_session",
    "walk": "SimulatedWalk simulate_feet simulate_walk",
    "wheels": "wheel_speeds wheel_ticks",
}
if not TYPE_CHECKING:
    __getattr__, __dir__ = lazy_exports(__name__, _LAZY_EXPORTS)
