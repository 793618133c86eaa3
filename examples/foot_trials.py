"""Rows of the study of feet on other bodies and on walks with faults.

`foot_study.py` prints them. Each function yields rows of text, with bodies from `foot_bodies.py`.
"""

import math
from collections import Counter, defaultdict

import numpy as np

import foot_bodies as bodies
import zerorate as zr
from zerorate.record import LogError
from zerorate.record.samples import Samples

BODIES = 10
"""Number of simulated bodies of each kind."""
CUTS = 20
"""Number of moments at which each recording is started."""
LOST = 0.02
"""Share of lost samples."""
HANDS = {"broad_05*": 2000.0 / 7.0, "broad_32*": 2000.0 / 7.0, "drive_imu*": 100.0}


def samples_of(path, rate=None):
    """Return times, rates and forces of a recording."""
    samples = Samples.of(zr.read_recording(path, rate=rate), mag=False)
    return samples.time, samples.gyro, samples.accel


def navigated(time, gyro, accel, **options):
    """Return the track of these samples."""
    rate = (len(time) - 1) / (time[-1] - time[0])
    return zr.FootNavigation(**options).process(bodies.recording(time, rate, gyro, accel))


def verdict(time, gyro, accel):
    """Return the share and the verdict: navigated, noted, refused or without swings."""
    track = navigated(time, gyro, accel, assume_foot=True)
    try:
        navigated(time, gyro, accel)
    except LogError:
        return track.foot_share, "refused"
    if not track.swings.are_judged:
        return track.foot_share, "never swings"
    doubted = any("foot" in note for note in track.notes)
    return track.foot_share, "noted" if doubted else "navigated"


def body_rows(folder):
    """Yield for each kind of body the number, the shares, and the verdicts."""
    groups = defaultdict(list)
    for path in sorted(folder.glob("foot_*.parquet")):
        groups["recorded feet"].append(verdict(*samples_of(path)))
    for pattern, rate in HANDS.items():
        (path,) = folder.glob(pattern)
        groups["recorded hands and car"].append(verdict(*samples_of(path, rate)))
    for kinds, body in ((bodies.FEET, bodies.foot), (bodies.OTHERS, bodies.other)):
        for kind in kinds:
            for seed in range(BODIES):
                _, _, *samples = body(seed, kind)
                group = f"foot, {kind}" if body is bodies.foot else kind
                groups[group].append(verdict(*samples))
    for name, found in groups.items():
        shares, words = zip(*found, strict=True)
        count = Counter(words)
        low, median, high = np.nanquantile([*shares, math.nan][:-1], [0.0, 0.5, 1.0])
        order = ("navigated", "noted", "refused", "never swings")
        yield (
            name,
            str(len(found)),
            f"{low:.2f} / {median:.2f} / {high:.2f}",
            *(str(count[word]) for word in order),
        )


def begun_later(samples, k):
    """Return the climb error, its sigma, and the horizontal end error of a track started at k."""
    time, gyro, accel = samples
    whole = navigated(*samples, assume_foot=True).position
    track = navigated(time[k:], gyro[k:], accel[k:])
    climb = track.position[-1, 2] - (whole[-1] - whole[k])[2]
    z, w = (values @ [1.0, 1j] for values in (track.position[:, :2], whole[k:, :2]))
    turn = (np.conj(z - z[0]) * (w - w[0])).sum()
    plane = abs((z[-1] - z[0]) * turn / abs(turn) - (w[-1] - w[0]))
    return abs(climb), track.sigma[-1, 2], plane


