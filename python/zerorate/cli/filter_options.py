"""Options of the filters as command options, from the package's tables."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any, Final, TypeAlias

from zerorate._native import DriftFilter
from zerorate.cli.errors import as_usage
from zerorate.cli.parameters import Option, Typed
from zerorate.cli.values import parse_number_or_word, parse_order, parse_pair_or_word
from zerorate.faults import use_argument_names
from zerorate.options import FILTER_OPTIONS, METHODS, REST_LIMITS, check_used, select_options
from zerorate.options import Option as Row

_NONE_WORDS: Final = {"adapt_for": "always", "rest_limit": "none", "bias_limit": "none"}
"""Words for None on the command line, for options with a number as default."""

_TAKEN: Final = {"order": "two numbers p,q: p from 1 to 3, q from 0 to 3"}
"""Values that are typed differently from Python, by kind of option."""

_SHOWN: Final = {
    "order": "2,1; robust: 1,0",
    **{name: f"{limit:g} deg/s, where the unit is known" for name, limit in REST_LIMITS.items()},
}
"""Defaults that depend on the method or the unit, as shown in help."""

_SWITCH: Final = {"on": True, "off": False}
"""Words for True and False, for options that also accept other words."""

_FLAGS: Final = {
    # In commands that write files, --output is the destination.
    "output": "--output-kind",
    # In commands that read logs, --scale multiplies their values.
    "scale": "--noise-scale",
}
"""Options of the drift filter with another name than in Python."""


def own_flag(name: str) -> str:
    """Return the flag of an option with the same name as in Python."""
    return f"--{name.replace('_', '-')}"


def flag(name: str) -> str:
    """Return the flag of an option of the drift filter."""
    return _FLAGS.get(name, own_flag(name))


def check_filter_options(options: Mapping[str, Any], methods: Sequence[str]) -> None:
    """Raise a usage fault for an option that no method uses, or an invalid value."""
    with use_argument_names({name: flag(name) for name in FILTER_OPTIONS}), as_usage():
        check_used(options, methods)
        for method in methods:
            # Errors do not depend on the rate.
            DriftFilter(1.0, **{**select_options(method, options), "method": method})


@dataclass(frozen=True)
class TableOptions:
    """Options of a table; a command receives a mapping of the typed options by name.

    Parameters
    ----------
    table : mapping of str to Option
        Table of options.
    panel : str
        Panel of help for options that every method uses.
    flag_of : callable
        Function that returns an option's flag on the command line.
    always : sequence of str
        Options that are always passed on, even at their default.
    """

    table: Mapping[str, Row]
    panel: str = "Filter"
    flag_of: Callable[[str], str] = own_flag
    always: Sequence[str] = ()

    def options(self) -> Iterator[Option]:
        """Yield the options."""
        for row in self.table.values():
            yield _option(row, self.flag_of(row.name), self.panel)

    def value(self, typed: Typed) -> dict[str, Any]:
        """Return the values of options that were typed or are always passed on."""
        usual = {name: self.table[name].default for name in self.always}
        names = {name: _name(self.flag_of(name)) for name in self.table}
        return usual | {name: typed[own] for name, own in names.items() if own in typed}


FilterOptions: TypeAlias = Annotated[
    Mapping[str, Any], TableOptions(FILTER_OPTIONS, flag_of=flag, always=("method",))
]
"""Options of `zerorate.DriftFilter`: the method, and all typed options."""


def _name(flag: str) -> str:
    return flag.removeprefix("--").replace("-", "_")


def _option(row: Row, flag: str, panel: str) -> Option:
    """Return an option of a table as a command option."""
    common = row.methods in (METHODS, ())
    option = Option(
        _help(row),
        flag,
        panel=panel if common else f"Only for {', '.join(row.methods)}",
        shown=_SHOWN.get(row.name),
        name=_name(flag),
        default=row.default,
    )
    if row.kind == "choice":
        return replace(option, choices=row.choices)
    if row.kind == "word or flag":
        return replace(option, choices=(*row.choices, *_SWITCH), parse=_parse_switch)
    if row.kind == "order":
        return replace(option, metavar="P,Q", parse=parse_order)
    if row.kind == "pair or word":
        pair = partial(parse_pair_or_word, words=row.choices)
        return replace(option, metavar="X,Y", parse=pair, default=_pair(row.default))
    if row.name in _NONE_WORDS:
        word = _NONE_WORDS[row.name]
        number = partial(parse_number_or_word, word=word)
        default = word if row.default is None else row.default
        return replace(option, metavar="NUMBER", parse=number, default=default)
    return replace(option, kind=float)


def _help(row: Row) -> str:
    """Return an option's meaning and values; choices are listed elsewhere."""
    meaning = f"{row.meaning[0].upper()}{row.meaning[1:]}."
    if row.kind in ("choice", "word or flag"):
        return meaning
    taken = _TAKEN.get(row.kind, row.expected)
    word = f", or '{_NONE_WORDS[row.name]}'" if row.name in _NONE_WORDS else ""
    return f"{meaning} {taken[0].upper()}{taken[1:]}{word}."


def _pair(default: Any) -> str:  # noqa: ANN401
    return ",".join(f"{number:g}" for number in default)


def _parse_switch(_: str, text: str) -> str | bool:
    return _SWITCH.get(text, text)
