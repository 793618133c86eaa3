"""The earth's magnetic field: against the test values that its model is published with."""

import math

import pytest

from zerorate.geometry import earth_field

# Year, height in km, latitude, longitude, declination: test values of NOAA and BGS for WMM 2025.
PUBLISHED = [
    (2025.0, 0.0, 80.0, 0.0, 1.28),
    (2025.0, 0.0, 0.0, 120.0, -0.16),
    (2025.0, 0.0, -80.0, 240.0, 68.78),
    (2025.0, 100.0, 80.0, 0.0, 0.85),
    (2027.5, 0.0, 80.0, 0.0, 2.59),
    (2027.5, 100.0, 0.0, 120.0, -0.23),
    (2025.0, 28.0, 89.0, -121.0, -99.77),
]


@pytest.mark.parametrize(("year", "height", "latitude", "longitude", "declination"), PUBLISHED)
def test_declinations_are_the_published_ones(year, height, latitude, longitude, declination):
    there = earth_field(latitude, longitude, height * 1000.0, year)
    assert math.degrees(there.declination) == pytest.approx(declination, abs=0.0051)


def test_munich_has_the_field_that_maps_show():
    """48 to 49 uT, a dip of 64 deg, and 4 to 5 deg east in 2026."""
    there = earth_field(48.1, 11.6, 500.0, year=2026.0)
    assert 48.0 < there.size < 49.5
    assert 63.5 < math.degrees(there.dip) < 65.5
    assert 4.0 < math.degrees(there.declination) < 5.0
    assert there.model == "World Magnetic Model 2025"


def test_the_south_dips_upwards():
    assert earth_field(-33.9, 151.2).dip < -1.0


def test_an_older_year_has_its_own_model():
    old, new = (earth_field(48.1, 11.6, year=year) for year in (2014.5, 2026.5))
    assert old.model == "World Magnetic Model 2010"
    assert math.degrees(new.declination - old.declination) > 1.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((91.0, 0.0), "latitude must be within 90 deg"),
        ((0.0, math.nan), "longitude must be within 360 deg"),
        ((0.0, 0.0, 1e9), "height must be in m"),
        ((0.0, 0.0, 0.0, 2035.0), "year must be 2010 to 2030"),
    ],
)
def test_no_place_and_no_year_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        earth_field(*arguments)


def test_without_pygeomag_the_extra_is_named(monkeypatch):
    monkeypatch.setattr("zerorate.geometry.magnetic.find_spec", lambda name: None)
    with pytest.raises(ImportError, match=r"needs pygeomag: run pip install '.\[magnetic\]'"):
        earth_field(48.0, 11.0)
