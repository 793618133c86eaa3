"""Choices and texts that become arguments."""

import re
from enum import StrEnum
from typing import Final, cast, get_args

from zerorate.cli.faults import UsageFault
from zerorate.noise.kinds import TauGrid

__all__ = [
    "RECORDING",
    "TOPIC",
    "Criterion",
    "CurveFormat",
    "Estimator",
    "Export",
    "FigureFormat",
    "LogFormat",
    "Method",
    "Motion",
    "Noise",
    "Outliers",
    "OutputKind",
    "Trend",
    "parse_adapt_for",
    "parse_columns",
    "parse_exports",
    "parse_names",
    "parse_order",
    "parse_taus",
    "parse_units",
]


RECORDING: Final = (
    "Recording: csv, tsv, txt, npy, npz, parquet, arrow, feather, h5, mat, bag, mcap, "
    "or the folder of a ROS 2 bag."
)
TOPIC: Final = "Topic of a ROS recording, where several hold an IMU."


class Method(StrEnum):
    """Methods of the filter."""

    kf = "kf"
    akf = "akf"
    fading = "fading"
    auto = "auto"


class Motion(StrEnum):
    """What the filter does while the sensor moves."""

    hold = "hold"
    ignore = "ignore"


class OutputKind(StrEnum):
    """What the filtered log holds."""

    estimate = "estimate"
    compensated = "compensated"


class Noise(StrEnum):
    """Variances that the measurement noise is taken from."""

    allan = "allan"
    hadamard = "hadamard"


class LogFormat(StrEnum):
    """File formats of a log."""

    parquet = "parquet"
    csv = "csv"
    npz = "npz"


class CurveFormat(StrEnum):
    """File formats of a deviation curve."""

    csv = "csv"
    json = "json"
    npz = "npz"


class Export(StrEnum):
    """Estimators whose configuration can be written, and a file of every axis' model."""

    kalibr = "kalibr"
    vins = "vins"
    orbslam3 = "orbslam3"
    px4 = "px4"
    json = "json"


class Criterion(StrEnum):
    """Criteria of order."""

    fpe = "fpe"
    aic = "aic"
    aicc = "aicc"
    bic = "bic"
    hq = "hq"


class Estimator(StrEnum):
    """Estimates of an ARMA model."""

    css = "css"
    exact = "exact"


class Outliers(StrEnum):
    """Ways to replace outliers."""

    none = "none"
    hampel = "hampel"
    moving_average = "moving-average"


class Trend(StrEnum):
    """What is taken off a record."""

    none = "none"
    mean = "mean"
    linear = "linear"


class FigureFormat(StrEnum):
    """File formats of a figure."""

    png = "png"
    svg = "svg"
    pdf = "pdf"


def parse_columns(text: str | None) -> list[str | int] | None:
    """Return the names and indices of a list with commas."""
    if text is None:
        return None
    words = [word.strip() for word in text.split(",")]
    if not all(words):
        raise UsageFault(f"--columns takes names or indices with commas between, got '{text}'")
    return [int(word) if re.fullmatch(r"-?\d+", word) else word for word in words]


def parse_names(option: str, text: str) -> list[str]:
    """Return the names of a list with commas."""
    words = [word.strip() for word in text.split(",")]
    if not all(words):
        raise UsageFault(f"{option} takes names with commas between, got '{text}'")
    return words


def parse_order(text: str) -> tuple[int, int]:
    """Return the orders of ``2,1``."""
    found = re.fullmatch(r"\s*(\d+)\s*,\s*(\d+)\s*", text)
    if found is None:
        raise UsageFault(f"--order takes two numbers p,q such as 2,1, got '{text}'")
    return int(found[1]), int(found[2])


def parse_adapt_for(text: str) -> float | None:
    """Return the seconds, None for ``always``."""
    if text == "always":
        return None
    try:
        return float(text)
    except ValueError:
        raise UsageFault(f"--adapt-for takes seconds or 'always', got '{text}'") from None


def parse_taus(text: str) -> TauGrid | list[float]:
    """Return the name of a grid, or the seconds of a list with commas."""
    if text in get_args(TauGrid):
        return cast(TauGrid, text)
    try:
        return [float(word) for word in text.split(",")]
    except ValueError:
        known = ", ".join(get_args(TauGrid))
        raise UsageFault(
            f"--taus takes {known}, or seconds such as 0.1,1,10, got '{text}'"
        ) from None


def parse_units(text: str | None) -> list[str]:
    """Return the units of a list with commas."""
    return [] if text is None else [word.strip() for word in text.split(",")]


def parse_exports(text: str | None) -> list[Export]:
    """Return the formats of a list with commas, each once."""
    words = [] if text is None else [word.strip() for word in text.split(",")]
    for word in words:
        if word not in list(Export):
            raise UsageFault(f"--export takes some of {', '.join(Export)}, got '{word}'")
    return list(dict.fromkeys(map(Export, words)))
