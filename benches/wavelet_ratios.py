"""Wavelet denoising compared with PyWavelets, in one run: ``python benches/wavelet_ratios.py``.

Each row is the minimum of several rounds. Every round times every row once, so that a disturbance
of the machine affects all rows equally. PyWavelets cannot process streams. Its row for a block
therefore transforms the last 64 samples again for each block of 32.
"""

import numpy as np
import pywt

import zerorate as zr
from ratios import least, print_table, seconds_per_sample
from versions import print_versions

N = 1_000_000
CALLS = 20_000
BLOCK = 32
RATE = 200.0


def visushrink(wavelet, level):
    def run(z):
        rest, *details = pywt.wavedec(z, wavelet, "symmetric", level)
        sigma = np.median(np.abs(details[-1])) / 0.674490
        t = sigma * np.sqrt(2.0 * np.log(z.size))
        details = [pywt.threshold(d, t, "soft") for d in details]
        return pywt.waverec([rest, *details], wavelet, "symmetric")[: z.size]

    return run


def check(z):
    """Check that both implementations are right before they are timed."""
    np.testing.assert_allclose(zr.denoise(z, "db4", 5).signal, visushrink("db4", 5)(z), atol=1e-11)


def live(wavelet, level):
    denoiser = zr.WaveletDenoiser(RATE, wavelet, level)
    denoiser.process(np.random.default_rng(2).standard_normal(20_000))
    return denoiser


def blocks(wavelet, level):
    """Return the time of a call with 32 samples, s."""
    denoiser, out = live(wavelet, level), np.empty(BLOCK)

    def run(z):
        for first in range(0, z.size, BLOCK):
            denoiser.process(z[first : first + BLOCK], out)

    return run


def one_by_one(wavelet, level):
    denoiser = live(wavelet, level)

    def run(z):
        for sample in z.tolist():
            denoiser.update(sample)

    return run


def anew(z):
    run = visushrink("db2", 3)
    for first in range(0, z.size, BLOCK):
        run(z[max(0, first - BLOCK) : first + BLOCK])


def rows_of(rows, z):
    return [lambda run=run, n=n: seconds_per_sample(run, z[:n]) for _, run, n in rows]


def main():
    print_versions("PyWavelets")
    z = np.random.default_rng(1).standard_normal(N)
    check(z)
    whole = [
        ("PyWavelets, db4, level 5", visushrink("db4", 5), N),
        *(
            (
                f"denoise, {wavelet}, level {level}",
                lambda z, w=wavelet, k=level: zr.denoise(z, w, k),
                N,
            )
            for wavelet, level in (("haar", 5), ("db2", 5), ("db4", 5), ("db8", 5), ("db4", "auto"))
        ),
    ]
    print_table("A sample of a record", [name for name, *_ in whole], least(rows_of(whole, z)))
    banks = [("haar", 3), ("db2", 3), ("db4", 3), ("db4", 5), ("db8", 5)]
    streamed = [(f"WaveletDenoiser, {w} {k}", live(w, k).process, N) for w, k in banks]
    print_table(
        "A sample of a stream", [name for name, *_ in streamed], least(rows_of(streamed, z))
    )
    calls = [(f"update, {w} {k}", one_by_one(w, k), CALLS) for w, k in banks]
    print_table("A call of a sample", [name for name, *_ in calls], least(rows_of(calls, z)))
    pieces = [
        ("PyWavelets, the last 64 anew, db2 3", anew, 3200),
        *((f"process, {w} {k}", blocks(w, k), 32 * CALLS // 10) for w, k in banks),
    ]
    times = [BLOCK * seconds for seconds in least(rows_of(pieces, z))]
    print_table("A call of a block of 32", [name for name, *_ in pieces], times)


if __name__ == "__main__":
    main()
