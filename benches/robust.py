"""Effect of outliers, stuck sensors and motion on a filter, as in ``docs/evidence/robust.md``.

python benches/robust.py [FOLDER] [--methods auto,fading] [--part degradation ...] [--whole]

FOLDER has the recordings. `robust_before.json` has the results of `auto` before its ticks were
robust. ``--record`` writes this file again.
"""

import argparse
import json
import math
import sys
from functools import cache
from pathlib import Path

import numpy as np

import zerorate as zr
from zerorate import metrics
from zerorate.simulation import Contamination
from zerorate.tasks.compare import compare_methods, read_trial
from zerorate.tasks.compare.methods import filter_arguments
from zerorate.tasks.compare.rest import HORIZONS, scoring_start
from zerorate.tasks.compare.simulated import run

BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"
BEFORE = Path(__file__).with_name("robust_before.json")
RESTING = {
    "ADIS16405": "adis16405_static_100hz_run1.parquet",
    "MPU-6050": "mpu6050_static_100hz.parquet",
}
MOVED = "broad_05_undisturbed_slow_rotation_with_breaks_B.parquet"
MOVED_RATE = 2000.0 / 7.0
RATE = 100.0
CUT = 2000.0
SEEDS = (1, 2)

# Contamination, and the mean and largest degradation of `auto` in the study of the methods: in
# the earlier version, and with the first version of the gate.
CASES = (
    ("", (1.000, 1.000), (0.999, 1.004)),
    ("share=0.001,size=100", (1.27, 2.02), (1.000, 1.004)),
    ("share=0.01,size=10", (1.12, 1.67), (0.996, 1.011)),
    ("share=0.01,size=100", (1.79, 2.99), (0.996, 1.011)),
    ("share=0.02,size=10,one-sided", (6.1, 11.8), (1.003, 1.014)),
    ("share=0.05,size=20", (1.70, 2.86), (1.009, 1.049)),
    ("share=0.05,size=100,one-sided", (107.0, 2771.0), (1.008, 1.049)),
    ("size=30,burst=20", (1.01, 1.08), (1.01, 1.05)),
)
ASKED = {
    "": (1.003, 1.01),
    "share=0.01,size=10": (1.01, 1.08),
    "share=0.01,size=100": (1.01, 1.08),
    "share=0.05,size=100,one-sided": (1.03, 1.12),
}

STUCK = ("stuck=10,at-zero", "stuck=10")
STUCK_FROM = (20.0, 60.0, 200.0)
NEAR = 0.01
SHOCK = 350.0


@cache
def axes(folder, whole):
    """Return name and samples, deg/s, of every axis at rest; the first 2000 s unless `whole`."""
    found = {}
    for sensor, file in RESTING.items():
        log = zr.read_log(folder / file, rate=RATE)
        n = len(log.data) if whole else round(CUT * RATE)
        for axis, z in zip("xyz", log.data.T, strict=True):
            found[f"{sensor} {axis}"] = np.ascontiguousarray(z[:n])
    return found


def drift_filter(method):
    return zr.DriftFilter(RATE, output="estimate", **filter_arguments(method))


def estimate(method, z):
    """Return the bias that a method would hold while coasting."""
    return metrics.running_mean(z) if method == "mean" else drift_filter(method).process(z)


def coasting(clean, held):
    """Return the coasting error at each horizon, relative to the clean record."""
    start = round(scoring_start(clean.size / RATE) * RATE)
    z, x = clean[start:], held[start:]
    return np.array([metrics.coasting_error(z, x, RATE, h) for h in HORIZONS])


def contaminated(text, z, seed):
    return Contamination.parse(text).apply(z, RATE, seed) if text else z


def lost(method, folder, whole, text):
    """Return the coasting errors on contaminated records by axis, shape (seeds, horizons)."""
    seeds = SEEDS if text else SEEDS[:1]
    return {
        axis: np.array([coasting(z, estimate(method, contaminated(text, z, s))) for s in seeds])
        for axis, z in axes(folder, whole).items()
    }


