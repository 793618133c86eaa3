"""The earth: gravity, radii, rates and local distances against published and closed forms."""

import numpy as np
import pytest

from zerorate.geometry import earth


class TestGravity:
    @pytest.mark.parametrize(
        ("latitude", "height", "expected"),
        [(0, 0, 9.780325336), (45, 0, 9.806197769), (90, 0, 9.832184938), (45, 1000, 9.803122828)],
    )
    def test_published_values(self, latitude, height, expected):
        got = earth.normal_gravity(np.radians(latitude), height)
        # As many digits as are printed.
        assert got == pytest.approx(expected, abs=6e-10)

    def test_arrays_as_one_by_one(self):
        latitudes = np.radians([[-80.0, 0.0], [10.0, 80.0]])
        got = earth.normal_gravity(latitudes, 50.0)
        assert got.shape == (2, 2)
        assert got[1, 0] == earth.normal_gravity(latitudes[1, 0], 50.0)


class TestRadii:
    def test_at_equator_and_pole(self):
        meridian, normal = earth.radii([0.0, np.pi / 2])
        a, e2 = earth.SEMI_MAJOR_AXIS, earth.ECCENTRICITY_SQUARED
        np.testing.assert_allclose(normal, [a, a / np.sqrt(1 - e2)], rtol=1e-15)
        np.testing.assert_allclose(meridian, [a * (1 - e2), a / np.sqrt(1 - e2)], rtol=1e-15)


class TestRates:
    def test_the_earth_turns_about_its_axis(self):
        rates = earth.earth_rate(np.radians([0.0, 45.0, -90.0]))
        # Its norm does not depend on the place, and at the south pole the axis points down.
        np.testing.assert_allclose(
            np.linalg.norm(rates, axis=1), earth.EARTH_RATE_RAD_S, rtol=1e-15
        )
        assert rates[0, 0] == earth.EARTH_RATE_RAD_S
        assert rates[1, 0] == pytest.approx(-rates[1, 2])
        assert rates[2, 2] == earth.EARTH_RATE_RAD_S

    def test_a_way_round_a_parallel_turns_once(self):
        # At 60 deg north a full circle to the east: 2 pi about the axis of the earth.
        latitude = np.radians(60.0)
        _, normal = earth.radii(latitude)
        round_the_earth = 2.0 * np.pi * (normal + 10.0) * np.cos(latitude)
        rate = earth.transport_rate(latitude, 10.0, [0.0, round_the_earth, 0.0])
        expected = 2.0 * np.pi * np.array([np.cos(latitude), 0.0, -np.sin(latitude)])
        np.testing.assert_allclose(rate, expected, rtol=1e-14, atol=1e-15)

    def test_north_turns_about_west(self):
        meridian, _ = earth.radii(0.5)
        rate = earth.transport_rate(0.5, 100.0, [meridian + 100.0, 0.0, 3.0])
        np.testing.assert_allclose(rate, [0.0, -1.0, 0.0], atol=1e-15)


class TestLocal:
    def test_a_second_of_arc(self):
        second = 1.0 / 3600.0
        ned = earth.local_ned([second, second, 5.0], [0.0, 0.0, 0.0])
        # A degree of latitude there is 110.574 km, one of longitude 111.320 km.
        np.testing.assert_allclose(ned, [110_574 / 3600, 111_320 / 3600, -5.0], atol=2e-4)

    def test_longitudes_across_the_date_line(self):
        east = earth.local_ned([[0.0, -179.5, 0.0]], [0.0, 179.5, 0.0])[0, 1]
        assert east == pytest.approx(np.radians(1.0) * earth.SEMI_MAJOR_AXIS)

    def test_there_and_back(self):
        rng = np.random.default_rng(1)
        ned = rng.normal(scale=300.0, size=(50, 3))
        for origin in ([-33.0, 151.0, 20.0], [60.0, 179.9999, 0.0], [0.0, -180.0, 5000.0]):
            there = earth.offset_position(origin, ned)
            assert (np.abs(there[:, 1]) <= 180.0).all()
            # A degree is rounded at 3e-14, that is 3 nm.
            np.testing.assert_allclose(earth.local_ned(there, origin), ned, atol=1e-8)

    def test_an_origin_a_position(self):
        places = np.array([[10.0, 20.0, 0.0], [-10.0, 170.0, 7.0]])
        np.testing.assert_array_equal(earth.local_ned(places, places), np.zeros((2, 3)))

    def test_angles_within_stay(self):
        angles = np.array([-180.0, 179.9999999999, 180.0, 0.1])
        np.testing.assert_array_equal(earth.wrap_degrees(angles), angles)
        np.testing.assert_allclose(
            earth.wrap_degrees([181.0, -181.0, 540.5]), [-179.0, 179.0, -179.5]
        )
