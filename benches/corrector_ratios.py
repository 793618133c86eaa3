"""Speed of ImuCorrector relative to C, in one run: ``python benches/corrector_ratios.py``.

C writes into existing memory and does not handle missing samples. ImuCorrector returns new arrays.
Each row is the minimum of several rounds. Every round times every row once, so that a disturbance
of the machine affects all rows equally.
"""

import ctypes

import numpy as np

import peers
import zerorate as zr
from ratios import least, print_table, seconds_per_sample
from versions import print_versions

N = 1_000_000
CALLS = 50_000

RNG = np.random.default_rng(1)
ARGUMENTS = {
    "gyro_matrix": np.eye(3) + 0.01 * RNG.standard_normal((3, 3)),
    "gyro_bias": RNG.standard_normal(3),
    "accel_matrix": np.eye(3) + 0.01 * RNG.standard_normal((3, 3)),
    "accel_bias": RNG.standard_normal(3),
    "g_sensitivity": 0.01 * RNG.standard_normal((3, 3)),
    "temperature": {
        "reference": 25.0,
        "range": (-1.0, 1.0),
        "coefficients": RNG.standard_normal((3, 4)),
    },
}
NEEDED = {3: 2, 6: 5, 7: 6}


def corrector(width, **options):
    used = dict(list(ARGUMENTS.items())[: NEEDED[width]])
    return zr.ImuCorrector(**used, **options)


class InC:
    """Reference implementation in C, compiled with ``flags``."""

    def __init__(self, width, *flags):
        name = "corrector" + "".join(flags).replace("=", "-") + ".so"
        source = peers.SOURCE.with_name("corrector.c")
        library = ctypes.CDLL(str(peers.compile_library(name, *flags, source=source)))
        pointer = np.ctypeslib.ndpointer(np.float64, flags="C")
        outputs = 1 if width == 3 else 2
        self.run = getattr(library, f"correct_{width}")
        self.run.argtypes = [pointer, pointer, ctypes.c_size_t, *([pointer] * outputs)]
        self.run.restype = None
        curve = ARGUMENTS["temperature"]
        numbers = [ARGUMENTS[name] for name in list(ARGUMENTS)[:5]]
        numbers += [curve["reference"], curve["range"], curve["coefficients"]]
        self.correction = np.concatenate([np.ravel(number) for number in numbers])
        self.out = [np.empty((N, 3)) for _ in range(outputs)]

    def __call__(self, z):
        self.run(self.correction, z, len(z), *self.out)
        return [out[: len(z)] for out in self.out]


def check(z):
    """Check that all implementations are right before they are timed."""
    for width in NEEDED:
        expected = InC(width, "-O3")(z[width])
        found = corrector(width).process(z[width])
        for got, floor in zip(found if width > 3 else [found], expected, strict=True):
            np.testing.assert_allclose(got, floor, rtol=1e-12, atol=1e-12)


def one_by_one(width):
    update = corrector(width).update

    def run(z):
        for row in z.tolist():
            update(row)

    return run


def rows(z):
    """Return name, function, and sample rows for each row of the table."""
    for width in NEEDED:
        yield f"copy of {width} numbers in NumPy", np.copy, z[width]
        yield f"C, native, {width} numbers", InC(width, "-O3", "-march=native"), z[width]
        yield f"C, generic x86-64, {width} numbers", InC(width, "-O3"), z[width]
        yield f"ImuCorrector.process, {width} numbers", corrector(width).process, z[width]
    out = np.empty((N, 3))
    yield "the same, 3 numbers, out=", lambda z: corrector(3).process(z, out=out[: len(z)]), z[3]
    for width in NEEDED:
        yield f"ImuCorrector.update, {width} numbers", one_by_one(width), z[width][:CALLS]


def main():
    print_versions("cc")
    z = {width: RNG.standard_normal((N, width)) for width in NEEDED}
    check({width: samples[:1000] for width, samples in z.items()})
    timed = list(rows(z))
    for _, run, samples in timed:
        run(samples[:1000])
    seconds = least([lambda run=run, z=z: seconds_per_sample(run, z) for _, run, z in timed])
    print_table("A sample of a record", [name for name, *_ in timed], seconds)


if __name__ == "__main__":
    main()
