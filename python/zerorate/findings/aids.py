"""Findings on barometer and compass: unit, convention and frozen readings, against the track."""

from __future__ import annotations

from collections.abc import Iterator

from zerorate.faults import make_sentence
from zerorate.findings.finding import Finding
from zerorate.findings.imus import Sensor
from zerorate.navigation.aid_channels import AID_KINDS, Channel, judge_channels
from zerorate.navigation.track import Track
from zerorate.record.fixes import Fixes
from zerorate.record.recording import Recording

_ADVICE = "Correct it in the logger, or state unit or column in `zerorate navigate`."


def aid_findings(
    recording: Recording, fixes: Fixes, track: Track, section: str, gyro: Sensor
) -> Iterator[Finding]:
    """Yield what `zerorate.navigate` says of the aids in a recording: alarms, then notes."""
    kinds = [kind for kind in AID_KINDS if kind in recording]
    if not kinds:
        return
    judged = judge_channels([Channel.of(kind, recording[kind]) for kind in kinds], fixes, track)
    for alarm in judged.alarms:
        text = make_sentence(alarm, ".")
        yield Finding(section, "aids", "act", text, figure=gyro.figure, advice=_ADVICE)
    for note in judged.notes:
        yield Finding(section, "aids", "good", make_sentence(note, "."), figure=gyro.figure)
    if not judged.alarms and not judged.notes:
        names = ", ".join(recording[kind].names[0] for kind in kinds)
        agreement = f"These readings agree with fixes and motion: {names}."
        yield Finding(section, "aids", "good", agreement, figure=gyro.figure)
