"""Simulated gyros: devices from data sheets, and records of which every part is known."""

from zerorate.simulate.devices import DEVICES, Device, device
from zerorate.simulate.gyro import simulate

__all__ = ["DEVICES", "Device", "device", "simulate"]