def over(errors, least):
    """Return mean and maximum of the errors relative to the smallest errors, both by axis."""
    ratios = np.concatenate([(errors[axis] / least[axis]).ravel() for axis in errors])
    return ratios.mean(), ratios.max()


def pair(values):
    return f"{values[0]:9.4g}{values[1]:10.4g}" if values else f"{'-':>9}{'-':>10}"


def degradation(folder, methods, whole, before):
    length = "whole" if whole else f"first {CUT:g} s"
    print(f"Coasting error at 10 and 60 s, six axes ({length}), over that on the clean record")
    print("mean and worst over axes, horizons and two seeds\n")
    reference = {axis: np.array(e) for axis, e in before["coasting"][length].items()}
    for method in methods:
        clean = lost(method, folder, whole, "")
        print(f"{method:32}{'own clean':>19}{'auto before':>19}", end="")
        print(f"{'study, before':>19}{'study, gate':>19}{'asked':>19}" if method == "auto" else "")
        for text, was, reached in CASES:
            errors = lost(method, folder, whole, text)
            told = pair(over(errors, clean)) + pair(over(errors, reference))
            asked = pair(was) + pair(reached) + pair(ASKED.get(text)) if method == "auto" else ""
            print(f"{text or 'none':32}{told}{asked}", flush=True)
        print()


def back(method, z, text, begin):
    """Return the time after a fault until the bias stays near the bias of the clean record, s."""
    fault = Contamination.parse(text)
    middle = 2 * round(begin * RATE)
    wrong = np.concatenate([fault.apply(z[:middle], RATE, seed=1), z[middle:]])
    end = fault.stuck_span(middle, RATE).stop
    clean, found = (estimate(method, x)[end:] for x in (z, wrong))
    far = np.flatnonzero(~(np.abs(found - clean) < NEAR))
    if not far.size:
        return 0.0
    return math.inf if far[-1] + 1 == clean.size else (far[-1] + 1) / RATE


def stuck(folder, methods, whole, before):
    print(f"Seconds until the bias is within {NEAR:g} deg/s for good after 10 s stuck from t on")
    print("inf: not before the record ends; asked for auto: at zero <= 15; study: 590 and 165\n")
    named = axes(folder, whole)
    print(f"{'':32}{'t, s':>6}" + "".join(f"{axis:>13}" for axis in named))
    for method in methods:
        for text in STUCK:
            for begin in STUCK_FROM:
                times = "".join(f"{back(method, z, text, begin):13.2f}" for z in named.values())
                print(f"{f'{method}, {text}':32}{begin:6g}{times}", flush=True)
    print()


def moved(folder, methods):
    """Return the error growth at 60 s, deg, and the shares of rest, in total and in motion."""
    trial = read_trial(folder / MOVED, rate=MOVED_RATE)
    (found,) = compare_methods([trial], methods)
    growth = {row.method: math.degrees(row.values["growth_60"]) for row in found.rows}
    log = trial.log
    moving = zr.read_log(folder / MOVED, rate=MOVED_RATE, columns=["movement"]).data[:, 0] > 0.5
    told = {}
    for method in methods:
        traces = [
            zr.DriftFilter(log.rate, **filter_arguments(method)).trace(np.ascontiguousarray(z))
            for z in log.data.T
        ]
        rest = np.column_stack([trace.at_rest for trace in traces])
        told[method] = (growth[method], rest.mean(), rest[moving].mean())
    return told


def motion(folder, methods, whole, before):
    print("Hand motion (BROAD 05): orientation growth at 60 s, deg; share at rest, all and moving")
    print("asked for auto: within 1 % and 0.005 of before\n")
    for method, (growth, rest, moving) in moved(folder, methods).items():
        print(f"{method:32}{growth:12.4f}{rest:12.4f}{moving:12.4f}")
    if (was := before.get("motion")) is not None:
        print(f"{'auto before':32}" + "".join(f"{value:12.4f}" for value in was))
    print()


