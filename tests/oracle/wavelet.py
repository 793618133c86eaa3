"""The streaming filter bank as sums over printed indices, of a whole record at once."""

import math

import numpy as np
import pywt

# Part of normal noise within its deviation, and its median size.
WITHIN, MEDIAN = 0.682689, 0.674490
# What the details of a second weigh in sigma, the most that one weighs, how many begin it.
FOLLOWING, HEAVIEST, FIRST = 0.2, 0.5, 16
# Of samples, a detail no larger than this part of them is zero.
ROUNDING = 32.0 * np.finfo(float).eps


def low(wavelet):
    return np.array(pywt.Wavelet(wavelet).rec_lo)


def high(h):
    return np.array([(-1) ** j * h[-1 - j] for j in range(len(h))])


def analysed(x, h):
    """a_k = sum over j of h_j x_{2k+2-F+j}, and d_k; x is zero before its beginning."""
    f = len(h)
    x = np.concatenate([np.zeros(f - 2), x])
    windows = np.lib.stride_tricks.sliding_window_view(x, f)[::2]
    return windows @ h, windows @ high(h)


def synthesised(a, d, h):
    """x_m = sum over k of h_{m-2k-2+F} a_k + g_{m-2k-2+F} d_k, as far as all k are there."""
    f, g, n = len(h), high(h), len(a)
    x = np.zeros(2 * n + f)
    for j in range(f):
        x[j : j + 2 * n : 2] += h[j] * a + g[j] * d
    return x[f - 2 : 2 * n]


def shrunk(d, t, mode):
    if mode == "hard":
        return np.where(np.abs(d) < t, 0.0, d)
    return np.sign(d) * np.maximum(np.abs(d) - t, 0.0)


def deviations(sizes, teaches, gain):
    """Sigma after each size of those that teach, by counting those below it."""
    first, count, sigma, told = [], 0, 0.0, np.zeros(len(sizes))
    for i, size in enumerate(sizes):
        if teaches[i]:
            count += 1
            if count <= FIRST:
                first.append(size)
                sigma = sorted(first)[FIRST // 2] / MEDIAN if count == FIRST else 0.0
            else:
                sigma *= math.exp(max(gain, 2.0 / count) * (WITHIN - (size < sigma)))
        told[i] = sigma
    return told


class WaveletDenoiser:
    def __init__(self, rate, wavelet="db2", level=3, mode="hard", threshold=4.0):
        self.h, self.level, self.mode, self.threshold = low(wavelet), level, mode, threshold
        self.gain = min(2.0 * FOLLOWING / rate, HEAVIEST)
        self.delay = (2**level - 1) * (len(self.h) - 1) + 1

    def process(self, z):
        """Of the first samples of all."""
        z = np.asarray(z, dtype=float)
        present = np.isfinite(z)
        if not present.any():
            return np.full(len(z), np.nan)
        begin = int(np.argmax(present))
        # A missing sample is as the last one before it, and all before the first as that.
        place = np.maximum.accumulate(np.where(present, np.arange(len(z)), begin))
        out = z[begin] + self.denoised(z[place] - z[begin], present)
        out[:begin] = np.nan
        return out

    def denoised(self, y, present):
        n, f, step = len(y), len(self.h), 2**self.level
        # Zeros on both sides, so that no border is near.
        before, after = step * f, step * (f + 1) - n % step
        x = np.concatenate([np.zeros(before), y, np.zeros(after)])
        details = []
        for _ in range(self.level):
            x, d = analysed(x, self.h)
            details.append(d)
        sigma = self.sigmas(np.abs(details[0][before // 2 :]), y, present)
        for k in reversed(range(self.level)):
            d = details[k]
            # It is known with this sample, and used when the levels below are ready.
            known = (np.arange(len(d)) + 1) * 2 ** (k + 1) - 1 - before
            used = known + (2 ** (self.level - k - 1) - 1) * (f - 1) * 2 ** (k + 1)
            t = self.threshold * sigma[np.clip((used - 1) // 2, 0, len(sigma) - 1)]
            d = shrunk(d, t, self.mode)
            x = synthesised(x[: len(d)], d[: len(x)], self.h)
        return x[before - self.delay :][:n]

    def sigmas(self, sizes, y, present):
        """Of the first level, after each of its details."""
        f, sizes = len(self.h), sizes[: len(present) // 2]
        before = np.concatenate([np.zeros(f - 1, dtype=bool), present])
        whole = np.lib.stride_tricks.sliding_window_view(before, f).all(axis=1)[1::2]
        told = deviations(sizes, whole & (sizes > ROUNDING * np.abs(y[1::2])), self.gain)
        return told if len(told) else np.zeros(1)
