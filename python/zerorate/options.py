"""The options of a drift filter: the core's table of names, defaults, ranges, units and methods.

The command line and refusals come from it.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final, Literal, TypedDict

from zerorate._native import DriftFilter, filter_options

__all__ = [
    "FILTER_OPTIONS",
    "METHODS",
    "PUBLISHED",
    "FilterOptions",
    "Option",
    "StreamOptions",
    "check_used",
    "checked_options",
    "used_by",
]

Kind = Literal["number", "number or None", "choice", "order"]


@dataclass(frozen=True)
class Option:
    """An option of `zerorate.DriftFilter`.

    Parameters
    ----------
    name : str
        Its keyword.
    kind : {"number", "number or None", "choice", "order"}
        What its value is: one of `choices`, or for an order two whole numbers (p, q).
    default : object
        Its default; None where that depends on the method, or where nothing is given.
    unit : str
        Unit of a number, "" where there is none.
    expected : str
        The values that are allowed, in words.
    choices : tuple of str
        The values of a choice.
    meaning : str
        What it is, in one sentence without a full stop.
    methods : tuple of str
        The methods that use it.
    """

    name: str
    kind: Kind
    default: object
    unit: str
    expected: str
    choices: tuple[str, ...]
    meaning: str
    methods: tuple[str, ...]


class FilterOptions(TypedDict, total=False):
    """Options of `zerorate.DriftFilter` where the method and the output are given apart."""

    order: tuple[int, int]
    fading: float
    adapt_for: float | None
    forgetting_factor: float
    process_noise: float
    process_noise_memory: float
    noise: Literal["allan", "hadamard"]
    startup: float
    scale: float | None
    motion: Literal["hold", "ignore"] | None


class StreamOptions(FilterOptions, total=False):
    """All options of `zerorate.DriftFilter`."""

    method: Literal["kf", "akf", "fading", "auto"]
    output: Literal["estimate", "compensated"]


def _table() -> tuple[Option, ...]:
    """Return the method, then all options in the order in which the core lists them."""
    rows: list[dict[str, Any]] = [dict(row) for row in filter_options()]
    own = tuple(
        Option(**{**row, "choices": tuple(row["choices"]), "methods": tuple(row["methods"])})
        for row in rows
    )
    methods = max((option.methods for option in own), key=len)
    default = DriftFilter(1.0).method
    expected = _listed(methods, "or")
    method = Option(
        "method", "choice", default, "", expected, methods, "method of the filter", methods
    )
    return (method, *own)


def _listed(words: Sequence[str], last: str = "and") -> str:
    *most, end = (f"'{word}'" for word in words)
    return f"{', '.join(most)} {last} {end}" if most else end


FILTER_OPTIONS: Final[Mapping[str, Option]] = MappingProxyType(
    {option.name: option for option in _table()}
)

METHODS: Final = FILTER_OPTIONS["method"].choices
"""All methods: the published ones, then the one that tunes itself."""

PUBLISHED: Final = FILTER_OPTIONS["order"].methods
"""The methods that have an ARMA model of the drift."""


def check_used(given: Iterable[str], methods: Sequence[str]) -> None:
    """Refuse options that no method uses.

    Parameters
    ----------
    given : iterable of str
        Names of options.
    methods : sequence of str
        The methods that run.

    Raises
    ------
    ValueError
        If there is such an option: it is named with the methods, and with those that use it.
    """
    for name in given:
        users = _option(name).methods
        if not set(users) & set(methods):
            running = "method {} does not" if len(methods) == 1 else "methods {} do not"
            start = running.format(_listed(methods))
            raise ValueError(f"{start} use {name}: it is for {_listed(users)}")


def used_by(method: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that a method uses, of those given for several methods."""
    return {name: value for name, value in options.items() if method in _option(name).methods}


def checked_options(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of one filter, after checking them as the filter itself does.

    Raises
    ------
    ValueError
        If one is out of range, or not used by the method.
    TypeError
        If there is no such option, or it is of another type.
    """
    DriftFilter(1.0, **options)
    return dict(options)


def _option(name: str) -> Option:
    if name not in FILTER_OPTIONS:
        raise TypeError(f"unknown option '{name}', expected some of {', '.join(FILTER_OPTIONS)}")
    return FILTER_OPTIONS[name]
