"""All that was found out about the record of one axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from zerorate.identify.checks.rest import Span
from zerorate.identify.checks.whiteness import Correlogram, Whiteness
from zerorate.identify.estimation.order import OrderSelection
from zerorate.identify.models.model import ArmaModel
from zerorate.identify.preparation.prepare import Prepared
from zerorate.identify.study.battery import Battery
from zerorate.identify.study.drift import slow_ratio
from zerorate.identify.study.judgement import judged
from zerorate.identify.study.online import Online
from zerorate.identify.study.survey import Survey

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Identification"]

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Identification:
    """The way of one axis from a record to a drift model.

    Attributes
    ----------
    name, unit : str
        Of the axis.
    survey : Survey
        The record as it came.
    moving : tuple of Span
        Where it was not at rest, s from its beginning.
    smooth : int
        Samples of the moving average that was taken, 1 for none.
    prepared : Prepared
        What was modelled, with all that was done to the record counted.
    tests : Battery
        Of stationarity and normality, of what was modelled.
    correlogram : Correlogram
        Of what was modelled.
    ar_orders, arma_orders : OrderSelection
        Criteria of every order.
    ar : ArmaModel
        Autoregressive model of the clear choice of order, by least squares.
    model : ArmaModel
        ARMA model of the clear choice, or of the order that was asked for.
    asked : bool
        Whether the order was asked for.
    whiteness : Whiteness
        Of the residuals of `model`.
    online : Online or None
        What recursive least squares of the same order learns from the same record; None where it
        has no such order.
    """

    name: str
    unit: str
    survey: Survey
    moving: tuple[Span, ...]
    smooth: int
    prepared: Prepared
    tests: Battery
    correlogram: Correlogram
    ar_orders: OrderSelection
    arma_orders: OrderSelection
    ar: ArmaModel
    model: ArmaModel
    asked: bool
    whiteness: Whiteness
    online: Online | None

    @property
    def rate(self) -> float:
        """Samples per second of what was modelled, Hz."""
        return self.prepared.rate or self.survey.rate

    @property
    def residuals(self) -> Floats:
        """Innovations of `model`, shape (n,), NaN where there is none."""
        return self.model.residuals(self.prepared.data)

    @property
    def slow_ratio(self) -> float:
        """Variance of the segments' means over what `model` says of it, about 1 at best."""
        return slow_ratio(self)

    @property
    def verdict(self) -> tuple[str, ...]:
        """What the numbers mean, a sentence each."""
        return judged(self)

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as what JSON can hold: there is no NaN or infinity in it."""
        from zerorate.identify.study.as_json import as_dict

        return as_dict(self)

    def plot(self) -> Figure:
        """Return the figure of this axis, 180 mm wide; needs matplotlib.

        Raises
        ------
        ImportError
            Without matplotlib: ``pip install 'zerorate[plot]'``.
        """
        from zerorate.show import plot_identification

        return plot_identification(self)
