"""What a filter did at each sample: bits of a trace, notes of an estimate, marks of a figure."""

from dataclasses import replace

import numpy as np
import pytest

import zerorate as zr
from support import faults, outside
from zerorate.attitude.events import KINDS, Event, event_mask, event_notes

RATE = 100.0
HAND = faults.hand(RATE, 40.0)


def traced(scene, *, nine=True, method="trace", **arguments):
    mag = scene.mag if nine else None
    filter_ = zr.Attitude(scene.rate, mag=nine, **arguments)
    return getattr(filter_, method)(scene.gyro, scene.accel, mag)


def rows_of(trace, event):
    return np.flatnonzero(event_mask(trace["events"].astype(np.uint16), event))


def with_gyro(scene, rows, value):
    gyro = scene.gyro.copy()
    gyro[rows] = value
    return replace(scene, gyro=gyro)


def recording(scene, name="scene.csv"):
    time = np.arange(len(scene.gyro)) / scene.rate
    logs = {
        "gyro": zr.Log(time, scene.rate, scene.gyro, ("x", "y", "z"), "rad/s"),
        "accel": zr.Log(time, scene.rate, scene.accel, ("a", "b", "c"), "m/s^2"),
    }
    if scene.mag is not None:
        logs["mag"] = zr.Log(time, scene.rate, scene.mag, ("mx", "my", "mz"), "uT")
    return zr.Recording(logs, name)


def fallen():
    """A body that is turned over while its gyro shows nothing."""
    scene = faults.hand(RATE, 20.0, start="rest")
    accel, gyro = scene.accel[:400].copy(), scene.gyro[:400]
    return replace(scene, gyro=np.tile(gyro, (3, 1)), accel=np.concatenate((accel, -accel, -accel)))


def jumped():
    """A bias that jumps by 0.7 deg/s in a long rest."""
    random = np.random.default_rng(1)
    noise = 1e-3 * random.standard_normal((12000, 6))
    noise[6000:, 2] += np.radians(0.7)
    return replace(HAND, gyro=noise[:, :3], accel=noise[:, 3:] * 10 + [0, 0, 9.81], mag=None)


CASES = {
    Event.RATE_LEFT_OUT: (lambda: with_gyro(HAND, 2000, 50.0), {"gyro_range": 35.0}),
    Event.RATE_MISSING: (lambda: with_gyro(HAND, slice(2000, 2050), np.nan), {}),
    Event.CLIPPED: (lambda: with_gyro(HAND, slice(2000, 2003), 35.0), {"gyro_range": 35.0}),
    Event.GLITCH: (lambda: faults.garbage(HAND, 2000, 2000.0, 1), {}),
    Event.KNOCK: (lambda: outside.knocked(faults.hand(RATE, 60.0), 3000), {"nine": False}),
    Event.FALL: (fallen, {"nine": False}),
    Event.BIAS_JUMP: (jumped, {"nine": False}),
    Event.HEADING_DRIFT: (lambda: outside.swerve(2.0, 0, seconds=120.0), {}),
    Event.FIELD_HELD: (lambda: faults.held_field(HAND, 1, 2000), {}),
    Event.UNCLEAR_REST: (lambda: faults.big_bias(15.0, (0.05, 0.05, 1.0)), {"nine": False}),
    Event.WRONG_UNIT: (lambda: replace(HAND, gyro=HAND.gyro * 57.3), {}),
}


@pytest.mark.parametrize("event", CASES, ids=lambda event: event.name)
def test_each_is_seen_where_it_happens_and_nowhere_before(event):
    make, arguments = CASES[event]
    rows = rows_of(traced(make(), **arguments), event)
    assert rows.size
    if event not in (Event.UNCLEAR_REST, Event.WRONG_UNIT, Event.FALL, Event.HEADING_DRIFT):
        assert rows[0] >= 2000
    if event in (Event.GLITCH, Event.RATE_LEFT_OUT):
        assert rows.size == 1


def test_a_field_that_is_another_is_ignored():
    motion = zr.simulate_motion("hand", RATE, 40.0, seed=2, magnet=[[25.0, 30.0]])
    trace = zr.Attitude(RATE).trace(motion.gyro, motion.accel, motion.mag)
    rows = rows_of(trace, Event.FIELD_IGNORED)
    assert 2500 <= rows[0] < 2700
    assert trace["disturbed"][rows].all()


def test_a_gap_is_one_sample():
    dt = np.full(4000, 0.01)
    dt[[1000, 2000, 3000]] = 5.0, -0.2, -20.0
    trace = zr.Attitude(RATE).trace(HAND.gyro, HAND.accel, HAND.mag, dt=dt)
    np.testing.assert_array_equal(rows_of(trace, Event.GAP), [1000, 2000, 3000])


