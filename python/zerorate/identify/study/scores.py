"""Criteria of order as differences that mean the same for each of them."""

from dataclasses import replace
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.identify.estimation.order import Criterion, OrderSelection

__all__ = ["CRITERIA", "above_least"]

CRITERIA: Final[tuple[Criterion, ...]] = ("fpe", "aic", "aicc", "bic", "hq")


def above_least(orders: OrderSelection, name: Criterion) -> npt.NDArray[np.float64]:
    """Return how far a criterion is above its least for every order, on the scale of N ln.

    Parameters
    ----------
    orders : OrderSelection
        Its criteria.
    name : str
        One of `CRITERIA`.
    """
    scores = replace(orders, criterion=name).scores
    return np.asarray(scores - scores.min())
