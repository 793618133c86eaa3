"""From a record at rest to a drift model, with the tests that justify it."""

from zerorate._native import RecursiveLeastSquares
from zerorate.identify.arma import ArmaGrid, arma_grid, fit_arma
from zerorate.identify.arma_model import ArmaModel
from zerorate.identify.arrangements import ReverseArrangements, reverse_arrangements
from zerorate.identify.autoregression import fit_ar
from zerorate.identify.correlogram import (
    Correlogram,
    Whiteness,
    autocorrelation,
    ljung_box,
    whiteness,
)
from zerorate.identify.filter_start import to_filter
from zerorate.identify.identification import Identification, identify
from zerorate.identify.network import NetworkModel, fit_network
from zerorate.identify.normality import anderson_darling, jarque_bera
from zerorate.identify.order import OrderSelection, select_order
from zerorate.identify.preparation import Change, Prepared, detrend, prepare, segments
from zerorate.identify.state_space import StateSpace
from zerorate.identify.stationarity import adf, kpss
from zerorate.identify.verdict import Verdict
from zerorate.identify.window_filters import decimate, far_from_average, hampel, moving_average
from zerorate.noise.rest import Span, moving_spans

__all__ = [
    "ArmaGrid",
    "ArmaModel",
    "Change",
    "Correlogram",
    "Identification",
    "NetworkModel",
    "OrderSelection",
    "Prepared",
    "RecursiveLeastSquares",
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
    "fit_network",
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


def __dir__() -> list[str]:
    """Show what is public."""
    return __all__
