"""From a record at rest to a drift model, with the tests that justify it."""

from zerorate.identify.checks.arrangements import ReverseArrangements, reverse_arrangements
from zerorate.identify.checks.kpss import kpss
from zerorate.identify.checks.normality import anderson_darling, jarque_bera
from zerorate.identify.checks.rest import Span, moving_spans
from zerorate.identify.checks.unit_root import adf
from zerorate.identify.checks.verdict import Verdict
from zerorate.identify.checks.whiteness import (
    Correlogram,
    Whiteness,
    autocorrelation,
    ljung_box,
    whiteness,
)
from zerorate.identify.estimation.arma import ArmaGrid, arma_grid, fit_arma
from zerorate.identify.estimation.autoregression import fit_ar
from zerorate.identify.estimation.order import OrderSelection, select_order
from zerorate.identify.filters.start import to_filter
from zerorate.identify.models.model import ArmaModel
from zerorate.identify.preparation.prepare import (
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
from zerorate.identify.state_space.system import StateSpace
from zerorate.identify.study.identification import identify
from zerorate.identify.study.result import Identification

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
