"""How close fitted coefficients come to the truth, and how often their intervals hold it.

``python examples/noise_accuracy.py [SEEDS]`` prints a table in Markdown: simulated records of
10 000 s at 100 Hz, whose coefficients are known. Errors are root mean squares over the seeds.
"""

import sys

import numpy as np

import zerorate as zr

RATE, DURATION = 100.0, 10_000.0
FIELDS = ("quantization", "angle_random_walk", "bias_instability", "rate_random_walk")
LETTERS = dict(zip(FIELDS, "QNBK", strict=True))
MODELS = {
    **{name: device.noise for name, device in zr.DEVICES.items()},
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
    """Return one record's fits of every kind."""
    z, _ = zr.simulate(model, RATE, DURATION, seed)
    curve = zr.allan(z, RATE)
    return curve.fit(), zr.whittle(z, RATE), curve.fit("polynomial"), peer(z)


def error(found, truth):
    """Return the root mean square of relative errors, in per cent."""
    return f"{100.0 * np.sqrt(np.mean((np.array(found) / truth - 1.0) ** 2)):.2g} %"


def row(name, field, truth, runs):
    """Return a line of the table: one term of one model."""
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


def main():
    """Print the table."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 20
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
