"""Simulated gyros: devices from data sheets, records of which every part is known, and faults."""

from zerorate.simulate.contamination import Contamination
from zerorate.simulate.devices import DEVICES, Device, device
from zerorate.simulate.gyro import simulate

__all__ = ["DEVICES", "Contamination", "Device", "device", "simulate"]
