"""Accuracy of a foot's track, on recorded walks with a reference and on simulated walks.

``python examples/foot_study.py [FOLDER]`` prints its tables in Markdown, and draws the figure of
`docs/how-to/walk.md`. The rows on other bodies, starts, climbs, lifts and splices come from
`foot_trials.py`. FOLDER has the recordings ``foot_*_200hz.parquet`` (sensors on a shoe, with motion
capture or control points; mtahakoroglu/LLIO-aided-iPyShoe). Default: ../shared/data next to the
checkout.
"""

import math
import resource
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

import foot_trials as trials
import zerorate as zr
from recordings import BESIDE
from tables import table
from zerorate.record.samples import Samples
from zerorate.show import save_figure

NAMES = (
    "vicon_20171122112203",
    "vicon_20171122114044",
    "vicon_20171127111153",
    "vicon_20171127112512",
    "vicon_20171215180305",
    "walk_SensorConnectData_37",
    "walk_SensorConnectData_35",
)
EVERY = 50
"""Number of motion-capture samples between two points of the reference."""
FIGURE = Path(__file__).resolve().parents[1] / "docs" / "figures" / "foot_track.png"
WALKS = 40
NOISE = math.radians(0.05)
RELATIVE = 0.001
"""White noise that the filter assumes for the gyro, rad/s/sqrt(Hz), and its increase by rate."""
BIAS = math.radians(0.3)
RANGE = math.radians(500.0)
"""Range that the live filter may assume for the gyros, rad/s."""


def reference(path):
    """Return the samples with a reference, and its positions, m, as complex numbers."""
    columns = pq.read_table(path, columns=["ref_x_m", "ref_y_m"]).columns
    x, y = (column.to_numpy().astype(float) for column in columns)
    known = np.flatnonzero(np.isfinite(x))
    if "vicon" in path.name:
        known = np.unique(np.append(known[::EVERY], known[-1]))
    return known, x[known] + 1j * y[known]


def errors(z, truth):
    """Return RMS and end error, m, of a path rotated about its start to fit its reference."""
    z, w = z - z[0], truth - truth[0]
    turn = (np.conj(z) * w).sum()
    off = np.abs(z * turn / abs(turn) - w)
    return math.sqrt(np.mean(off**2)), off[-1]


def live(path, known, truth, gyro_range=None):
    """Return RMS and end error, m, of the live filter, with its output corrected for its delay."""
    samples = Samples.of(zr.read_recording(path), mag=False)
    foot = zr.FootFilter(200.0, floor="level", gyro_range=gyro_range)
    told = foot.process(samples.gyro, samples.accel)
    late = round(foot.delay * foot.rate)
    place = np.vstack([told[late:], np.repeat(told[-1:], late, axis=0)])
    there = np.isfinite(place[known, 0])
    z, w = place[known[there], :2] @ [1.0, 1j], truth[there]
    return errors(z, w)


def recorded(folder, **options):
    """Yield each recording's name, length, m, and tracks of the filter and the smoother."""
    for name in NAMES:
        path = folder / f"foot_{name}_200hz.parquet"
        known, truth = reference(path)
        length = np.abs(np.diff(truth)).sum()
        track = zr.FootNavigation(**options).process(zr.read_recording(path))
        ways = [one.position[known, :2] @ [1.0, 1j] for one in (track, track.smooth())]
        yield name, length, track, [errors(way, truth) for way in ways]


def recorded_rows(folder):
    """Yield the rows of the recorded walks."""
    for name, length, track, (forward, smoothed) in recorded(folder, floor="level"):
        path = folder / f"foot_{name}_200hz.parquet"
        now = live(path, *reference(path))
        limits = sorted({round(math.degrees(one.limit)) for one in track.clipped})
        yield (
            name,
            f"{length:.1f}",
            str(len(track.stances)),
            ", ".join(map(str, limits)),
            f"{now[0]:.3f} / {forward[0]:.3f} / {smoothed[0]:.3f}",
            " / ".join(f"{100 * one[1] / length:.2f}" for one in (now, forward, smoothed)),
            f"{np.hypot(*track.sigma[-1, :2]):.2f}",
        )


def tail_rows(folder):
    """Yield mean, median, 90 % and 95 % of horizontal errors, m: RMS, and at the end."""
    found = {name: [] for name in ("live", "live, range stated", "filter", "smoothed")}
    for name, _, _, ways in recorded(folder, floor="level"):
        path = folder / f"foot_{name}_200hz.parquet"
        known, truth = reference(path)
        both = live(path, known, truth), live(path, known, truth, RANGE), *ways
        for values, way in zip(found.values(), both, strict=True):
            values.append(way)
    for name, values in found.items():
        columns = np.array(values).T
        parts = [
            " / ".join(f"{x:.3f}" for x in (column.mean(), *np.quantile(column, [0.5, 0.9, 0.95])))
            for column in columns
        ]
        yield name, *parts


def part_rows(folder):
    """Yield mean end errors with one part of the filter left out."""
    parts = {
        "all": {"floor": "level"},
        "no level floor": {},
        "clipped rates as they are": {"floor": "level", "restore": False},
    }
    for name, options in parts.items():
        found = [100 * both[1][1] / length for _, length, _, both in recorded(folder, **options)]
        yield name, *(f"{np.mean(part):.2f}" for part in (found[:5], found[5:]))


