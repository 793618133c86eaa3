"""Fixes as a record: what is checked, and how parts of it are taken."""

import copy
import pickle

import numpy as np
import pytest

from zerorate.record.fixes import Fixes

N = 5
TIME = np.arange(N) * 0.25
PLACE = np.column_stack([np.full(N, -33.9), np.full(N, 151.2), np.linspace(10.0, 11.0, N)])
FULL = {
    "velocity": np.ones((N, 3)),
    "position_sigma": np.full((N, 3), 2.0),
    "velocity_sigma": np.full((N, 3), 0.1),
    "quality": [1, 1, 2, 5, 5],
    "satellites": np.arange(8, 8 + N),
    "velocity_time": TIME - 0.1,
}


class TestParts:
    def test_a_span_has_its_first_and_not_its_last_moment(self):
        part = Fixes(TIME, PLACE, **FULL, epoch=5.0, source="a", notes=("b",)).between(0.25, 1.0)
        np.testing.assert_array_equal(part.time, [0.25, 0.5, 0.75])
        assert len(part) == 3
        np.testing.assert_array_equal(part.quality, [1, 2, 5])
        assert {key: len(array) for key, array in part.as_dict().items()}.keys() >= FULL.keys()
        assert (part.epoch, part.source, part.notes) == (5.0, "a", ("b",))

    def test_a_span_without_fixes_is_empty(self):
        fixes = Fixes(TIME, PLACE)
        assert [len(fixes.between(*span)) for span in ((7, 9), (-2, -1), (0.5, 0.1))] == [0, 0, 0]
        assert repr(fixes.between(7, 9)) == "Fixes(0 in 0 s, positions)"
        assert len(fixes.between()) == N

    def test_a_choice_by_mask(self):
        fixes = Fixes(TIME, PLACE, **FULL)
        good = fixes.chosen(fixes.quality == 5)
        np.testing.assert_array_equal(good.satellites, [11, 12])

    def test_what_is_unknown_stays_so(self):
        fixes = Fixes(TIME, PLACE).between(0.0, 0.5)
        unknown = [name for name, array in fixes.as_dict().items() if array is None]
        assert unknown == list(FULL)
        assert fixes.epoch is None

    def test_another_clock(self):
        fixes = Fixes(TIME, PLACE, epoch=1000.0).shifted(0.125)
        np.testing.assert_array_equal(fixes.time, TIME + 0.125)
        assert fixes.epoch == 999.875

    def test_copies_are_equal_and_nothing_can_be_written(self):
        fixes = Fixes(TIME, PLACE, **FULL)
        for other in (copy.deepcopy(fixes), pickle.loads(pickle.dumps(fixes))):
            np.testing.assert_equal(other.as_dict(), fixes.as_dict())
        with pytest.raises(ValueError, match="read-only"):
            fixes.time[0] = 1.0

    def test_the_arrays_given_are_not_kept(self):
        place = PLACE.copy()
        fixes = Fixes(TIME, place)
        place[0] = 0.0
        np.testing.assert_array_equal(fixes.position, PLACE)


def changed(array, at, value):
    array = np.array(array, dtype=float)
    array[at] = value
    return array


class TestRefusals:
    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            ({"time": TIME[:4]}, r"position must be of shape \(4, 3\), got \(5, 3\)"),
            ({"time": TIME[:, None]}, r"time must be of shape \(n,\), got \(5, 1\)"),
            ({"time": changed(TIME, 2, np.nan)}, "time must be finite and rise"),
            ({"time": changed(TIME, 2, 0.25)}, r"rise from fix to fix: fix 2 is at 0.25 s after"),
            ({"position": PLACE[:, :2]}, r"position must be of shape \(5, 3\), got \(5, 2\)"),
            ({"position": changed(PLACE, (3, 0), 91.0)}, "fix 3 is latitude 91.0"),
            (
                {"position": changed(PLACE, (3, 1), np.nan)},
                "fix 3 is latitude -33.9, longitude nan",
            ),
            ({"position": changed(PLACE, (1, 2), np.inf)}, "position must not be infinite"),
            ({"velocity": np.ones((N, 2))}, r"velocity must be of shape \(5, 3\)"),
            ({"position_sigma": changed(PLACE, (2, 1), 0.0) * [-1, 1, 1]}, "fix 2 is not"),
            ({"velocity_sigma": -np.ones((N, 3))}, "velocity_sigma must be positive.*fix 0"),
            ({"quality": [1, 1, 2, 1.5, 1]}, "quality must be whole numbers"),
            ({"satellites": [1, 1, np.nan, 1, 1]}, "satellites must be whole numbers"),
            ({"satellites": ["many"] * N}, "satellites must be an array of numbers"),
            ({"epoch": np.nan}, "epoch must be a finite number"),
        ],
    )
    def test_in_one_sentence(self, arguments, message):
        with pytest.raises(ValueError, match=message):
            Fixes(**{"time": TIME, "position": PLACE, **arguments})

    def test_heights_and_velocities_may_be_missing(self):
        fixes = Fixes(TIME, changed(PLACE, (0, 2), np.nan), np.full((N, 3), np.nan))
        assert np.isnan(fixes.position[0, 2])
        assert len(Fixes([], np.zeros((0, 3)))) == 0


def test_what_a_mask_hides_is_missing():
    places = np.ma.masked_array([[45.0, 7.0, 0.0], [45.0, 7.0, 999.0]], mask=False)
    places[1, 2] = np.ma.masked
    hidden = np.ma.masked_array(np.full((2, 3), 999.0), mask=True)
    fixes = Fixes([0.0, 1.0], places, hidden, position_sigma=hidden)
    assert np.isnan(fixes.velocity).all()
    assert np.isnan(fixes.position_sigma).all()
    assert np.isnan(fixes.position[1, 2])
