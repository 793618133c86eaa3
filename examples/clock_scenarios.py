"""Clock of a receiver in drives with faults.

``python examples/clock_scenarios.py`` prints a table in Markdown, in half a minute. Each row has 24
simulated drives. The clocks of positions and velocities differ from the sensors' clock by up to 0.3
s. The errors of `find_time_offset` are next to its standard deviations.
"""

from dataclasses import replace

import numpy as np

import zerorate as zr
from navigation_studies import many, rms
from tables import table
from zerorate.navigation import find_start, find_time_offset
from zerorate.record import TimeOffset

RATE, DURATION = 50.0, 200.0
DRIVES = range(300, 324)
ONE_DEGREE = 111e3
"""Length of a degree of latitude, m."""


def main():
    """Print the table."""
    rows = [row(name, *scenario) for name, scenario in SCENARIOS.items()]
    head = ("drives of 200 s", "told", "position, s RMS", "in deviations: RMS, worst")
    head += ("velocity, s RMS", "in deviations: RMS, worst")
    print(table("Clocks", head, rows, markdown=True))


def row(name, options, spoil):
    """Return the results for a scenario."""
    found = np.array(many(lambda seed: off(seed, options, spoil), DRIVES))
    told = found[np.isfinite(found[:, 0])]
    cells = [name, f"{len(told)} of {len(found)}"]
    for errors, sigma in ((told[:, 0], told[:, 1]), (told[:, 2], told[:, 3])):
        normalised = errors / sigma
        cells += [f"{rms(errors):.4f}", f"{rms(normalised):.2f}, {np.abs(normalised).max():.1f}"]
    return cells


def off(seed, options, spoil):
    """Return the errors of both offsets with standard deviations; NaN if none is reported."""
    random = np.random.default_rng([seed, 77])
    true = random.uniform(-0.3, 0.3, 2)
    if spoil is together:
        true[1] = true[0]
    clocks = TimeOffset(true[0], 0.0, true[1], 0.0)
    told = {"duration": DURATION} | options
    drive = zr.simulate_drive(RATE, seed=seed, time_offset=clocks, **told)
    fixes = spoil(drive.fixes, random)
    imu = drive.recording()
    found = find_time_offset(imu, fixes, find_start(imu, fixes))
    if not found.identifiable:
        return np.full(4, np.nan)
    late, velocity_late = np.array([found.seconds, found.velocity_seconds]) - true
    return late, found.sigma, velocity_late, found.velocity_sigma


def as_they_are(fixes, random):
    """Return the fixes of a good receiver."""
    return fixes


def together(fixes, random):
    """Return the fixes unchanged; both clocks are the same."""
    return fixes


def outliers(fixes, random):
    """Return fixes with errors of about 30 m in one position of twenty."""
    position, bad = fixes.position.copy(), random.random(len(fixes)) < 0.05
    position[bad, :2] += random.standard_normal((bad.sum(), 2)) * 3e-4
    return replace(fixes, position=position)


def wrong_velocities(fixes, random):
    """Return fixes with errors of about 3 m/s in one velocity of twenty."""
    velocity, bad = fixes.velocity.copy(), random.random(len(fixes)) < 0.05
    velocity[bad] += random.standard_normal((bad.sum(), 3)) * 3.0
    return replace(fixes, velocity=velocity)


def tunnel(fixes, random):
    """Return fixes with a gap of 40 s."""
    outside = (fixes.time < 80.0) | (fixes.time > 120.0)
    parts = ("time", "position", "velocity", "position_sigma", "velocity_sigma")
    return replace(fixes, **{name: getattr(fixes, name)[outside] for name in parts})


def jitter(fixes, random):
    """Return fixes with independent time errors of up to 20 ms."""
    return replace(fixes, time=fixes.time + random.uniform(-0.02, 0.02, len(fixes)))


def walking(fixes, random):
    """Return fixes with a random walk of the positions, 0.3 m per fix."""
    position = fixes.position.copy()
    walk = np.cumsum(random.standard_normal((len(fixes), 2)), axis=0)
    position[:, :2] += walk * 0.3 / ONE_DEGREE
    return replace(fixes, position=position)


SCENARIOS = {
    "two clocks": ({}, as_they_are),
    "one clock": ({}, together),
    "400 s": ({"duration": 400.0}, as_they_are),
    "one fix in twenty some 30 m off": ({}, outliers),
    "one velocity in twenty some 3 m/s off": ({}, wrong_velocities),
    "a tunnel of 40 s": ({}, tunnel),
    "stamps 20 ms off": ({}, jitter),
    "positions that walk 0.3 m a fix": ({}, walking),
    "ten fixes a second": ({"fixes_rate": 10.0}, as_they_are),
    "RTK of 2 cm at 4 Hz": (
        {"position_sigma": 0.02, "velocity_sigma": 0.05, "fixes_rate": 4.0},
        as_they_are,
    ),
    "5 s of rest at the start": ({"rest": 5.0}, as_they_are),
    "sensors without noise": ({"gyro": None, "accel": None}, as_they_are),
}


if __name__ == "__main__":
    main()
