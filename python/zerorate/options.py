"""Options of the drift filter: names, defaults, ranges, units and methods.

The compiled core has the table and uses it in error messages. The command line is built from the
rows that this module reads.
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
    # Only the stub lists the arguments with names and types.
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
        Keyword of the option.
    kind : str
        Kind of the value:

        - "number" or "seconds"
        - "seconds or always": seconds, or None for always
        - "order": two whole numbers (p, q)
        - "choice": one of `choices`
        - "pair or word": two numbers, or one of `choices`
        - "word or flag": one of `choices`, True or False
    default : object
        Default value; None if the default depends on the method, or if there is no default.
    meaning : str
        Meaning of the option, without a full stop at the end.
    expected : str
        Allowed values, in words.
    unit : str
        Unit of a number, "" without a unit.
    choices : tuple of str
        Words that are allowed as values.
    methods : tuple of str
        Methods that use the option; empty if the filter has no methods.
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
        """Return an option with a choice of words; the first word is the default."""
        return cls(name, "choice", choices[0], meaning, _join_words(choices, "or"), choices=choices)


def options_of_rows(rows: Iterable[_Option]) -> Iterator[Option]:
    """Yield the options of a table of the core, in the order of the help."""
    for row in rows:
        parts: dict[str, Any] = dict(row)
        words = {name: tuple(parts[name]) for name in ("choices", "methods")}
        yield Option(**(parts | words))


def index_by_name(rows: Iterable[Option]) -> Mapping[str, Option]:
    """Return the options by name."""
    return MappingProxyType({option.name: option for option in rows})


FILTER_OPTIONS: Final = index_by_name(options_of_rows(filter_options()))

METHODS: Final = FILTER_OPTIONS["method"].choices
"""All methods: the published ones, then the one that tunes itself."""

PUBLISHED_METHODS: Final = FILTER_OPTIONS["order"].methods
"""Methods that use an ARMA model of the drift."""


REST_LIMITS: Final = MappingProxyType(
    {
        # A running engine shakes a sensor at rest by 2 to 5 deg/s. Motion by hand also changes the
        # mean, by more than the three tenths of this limit that a rest allows.
        "rest_limit": 10.0,
        # Data sheets of MEMS gyros allow this bias at power-on; steady rotations are often faster.
        "bias_limit": 20.0,
    }
)
"""Limits of a rest for MEMS gyros, deg/s, used if the unit of the samples is known."""


def add_rest_limits(
    options: Mapping[str, Any],
    methods: Sequence[str],
    unit: str | None,
    names: Iterable[str] = tuple(REST_LIMITS),
) -> dict[str, Any]:
    """Return filter options with the default limits of rest added, if the unit is known.

    Parameters
    ----------
    options : mapping
        Options of the user. A limit in them replaces the default limit; None means no limit.
    methods : sequence of str
        Methods that will run.
    unit : str or None
        Unit of the samples; None if not known.
    names : iterable of str
        Names of limits in `REST_LIMITS` to add; default all.

    Returns
    -------
    dict
        The options and the limits that a method uses, in the unit of the samples. No limit is added
        if the samples are no rates, or with ``motion="ignore"``.
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
    """Raise ValueError for options that no method uses.

    Parameters
    ----------
    names : iterable of str
        Names of options.
    methods : sequence of str
        Methods that will run.
    options : mapping
        Options by name; default: options of the drift filter.

    Raises
    ------
    ValueError
        If none of the methods uses an option. The message names methods that use it.
    """
    for name in names:
        users = _find_option(name, options).methods
        if not set(users) & set(methods):
            running = f"method{'s' if len(methods) > 1 else ''} {_join_words(methods)}"
            raise ArgumentError(name, f"has no effect on {running}, only on {_join_words(users)}")


def select_options(method: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that a method uses."""
    return {name: value for name, value in options.items() if method in _find_option(name).methods}


def check_options(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of one filter after the filter has checked them.

    Returns
    -------
    dict
        The options, with the method.

    Raises
    ------
    ValueError
        If a value is out of range, or the method does not use the option.
    TypeError
        If an option is unknown, or its value has a wrong type.
    """
    method = options.get("method", FILTER_OPTIONS["method"].default)
    # The filter checks the name of the method.
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
