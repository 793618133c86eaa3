"""The options of a drift filter: one table of their names, defaults, ranges, units and methods.

The table stands in the core, whose refusals come from it; the command line comes from what is read
of it here.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, Literal

from zerorate._native import DriftFilter, filter_options
from zerorate.faults import ArgumentError
from zerorate.units import convert, kind

if TYPE_CHECKING:
    from zerorate._native import _FilterOptions as FilterOptions
    from zerorate._native import _Option
    from zerorate._native import _StreamOptions as StreamOptions
else:
    # The stub alone lists them by name and type.
    FilterOptions = StreamOptions = _Option = dict

__all__ = [
    "FILTER_OPTIONS",
    "METHODS",
    "PUBLISHED_METHODS",
    "REST_LIMITS",
    "FilterOptions",
    "Option",
    "StreamOptions",
    "add_rest_limits",
    "check_options",
    "check_used",
    "index_by_name",
    "options_of_rows",
    "select_options",
]

Kind = Literal[
    "order", "number", "seconds", "seconds or always", "choice", "pair or word", "word or flag"
]


def _join_words(words: Sequence[str], last: str = "and") -> str:
    *most, end = (f"'{word}'" for word in words)
    return f"{', '.join(most)} {last} {end}" if most else end


@dataclass(frozen=True)
class Option:
    """An option of a filter: `zerorate.DriftFilter`, `Attitude`, `NavigationFilter` and others.

    Parameters
    ----------
    name : str
        Its keyword.
    kind : str
        What its value is: "order", two whole numbers (p, q); "number"; "seconds", or None for
        always in "seconds or always"; "choice", one of `choices`; "pair or word", two numbers or
        one of these; "word or flag", one of these, True or False.
    default : object
        Its default; None where that depends on the method, or where nothing is given.
    meaning : str
        What it is, in one sentence without a full stop.
    expected : str
        The values that are allowed, in words.
    unit : str
        Unit of a number, "" where there is none.
    choices : tuple of str
        The values of a choice, or the words in place of two numbers.
    methods : tuple of str
        The methods that use it; none where there are no methods and it always counts.
    """

    name: str
    kind: Kind
    default: object
    meaning: str
    expected: str
    unit: str = ""
    choices: tuple[str, ...] = ()
    methods: tuple[str, ...] = ()

    @classmethod
    def choice(cls, name: str, choices: tuple[str, ...], meaning: str) -> Option:
        """Return one of some words, of which the first is the default."""
        return cls(name, "choice", choices[0], meaning, _join_words(choices, "or"), choices=choices)


def options_of_rows(rows: Iterable[_Option]) -> Iterator[Option]:
    """Yield the rows of one of the core's tables, in the order in which help shows them."""
    for row in rows:
        parts: dict[str, Any] = dict(row)
        words = {name: tuple(parts[name]) for name in ("choices", "methods")}
        yield Option(**(parts | words))


def index_by_name(rows: Iterable[Option]) -> Mapping[str, Option]:
    """Return a table by the names of its options."""
    return MappingProxyType({option.name: option for option in rows})


FILTER_OPTIONS: Final = index_by_name(options_of_rows(filter_options()))

METHODS: Final = FILTER_OPTIONS["method"].choices
"""All methods: the published ones, then the one that tunes itself."""

PUBLISHED_METHODS: Final = FILTER_OPTIONS["order"].methods
"""The methods that have an ARMA model of the drift."""


REST_LIMITS: Final = MappingProxyType(
    {
        # Motors that run shake a sensor at rest by 2 to 5 deg/s; a hand moves its mean as well, by
        # more than the three tenths of this that a rest may.
        "rest_limit": 10.0,
        # Data sheets allow MEMS gyros up to this at power-on; what turns for long is often faster.
        "bias_limit": 20.0,
    }
)
"""deg/s: what rest can be for a MEMS gyro, where the unit of the samples is known."""


def add_rest_limits(
    options: Mapping[str, Any],
    methods: Sequence[str],
    unit: str | None,
    names: Iterable[str] = tuple(REST_LIMITS),
) -> dict[str, Any]:
    """Return options of filters with the limits of rest, if the unit is known.

    Parameters
    ----------
    options : mapping
        Those that were given; a limit among them stands, None for no limit.
    methods : sequence of str
        The methods that run.
    unit : str or None
        Of the samples.
    names : iterable of str
        Which of `REST_LIMITS`; default all.

    Returns
    -------
    dict
        The options, and in the unit of the samples those of the limits that a method uses. There
        are none for what is no rate, and with ``motion="ignore"``, which takes all for rest.
    """
    if unit is None or not _is_rate(unit) or options.get("motion") == "ignore":
        return dict(options)
    limits = {
        name: convert(REST_LIMITS[name], "deg/s", unit)
        for name in names
        if set(_find_option(name).methods) & set(methods)
    }
    return limits | dict(options)


def check_used(
    names: Iterable[str],
    methods: Sequence[str],
    options: Mapping[str, Option] = FILTER_OPTIONS,
) -> None:
    """Refuse options that no method uses.

    Parameters
    ----------
    names : iterable of str
        Names of options.
    methods : sequence of str
        The methods that run.
    options : mapping
        The table that the names are of; by default that of the drift filter.

    Raises
    ------
    ValueError
        If there is such an option: it is named with the methods, and with those that use it.
    """
    for name in names:
        users = _find_option(name, options).methods
        if not set(users) & set(methods):
            running = f"method{'s' if len(methods) > 1 else ''} {_join_words(methods)}"
            raise ArgumentError(name, f"has no effect on {running}, only on {_join_words(users)}")


def select_options(method: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that a method uses, of those given for several methods."""
    return {name: value for name, value in options.items() if method in _find_option(name).methods}


def check_options(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of one filter, after checking them as the filter itself does.

    Returns
    -------
    dict
        The options, the method among them.

    Raises
    ------
    ValueError
        If one is out of range, or not used by the method.
    TypeError
        If there is no such option, or it is of another type.
    """
    method = options.get("method", FILTER_OPTIONS["method"].default)
    # The filter says what a method may be.
    DriftFilter(1.0, **{"method": method, **select_options(method, options)})
    check_used(options, [method])
    return {"method": method, **options}


def _is_rate(unit: str) -> bool:
    try:
        return kind(unit) == "rate"
    except ValueError:
        return False


def _find_option(name: str, options: Mapping[str, Option] = FILTER_OPTIONS) -> Option:
    if name not in options:
        raise TypeError(f"unknown option '{name}', expected some of {', '.join(options)}")
    return options[name]
