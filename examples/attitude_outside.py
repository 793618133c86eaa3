"""Attitude errors outside the laboratory, compared with vqf.

``python examples/attitude_outside.py [RECORDINGS]`` prints tables in Markdown. The simulated scenes
include cars, rate tables, quadrotors, bodies that never rest, and failing sensors. With the folder
of recordings, BROAD 05 and 32 are included, unchanged and changed.

Values are RMS errors in degrees, as means over the seeds. In brackets is the share of errors within
three standard deviations of the filter. vqf is left out if it is not installed.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import zerorate as zr
from tables import table

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support import faults, outside

try:
    from vqf import VQF, offlineVQF
except ImportError:
    VQF = None

IRON, STRONG_IRON = (3.6, -3.6, 3.0), np.array([10.0, -8.0, 7.5])
BROAD = {
    5: "broad_05_undisturbed_slow_rotation_with_breaks_B",
    32: "broad_32_disturbed_attached_magnet_1cm",
}
KNOCK, SILENCE = 22073, 26929
"""Rows of BROAD 05 during motion."""


class Own:
    """`zerorate.Attitude`."""

    def run(self, scene, offline=False):
        """Return orientations and standard deviations."""
        filter_ = zr.Attitude(scene.rate, mag=scene.mag is not None)
        follow = filter_.smooth if offline else filter_.trace
        return follow(scene.gyro, scene.accel, scene.mag)


class Theirs:
    """vqf, which returns no standard deviations."""

    def run(self, scene, offline=False):
        """Return orientations; None if a sample is missing, because vqf cannot process it."""
        sensors = (scene.gyro, scene.accel, scene.mag)
        gyro, accel, mag = (None if z is None else np.ascontiguousarray(z) for z in sensors)
        if not (np.isfinite(gyro).all() and np.isfinite(accel).all()):
            return None
        name = "quat6D" if mag is None else "quat9D"
        if offline:
            found = offlineVQF(gyro, accel, mag, 1.0 / scene.rate)
        else:
            found = VQF(1.0 / scene.rate).updateBatch(gyro, accel, mag)
        return {"quaternion": found[name]}


def six(scene):
    """Return a scene without its magnetometer."""
    return replace(scene, mag=None)


def of_heading(method, scenes, relative=None, offline=False):
    """Return a cell: heading error, and share within three standard deviations."""
    found, known = [], []
    for scene in scenes:
        trace = method.run(scene, offline)
        if trace is None:
            return ""
        off, _, where = outside.judged(scene, trace["quaternion"], relative)
        found.append(outside.rms(off))
        if "heading_sigma" in trace:
            known.append(np.mean(np.abs(off) < 3.0 * trace["heading_sigma"][where]))
    share = f" ({np.mean(known):.2f})" if known else ""
    return f"{np.mean(found):.1f}{share}"


def of_both(method, scenes, relative=None, offline=False):
    """Return a cell: inclination and heading errors, and share of tilt within three sigma."""
    found, known = [], []
    for scene in scenes:
        trace = method.run(scene, offline)
        if trace is None:
            return ""
        off, leaning, where = outside.judged(scene, trace["quaternion"], relative)
        found.append((outside.rms(leaning), outside.rms(off)))
        if "tilt_sigma" in trace:
            known.append(np.mean(leaning < 3.0 * trace["tilt_sigma"][where]))
    share = f" ({np.mean(known):.2f})" if known else ""
    return "{:.2f} / {:.2f}".format(*np.mean(found, axis=0)) + share


def level_scenes():
    """Yield name, scenes with a magnetometer, and True if six axes are informative, too."""
    yield "bends of 3 deg/s", [outside.bends(3.0, k) for k in range(3)], True
    yield "bends of 1.5 deg/s", [outside.bends(1.5, k) for k in range(3)], True
    for name, rates in (("20, 60, 200", (20.0, 60.0, 200.0)), ("1, 2, 5, 8", (1.0, 2.0, 5.0, 8.0))):
        tables = [outside.turntable(r, k) for r in rates for k in range(3)]
        yield f"table of {name} deg/s", tables, True
    for r in (1.0, 2.0, 5.0, 8.0):
        tables = [outside.turntable(r, k, still=True) for k in range(3)]
        yield f"table of {r:g} deg/s, nothing shakes", tables, True
    for r in (1.0, 2.0, 5.0, 20.0):
        tables = [outside.turntable(r, k, rest=0.0, still=True) for k in range(3)]
        yield f"the same of {r:g} deg/s, from the first sample on", tables, True
    for r in (0.5, 1.0, 2.0):
        scenes = [outside.swerve(r, k) for k in (0, 1)]
        yield f"swerve, the bias jumps by {r:g} deg/s", scenes, False
    yield (
        "it grows by 0.01 deg/s² to 1",
        [outside.swerve(1.0, k, grows=0.01) for k in (0, 1)],
        False,
    )
    yield "half the rates, 1 deg/s", [outside.swerve(1.0, k, share=0.5) for k in (0, 1)], False
    rests = [outside.swerve(1.0, k, rest=(200.0, 220.0), seconds=400.0) for k in (0, 1)]
    yield "1 deg/s, and a rest", rests, False
    places = {"": {}, ", rooms of 2 uT": {"room": 2.0}, ", of 4 uT": {"room": 4.0}}
    for r, told in ((0.0, "city"), (1.0, "city, the bias jumps by 1 deg/s")):
        for place, more in {**places, ", iron of 6 uT": {"iron": IRON}}.items():
            yield told + place, [outside.city(k, r=r, **more) for k in (0, 1)], not place


def drives():
    """Yield name and simulated scenes of cars near iron."""
    for iron in (0.0, 0.1, 0.25, 0.5):
        for cars in (False, True):
            for jump in (0.0, 1.0):
                told = (
                    f"iron of {iron:g} of the field" if iron else "no iron",
                    *(["other cars pass"] if cars else []),
                    *(["the bias jumps by 1 deg/s"] if jump else []),
                )
                scenes = [outside.drive(k, iron=iron, cars=cars, jump=jump) for k in range(8)]
                yield ", ".join(told), scenes


def recorded(folder, trial):
    """Return a trial of BROAD, scored in motion."""
    recording = zr.read_recording(folder / f"{BROAD[trial]}.parquet", 2000.0 / 7.0)
    gyro, accel, mag = (recording[name].data for name in ("gyro", "accel", "mag"))
    where = zr.read_log(
        folder / f"{BROAD[trial]}.parquet", rate=2000.0 / 7.0, columns="movement"
    ).data[:, 0]
    return outside.Scene(2000.0 / 7.0, gyro, accel, mag, recording["reference"].data, where > 0.5)


def changes(scene):
    """Yield the name of each change of a recording, and the changed recording."""
    yield "as it is", scene
    yield "knocked by 30 deg", outside.knocked(scene, KNOCK)
    yield "the gyro gives zeros for 3 s", outside.silenced(scene, SILENCE)
    yield "bias + 1 deg/s an axis, in motion", outside.biased(scene, (1.0, -1.0, 1.0), KNOCK)
    yield "bias + 3 deg/s an axis, in motion", outside.biased(scene, (3.0, -3.0, 3.0), KNOCK)
    yield "clipped at 250 deg/s", outside.clipped(scene)
    yield "the last sample again for 0.3 s in 10", outside.held(scene)
    yield "all missing for 0.3 s in 10", outside.held(scene, value=np.nan)


def cropped(scene, bias, rest):
    """Return a recording with `rest` seconds before its first motion, and with a bias."""
    first = np.flatnonzero(scene.where)[0]
    whole = outside.biased(scene, np.array([0.3, 0.5, 0.81]) * bias)
    return whole.cropped(max(first - round(rest * scene.rate), 0))


def under_way():
    """Yield name and scenes of bodies that never rest."""
    for kind in ("robot", "car"):
        for bias in (0.3, 1.0):
            scenes = [faults.under_way(kind, seed, bias) for seed in range(16)]
            yield f"{kind} that never rests, bias of {bias:g} deg/s", scenes


def speeding_up():
    """Yield name and scenes of bodies that speed up for some seconds."""
    for tilt, lift in ((20.0, 0.0), (35.0, 0.0), (20.0, 1.0), (35.0, 1.0)):
        name = f"drone, tilts to {tilt:g} deg" + (", climbs and falls" if lift else "")
        yield name, [faults.fast_drone(tilt, seed, lift=lift) for seed in range(6)]
    for push, lasts in ((0.7, 60.0), (1.5, 60.0), (2.5, 35.0), (4.0, 15.0)):
        scenes = [faults.pushed(push, lasts, ramp=ramp) for ramp in (0.5, 1.5, 6.0)]
        yield f"{push:g} m/s² for {lasts:g} s", scenes
    rough = [(2.5, 35.0, 100.0), (3.5, 12.0, 100.0), (2.5, 35.0, 10.0), (3.5, 12.0, 10.0)]
    scenes = [faults.pushed(p, s, shaken=3.0, noise=3.0, rate=rate) for p, s, rate in rough]
    yield "a rough road, 2.5 and 3.5 m/s²", scenes


def failing():
    """Yield name and scenes with failing sensors or disturbed fields."""
    hand = faults.hand(100.0, 60.0)
    yield "hand, as it is", [hand]
    spoilt = [faults.garbage(hand, 2000, v, axis) for v in (500.0, 2e3, 2e4) for axis in (0, 2)]
    yield "one garbage sample of the gyro", spoilt
    yield "the magnetometer freezes after 5 s", [faults.held_field(hand, 1, 500)]
    for every in (50, 100):
        yield f"it is held for {every / 100.0:g} s each time", [faults.held_field(hand, every)]
    for angle, lasts in ((50.0, 8.0), (90.0, 4.0), (50.0, 15.0)):
        scenes = [faults.passing(angle, lasts, seed) for seed in range(3)]
        yield f"car, the field turns by {angle:g} deg for {lasts:g} s", scenes
    for size in (12.0, 25.0):
        scenes = [faults.big_bias(size, axis) for axis in ((1.0, -0.5, 0.3), (0.1, 0.1, 1.0))]
        yield f"hand, bias of {size:g} deg/s", scenes


def printed(title, methods, rows):
    """Print a table with a column of cells for each method."""
    body = [(name, *(of(method) for method in methods.values())) for name, of in rows]
    print(table(title, ("", *methods), body, markdown=True), end="\n\n")


def main(arguments):
    """Print the tables."""
    methods = {"vqf": Theirs()} if VQF else {}
    methods["zerorate"] = Own()
    rows = list(level_scenes())
    nine = [(name, lambda m, s=scenes: of_heading(m, s)) for name, scenes, _ in rows]
    printed("Level bodies, nine axes: heading", methods, nine)
    plain = [
        (name, lambda m, s=scenes: of_heading(m, map(six, s))) for name, scenes, too in rows if too
    ]
    printed("The same, six axes: heading", methods, plain)
    near = [(name, lambda m, s=scenes: of_heading(m, s)) for name, scenes in drives()]
    printed("Cars near iron, nine axes: heading", methods, near)
    flights = [outside.hover(k, *of) for k, of in enumerate(outside.FLIGHTS)]
    still = [outside.hover(k, *of, shift=0.0) for k, of in enumerate(outside.FLIGHTS)]
    hovers = [
        ("live", lambda m: of_both(m, flights, 10)),
        ("live, no shift of the bias in flight", lambda m: of_both(m, still, 10)),
        ("offline", lambda m: of_both(m, flights, 10, offline=True)),
    ]
    printed("Quadrotors, six axes: inclination / heading", methods, hovers)
    never = [(name, lambda m, s=scenes: of_heading(m, s, None)) for name, scenes in under_way()]
    printed("Bodies that never rest, six axes: heading", methods, never)
    pushes = [(name, lambda m, s=scenes: of_both(m, s)) for name, scenes in speeding_up()]
    printed("Bodies that speed up, six axes: inclination / heading", methods, pushes)
    broken = [(name, lambda m, s=scenes: of_heading(m, s)) for name, scenes in failing()]
    printed("Sensors and fields that fail, nine axes: heading", methods, broken)
    if arguments.recordings is None:
        return
    for trial in BROAD:
        scene = recorded(arguments.recordings, trial)
        first = int(np.flatnonzero(scene.where)[0])
        changed = list(changes(six(scene)))
        told = [(name, lambda m, s=s, f=first: of_both(m, [s], f)) for name, s in changed]
        printed(f"BROAD {trial:02d}, six axes: inclination / heading", methods, told)
        iron = outside.with_iron(scene, STRONG_IRON)
        told = [
            ("as it is", lambda m, s=scene: of_heading(m, [s])),
            ("iron of 15 uT", lambda m, s=iron: of_heading(m, [s])),
            *(
                (name, lambda m, s=s: of_heading(m, [s]))
                for name, s in changes(scene)
                if name.startswith("bias")
            ),
        ]
        printed(f"BROAD {trial:02d}, nine axes: heading", methods, told)
    scene = six(recorded(arguments.recordings, 5))
    for offline in (False, True):
        told = []
        for bias, rest in ((0, 99.0), (5, 99.0), (5, 0.8), (5, 2.0), (5, 3.0), (10, 2.0)):
            one = cropped(scene, bias, rest)
            first = int(np.flatnonzero(one.where)[0])
            name = f"bias {bias} deg/s, {'all' if rest > 50.0 else f'{rest:g} s'} of rest"
            told.append((name, lambda m, s=one, f=first, o=offline: of_both(m, [s], f, o)))
        way = "offline" if offline else "live"
        printed(f"BROAD 05, six axes, {way}: inclination / heading", methods, told)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="How true the attitude is outside the laboratory")
    parser.add_argument("recordings", nargs="?", type=Path)
    main(parser.parse_args())