def regret(folder, methods, whole, before):
    print(
        "Simulated gyros, 12 seeds: RMSE over that of the optimum; asked: mean at most 0.005 more"
    )
    print()
    found = run(methods, progress=waiting)
    print(f"{'':32}" + "".join(f"{method:>14}" for method in methods) + f"{'auto before':>14}")
    was = before.get("regret", {})
    for model, row in zip(found.models, found.regret, strict=True):
        print(f"{model.name:32}" + cells([*row, was.get(model.name, math.nan)]))
    names = [
        model.name for model, kept in zip(found.models, found.lasting_mask, strict=True) if kept
    ]
    known = [was[name] for name in names if name in was]
    print(f"{'mean':32}" + cells([*found.mean, np.mean(known) if known else math.nan]))
    print(f"{'worst':32}" + cells([*found.worst, max(known, default=math.nan)]))
    print()


def cells(values):
    return "".join(f"{value:14.4f}" for value in values)


def waiting(step, fraction):
    if sys.stderr.isatty():
        print(f"\r{step:24}{100 * fraction:4.0f} %", end="", file=sys.stderr)


def shift(method, present, z):
    """Return the largest bias step from one tick with only a few samples at 350 deg/s."""
    f = drift_filter(method)
    half = z.size // 2
    level = float(f.process(z[:half])[-1])
    tick = np.full(25, np.nan)
    tick[:present] = SHOCK
    found = f.trace(np.concatenate([tick, z[half:]]))
    return float(np.abs(found.bias - level).max()), bool(found.at_rest.all())


def short(folder, methods, whole, before):
    print(
        f"A tick of missing samples but 1, 2, 3 at {SHOCK:g} deg/s: shift of the bias, deg/s, and"
    )
    print("whether it says at rest throughout; study before: 0.50, 1.06, 1.69\n")
    noise = 0.1 * np.random.default_rng(1).standard_normal(12_000)
    for method in methods:
        found = [shift(method, present, noise) for present in (1, 2, 3)]
        told = "".join(f"{by:10.3f} {'rest' if rest else 'motion':6}" for by, rest in found)
        print(f"{method:32}{told}")
    print()


PARTS = {part.__name__: part for part in (degradation, stuck, motion, regret, short)}


def record(folder):
    """Write the current results of `auto`."""
    errors = {
        "whole" if whole else f"first {CUT:g} s": {
            axis: found[0].tolist() for axis, found in lost("auto", folder, whole, "").items()
        }
        for whole in (False, True)
    }
    found = run(["auto"], progress=waiting)
    regrets = zip(found.models, found.regret[:, 0].tolist(), strict=True)
    content = {
        "about": "auto before its ticks were robust: coasting errors at 10 and 60 s in deg, regret "
        "on simulated gyros (12 seeds), orientation growth at 60 s in deg and shares at rest",
        "coasting": errors,
        "motion": moved(folder, ["auto"])["auto"],
        "regret": {model.name: value for model, value in regrets},
    }
    BEFORE.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def parsed():
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    options.add_argument("folder", nargs="?", type=Path, default=BESIDE)
    options.add_argument("--methods", default="auto", type=lambda text: text.split(","))
    options.add_argument("--part", action="append", choices=PARTS, help="default: all")
    options.add_argument("--whole", action="store_true", help="all of the ADIS16405's 10 000 s")
    options.add_argument("--record", action="store_true", help="write robust_before.json")
    return options.parse_args()


def main():
    chosen = parsed()
    if chosen.record:
        record(chosen.folder)
    before = json.loads(BEFORE.read_text(encoding="utf-8"))
    for part in chosen.part or PARTS:
        PARTS[part](chosen.folder, chosen.methods, chosen.whole, before)


if __name__ == "__main__":
    main()
