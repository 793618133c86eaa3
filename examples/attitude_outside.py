"""How true the attitude is outside the laboratory, beside vqf and an earlier build.

``python examples/attitude_outside.py [RECORDINGS] [--released _native.abi3.so]`` prints tables in
Markdown: bends, rate tables, swerves, a car in a city, cars near iron, quadrotors and, where the
folder of recordings is given, BROAD 05 and 32 as they are and changed. Degrees, root mean squares,
mean of the seeds; in brackets the share of errors within three of the filter's own standard
deviations. vqf is left out where it is not installed.
"""

import argparse
import importlib.machinery
import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import zerorate as zr
from tables import table
from zerorate.linear.run import LinearRun
from zerorate.navigation.processing import processed
from zerorate.record.missing import without_masks
from zerorate.units import convert

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support import outside

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
"""Rows of BROAD 05 in the midst of motion."""


class Own:
    """`zerorate.Attitude`, of this build or of another."""

    def __init__(self, kind=zr.Attitude):
        self.kind = kind

    def run(self, scene, offline=False):
        """Return orientations and deviations."""
        filter_ = self.kind(scene.rate, mag=scene.mag is not None)
        follow = filter_.smooth if offline else filter_.trace
        return follow(scene.gyro, scene.accel, scene.mag)


class Theirs:
    """vqf, which says no deviations."""

    def run(self, scene, offline=False):
        """Return orientations, None where a sample is missing: it takes none such."""
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


def released(path, name="Attitude"):
    """Return a filter of another build."""
    loader = importlib.machinery.ExtensionFileLoader("zerorate._native", str(path))
    spec = importlib.util.spec_from_loader("zerorate._native", loader)
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    module.register(
        convert=convert, without_masks=without_masks, linear_run=LinearRun, navigate=processed
    )
    return getattr(module, name)


def six(scene):
    """Return it without its magnetometer."""
    return replace(scene, mag=None)


def of_heading(method, scenes, relative=None, offline=False):
    """Return a cell: error of the heading, and how well it is known."""
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
    """Return a cell: errors of inclination and heading, and how well the tilt is known."""
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
    """Yield name, scenes with a magnetometer, and whether six axes say something too."""
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
    """Yield name and scenes of cars near iron, as simulated motion has them."""
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
    """Return a trial of BROAD, whose motion counts."""
    recording = zr.read_recording(folder / f"{BROAD[trial]}.parquet", 2000.0 / 7.0)
    gyro, accel, mag = (recording[name].data for name in ("gyro", "accel", "mag"))
    where = zr.read_log(
        folder / f"{BROAD[trial]}.parquet", rate=2000.0 / 7.0, columns="movement"
    ).data[:, 0]
    return outside.Scene(2000.0 / 7.0, gyro, accel, mag, recording["reference"].data, where > 0.5)


def changes(scene):
    """Yield what is changed in a recording, and the recording."""
    yield "as it is", scene
    yield "knocked by 30 deg", outside.knocked(scene, KNOCK)
    yield "the gyro gives zeros for 3 s", outside.silenced(scene, SILENCE)
    yield "bias + 1 deg/s an axis, in motion", outside.biased(scene, (1.0, -1.0, 1.0), KNOCK)
    yield "bias + 3 deg/s an axis, in motion", outside.biased(scene, (3.0, -3.0, 3.0), KNOCK)
    yield "clipped at 250 deg/s", outside.clipped(scene)
    yield "the last sample again for 0.3 s in 10", outside.held(scene)
    yield "all missing for 0.3 s in 10", outside.held(scene, value=np.nan)


def cropped(scene, bias, rest):
    """Return a recording with so many seconds of rest before its first motion, and a bias."""
    first = np.flatnonzero(scene.where)[0]
    whole = outside.biased(scene, np.array([0.3, 0.5, 0.81]) * bias)
    return whole.cropped(max(first - round(rest * scene.rate), 0))


def printed(title, methods, rows):
    """Print a table of cells by method."""
    body = [(name, *(of(method) for method in methods.values())) for name, of in rows]
    print(table(title, ("", *methods), body, markdown=True), end="\n\n")


def main(arguments):
    """Print the tables."""
    methods = {"vqf": Theirs()} if VQF else {}
    if arguments.released:
        methods["before"] = Own(released(arguments.released))
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
    parser.add_argument("--released", type=Path)
    main(parser.parse_args())
