"""Criteria of order as differences that mean the same for each of them."""

import numpy as np
import numpy.typing as npt

from zerorate.identify.order import OrderSelection

__all__ = ["CRITERIA", "above_least"]

CRITERIA = ("fpe", "aic", "aicc", "bic", "hq")


def above_least(orders: OrderSelection, name: str) -> npt.NDArray[np.float64]:
    """Return how far a criterion is above its least for every order, on the scale of N ln.

    Parameters
    ----------
    orders : OrderSelection
        Its criteria.
    name : str
        One of `CRITERIA`.
    """
    scores = getattr(orders, name)
    # The only one that is a variance.
    scores = orders.n * np.log(scores) if name == "fpe" else scores
    return np.asarray(scores - scores.min())
