"""Where the antenna is: found beside the errors, said where it is not as told, and smoothed."""

import numpy as np

import zerorate as zr
from support.drives import MODELS, start_of
from zerorate.geometry.earth import local_ned

TRUE = np.array([1.0, 0.3, -0.5])


def drive(seed=3, seconds=200.0):
    return zr.simulate_drive(50.0, seconds, seed=seed, antenna=TRUE)


def filter_(driven, **options):
    return zr.NavigationFilter(start_of(driven, 28.0), **{**MODELS, **options})


def test_it_is_found_within_its_deviation():
    """Of 20 drives forward and right to 4 cm; down hardly, for a car does not tilt."""
    off = []
    for seed in range(4):
        driven = drive(seed)
        nav = filter_(driven, antenna_sigma=1.0)
        assert (nav.antenna_sigma == 1.0).all()
        track = nav.process(driven.recording(), driven.fixes, keep="track")
        assert (nav.antenna_sigma[:2] < 0.15).all()
        off.append((nav.antenna - TRUE) / nav.antenna_sigma)
        assert track.notes[0].startswith("the antenna is ")
    assert np.abs(off).max() < 3.5
    assert np.sqrt(np.mean(np.square(off))) < 1.6


def test_one_that_is_told_wrongly_shows():
    driven = drive()
    wrong = filter_(driven, antenna_sigma=0.05)
    right = filter_(driven, antenna=TRUE, antenna_sigma=0.05)
    notes = [nav.process(driven.recording(), driven.fixes).notes for nav in (wrong, right)]
    assert notes[0][0].startswith("the antenna is not at its stated position: 0.")
    assert notes[1][0].startswith("the antenna is 0.98 ± 0.04, 0.30 ± ")


def test_smoothing_with_it_is_smoothing_with_the_one_that_is_found():
    """A constant has the same estimate at all times: as if it had been known to be there."""
    driven = drive()
    options = {"adapt": "fixed", "gate": 1e9}
    nav = filter_(driven, antenna_sigma=1.0, **options)
    found = nav.process(driven.recording(), driven.fixes).smooth()
    known = filter_(driven, antenna=nav.antenna, **options)
    fixed = known.process(driven.recording(), driven.fixes).smooth()
    late = driven.time > 35.0
    assert np.abs(local_ned(found.position[late], fixed.position[late])).max() < 0.01
    assert np.abs(found.velocity - fixed.velocity)[late].max() < 0.002
    # What is not known of the antenna is not known of the place.
    assert (found.sigma[late, :3] > fixed.sigma[late, :3]).all()
    assert (found.sigma[late, 2] > 0.7).all()


def test_wheels_are_smoothed_with_their_scale():
    """Errors over their deviations of a smoothed track, whose wheels begin to tell on the way."""
    squares = []
    for seed in range(3):
        driven = zr.simulate_drive(50.0, 200.0, seed=seed)
        told = zr.simulation.wheel_speeds(driven, scale=0.02, seed=seed)
        told[driven.time < 60.0] = np.nan
        nav = filter_(driven, vehicle="wheeled", antenna_sigma=0.1)
        best = nav.process(driven.recording(), driven.fixes, wheel_speed=told).smooth()
        late = driven.time > 35.0
        error = best.errors(driven.truth_position, driven.truth_velocity)[late]
        squares.append(np.mean((error / best.sigma[late, :6]) ** 2, axis=0))
    assert (np.mean(squares, axis=0) < 2.5).all()
    assert 0.5 < np.mean(squares) < 1.6
