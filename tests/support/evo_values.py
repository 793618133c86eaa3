"""What evo prints of two tracks: ``python tests/support/evo_values.py`` in an environment with evo.

The tests hold `zerorate.metrics.ate` and `rpe` against these values. Needs zerorate beside evo.
"""

import numpy as np

import zerorate as zr


def track(n=400, wobble=0.0, turn=0.0, shift=0.0, late=0.0):
    """Return a winding track of 20 s with errors of known size, without a random number."""
    t = np.arange(n) * 0.05
    at = t + late
    place = np.column_stack((3.0 * np.sin(0.5 * at), 2.0 * np.cos(0.7 * at), 0.3 * at))
    place += wobble * np.column_stack((np.sin(9.0 * t), np.cos(7.0 * t), np.sin(5.0 * t)))
    half = 0.5 * (0.4 * at + turn + wobble * np.sin(3.0 * t))
    quaternion = np.column_stack((np.cos(half), 0.1 * np.sin(at), 0.0 * at, np.sin(half)))
    c, s = np.cos(turn), np.sin(turn)
    place = place @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) + shift
    return zr.record.Poses(t, place, quaternion)


def both():
    """Return the estimate, of which poses are missing and times are a little off, and the truth."""
    found = track(wobble=0.05, turn=0.3, shift=1.5, late=0.004)
    kept = np.arange(len(found)) % 7 != 3
    times = found.time[kept] + 0.002
    return zr.record.Poses(times, found.position[kept], found.quaternion[kept]), track()


def main():
    """Print them."""
    from evo.core import metrics, sync, trajectory
    from evo.core.units import Unit

    def as_evo(poses):
        return trajectory.PoseTrajectory3D(poses.position, poses.quaternion, poses.time)

    estimate, truth = both()
    parts = {"m": metrics.PoseRelation.translation_part}
    parts["deg"] = metrics.PoseRelation.rotation_angle_deg
    ways = {
        "rigid": lambda e, r: e.align(r),
        "similar": lambda e, r: e.align(r, correct_scale=True),
        "origin": lambda e, r: e.align_origin(r),
        "none": lambda e, r: None,
    }
    for name, fit in ways.items():
        for unit, part in parts.items():
            ref, est = sync.associate_trajectories(as_evo(truth), as_evo(estimate), max_diff=0.01)
            fit(est, ref)
            ape = metrics.APE(part)
            ape.process_data((ref, est))
            print("ate", name, unit, ape.get_all_statistics())
    steps = {
        "10 poses": (10, Unit.frames, False),
        "10 poses, every": (10, Unit.frames, True),
        "2 m": (2.0, Unit.meters, False),
        "2 m, every": (2.0, Unit.meters, True),
    }
    for name, (delta, of, every) in steps.items():
        for unit, part in parts.items():
            ref, est = sync.associate_trajectories(as_evo(truth), as_evo(estimate), max_diff=0.01)
            rpe = metrics.RPE(part, delta=delta, delta_unit=of, all_pairs=every)
            rpe.process_data((ref, est))
            print("rpe", name, unit, len(rpe.error), rpe.get_all_statistics())


if __name__ == "__main__":
    main()
