"""Linear Kalman filter compared with filterpy and simdkalman: ``python benches/linear_ratios.py``.

Each row is the minimum of several rounds. Every round times every row once, so that a disturbance
of the machine affects all rows equally. The timed code predicts and corrects once per sample.
zerorate and filterpy use Joseph's form.
"""

import time

import numpy as np

import zerorate as zr
from peers import filterpy_filter
from ratios import least, print_table
from versions import print_versions

SIZES = [(2, 1), (4, 2), (6, 3), (8, 4), (10, 5)]
STEPS, CALLS, FILTERPY_STEPS = 20_000, 20_000, 500
FILTERS, FILTER_STEPS = 1024, 200


def model(n, m):
    rng = np.random.default_rng([n, m])
    F = rng.standard_normal((n, n))
    F *= 0.98 / np.abs(np.linalg.eigvals(F)).max()
    return {
        "F": F,
        "H": rng.standard_normal((m, n)),
        "Q": 0.1 * np.eye(n),
        "R": np.eye(m),
        "x0": np.zeros(n),
        "P0": np.eye(n),
    }


def of(arguments, **options):
    return zr.LinearKalman(**arguments, **options)


def seconds(work, count):
    start = time.perf_counter()
    work()
    return (time.perf_counter() - start) / count


def batch(arguments, z, keep):
    kf = of(arguments)
    return lambda: seconds(lambda: kf.process(z, keep=keep), len(z))


def calls(arguments, z):
    """Return a pair of calls, with the samples in the form that a loop has."""
    kf = of(arguments)
    rows = z[:CALLS, 0].tolist() if z.shape[1] == 1 else list(z[:CALLS])

    def work():
        predict, update = kf.predict, kf.update
        for row in rows:
            predict()
            update(row)

    return lambda: seconds(work, len(rows))


def filterpy(arguments, z, version):
    m, n = arguments["H"].shape
    kf = filterpy_filter(version)(dim_x=n, dim_z=m)
    kf.x, kf.P = arguments["x0"][:, np.newaxis], arguments["P0"]
    for name in "FHQR":
        setattr(kf, name, arguments[name])
    rows = z[:FILTERPY_STEPS, :, np.newaxis]

    def work():
        for row in rows:
            kf.predict()
            kf.update(row)

    return lambda: seconds(work, len(rows))


def many(arguments, z, keep):
    kf = of(arguments, channels=z.shape[1])
    return lambda: seconds(lambda: kf.process(z, keep=keep), z[..., 0].size)


def simdkalman(arguments, z):
    import simdkalman

    names = ["state_transition", "observation_model", "process_noise", "observation_noise"]
    given = dict(zip(names, (arguments[name] for name in "FHQR"), strict=True))
    kf = simdkalman.KalmanFilter(**given)
    records = np.ascontiguousarray(z.swapaxes(0, 1))

    def work():
        kf.compute(
            records,
            0,
            initial_value=arguments["x0"],
            initial_covariance=arguments["P0"],
            filtered=True,
            smoothed=False,
        )

    return lambda: seconds(work, z[..., 0].size)


def main():
    print_versions("filterpy", "filterpy 2", "simdkalman")
    rng = np.random.default_rng(1)
    for n, m in SIZES:
        arguments, z = model(n, m), rng.standard_normal((STEPS, m))
        rows = {
            "filterpy 1": filterpy(arguments, z, 1),
            "filterpy 2": filterpy(arguments, z, 2),
            "process, states kept": batch(arguments, z, "state"),
            "process, all kept": batch(arguments, z, "all"),
            "predict and update, two calls": calls(arguments, z),
        }
        print_table(f"{n} states, {m} measurements: a step", list(rows), least(list(rows.values())))
    arguments, z = model(3, 1), rng.standard_normal((FILTER_STEPS, FILTERS, 1))
    apart = np.where(rng.random(z.shape) < 0.1, np.nan, z)
    rows = {
        "simdkalman": simdkalman(arguments, z),
        "process, states kept": many(arguments, z, "state"),
        "process, all kept": many(arguments, z, "all"),
        "all kept, 10 % missing": many(arguments, apart, "all"),
    }
    title = f"{FILTERS} filters of 3 states: a filter and step"
    print_table(title, list(rows), least(list(rows.values())))


if __name__ == "__main__":
    main()
