"""The report says of barometer and compass what `zerorate.navigate` says."""

from dataclasses import replace

import numpy as np
import pytest

import zerorate as zr
from support.vehicles import simulate_vehicle
from zerorate.faults import render_text
from zerorate.simulation import barometer, compass_heading, with_aids


@pytest.fixture(scope="module")
def boat():
    """Return a boat with barometer and compass."""
    made = simulate_vehicle("boat", 130.0, seed=4)
    return made, with_aids(made, pressure=barometer(made), heading=compass_heading(made, rate=5.0))


def changed(recording, kind, work):
    """Return a recording with other readings of an aid, whose unit nothing states."""
    log = recording[kind]
    logs = {**recording, kind: replace(log, data=work(log.data), unit="unit")}
    return replace(recording, logs=logs)


def texts(report):
    return [(f.severity, render_text(f.text)) for f in report.findings if f.kind == "aids"]


def test_aids_that_agree(boat):
    made, recording = boat
    (finding,) = texts(zr.report(recording, fixes=made.fixes))
    assert finding[0] == "good"


@pytest.mark.parametrize(
    ("kind", "work", "severity"),
    [
        ("pressure", lambda values: values / 6894.76, "good"),  # psi
        ("pressure", lambda values: values / 3.0, "act"),
        ("heading", lambda values: np.pi / 2 - values, "good"),  # from east, anticlockwise
        ("heading", lambda values: np.linspace(0.0, 60.0, len(values))[:, None] % 6.28, "act"),
    ],
)
def test_report_and_track_say_the_same(boat, kind, work, severity):
    made, recording = boat
    wrong = changed(recording, kind, work)
    found = zr.navigate(wrong, made.fixes)
    said = [*found.alarms] if severity == "act" else [*found.notes]
    said = [render_text(one) for one in said]
    reported = [text for own, text in texts(zr.report(wrong, fixes=made.fixes)) if own == severity]
    assert reported
    for text in reported:
        assert any(text[:40] in one for one in said), (reported, said)
