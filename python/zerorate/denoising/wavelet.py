"""Wavelet denoising of a whole record."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal, TypeAlias

import numpy.typing as npt

from zerorate import _native
from zerorate.types import Floats, Integers
from zerorate.views import OneArray, Result

Wavelet: TypeAlias = Literal["haar", "db2", "db4", "db8"]
Mode: TypeAlias = Literal["soft", "hard"]
LevelName: TypeAlias = Literal["auto", "psr", "psr-normalised"]


@dataclass(frozen=True, eq=False)
class Denoised(OneArray, Result):
    """A denoised record.

    Attributes
    ----------
    signal : ndarray, shape (n,) or (n, k)
        Denoised record, in the unit of the samples.
    level : int or ndarray, shape (k,)
        Last thresholded level of each column.
    sigma : float or ndarray, shape (k,)
        Standard deviation of white noise, from the details of the first level.
    threshold : float or ndarray, shape (k,)
        Threshold of the details, sigma sqrt(2 ln n).
    wavelet, mode : str
        Wavelet and kind of threshold of the call.
    approximation : bool
        True if the approximation was also thresholded.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> z = np.sin(np.arange(20_000) / 3000.0)
    >>> found = zr.denoise(z + 0.1 * np.random.default_rng(1).standard_normal(z.size))
    >>> found.signal.shape, round(float(found.threshold / found.sigma), 2)  # sqrt(2 ln n)
    ((20000,), 4.45)
    """

    _array_field: ClassVar[str] = "signal"

    signal: Floats
    level: int | Integers
    sigma: float | Floats
    threshold: float | Floats
    wavelet: Wavelet
    mode: Mode
    approximation: bool


def denoise(
    z: npt.ArrayLike,
    wavelet: Wavelet = "db4",
    level: int | LevelName = "auto",
    mode: Mode = "soft",
    approximation: bool = False,
    *,
    rho: float | None = None,
) -> Denoised:
    """Denoise a whole record: remove details below a noise threshold.

    A filter bank splits the record into octaves, the finest first. White noise is equally strong in
    all octaves. Slow motion appears only in the coarse octaves. Noise alone hardly reaches the
    threshold sigma sqrt(2 ln n). Details below the threshold become zero (VisuShrink), and the
    signal is reconstructed. There is no delay, because later samples are used. `WaveletDenoiser`
    denoises a stream of samples.

    Parameters
    ----------
    z : array_like, shape (n,) or (n, k)
        Samples in any unit, without missing samples. Columns are denoised separately.
    wavelet : {"haar", "db2", "db4", "db8"}, default "db4"
        Daubechies' wavelet of 2, 4, 8 or 16 taps. Longer wavelets keep only smoother motion.
    level : int or {"auto", "psr", "psr-normalised"}, default "auto"
        Number of octaves to threshold; each octave halves the variance of white noise.

        - "auto": the last level with details that match the noise of the first level, in median and
          root mean square. It stops where motion or coloured noise begins.
        - "psr": the last level before the largest detail exceeds `rho` times the sum of all details
          (Wu and Ran). This level depends more on the length of the record than on its content.
        - "psr-normalised": the same rule, with the ratio divided by the ratio of white noise.
    mode : {"soft", "hard"}, default "soft"
        "soft" subtracts the threshold from details above it: the result is smooth. "hard" keeps
        these details unchanged: the peaks of motion are kept.
    approximation : bool, default False
        Also apply the threshold to the approximation below the last level, as Wu and Ran do. Slow
        drift and slow motion then count as noise.
    rho : float, optional
        Limit of the "psr" rules. Default: 0.05 for "psr", 1.5 for "psr-normalised".

    Returns
    -------
    Denoised
        Result with `signal`, `level`, `sigma` and `threshold`.

    Raises
    ------
    ValueError
        If a sample is missing or the record is too short. If an argument is not as described.

    Notes
    -----
    D. L. Donoho, I. M. Johnstone, Biometrika 81(3), 1994; J. Wu, C. Ran, Instrument Technique and
    Sensor 2021(2), equation 10. Borders are half-point symmetric. A record with zero noise is
    returned unchanged: a constant record, or a record in which most samples repeat the previous
    sample.

    Examples
    --------
    >>> import numpy as np
    >>> import zerorate as zr
    >>> z = np.sin(np.arange(20_000) / 3000.0)
    >>> z += 0.1 * np.random.default_rng(1).standard_normal(z.size)
    >>> found = zr.denoise(z)
    >>> found.level, round(found.sigma, 3)
    (8, 0.1)
    """
    signal, levels, sigmas, thresholds = _native.denoise(
        z, wavelet, level, rho, mode, approximation
    )
    if signal.ndim == 2:
        return Denoised(signal, levels, sigmas, thresholds, wavelet, mode, approximation)
    values = int(levels[0]), float(sigmas[0]), float(thresholds[0])
    return Denoised(signal, *values, wavelet, mode, approximation)
