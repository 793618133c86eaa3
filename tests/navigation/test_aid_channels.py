"""Units and conventions of aids by evidence: found, told, or refused with what to type."""

import math

import numpy as np
import pytest

import zerorate as zr
from support.drives import MODELS, drive, start_of
from zerorate.navigation.aid_channels import _CONVENTIONS, PRESSURE_UNITS, Channel, judge_channels
from zerorate.record.log import LogError
from zerorate.record.names import meaning_of
from zerorate.simulation import barometer, compass_heading

SECONDS = 110.0


@pytest.fixture(scope="module")
def made():
    one = drive(SECONDS)
    nav = zr.NavigationFilter(start_of(one), **MODELS)
    return one, nav.process(one.recording(), one.fixes, keep="track")


def channel(kind, one, values, unit="", **more):
    present = np.isfinite(values)
    return Channel(kind, one.time[present], values[present], unit, f"{kind}_column", **more)


def judged(one, track, *channels):
    return judge_channels(list(channels), one.fixes, track)


@pytest.mark.parametrize("stated", [True, False], ids=["stated", "by size"])
@pytest.mark.parametrize("unit", PRESSURE_UNITS)
def test_a_pressure_of_any_unit_becomes_pascals(made, unit, stated):
    one, track = made
    pascals = barometer(one)
    given = channel("pressure", one, pascals / PRESSURE_UNITS[unit], unit if stated else "")
    found = judged(one, track, given)
    np.testing.assert_allclose(found.aids["pressure"].value, pascals[np.isfinite(pascals)])
    assert not found.alarms
    assert bool(found.notes) != stated
    assert all(f"is a pressure in {unit} at 50" in note for note in found.notes)


@pytest.mark.parametrize("unit", PRESSURE_UNITS)
def test_a_pressure_of_another_unit_than_stated_is_refused_with_its_own(made, unit):
    one, track = made
    other = "kPa" if unit == "hPa" else "hPa"
    values = barometer(one) / PRESSURE_UNITS[unit]
    with pytest.raises(LogError, match=f"would be one in {unit}: pressure_unit='{unit}' says so"):
        judged(one, track, channel("pressure", one, values, other, is_requested=True))
    found = judged(one, track, channel("pressure", one, values, other))
    assert not found.aids
    assert found.alarms[0].endswith("it is not used")


def test_what_is_no_pressure_is_refused(made):
    one, track = made
    for factor in (3e-2, 0.3, 7.0):
        with pytest.raises(LogError, match="pressure_unit='hPa' says its unit"):
            judged(one, track, channel("pressure", one, factor * barometer(one), is_requested=True))


@pytest.mark.parametrize("unit", ["deg", "rad"])
@pytest.mark.parametrize("whole", [True, False], ids=["0 to 360", "-180 to 180"])
@pytest.mark.parametrize("convention", _CONVENTIONS)
def test_a_heading_of_any_convention_becomes_north_over_east(made, convention, whole, unit):
    one, track = made
    sense, offset = convention
    true = compass_heading(one, rate=5.0)
    turned = sense * (true - offset)
    turned = np.mod(turned, 2 * math.pi) if whole else np.angle(np.exp(1j * turned))
    values = np.degrees(turned) if unit == "deg" else turned
    found = judged(one, track, channel("heading", one, values))
    error = np.exp(1j * (found.aids["heading"].value - true[np.isfinite(true)]))
    assert np.abs(np.angle(error)).max() < 1e-9
    assert abs(found.heading_offset) < 0.05
    said = [note for note in found.notes if "converted" in note]
    assert bool(said) == (convention != (1.0, 0.0))


def test_a_heading_that_fits_no_convention_is_refused(made):
    one, track = made
    random = np.random.default_rng(4).uniform(0.0, 360.0, len(one.time))
    with pytest.raises(LogError, match="no other convention fits; compass names another column"):
        judged(one, track, channel("heading", one, random, "deg", is_requested=True))
    found = judged(one, track, channel("heading", one, random, "deg"))
    assert not found.aids
    assert len(found.alarms) == 1


@pytest.mark.parametrize("unit", ["deg", "rad"])
def test_a_wrong_unit_of_a_heading_is_named(made, unit):
    one, track = made
    heading = np.mod(compass_heading(one, rate=5.0), 2.0 * math.pi)
    values, wrong = (np.degrees(heading), "rad") if unit == "deg" else (heading, "deg")
    with pytest.raises(LogError, match=f"compass_unit='{unit}' says"):
        judged(one, track, channel("heading", one, values, wrong, is_requested=True))


def test_a_heading_near_north_without_motion_needs_a_unit(made):
    one, _ = made
    with pytest.raises(LogError, match="may be in deg or in rad; compass_unit='deg' says it"):
        judged(one, None, channel("heading", one, 0.5 + 0.0 * one.time, is_requested=True))


@pytest.mark.parametrize("kind", ["heading", "pressure"])
def test_frozen_readings_are_left_out_and_told(made, kind):
    one, track = made
    height = one.truth_position[:, 2]
    first = 50.0
    last = first + 25.0
    inside = (one.time >= first) & (one.time < last)
    make, unit = (compass_heading, "rad") if kind == "heading" else (barometer, "Pa")
    found = judged(one, track, channel(kind, one, make(one, frozen=[(first, last)]), unit))
    moved = kind == "heading" or np.ptp(height[inside]) > 6.0
    left = np.asarray(found.aids[kind].time)
    assert (((left >= first) & (left < last)).sum() == 0) == moved
    assert len(found.alarms) == moved
    assert all("one value for 25" in alarm for alarm in found.alarms)


@pytest.mark.parametrize(
    ("name", "kind", "unit"),
    [
        ("pressure_hpa", "pressure", "hPa"),
        ("baro_mbar", "pressure", "hPa"),
        ("Pressure [kPa]", "pressure", "kPa"),
        ("pressure", "pressure", None),
        ("baro_alt_m", "height", "m"),
        ("baro_altitude_ft", "height", "ft"),
        ("heading_deg", "heading", "deg"),
        ("compass_rad", "heading", "rad"),
        ("gnss_heading_deg", "heading", "deg"),
        ("baseline_north_m", "baseline", "m"),
        ("relpos_e_cm", "baseline", "cm"),
    ],
)
def test_names_of_aids(name, kind, unit):
    meaning = meaning_of(name)
    assert (meaning.kind, meaning.unit) == (kind, unit)


@pytest.mark.parametrize(
    "name",
    [
        "diff_pressure_pa",
        "airspeed_pressure",
        "tire_pressure_bar",
        "pressure_sigma_pa",
        "course_deg",
        "heading",
        "baro_alt",
        "baseline_sigma_north_m",
        "target_heading_deg",
        "oil_pressure",
    ],
)
def test_names_of_no_aid(name):
    meaning = meaning_of(name)
    assert meaning is None or meaning.kind not in ("pressure", "height", "heading", "baseline")
