"""Two feet of one person: held together, and what differs between them."""

from dataclasses import replace

import numpy as np
import pytest

import zerorate as zr

ASYMMETRIES = ("stride_length", "stride_time", "swing_time", "stance_time")


def tracked(walk, turned=0.0):
    """The track of a foot, its sensor put on another way and its heading drifting."""
    c, s = np.cos(turned), np.sin(turned)
    axes = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    logs = {
        name: zr.Log.at(walk.time, walk.rate, log.data @ axes.T, log.names, log.unit, {})
        for name, log in walk.recording().logs.items()
    }
    return zr.FootNavigation(floor="level").process(zr.Recording(logs, "a foot")).smooth()


def drifted(track, rate):
    """The same, as a heading that drifts has it, rad/s."""
    z = track.position[:, :2] @ [1.0, 1j]
    steps = np.diff(z, prepend=z[0]) * np.exp(1j * rate * (track.time - track.time[0]))
    way = np.cumsum(steps)
    position = track.position.copy()
    position[:, 0], position[:, 1] = way.real, way.imag
    return replace(track, position=position)


def off(track, walk):
    return float(np.hypot(*(track.position - walk.position)[-1, :2]))


def test_feet_are_held_together_whichever_way_their_sensors_look():
    walks = zr.simulate_feet(100.0, strides=60, seed=3)
    left, right = drifted(tracked(walks[0]), 4e-3), drifted(tracked(walks[1], 0.7), -4e-3)
    feet = zr.join_feet(left, right)
    assert off(left, walks[0]) > 6.0
    # What both headings drift apart is taken back.
    assert max(off(feet.left, walks[0]), off(feet.right, walks[1])) < 2.5
    assert feet.bound_count > 10
    gap = np.hypot(*(feet.left.position - feet.right.position)[:, :2].T)
    assert np.nanmax(gap) < 1.5
    assert feet.left.sigma[-1, 1] < left.sigma[-1, 1]
    # It looks where it goes: along the way of the left foot.
    assert np.abs(feet.right.velocity[:, 0]).max() > 3.0 * np.abs(feet.right.velocity[:, 1]).max()


def test_feet_that_agree_stay_and_are_alike():
    walks = zr.simulate_feet(100.0, strides=12, seed=1)
    tracks = [tracked(walk) for walk in walks]
    feet = zr.join_feet(*tracks, distance=2.0)
    assert feet.bound_count == 0
    assert np.abs(feet.left.position - tracks[0].position).max() < 1e-3
    found = feet.asymmetry()
    assert set(found) >= {"stride_length", "stride_time", "stance_time"}
    for one in found.values():
        assert abs(one.percent) < max(5.0 * one.percent_sigma, 4.0)
    assert "Two feet: " in feet.table()


def test_the_deviations_of_an_asymmetry_are_honest():
    scores = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        swing, stance = 0.5 + rng.uniform(0.0, 0.08), 0.65 + rng.uniform(0.0, 0.1)
        rate, rest = (100.0, 200.0, 400.0)[seed % 3], 2.0 + rng.uniform(0.0, 0.1)
        walks = zr.simulate_feet(rate, strides=25, rest=rest, swing=swing, stance=stance, seed=seed)
        left, right = (zr.FootNavigation().process(walk.recording()) for walk in walks)
        # Both feet walk alike: every difference is an error.
        found = zr.join_feet(left, right).asymmetry()
        scores.append([found[name].percent / found[name].percent_sigma for name in ASYMMETRIES])
    scores = np.abs(scores)
    assert scores.max() < 3.0
    assert (scores < 2.0).mean() >= 0.9


def test_faults():
    walks = zr.simulate_feet(100.0, strides=4, seed=1)
    left, right = map(tracked, walks)
    with pytest.raises(ValueError, match="distance must be a positive number"):
        zr.join_feet(left, right, distance=0.0)
    later = replace(right, time=right.time + 100.0)
    with pytest.raises(ValueError, match="must have 5 s and four stances in common"):
        zr.join_feet(left, later)