def test_nothing_befalls_a_hand():
    assert not traced(HAND)["events"].any()


def test_a_bias_that_no_rest_has_denied_undoes_none():
    trace = traced(faults.big_bias(15.0, (1.0, -0.5, 0.3)), nine=False)
    assert trace["at_rest"].any()
    assert not rows_of(trace, Event.REST_UNDONE).size


@pytest.mark.parametrize("nine", [True, False])
def test_parts_and_the_offline_pass_have_the_same(nine):
    knocked = replace(outside.knocked(HAND, 1500), mag=HAND.mag)
    scene = faults.garbage(knocked, 3000, 2000.0, 1)
    whole = traced(scene, nine=nine)["events"]
    filter_ = zr.Attitude(RATE, mag=nine)
    mag = (lambda part: scene.mag[part]) if nine else (lambda part: None)
    parts = [
        filter_.trace(scene.gyro[part], scene.accel[part], mag(part))["events"]
        for part in (slice(0, 3001), slice(3001, 3002), slice(3002, None))
    ]
    np.testing.assert_array_equal(np.concatenate(parts), whole)
    np.testing.assert_array_equal(traced(scene, nine=nine, method="smooth")["events"], whole)


def test_named_methods_have_those_of_samples():
    scene = with_gyro(HAND, slice(2000, 2050), np.nan)
    trace = traced(scene, method="trace")
    named = zr.Attitude(RATE, method="mahony").trace(scene.gyro, scene.accel, scene.mag)
    np.testing.assert_array_equal(
        rows_of(named, Event.RATE_MISSING), rows_of(trace, Event.RATE_MISSING)
    )


def test_bits_are_named_once():
    assert [kind.event for kind in KINDS] == list(Event)
    assert len({kind.name for kind in KINDS}) == len(KINDS)


class TestEstimate:
    def scene(self):
        return faults.garbage(with_gyro(HAND, slice(3000, 3050), np.nan), 2000, 500.0, 2)

    @pytest.mark.parametrize("offline", [False, True])
    def test_notes_say_what_acted_and_when(self, offline):
        found = zr.estimate_attitude(recording(self.scene()), offline=offline)
        assert found.events.dtype == np.uint16
        glitch = [note for note in found.notes if note.startswith("outlier of the gyro")]
        assert glitch == ["outlier of the gyro undone: 1 time, at 20.0 s"]
        missing = [note for note in found.notes if note.startswith("no rate")]
        assert missing == ["no rate for more than 0.05 s: 0.5 s, from 30.1 s on"]
        assert sum(note.startswith("at rest") for note in found.notes) == 1

    def test_many_are_one_line(self):
        events = np.zeros(4000, np.uint16)
        events[1000::200] += int(Event.GLITCH)
        events[[300, 350, 900]] += int(Event.KNOCK)
        events[1000:1100] += int(Event.FIELD_HELD)
        events[3000:3500] += int(Event.FIELD_HELD)
        notes = [*event_notes(events, np.zeros(4000, bool), np.arange(4000) / RATE, RATE)]
        assert [note.rpartition(": ")[2] for note in notes] == [
            "15 times, at 10.0, 12.0, 14.0, 16.0 and 11 more s",
            "2 times, at 3.0, 9.0 s",
            "6.0 s in 2 spans, the first at 10.0 s, the longest 5.0 s at 30.0 s",
        ]

    def test_the_figure_has_a_row_for_each(self):
        figure = zr.estimate_attitude(recording(self.scene())).plot()
        panel = figure.axes[-1]
        assert [label.get_text() for label in panel.get_yticklabels()] == ["glitch", "missing"]
        assert len(panel.collections) >= 2
        plain = zr.estimate_attitude(recording(HAND)).plot()
        assert len(plain.axes) == len(figure.axes) - 1


def test_the_report_says_what_to_type_for_a_rest_that_may_be_a_table():
    scene = replace(faults.big_bias(15.0, (0.05, 0.05, 1.0)), mag=None)
    found = zr.report(recording(scene))
    (one,) = [one for one in found.findings if one.kind == "unclear rest"]
    assert one.severity == "look"
    assert one.value == pytest.approx(15.0, abs=0.1)
    assert "at rest, or on a rate table" in one.text
    assert "bias_limit=math.radians(20)" in one.advice
    still = replace(scene, gyro=scene.gyro * 0.1)
    assert not [one for one in zr.report(recording(still)).findings if one.kind == "unclear rest"]
