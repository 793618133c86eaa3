"""From a record at rest to a drift model, with the tests that justify it."""

from zerorate.identify.autoregression import fit_ar
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
    "ArmaModel",
    "Change",
    "Correlogram",
    "OrderSelection",
    "Prepared",
    "ReverseArrangements",
    "Span",
    "Verdict",
    "Whiteness",
    "adf",
    "anderson_darling",
    "autocorrelation",
    "decimate",
    "detrend",
    "far_from_average",
    "fit_ar",
    "hampel",
    "jarque_bera",
    "kpss",
    "ljung_box",
    "moving_average",
    "moving_spans",
    "prepare",
    "reverse_arrangements",
    "segments",
    "select_order",
    "whiteness",
]
