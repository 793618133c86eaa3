"""What is in a log: sensors, rates, units, and what was assumed to read it."""

from collections.abc import Iterator, Sequence

from zerorate.findings.finding import Finding
from zerorate.findings.imus import Imu
from zerorate.record.recording import Recording

SECTION = "What is here"
_SLOW = 50.0
"""Hz below which motion and vibration are not told apart."""


def contents(recording: Recording, found: Sequence[Imu]) -> Iterator[Finding]:
    """Yield what there is, what was assumed to read it, and what is too slow."""
    for name, log in recording.items():
        text = (
            f"{name}: {log.channels} channels in {log.unit}, {log.n} samples at {log.rate:.6g} Hz."
        )
        yield Finding(SECTION, "sensor", "good", text, log.rate, "Hz", figure=_figure(found, name))
    notes = [note for log in recording.values() for note in log.meta.get("notes", ())]
    for note in dict.fromkeys((*recording.notes, *notes)):
        yield Finding(SECTION, "reading", "good", f"{note[0].upper()}{note[1:]}.")
    for imu in found:
        yield from _on_imu(imu)


def _figure(found: Sequence[Imu], name: str) -> str:
    return next((one.figure for imu in found for one in imu.sensors if one.name == name), "")


def _on_imu(imu: Imu) -> Iterator[Finding]:
    for one in imu.sensors:
        if one.factor is None:
            yield Finding(
                SECTION, "unit", "look",
                f"{one.name}: its unit is not known, so no number of it is judged.",
                figure=one.figure, advice="Give the unit with unit= or --unit.",
            )  # fmt: skip
    slow = [one for one in imu.sensors if one.log.rate < _SLOW]
    if slow and imu.name == "IMU 0":
        rate = slow[0].log.rate
        yield Finding(
            SECTION, "slow", "look",
            f"{slow[0].name} has {rate:.3g} Hz: too slow to show vibration, noise or spikes.",
            rate, "Hz", figure=slow[0].figure,
            advice="Log the IMU at 100 Hz or more (PX4: SDLOG_PROFILE high rate; ArduPilot: "
            "LOG_BITMASK with fast IMU).",
        )  # fmt: skip
