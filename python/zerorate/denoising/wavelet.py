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
    """A denoised record: without the details that are no larger than noise.

    Attributes
    ----------
    signal : ndarray, shape (n,) or (n, k)
        The record, in its own unit.
    level : int or ndarray, shape (k,)
        Last thresholded level of each column.
    sigma : float or ndarray, shape (k,)
        Standard deviation of white noise, from the details of the first level.
    threshold : float or ndarray, shape (k,)
        Threshold of the details, sigma sqrt(2 ln n).
    wavelet, mode : str
    approximation : bool
        The given arguments.

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
    """Return a whole record without the details that are no larger than noise.

    A filter bank splits the record into octaves, from the finest on. White noise is equally strong
    in all of them, a slow motion is in none but the coarse ones. Details smaller than
    sigma sqrt(2 ln n), which noise alone hardly reaches, become zero (VisuShrink), and the signal
    is reconstructed. There is no delay, since each sample is processed with later ones:
    `WaveletDenoiser` denoises while samples arrive.

    Parameters
    ----------
    z : array_like, shape (n,) or (n, k)
        Samples in any unit, none missing. Columns are denoised separately.
    wavelet : {"haar", "db2", "db4", "db8"}, default "db4"
        Daubechies' wavelet of 2, 4, 8 or 16 taps. A longer one keeps only smoother motion.
    level : int or {"auto", "psr", "psr-normalised"}, default "auto"
        Number of octaves to threshold; each halves the variance of white noise.

        - "auto": the last level whose details still look like the noise of the first one, by their
          median and their root mean square. It stops where motion begins, or noise has a colour.
        - "psr": the last one before the largest detail is more than `rho` times the sum of all (Wu
          and Ran). It depends on the length of the record more than on its content.
        - "psr-normalised": this ratio over that of white noise.
    mode : {"soft", "hard"}, default "soft"
        Details above the threshold shrink by it, or stay. Soft is smooth; hard keeps
        the peaks of motion.
    approximation : bool, default False
        Also threshold the approximation below the last level, as Wu and Ran do: this treats slow
        drift, and slow motion, as noise.
    rho : float, optional
        Cut of the last two rules: 0.05 of "psr", 1.5 of "psr-normalised".

    Returns
    -------
    Denoised
        With `signal`, `level`, `sigma` and `threshold`.

    Raises
    ------
    ValueError
        If a sample is missing, the record too short for one level or for so many, or an argument
        not as described.

    Notes
    -----
    D. L. Donoho, I. M. Johnstone, Biometrika 81(3), 1994; J. Wu, C. Ran, Instrument Technique and
    Sensor 2021(2), equation 10. Borders are half-point symmetric. A record with zero noise, such as
    a constant, or one so coarse that most samples equal the one before, is returned unchanged.

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
