"""Speed of StreamingAllan relative to C, in one run: ``python benches/streaming_ratios.py``.

C computes the Allan variance only, StreamingAllan computes Allan and Hadamard variances. Each row
is the minimum of several rounds. Every round times every row once, so that a disturbance of the
machine affects all rows equally.
"""

import ctypes

import numpy as np

import peers
import zerorate as zr
from ratios import least, print_table, seconds_per_sample
from versions import print_versions

N = 1_000_000
CALLS = 50_000


class InC:
    """Reference implementation in C, compiled with ``flags``."""

    def __init__(self, octaves, *flags):
        name = "streaming" + "".join(flags).replace("=", "-") + ".so"
        source = peers.SOURCE.with_name("streaming.c")
        library = ctypes.CDLL(str(peers.compile_library(name, *flags, source=source)))
        pointer = np.ctypeslib.ndpointer(np.float64, flags="C")
        library.allan_new.restype = ctypes.c_void_p
        library.allan_new.argtypes = [ctypes.c_size_t]
        library.allan_process.argtypes = [ctypes.c_void_p, pointer, ctypes.c_size_t]
        library.allan_variances.argtypes = [ctypes.c_void_p, pointer]
        self.library, self.octaves = library, octaves
        self.state = library.allan_new(octaves)

    def process(self, z):
        self.library.allan_process(self.state, z, z.size)

    def deviation(self):
        variances = np.empty(self.octaves)
        self.library.allan_variances(self.state, variances)
        return np.sqrt(variances)


def check(z, octaves=16):
    """Check that both implementations are right before they are timed."""
    floor, allan = InC(octaves, "-O3"), zr.StreamingAllan(100.0, octaves)
    floor.process(z)
    allan.process(z)
    np.testing.assert_allclose(allan.deviation, floor.deviation(), rtol=1e-9)


def one_by_one(octaves):
    allan = zr.StreamingAllan(100.0, octaves)

    def run(z):
        for sample in z.tolist():
            allan.update(sample)

    return run


def main():
    print_versions("cc")
    z = np.random.default_rng(1).standard_normal(N)
    check(z)
    rows = [
        ("C, native, 16 octaves, Allan alone", InC(16, "-O3", "-march=native").process, N),
        ("C, generic x86-64, 16 octaves", InC(16, "-O3").process, N),
        *(
            (f"StreamingAllan, {j} octaves", zr.StreamingAllan(100.0, j).process, N)
            for j in (8, 12, 16, 20)
        ),
        ("StreamingAllan.update, 16 octaves", one_by_one(16), CALLS),
    ]
    for _, run, _ in rows:
        run(z)  # fill the rings
    timed = [lambda run=run, n=n: seconds_per_sample(run, z[:n]) for _, run, n in rows]
    print_table("A sample of a stream", [name for name, *_ in rows], least(timed))


if __name__ == "__main__":
    main()