def start_rows(folder):
    """Yield the errors of walks started at a random moment, relative to the whole walks."""
    draws = np.random.default_rng(5)
    groups = {"recorded": [samples_of(path) for path in sorted(folder.glob("foot_*.parquet"))]}
    for kind in ("walking", "running"):
        groups[f"simulated, {kind}"] = [
            bodies.foot(seed, kind, 200.0, 25.0)[2:] for seed in range(7)
        ]
    for name, walks in groups.items():
        found = [
            begun_later(walk, round(len(walk[0]) * draws.uniform(0.2, 0.45)))
            for walk in walks
            for _ in range(CUTS if name == "recorded" else CUTS // 2)
        ]
        climb, sigma, plane = np.array(found).T
        yield (
            name,
            str(len(found)),
            f"{np.quantile(climb, 0.9):.2f} / {climb.max():.2f}",
            f"{np.mean(climb > 3.0 * sigma):.3f}",
            f"{math.sqrt(np.mean((climb / sigma) ** 2)):.2f}",
            f"{np.quantile(plane, 0.9):.2f} / {plane.max():.2f}",
        )


def climb_rows(folder):
    """Yield the climb of level walks over its sigma, for gyros that are clipped afterwards."""
    paths = sorted(folder.glob("foot_*.parquet"))
    for limit in (math.inf, 400.0, 250.0, 125.0):
        most = math.radians(limit)
        recorded = []
        for path in paths:
            time, gyro, accel = samples_of(path)
            track = navigated(time, np.clip(gyro, -most, most), accel, assume_foot=True)
            recorded.append(track.position[-1, 2] / track.sigma[-1, 2])
        made = []
        for seed in range(20):
            walk = zr.simulate_walk(
                strides=40, seed=seed, turn=0.1, gyro_noise=math.radians(0.05), gyro_range=most
            )
            track = zr.FootNavigation(assume_foot=True).process(walk.recording())
            made.append((track.position - walk.position)[-1, 2] / track.sigma[-1, 2])
        yield (
            "not clipped" if math.isinf(limit) else f"{limit:.0f} deg/s",
            *(
                f"{math.sqrt(np.mean(np.square(ratios))):.2f} ({np.abs(ratios).max():.1f})"
                for ratios in (recorded, made)
            ),
        )


def consistency_rows():
    """Yield errors over sigma after a minute: across, along, up, heading."""
    for rest in (2.0, 0.0):
        for rate in (50.0, 100.0, 200.0, 400.0):
            for lost in (0.0, LOST):
                yield consistency_row(rest, rate, lost)


def consistency_row(rest, rate, lost, walks=20):
    """Return the row for a rate, with or without a rest and lost samples."""
    ratios = []
    for seed in range(walks):
        noise, bias = math.radians(0.05), math.radians(0.3)
        walk = zr.simulate_walk(
            rate, 57, seed=seed, rest=rest, gyro_noise=noise, gyro_bias=bias, accel_noise=0.03
        )
        draws = np.random.default_rng(1000 + seed)
        size = 0.001 * math.sqrt(rate) * np.linalg.norm(walk.gyro, axis=1)
        gyro = walk.gyro + size[:, np.newaxis] * draws.standard_normal(walk.gyro.shape)
        gyro[draws.random(len(gyro)) < lost] = math.nan
        track = navigated(walk.time, gyro, walk.accel)
        w, x, y, z = track.quaternion[-1]
        heading = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        off = [*(track.position - walk.position)[-1], heading]
        ratios.append(np.array(off) / track.sigma[-1, [0, 1, 2, 8]])
    size = np.sqrt(np.mean(np.square(ratios), axis=0))
    name = "after a rest" if rest else "never at rest"
    return name, f"{rate:.0f}", f"{100.0 * lost:.0f}", *(f"{x:.2f}" for x in size)


def lift_rows(folder, rides=80):
    """Yield the counts of found and false lift rides, and the errors of their heights."""
    found, errors, truth = 0, [], []
    for seed in range(rides):
        *samples, height = bodies.lift(seed)
        seen = navigated(*samples).rides
        if len(seen) == 1:
            found += 1
            errors.append(seen[0].height - height)
            truth.append(height)
    off = np.array(errors)
    share = np.median(np.abs(off / truth))
    yield (
        "rides",
        str(rides),
        str(found),
        f"{math.sqrt(np.mean(off**2)):.2f}",
        f"{100.0 * share:.1f}",
    )
    walks = [samples_of(path) for path in sorted(folder.glob("foot_*.parquet"))]
    walks += [bodies.foot(seed)[2:] for seed in range(rides)]
    false = sum(bool(navigated(*walk, assume_foot=True).rides) for walk in walks)
    yield "walks", str(len(walks)), str(false), "", ""


def splice_rows(splices=40):
    """Yield the strides until stances are used after a seam, and rejections; also live."""
    strides, rejected, live, said = [], [], [], 0
    for seed in range(splices):
        time, gyro, accel, seam = bodies.spliced(seed)
        track = navigated(time, gyro, accel, assume_foot=True)
        after = track.lowest[time[track.lowest] > seam]
        wrong = np.flatnonzero(np.linalg.norm(track.velocity[after], axis=1) > 0.3)
        strides.append(int(wrong[-1]) + 1 if wrong.size else 0)
        rejected.append(track.rejection_count)
        said += any("level was wrong" in note for note in track.notes)
        foot = zr.FootFilter(100.0)
        foot.process(gyro, accel)
        live.append(foot.rejection_count)
    yield (
        str(splices),
        f"{np.median(strides):.0f} / {max(strides)}",
        f"{np.median(rejected):.0f} / {max(rejected)}",
        f"{np.median(live):.0f} / {max(live)}",
        str(said),
    )
