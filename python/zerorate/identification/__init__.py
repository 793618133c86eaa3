"""Identification of a drift model from a record at rest, with tests."""

from zerorate._native import RecursiveLeastSquares
from zerorate.identification.arma import ArmaGrid, arma_grid, fit_arma
from zerorate.identification.arma_model import ArmaModel
from zerorate.identification.arrangements import ReverseArrangements, reverse_arrangements
from zerorate.identification.autoregression import fit_ar
from zerorate.identification.correlogram import (
    Correlogram,
    Whiteness,
    autocorrelation,
    ljung_box,
    whiteness,
)
from zerorate.identification.filter_start import to_filter
from zerorate.identification.identification import Identification, identify
from zerorate.identification.network import NetworkModel, fit_network
from zerorate.identification.normality import anderson_darling, jarque_bera
from zerorate.identification.order import OrderSelection, select_order
from zerorate.identification.preparation import Change, PreparedRecord, detrend, prepare, segments
from zerorate.identification.state_space import StateSpace
from zerorate.identification.stationarity import adf, kpss
from zerorate.identification.verdict import Verdict
from zerorate.identification.window_filters import (
    decimate,
    far_from_average,
    hampel,
    moving_average,
)
from zerorate.noise.motion_check import Span, moving_spans

__all__ = [
    "ArmaGrid",
    "ArmaModel",
    "Change",
    "Correlogram",
    "Identification",
    "NetworkModel",
    "OrderSelection",
    "PreparedRecord",
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
    """Return the public names."""
    return __all__
