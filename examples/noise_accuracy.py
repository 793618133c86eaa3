"""Errors of fitted noise coefficients, and the coverage of their intervals.

``python examples/noise_accuracy.py [SEEDS]`` prints a table in Markdown for simulated records of 10
000 s at 100 Hz with known coefficients. Errors are RMS over the seeds.

``python examples/noise_accuracy.py lengths [SEEDS]`` prints the coefficients that records of one
minute to ten hours determine.
"""

import sys

import numpy as np

import zerorate as zr

RATE, DURATION = 100.0, 10_000.0
LENGTHS = {"1 min": 60.0, "10 min": 600.0, "1 h": 3600.0, "3 h": 10_800.0, "10 h": 36_000.0}
FIELDS = ("quantization", "angle_random_walk", "bias_instability", "rate_random_walk")
LETTERS = dict(zip(FIELDS, "QNBK", strict=True))
MODELS = {
    **{name: device.noise for name, device in zr.simulation.DEVICES.items()},
    "strong walk": zr.NoiseModel(1e-4, 2e-5, 1e-5),
    "no flicker": zr.NoiseModel(1e-4, 0.0, 5e-6),
    "quantised": zr.NoiseModel(2e-5, 1e-5, quantization=1e-5),
}


def peer(z):
    """Fit with the package allan-variance, if it is installed."""
    try:
        import allan_variance
    except ImportError:
        return None
    parameters, _ = allan_variance.estimate_parameters(*allan_variance.compute_avar(z, 1.0 / RATE))
    return dict(zip(FIELDS, parameters[:4], strict=True))


def fits(model, seed):
    """Return all fits of one record."""
    z, _ = zr.simulate(model, RATE, DURATION, seed)
    curve = zr.allan(z, RATE, unit="rad/s")
    return curve.fit(), zr.noise.whittle(z, RATE, unit="rad/s"), curve.fit("polynomial"), peer(z)


def error(found, truth):
    """Return the RMS of the relative errors, in percent."""
    return f"{100.0 * np.sqrt(np.mean((np.array(found) / truth - 1.0) ** 2)):.2g} %"


def row(name, field, truth, runs):
    """Return a row of the table for one term of one model."""
    curve, whittle, polynomial, others = zip(*runs, strict=True)
    ours = [getattr(model, field) for model in curve]
    second = [getattr(model, field) for model in whittle]
    known = np.array([c.identifiable for c in ours])
    held = np.array([abs(c - truth) <= c.sigma for c in ours])
    cells = [
        name,
        LETTERS[field],
        f"{known.mean():.0%}",
        error(ours, truth),
        f"{held[known].mean():.0%}" if known.any() else "-",
        f"{np.mean([c.upper_bound >= truth for c in ours]):.0%}",
        error(second, truth),
        error([getattr(model, field) for model in polynomial], truth),
        "-" if others[0] is None else error([other[field] for other in others], truth),
    ]
    return "| " + " | ".join(cells) + " |"


def length_row(name, length, truth, found):
    """Return a row of the other table for records of one length and one model."""
    white = [model.angle_random_walk for model in found]
    cells = [name, length, error(white, truth.angle_random_walk)]
    for field in ("bias_instability", "rate_random_walk"):
        coefficients = [getattr(model, field) for model in found]
        bounds = np.array([c.upper_bound for c in coefficients]) / getattr(truth, field)
        cells += [f"{np.mean([c.identifiable for c in coefficients]):.0%}"]
        cells += [error(coefficients, getattr(truth, field)), f"{np.median(bounds):.2g}"]
    return "| " + " | ".join(cells) + " |"


def lengths(seeds):
    """Print the coefficients that records of each length determine."""
    print("| record | length | N | B identifiable | B | B bound | K identifiable | K | K bound |")
    print("| --- | ---: " + "| ---: " * 7 + "|")
    longest = max(LENGTHS.values())
    for number, (name, device) in enumerate(zr.simulation.DEVICES.items()):
        records = [
            zr.simulate(device.noise, RATE, longest, 5000 + 1000 * number + seed)[0]
            for seed in range(seeds)
        ]
        for length, seconds in LENGTHS.items():
            parts = (z[: round(seconds * RATE)] for z in records)
            found = [zr.allan(z, RATE, unit="rad/s").fit() for z in parts]
            print(length_row(name, length, device.noise, found), flush=True)


def main():
    """Print the requested table."""
    arguments = sys.argv[1:]
    if arguments[:1] == ["lengths"]:
        lengths(int(arguments[1]) if len(arguments) > 1 else 20)
    else:
        accuracy(int(arguments[0]) if arguments else 20)


def accuracy(seeds):
    """Print the errors of the fits."""
    head = "record, term, identifiable, fit, interval holds, bound holds, Whittle, polynomial"
    print("| " + " | ".join([*head.split(", "), "allan-variance"]) + " |")
    print("| --- | --- " + "| ---: " * 7 + "|")
    for number, (name, model) in enumerate(MODELS.items()):
        runs = [fits(model, 1000 * number + seed) for seed in range(seeds)]
        for field in FIELDS:
            truth = float(getattr(model, field))
            if truth > 0.0:
                print(row(name, field, truth, runs), flush=True)


if __name__ == "__main__":
    main()
