"""Correlations of a record with itself."""

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate import _native
from zerorate.identify.preparation.centring import centred
from zerorate.identify.preparation.smoothing import checked_width
from zerorate.identify.records import as_record

__all__ = ["Correlations", "Correlogram", "autocorrelation", "correlations", "partial"]

Floats = npt.NDArray[np.float64]
Counts = npt.NDArray[np.int64]

_TWO_SIDED_95: Final = 1.959963984540054


@dataclass(frozen=True, eq=False)
class Correlogram:
    """Autocorrelations of a record, and what of them the shorter lags do not explain.

    Attributes
    ----------
    lags : ndarray of int64, shape (m,)
        From 1 on, in samples.
    acf, pacf : ndarray of float64, shape (m,)
        Autocorrelation and partial autocorrelation.
    bound : float
        1.96 / sqrt(n), within which 95 of 100 correlations of white noise lie (Bartlett). Gaps
        leave fewer products than that; then it is that of the lag that lost most.
    n : int
        Samples that are there.
    """

    lags: Counts
    acf: Floats
    pacf: Floats
    bound: float
    n: int


class Correlations(NamedTuple):
    """Autocorrelations at lags 1 to m, the pairs each was made of, and the number of samples."""

    acf: Floats
    pairs: Counts
    n: int

    def up_to(self, lags: int) -> "Correlations":
        """Return those of the first lags."""
        return Correlations(self.acf[:lags], self.pairs[:lags], self.n)

    def correlogram(self) -> Correlogram:
        """Return them with partial ones and the bound."""
        lags = np.arange(1, self.acf.size + 1)
        fewest = int(np.min(self.pairs + lags))
        bound = _TWO_SIDED_95 / float(np.sqrt(fewest))
        return Correlogram(lags, self.acf, partial(self.acf), bound, self.n)


def autocorrelation(z: npt.ArrayLike, lags: int) -> Correlogram:
    """Return autocorrelations and partial autocorrelations at lags 1 to `lags`.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples in any unit; those not finite are missing, and no product reaches across them.
    lags : int
        The greatest lag, 1 to n - 1, within the longest stretch without a gap.

    Returns
    -------
    Correlogram

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis, has too few or only equal samples, or `lags` is not as described.

    Notes
    -----
    r_l = sum (z_k - m)(z_(k+l) - m) / sum (z_k - m)^2; with gaps the sum is scaled to the n - l
    products of a whole record. Partial autocorrelations by the recursion of Durbin and Levinson;
    G. E. P. Box, G. M. Jenkins, Time Series Analysis, sections 2.1 and 3.2.

    Examples
    --------
    >>> noise = np.random.default_rng(1).standard_normal(10_002)
    >>> smoothed = noise[:-2] + noise[1:-1] + noise[2:]
    >>> autocorrelation(smoothed, 2).acf.round(1).tolist()
    [0.7, 0.3]
    """
    return correlations(as_record(z, 2, "autocorrelation"), lags).correlogram()


def correlations(record: Floats, lags: int, welcome: int = 0) -> Correlations:
    """Return autocorrelations of a record whose samples differ.

    At lags up to `lags`, or up to `welcome` as far as there are products so far apart.
    """
    checked_width(lags, "lags")
    if lags >= record.size:
        raise ValueError(f"lags must be less than the number of samples, {record.size}, got {lags}")
    sums, pairs = _native.lagged_products(centred(record), max(lags, welcome))
    longest = int(np.count_nonzero(pairs))
    if lags >= longest:
        raise ValueError(f"lags must be less than the longest stretch, {longest}, got {lags}")
    n, lag = int(pairs[0]), np.arange(1, longest)
    pairs = pairs[1:longest]
    return Correlations(sums[1:longest] / sums[0] * ((n - lag) / pairs), pairs, n)


def partial(acf: Floats) -> Floats:
    """Return the partial autocorrelations by the recursion of Durbin and Levinson.

    NaN from the lag on at which nothing is left to explain, which gaps or rounding may bring about.
    """
    pacf = np.full(acf.size, np.nan)
    phi, left = np.empty(0), 1.0
    for k, r in enumerate(acf):
        if not left > 0.0:
            break
        pacf[k] = (r - phi @ acf[:k][::-1]) / left
        phi = np.append(phi - pacf[k] * phi[::-1], pacf[k])
        left *= 1.0 - pacf[k] ** 2
    return pacf
