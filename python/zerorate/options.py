"""The options of a drift filter: one table of their names, defaults, ranges, units and methods.

Signatures, the command line and refusals come from it.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final, Literal, TypedDict

from zerorate._native import DriftFilter

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

Kind = Literal["order", "number", "seconds", "seconds or always", "choice"]


@dataclass(frozen=True)
class Option:
    """An option of `zerorate.DriftFilter`.

    Parameters
    ----------
    name : str
        Its keyword.
    kind : {"order", "number", "seconds", "seconds or always", "choice"}
        What its value is: two whole numbers (p, q), a number, seconds, seconds or None for always,
        or one of `choices`.
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


def _listed(words: Sequence[str], last: str = "and") -> str:
    *most, end = (f"'{word}'" for word in words)
    return f"{', '.join(most)} {last} {end}" if most else end


def _table() -> tuple[Option, ...]:
    """Return the options in the order in which help shows them."""
    published: tuple[str, ...] = ("kf", "akf", "fading")
    every = (*published, "auto")
    fraction = "above 0 and at most 1"
    positive, not_negative = "a positive number", "zero or a positive number"
    order = "(p, q) with p from 1 to 3 and q from 0 to 3"
    rows: tuple[tuple[str, Kind, object, str | tuple[str, ...], str, tuple[str, ...]], ...] = (
        ("method", "choice", "fading", every, "Method of the filter", every),
        (
            "motion",
            "choice",
            None,
            ("hold", "ignore"),
            "'hold' the drift in motion, the default of auto, or 'ignore' motion",
            every,
        ),
        (
            "output",
            "choice",
            "estimate",
            ("estimate", "compensated"),
            "The 'estimate' of the drift, or the rate 'compensated' by it",
            every,
        ),
        ("order", "order", (2, 1), order, "Orders of the ARMA model of the drift", published),
        ("fading", "number", 0.97, fraction, "Memory of the measurement noise R", ("fading",)),
        (
            "adapt_for",
            "seconds or always",
            120.0,
            f"{not_negative} of seconds",
            "How long the model is learned after the start-up",
            published,
        ),
        (
            "forgetting_factor",
            "number",
            1.0,
            fraction,
            "Memory of the model's least squares",
            published,
        ),
        (
            "process_noise",
            "number",
            0.1,
            not_negative,
            "Initial G and P, in variances of the start-up",
            published,
        ),
        (
            "process_noise_memory",
            "number",
            0.0,
            not_negative,
            "Samples that the initial G counts for",
            ("fading",),
        ),
        (
            "noise",
            "choice",
            "allan",
            ("allan", "hadamard"),
            "Variance that R is taken from",
            ("akf", "fading"),
        ),
        ("startup", "seconds", 1.0, f"{positive} of seconds", "Length of the start-up", every),
        (
            "scale",
            "number",
            None,
            positive,
            "Deviation of the noise in the unit of the data, if it is known",
            every,
        ),
    )
    return tuple(_row(*row) for row in rows)


def _row(
    name: str,
    kind: Kind,
    default: object,
    values: str | tuple[str, ...],
    meaning: str,
    methods: tuple[str, ...],
) -> Option:
    unit = "s" if kind.startswith("seconds") else ""
    if isinstance(values, str):
        return Option(name, kind, default, unit, values, (), meaning, methods)
    return Option(name, kind, default, unit, _listed(values, "or"), values, meaning, methods)


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
            running = f"method{'s' if len(methods) > 1 else ''} {_listed(methods)}"
            raise ValueError(f"{name} has no effect on {running}, only on {_listed(users)}")


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
    method = options.get("method", FILTER_OPTIONS["method"].default)
    # The filter says what a method may be.
    DriftFilter(1.0, **{"method": method, **used_by(method, options)})
    check_used(options, [method])
    return dict(options)


def _option(name: str) -> Option:
    if name not in FILTER_OPTIONS:
        raise TypeError(f"unknown option '{name}', expected some of {', '.join(FILTER_OPTIONS)}")
    return FILTER_OPTIONS[name]