def simulated(seed, *, rest, noise, relative, bias, strides=57):
    """Return a walk and its track, for a gyro with additional noise by its rate."""
    walk = zr.simulate_walk(strides=strides, seed=seed, rest=rest, gyro_noise=noise, gyro_bias=bias)
    draws = np.random.default_rng(1000 + seed)
    size = relative * math.sqrt(walk.rate) * np.linalg.norm(walk.gyro, axis=1)
    gyro = walk.gyro + size[:, np.newaxis] * draws.standard_normal(walk.gyro.shape)
    logs = walk.recording().logs
    shown = zr.Log.at(walk.time, walk.rate, gyro, logs["gyro"].names, "rad/s", {})
    recording = zr.Recording({**logs, "gyro": shown}, "simulated walk")
    return walk, zr.FootNavigation().process(recording, keep="track")


def heading(quaternion):
    """Return headings, rad."""
    w, x, y, z = quaternion.T
    return np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def simulated_rows():
    """Yield errors after a minute next to the filter's standard deviations."""
    cases = {
        "consumer gyro, rest before": (2.0, NOISE, RELATIVE, BIAS),
        "consumer gyro, no rest": (0.0, NOISE, RELATIVE, BIAS),
        "a twentieth of the noise, rest before": (2.0, NOISE / 20, RELATIVE / 20, BIAS),
    }
    for name, (rest, noise, relative, bias) in cases.items():
        turned, told, off, far = [], [], [], []
        for seed in range(WALKS):
            walk, track = simulated(seed, rest=rest, noise=noise, relative=relative, bias=bias)
            turned.append(heading(track.quaternion[-1:])[0])
            told.append(track.sigma[-1, 8])
            off.append((track.position - walk.position)[-1, :2])
            far.append(track.sigma[-1, :2])
        turned, told, off, far = map(np.array, (turned, told, off, far))
        yield (
            name,
            f"{np.degrees(np.sqrt(np.mean(turned**2))):.2f}",
            f"{np.degrees(told.mean()):.2f}",
            f"{np.mean(np.abs(turned) < told):.2f}",
            f"{np.sqrt(np.mean(off**2)):.2f}",
            f"{np.sqrt(np.mean(far**2)):.2f}",
            f"{np.mean(np.abs(off) < far):.2f}",
        )


def hour_rows():
    """Yield the processor time for an hour at 200 Hz, also live, and the end error."""
    walk = zr.simulate_walk(strides=3425, seed=0, turn=0.05, gyro_noise=NOISE)
    recording = walk.recording()
    begun = time.process_time()
    track = zr.FootNavigation(floor="level").process(recording)
    forward = time.process_time() - begun
    begun = time.process_time()
    best = track.smooth()
    smoothed = time.process_time() - begun
    foot = zr.FootFilter(walk.rate, floor="level", gyro_range=RANGE)
    begun = time.process_time()
    foot.process(walk.gyro, walk.accel)
    each = 1e6 * (time.process_time() - begun) / len(walk.time)
    off = np.hypot(*(best.position - walk.position)[-1, :2])
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    yield (
        f"{walk.time[-1]:.0f}",
        f"{walk.distance:.0f}",
        f"{off:.1f}",
        f"{np.hypot(*best.sigma[-1, :2]):.1f}",
        f"{forward:.1f}",
        f"{smoothed:.1f}",
        f"{peak:.0f}",
        f"{each:.2f}",
    )


def draw(folder):
    """Draw the figure of the how-to."""
    path = folder / "foot_walk_SensorConnectData_37_200hz.parquet"
    track = zr.FootNavigation(floor="level").process(zr.read_recording(path)).smooth()
    save_figure(track.plot(), FIGURE)


TABLES = (
    (
        "Recorded walks, live / filter / smoothed",
        ("recording", "m", "stances", "clipped at", "rmse m", "end %", "sigma m"),
        recorded_rows,
    ),
    (
        "Errors in the plane, m: mean / median / p90 / p95 of the recorded walks",
        ("filter", "rmse", "end"),
        tail_rows,
    ),
    (
        "Mean end error, %, smoothed",
        ("filter", "five with motion capture", "two with control points"),
        part_rows,
    ),
    (
        f"{WALKS} simulated minutes",
        ("sensor", "heading deg", "sigma", "within sigma", "end m", "sigma", "within sigma"),
        lambda _: simulated_rows(),
    ),
    (
        "Is it a foot?",
        ("body", "count", "share", "navigated", "noted", "refused", "never swings"),
        trials.body_rows,
    ),
    (
        "Begun at a random moment",
        ("walks", "count", "climb off m", "beyond 3 sigma", "over sigma", "end off m"),
        trials.start_rows,
    ),
    (
        "Climb of level walks over its deviation, rms (largest)",
        ("gyro", "recorded", "simulated"),
        trials.climb_rows,
    ),
    (
        "Errors over deviations, rms, after a minute",
        ("start", "Hz", "lost %", "along", "across", "up", "heading"),
        lambda _: trials.consistency_rows(),
    ),
    ("Lifts", ("", "count", "found once", "height off m", "median %"), trials.lift_rows),
    (
        "Two walks joined, sensors mounted otherwise",
        ("splices", "strides until right", "rejections", "live", "noted"),
        lambda _: trials.splice_rows(),
    ),
    (
        "A simulated hour",
        ("s", "m", "end m", "sigma m", "filter s", "smoother s", "peak MB", "live µs a sample"),
        lambda _: hour_rows(),
    ),
)


def main(folder):
    """Print the tables."""
    for title, head, rows in TABLES:
        print(table(title, head, rows(folder), markdown=True), flush=True)
    draw(folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else BESIDE)
