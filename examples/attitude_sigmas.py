"""Attitude errors divided by their standard deviations, on every platform.

``python examples/attitude_sigmas.py [RECORDINGS]`` prints a table in Markdown. It has the RMS of
the tilt error over its standard deviation, and of the heading error over its standard deviation.
Next to them is the RMS of the standard deviation in degrees. 1 is exact; below 1 the standard
deviation is too large.

The platforms are motions of `zerorate.simulate_motion`, bodies outside the laboratory and, with the
folder of recordings, hands (BROAD 05 and 32). Without a magnetometer the heading is relative to the
start.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

import attitude_outside as platforms
import zerorate as zr
from attitude_outside import outside
from tables import table

KINDS = ("pendulum", "spinning pendulum", "arm", "vehicle", "circle", "hand")
SETTLED_S = 15.0
"""Time after which the start is over, s."""


def simulated(kind, start, seeds):
    """Return scenes of a simulated motion with nine axes."""
    for seed in range(seeds):
        motion = zr.simulate_motion(kind, 100.0, 60.0, seed=seed, start=start)
        where = np.ones(len(motion.time), dtype=bool)
        sensors = motion.gyro, motion.accel, motion.mag
        yield outside.Scene(100.0, *sensors, motion.quaternion, where)


def scenarios(folder):
    """Yield name, scenes (with a magnetometer if available), and the first row to score."""
    for kind in KINDS:
        for start in ("rest", "motion"):
            yield f"{kind}, from {start}", list(simulated(kind, start, 8)), start == "rest"
    for name, scenes, too in platforms.level_scenes():
        if "first sample" not in name:
            yield name, scenes, too
    for name, scenes in list(platforms.drives())[::5]:
        yield f"car, {name}", scenes[:4], False
    flights = [outside.hover(k, *of) for k, of in enumerate(outside.FLIGHTS)]
    yield "quadrotors", flights, True
    for name, scenes in platforms.speeding_up():
        yield name, scenes, True
    for name, scenes in list(platforms.failing())[3:8]:
        yield name, scenes, False
    if folder is not None:
        for trial in platforms.BROAD:
            yield f"hand, BROAD {trial:02d}", [platforms.recorded(folder, trial)], True


def ratios(scenes, *, six, offline=False):
    """Return the RMS ratios of tilt and heading, and the RMS standard deviations, deg."""
    found = []
    for given in scenes:
        scene = replace(given, mag=None) if six else given
        settled = scene.where & (np.arange(len(scene.where)) >= SETTLED_S * scene.rate)
        scene = replace(scene, where=settled)
        first = int(np.flatnonzero(settled)[0])
        filter_ = zr.Attitude(scene.rate, mag=scene.mag is not None)
        follow = filter_.smooth if offline else filter_.trace
        trace = follow(scene.gyro, scene.accel, scene.mag)
        relative = first if scene.mag is None else None
        heading, tilt, where = outside.judged(scene, trace["quaternion"], relative)
        sigmas = trace["tilt_sigma"][where], trace["heading_sigma"][where]
        off = (tilt / sigmas[0], heading / sigmas[1])
        found.append([np.nanmean(np.square(one)) for one in (*off, *sigmas)])
    tilt, heading, *sigmas = np.sqrt(np.mean(found, axis=0))
    return tilt, heading, *np.degrees(sigmas)


def shown(tilt, heading, tilt_sigma, heading_sigma):
    """Return the cells of both ratios."""
    return f"{tilt:.2f} ({tilt_sigma:.2g})", f"{heading:.2f} ({heading_sigma:.2g})"


def main(folder):
    """Print the table."""
    rows = []
    for name, scenes, too in scenarios(folder):
        has_field = scenes[0].mag is not None
        nine = shown(*ratios(scenes, six=False)) if has_field else ("", "")
        plain = shown(*ratios(scenes, six=True)) if too or not has_field else ("", "")
        rows.append((name, *nine, *plain))
        print(*rows[-1], sep=" | ", flush=True)
    head = ("error over σ (σ, deg)", "nine axes: tilt", "heading", "six axes: tilt", "heading")
    print(table("Do the deviations hold?", head, rows, markdown=True))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Do the standard deviations of an attitude hold?")
    parser.add_argument("recordings", nargs="?", type=Path)
    main(parser.parse_args().recordings)
