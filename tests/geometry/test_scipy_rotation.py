"""Orientations give a Rotation of scipy, and every rotation may be given as one."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import zerorate as zr
from support.checks import assert_same_bits
from support.drives import drive, start_of
from zerorate.geometry.rotations import rotate

TURN = Rotation.from_rotvec([0.1, -0.2, 0.3])


def orientations():
    moving = drive()
    recording = moving.recording()
    hand = zr.simulate_motion("hand", duration=20.0).recording()
    track = zr.NavigationFilter(start_of(moving)).process(recording, moving.fixes)
    yield zr.estimate_attitude(hand)
    yield zr.align(recording, latitude=48.0, heading="course", span=(0.0, 10.0))
    yield track
    yield track.poses()
    yield zr.walk(zr.simulate_walk(strides=10).recording())


def test_an_orientation_turns_vectors_as_its_rotation_does():
    vector = np.array([1.0, 2.0, 3.0])
    for result in orientations():
        q = result.quaternion
        expected = rotate(q, np.broadcast_to(vector, (*q.shape[:-1], 3)))
        np.testing.assert_allclose(result.rotation.apply(vector), expected, atol=1e-12)


def test_an_unknown_orientation_has_no_rotation():
    poses = zr.record.Poses([0.0, 1.0], np.zeros((2, 3)), [[1.0, 0, 0, 0], [np.nan] * 4])
    with pytest.raises(ValueError, match="1 orientations are unknown, expected none"):
        poses.rotation  # noqa: B018


def test_a_rotation_stands_for_its_matrix():
    matrix = TURN.as_matrix()
    moving = drive()
    recording = moving.recording()
    both = [zr.record.body_axes(recording, turn).gyro.data for turn in (TURN, matrix)]
    assert_same_bits(*both)
    drives = [zr.simulate_drive(duration=10.0, body_from_sensor=one) for one in (TURN, matrix)]
    assert_same_bits(*(one.recording().gyro.data for one in drives))
    samples = np.random.default_rng(5).normal([0.0, 0.0, 9.8], 1.0, (200, 2, 3))
    turns = Rotation.concatenate([Rotation.identity(), TURN])
    fused = [
        zr.array.fuse_accelerometers(samples, np.zeros((200, 3)), 50.0, rotations=one)
        for one in (turns, turns.as_matrix())
    ]
    assert_same_bits(*map(np.asarray, fused))


def test_a_mount_is_given_as_a_rotation():
    moving = drive()
    recording, fixes = moving.recording(), moving.fixes
    tracks = [
        zr.navigate(recording, fixes, mount=mount, time_offset=0.0, outages=()).track
        for mount in (Rotation.identity(), np.eye(3))
    ]
    assert_same_bits(tracks[0].position, tracks[1].position)


def test_a_reference_is_given_as_a_rotation():
    estimate = next(orientations())
    reference = estimate.rotation * TURN
    quaternions = reference.as_quat(scalar_first=True)
    errors = [
        zr.metrics.orientation_errors(estimate.rotation, one) for one in (reference, quaternions)
    ]
    assert errors[0] == errors[1]
    assert errors[0].total == pytest.approx(TURN.magnitude())
    poses = [
        zr.record.Poses(estimate.time, np.zeros((estimate.n, 3)), one)
        for one in (reference, quaternions)
    ]
    assert_same_bits(poses[0].quaternion, poses[1].quaternion)
