"""Starts during motion: the motion that `auto` treats as rest, and the resulting error.

python benches/starts.py [FOLDER] [--rest-limit 10]

FOLDER has the recordings. A limit of 0 means no limit.
"""

import argparse
from pathlib import Path

import numpy as np

import zerorate as zr
from zerorate.simulation.motions import MOTIONS

BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"
BIAS, NOISE, SEEDS = 0.6, 0.1, 12
TURNS = 0.5


def measured(z, rate, bias, moves, limit):
    """Return the share of motion treated as rest, the bias error relative to zero, and the delay.

    The delay is the time from the start of the first rest after the motion until it is found, s. A
    value is NaN if it does not exist.
    """
    options = {"rest_limit": limit} if limit else {}
    trace = zr.DriftFilter(rate, method="auto", **options).trace(z)
    share = trace.at_rest[moves].mean() if moves.any() else np.nan
    worse = max(0.0, float((np.abs(trace.bias - bias) - abs(bias)).max()))
    first = np.flatnonzero(~moves)
    if not first.size:
        return share, worse, np.nan
    found = np.flatnonzero(
        trace.at_rest[first[0] :] & (np.abs(trace.bias[first[0] :] - bias) < 0.1)
    )
    return share, worse, found[0] / rate if found.size else np.inf


def hand(folder, limit):
    """Yield the results of three axes, each from the middle of every movement."""
    log = zr.read_recording(
        folder / "broad_05_undisturbed_slow_rotation_with_breaks_B.parquet", rate=2000.0 / 7.0
    ).gyro
    movement = zr.read_log(
        folder / "broad_05_undisturbed_slow_rotation_with_breaks_B.parquet",
        rate=2000.0 / 7.0,
        columns="movement",
    ).data[:, 0]
    moves, z = movement > 0.5, np.degrees(log.data)
    bias = z[: round(34.0 * log.rate)].mean(axis=0)
    edges = (np.flatnonzero(np.diff(moves.astype(int))) + 1).reshape(-1, 2)
    for first, last in edges:
        start = (first + last) // 2
        for axis in range(3):
            yield measured(z[start:, axis].copy(), log.rate, bias[axis], moves[start:], limit)


def shaft(folder, limit):
    """Yield the results of a shaft that rotates back and forth and never rests."""
    z = zr.read_log(
        folder / "mpu6050_encoder_yaw_slow_100hz.parquet", columns="shaft_gyro_z_dps"
    ).data[:, 0]
    for start in range(50, 1400, 150):
        rest = z[start * 100 :].copy()
        yield measured(rest, 100.0, 0.0, np.ones(rest.size, bool), limit)


def simulated(motion, limit):
    """Yield the results of at least 70 s of motion, followed by 20 s of rest."""
    rate = 200.0
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        turned = motion(rate, 90.0, seed)[round(rng.uniform(0.0, 20.0) * rate) :]
        turned = np.append(turned, np.zeros(4000))
        z = BIAS + turned + NOISE * rng.standard_normal(turned.size)
        moves = np.abs(turned) > TURNS
        share, worse, _ = measured(z, rate, BIAS, moves, limit)
        late = measured(z, rate, BIAS, np.arange(z.size) < z.size - 4000, limit)[2]
        yield share, worse, late


def main():
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    options.add_argument("folder", nargs="?", type=Path, default=BESIDE)
    options.add_argument("--rest-limit", type=float, default=10.0, help="deg/s, 0 for none")
    chosen = options.parse_args()
    print("share of the motion taken for rest, mean and worst; bias worse than none, deg/s; first")
    print(f"rest found, s, worst. Simulated motion is turning by more than {TURNS:g} deg/s.\n")
    cases = {
        "hand (BROAD 5), 12 starts": hand(chosen.folder, chosen.rest_limit),
        "shaft, 9 starts": shaft(chosen.folder, chosen.rest_limit),
    }
    for name, motion in MOTIONS.items():
        cases[f"simulated {name}, {SEEDS}"] = simulated(motion, chosen.rest_limit)
    for name, found in cases.items():
        shares, worse, late = np.array(list(found)).T
        print(
            f"{name:28}{shares.mean():8.4f}{shares.max():8.4f}{worse.max():9.3f}{late.max():8.2f}"
        )


if __name__ == "__main__":
    main()
