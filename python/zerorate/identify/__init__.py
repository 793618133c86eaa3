"""From a record at rest to a drift model, with the tests that justify it."""

from zerorate.identify.arma import ArmaGrid, arma_grid, fit_arma
from zerorate.identify.autoregression import fit_ar
from zerorate.identify.filters import to_filter
from zerorate.identify.identification import identify
from zerorate.identify.model import ArmaModel
from zerorate.identify.normality import anderson_darling, jarque_bera
from zerorate.identify.order import OrderSelection, select_order
from zerorate.identify.prepare import (
    Change,
    Prepared,
    decimate,
    detrend,
    far_from_average,
    hampel,
    moving_average,
    prepare,
    segments,
)
from zerorate.identify.rest import Span, moving_spans
from zerorate.identify.result import Identification
from zerorate.identify.state_space import StateSpace
from zerorate.identify.stationarity import ReverseArrangements, adf, kpss, reverse_arrangements
from zerorate.identify.verdict import Verdict
from zerorate.identify.whiteness import (
    Correlogram,
    Whiteness,
    autocorrelation,
    ljung_box,
    whiteness,
)

__all__ = [
    "ArmaGrid",
    "ArmaModel",
    "Change",
    "Correlogram",
    "Identification",
    "OrderSelection",
    "Prepared",
    "ReverseArrangements",
    "Span",
    "StateSpace",
    "Verdict",
    "Whiteness",
    "adf",
    "anderson_darling",
    "arma_grid",
    "autocorrelation",
    "decimate",
    "detrend",
    "far_from_average",
    "fit_ar",
    "fit_arma",
    "hampel",
    "identify",
    "jarque_bera",
    "kpss",
    "ljung_box",
    "moving_average",
    "moving_spans",
    "prepare",
    "reverse_arrangements",
    "segments",
    "select_order",
    "to_filter",
    "whiteness",
]
