"""Contents of a log: sensors, rates, units, and assumptions made to read it."""

from collections.abc import Iterator, Sequence

from zerorate.findings.finding import Finding
from zerorate.findings.imus import Imu
from zerorate.record.devices import sensor_labels
from zerorate.record.recording import Recording

SECTION = "What is here"
_SLOW_RATE_HZ = 50.0
"""Rate below which motion and vibration are not distinguished, Hz."""


def contents_findings(recording: Recording, imus: Sequence[Imu]) -> Iterator[Finding]:
    """Yield findings on contents, assumptions made while reading, and low rates."""
    labels = sensor_labels(recording)
    for name, log in recording.items():
        samples = f"{log.n} samples at {log.rate:.6g} Hz"
        text = f"{labels[name]}: {log.channels} channels in {log.unit}, {samples}."
        yield Finding(
            SECTION, "sensor", "good", text, log.rate, "Hz", figure=_figure_anchor(imus, name)
        )
    notes = [note for log in recording.values() for note in log.meta.get("notes", ())]
    for note in dict.fromkeys((*recording.notes, *notes)):
        yield Finding(SECTION, "reading", "good", f"{note[0].upper()}{note[1:]}.")
    for imu in imus:
        yield from _check_imu(imu, imu is imus[0])


def _figure_anchor(imus: Sequence[Imu], name: str) -> str:
    return next(
        (sensor.figure for imu in imus for sensor in imu.sensors if sensor.name == name), ""
    )


def _check_imu(imu: Imu, is_first: bool) -> Iterator[Finding]:
    for sensor in imu.sensors:
        if sensor.factor is None:
            yield Finding(
                SECTION, "unit", "look",
                f"{sensor.label}: its unit is not known, so none of its values is checked.",
                figure=sensor.figure, advice="Give the unit with unit= or --unit.",
            )  # fmt: skip
    slow_sensors = [sensor for sensor in imu.sensors if sensor.log.rate < _SLOW_RATE_HZ]
    if slow_sensors and is_first:
        rate = slow_sensors[0].log.rate
        yield Finding(
            SECTION, "slow", "look",
            f"{slow_sensors[0].label} has {rate:.3g} Hz: too slow to show vibration, noise "
            "or spikes.",
            rate, "Hz", figure=slow_sensors[0].figure,
            advice="Log the IMU at 100 Hz or more (PX4: SDLOG_PROFILE high rate; ArduPilot: "
            "LOG_BITMASK with fast IMU).",
        )  # fmt: skip
