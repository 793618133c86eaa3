"""Results of the foot filter for a cart that drives and stops, and the limits of a rule for it.

``python examples/foot_machine.py`` simulates carts at 200 Hz. They drive 3 to 15 s at 0.3 to 1 m/s,
with gentle ramps and curves. Then they stop for 2 to 4 s. The floor is level, or its slope changes
by hundredths of a degree. The first table in Markdown has the errors of the foot filter;
`zr.FootNavigation` refuses such motion or adds a note. The second table has the signs of the stops
in force and rate.
"""

import numpy as np

from tables import table
from zerorate._native import foot_track

RATE = 200.0
SECONDS = 200.0
SEEDS = range(6)
GRAVITY = 9.81
NOISE = (np.radians(0.1), 0.03)
"""Noise of a sample at rest, rad/s and m/s²."""
MOTOR = (np.radians(1.0), 0.3)
"""Additional noise from a motor, rad/s and m/s²."""
FIRST = 2.5
"""Length of the first rest that shows the noise at rest, s."""


def eased(s):
    """Return a smooth step from 0 to 1."""
    s = np.clip(s, 0.0, 1.0)
    return s**2 * (3.0 - 2.0 * s)


def cart(seed, shaken, slope=0.0):
    """Return gyro and accelerometer (forward, left, up), true positions, m, and speed, m/s."""
    draws = np.random.default_rng(seed)
    n = round(SECONDS * RATE)
    speed, turn, pitch = np.zeros((3, n))
    k, before = round(3.0 * RATE), 0.0
    while k < n:
        lasts, cruise = draws.uniform(3.0, 15.0), draws.uniform(0.3, 1.0)
        ramp = min(draws.uniform(1.0, 2.5), lasts / 2.2)
        t = np.arange(round(lasts * RATE)) / RATE
        end = min(n, k + len(t))
        leg = cruise * eased(t / ramp) * eased((lasts - t) / ramp)
        wheel = draws.uniform(-1.2, 1.2) * (draws.random() < 0.6)
        bend = wheel * np.gradient(eased(t / lasts), 1.0 / RATE)
        after = slope * draws.standard_normal()
        speed[k:end], turn[k:end] = leg[: end - k], bend[: end - k]
        pitch[k:] = after
        pitch[k:end] = (before + (after - before) * eased(t / lasts))[: end - k]
        before, k = after, end + round(draws.uniform(2.0, 4.0) * RATE)
    yaw = np.cumsum(turn) / RATE
    place = np.cumsum(np.column_stack([speed * np.cos(yaw), speed * np.sin(yaw)]), axis=0) / RATE
    gyro = np.column_stack([np.zeros(n), np.gradient(pitch, 1.0 / RATE), turn])
    ahead = np.gradient(speed, 1.0 / RATE) - GRAVITY * np.sin(pitch)
    force = np.column_stack([ahead, speed * turn, GRAVITY * np.cos(pitch)])
    moves = (speed > 1e-3) * shaken
    for values, noise, motor in ((gyro, NOISE[0], MOTOR[0]), (force, NOISE[1], MOTOR[1])):
        white = draws.standard_normal((2, n, 3))
        values += noise * white[0] + motor * moves[:, np.newaxis] * white[1]
    return gyro + np.radians(draws.normal(0.0, 0.2, 3)), force, place, speed


def as_a_foot(gyro, force, place):
    """Return the end error of the foot filter, relative to the path and to its sigma."""
    time = np.arange(len(gyro)) / RATE
    found, _ = foot_track(time, gyro, force, False, False, False)
    off = np.hypot(*(found["position"][-1, :2] * [1.0, -1.0] - place[-1]))
    way = np.hypot(*np.diff(place, axis=0).T).sum()
    return off / way, off / np.hypot(*found["sigma"][-1, :2])


def quiet(gyro, force):
    """Return the mask where rate and force are as quiet and constant as in the first rest."""
    first = slice(0, round(FIRST * RATE))
    half = round(0.15 * RATE)
    box = np.ones(2 * half + 1) / (2 * half + 1)
    fits = np.ones(len(gyro), bool)
    for values in (gyro, force):
        mean = np.column_stack([np.convolve(axis, box, "same") for axis in values.T])
        spread = np.convolve(((values - mean) ** 2).sum(axis=1), box, "same")
        fits &= spread < 1.3 * spread[first].mean()
        step = np.abs(mean[2 * half :] - mean[: -2 * half]) / (
            values[first].std(axis=0) * np.sqrt(2.0 * box[0])
        )
        jumps = np.ones(len(gyro), bool)
        jumps[half:-half] = (step > 4.0).any(axis=1)
        fits &= np.convolve(jumps, np.ones(round(RATE)), "same") < 0.5
    return fits


def stop_speeds(force, speed):
    """Return the speed from the force at each stop, with zero speed at the previous rest, m/s."""
    stands = speed <= 1e-3
    edges = np.flatnonzero(np.diff(stands.astype(int)))
    begins, ends = edges[~stands[edges]] + 1, edges[stands[edges]] + 1
    found = []
    for leave in ends:
        later = begins[begins > leave]
        if later.size:
            level = force[max(leave - round(RATE), 0) : leave, 0].mean()
            found.append((force[leave : later[0], 0] - level).sum() / RATE)
    return found


def main():
    """Print the tables."""
    rows = []
    for name, shaken in (("motors shake", True), ("perfectly smooth", False)):
        told = np.array([as_a_foot(*cart(seed, shaken)[:3]) for seed in SEEDS])
        rows.append((name, f"{100 * np.median(told[:, 0]):.0f}", f"{np.median(told[:, 1]):.0f}"))
    head = "cart", "end error, % of the way", "over its sigma"
    print(table("Taken for a foot, medians of six carts", head, rows, markdown=True))
    rows = []
    for slope in (0.0, 0.05, 0.1, 0.3):
        shares, speeds = [], []
        for seed in SEEDS:
            gyro, force, _, speed = cart(seed, False, np.radians(slope))
            rests = quiet(gyro, force)
            shares.append(np.mean(speed[rests] > 0.05))
            speeds += stop_speeds(force, speed)
        rows.append((f"{slope:g}", f"{np.mean(shares):.2f}", f"{np.std(speeds):.2f}"))
    head = "slope, deg", "of quiet moments it moves in", "speed at stops by the force, rms m/s"
    print(table("Smooth carts", head, rows, markdown=True))


if __name__ == "__main__":
    main()
