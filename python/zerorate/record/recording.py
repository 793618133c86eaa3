"""Recordings: several logs by name, each with its own unit, rate and clock."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from zerorate.record.log import Log, notes_of
from zerorate.record.supplement import Supplement, Tables

if TYPE_CHECKING:
    from zerorate.record.fixes import Fixes
    from zerorate.record.mounting import Mounting


@dataclass(frozen=True, eq=False)
class Recording(Mapping[str, Log]):
    """Logs by name, each with its own unit, rate, clock and gaps.

    Parameters
    ----------
    logs
        Logs by name: ``"gyro"``, ``"accel"``, ``"mag"``, ``"temperature"``, ``"reference"``,
        ``"position"`` and others. Further logs of a kind are ``"gyro_1"``, ``"gyro_2"`` and so on.
    source
        Description of the source, used only in messages.
    notes
        Sentences on assumptions about the recording. Sentences on a log are in its
        ``meta["notes"]``.
    supplement
        Further contents of the source, read at first access: `fixes`, `mounting`, `device`,
        `tables`. ``replace(recording, logs=...)`` keeps them.

    Examples
    --------
    >>> import numpy as np
    >>> import zerorate as zr
    >>> table = {"time_s": np.arange(4) / 100, "temp_degc": np.full(4, 21.0)}
    >>> recording = zr.read_recording({**table, "gyro_dps": np.zeros((4, 3))})
    >>> recording.names, recording.gyro.unit, recording["temperature"].unit, recording.mag
    (('temperature', 'gyro'), 'deg/s', 'degC', None)
    """

    logs: Mapping[str, Log]
    source: str = "the recording"
    notes: tuple[str, ...] = field(default=(), kw_only=True)
    supplement: Supplement = field(default_factory=Supplement, kw_only=True)

    def __getitem__(self, name: str) -> Log:
        """Return a log by its name; a KeyError lists the existing names."""
        try:
            return self.logs[name]
        except KeyError:
            listed = ", ".join(self.logs)
            raise KeyError(f"there is no '{name}'; the recording has: {listed}") from None

    def __iter__(self) -> Iterator[str]:
        """Return an iterator over the names."""
        return iter(self.logs)

    def __len__(self) -> int:
        """Return the number of logs."""
        return len(self.logs)

    def __repr__(self) -> str:
        """Return the source, and channels, rate and unit of each log."""
        listed = (f"{n}: {x.channels} at {x.rate:g} Hz, {x.unit}" for n, x in self.items())
        return f"Recording({self.source}; {'; '.join(listed)})"

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all logs."""
        return tuple(self.logs)

    @property
    def gyro(self) -> Log | None:
        """First gyro, angular rates; None without a gyro."""
        return self.logs.get("gyro")

    @property
    def accel(self) -> Log | None:
        """First accelerometer, specific forces; None without an accelerometer."""
        return self.logs.get("accel")

    @property
    def mag(self) -> Log | None:
        """First magnetometer, magnetic field; None without a magnetometer."""
        return self.logs.get("mag")

    @property
    def temperature(self) -> Log | None:
        """First temperature; None without a temperature."""
        return self.logs.get("temperature")

    @property
    def reference(self) -> Log | None:
        """First reference: angle, rate or orientation from another instrument."""
        return self.logs.get("reference")

    @property
    def position(self) -> Log | None:
        """First position, for example of a GNSS receiver; its channels can have different units."""
        return self.logs.get("position")

    @property
    def fixes(self) -> Fixes | None:
        """Fixes of the receiver in the source, read at first access; None without fixes.

        `zerorate.read_fixes` returns the same for the whole source. Raises LogError if positions in
        the source are no fixes. Raises OSError if the file can no longer be read.
        """
        return self.supplement.fixes

    @property
    def mounting(self) -> Mounting | None:
        """Mounting of the sensors from the source's metadata; None if not stated.

        Raises LogError if the metadata cannot be read. `body_axes` applies the rotation.
        """
        return self.supplement.mounting

    @property
    def device(self) -> str | None:
        """Serial number of the device that wrote the source; None if the source has none."""
        return self.supplement.read_device()

    def tables(self, *prefixes: str) -> Tables:
        """Return name and columns of the source's tables with one of these name prefixes.

        The file is opened again. Raises LogError or OSError if that fails.
        """
        return self.supplement.read_tables(prefixes)

    def of_kind(self, kind: str) -> tuple[Log, ...]:
        """Return all logs of a kind, for example ``"gyro"``, in the order of the source."""
        names = (name for name in self if name.rpartition("_")[2].isdigit() or name == kind)
        return tuple(self[n] for n in names if n == kind or n.rpartition("_")[0] == kind)


def notes_on(recording: Recording) -> tuple[str, ...]:
    """Return the sentences on a recording and on its logs, without duplicates."""
    of_logs = (note for log in recording.values() for note in notes_of(log))
    return tuple(dict.fromkeys((*recording.notes, *of_logs)))
