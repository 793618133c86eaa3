"""Simulated gyros: devices from data sheets, records of which every part is known, and faults."""

from zerorate.simulation.contamination import Contamination
from zerorate.simulation.devices import DEVICES, Device, device
from zerorate.simulation.gyro import simulate

__all__ = ["DEVICES", "Contamination", "Device", "device", "simulate"]
