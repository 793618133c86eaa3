"""Autoregressions by least squares over rows that are written out."""

from dataclasses import dataclass

import numpy as np


@dataclass
class LeastSquares:
    """Coefficients [phi, c], their covariance, and what is left over n rows."""

    coefficients: np.ndarray
    covariance: np.ndarray
    sigma2: float
    n: int
    condition: float


def stretches(z):
    """The parts of a record that hold finite values only."""
    missing = np.flatnonzero(~np.isfinite(z))
    return [part[np.isfinite(part)] for part in np.split(z, missing)]


def rows(z, p, start=None):
    """Rows [z_(k-1), ..., z_(k-p)] and their z_k, of every k from ``start`` on in a stretch."""
    start = p if start is None else start
    long = [part for part in stretches(z) if part.size > start]
    lagged = [
        np.column_stack([part[start - lag : part.size - lag] for lag in range(p + 1)])
        for part in long
    ]
    together = np.concatenate(lagged)
    return together[:, 1:], together[:, 0]


def least_squares(z, p, start=None, constant=True):
    """Fit about the mean, which is put back afterwards: a large offset costs no digits."""
    level = np.nanmean(np.where(np.isfinite(z), z, np.nan)) if constant else 0.0
    X, y = rows(z - level, p, start)
    design = np.column_stack([X, np.ones(y.size)]) if constant else X
    b = np.linalg.lstsq(design, y, rcond=None)[0]
    sigma2 = np.mean((y - design @ b) ** 2)
    root = np.zeros((p + 1, design.shape[1]))
    root[: design.shape[1]] = np.linalg.inv(np.linalg.qr(design, mode="r"))
    root[p] -= level * root[:p].sum(axis=0)
    b = np.append(b, np.zeros(p + 1 - b.size))
    b[p] += level * (1.0 - b[:p].sum())
    return LeastSquares(b, sigma2 * root @ root.T, sigma2, y.size, condition(X, constant))


def condition(X, constant):
    """Condition number of X'X, scaled to a unit diagonal."""
    if X.shape[1] == 0:
        return 1.0
    centred = X - X.mean(axis=0) if constant else X
    return np.linalg.cond(centred / np.linalg.norm(centred, axis=0)) ** 2
