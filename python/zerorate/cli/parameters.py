"""Options and arguments of commands.

A command is a function with annotations that declare its options. An `Option` or an `Argument`
declares one option; a dataclass or another `Group` declares several.
"""

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from types import NoneType, UnionType
from typing import (
    Annotated,
    Any,
    Final,
    Literal,
    Protocol,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

from zerorate.cli.errors import UsageFault

REQUIRED: Final = inspect.Parameter.empty
_MIN_SIMILARITY: Final = 0.8
_MAX_SHOWN_CHOICES: Final = 30
"""Largest width of choices shown next to an option's name, characters."""
_OFF: Final = "--no-"
"""Prefix of flags that turn off a default."""
_NUMBERS: Final = {float: "a number", int: "a whole number"}
_OPTION: Final = "option"
"""Key of a field's metadata for its option."""
_METAVARS: Final = {float: "NUMBER", int: "N", Path: "FILE"}

T = TypeVar("T")
Typed = Mapping[str, Any]
"""Typed values by parameter name."""


@dataclass(frozen=True)
class Option:
    """Option with its help.

    Parameters
    ----------
    help : str
        What to type and what it does.
    flags : str
        Flags, separated by blanks. Default: two hyphens and the name.
    metavar : str
        Placeholder of the value in help. Default: its choices, or a word for its type.
    panel : str
        Panel of help.
    shown : str, optional
        Default as shown in help; "" to hide it.
    choices : sequence of str
        Allowed values; empty for all.
    parse : callable, optional
        Function of the flag and the typed text that returns the value.
    convert : callable, optional
        Function of the typed number that returns the value in another unit.
    min, max : float, optional
        Bounds of a number.
    name, kind, default, many
        Name, type and default of the parameter, and True for a list; read from the annotation.
    """

    help: str
    flags: str = ""
    metavar: str = ""
    panel: str = ""
    shown: str | None = None
    choices: Sequence[str] = ()
    parse: Callable[[str, str], Any] | None = None
    convert: Callable[[float], float] | None = None
    min: float | None = None
    max: float | None = None
    name: str = ""
    kind: Any = str
    default: Any = REQUIRED
    many: bool = False

    def of(self, name: str, hint: Any, default: object, panel: str) -> "Option":  # noqa: ANN401
        """Return the option of a parameter."""
        kind = _without_none(hint)
        many = get_origin(kind) is list
        kind = get_args(kind)[0] if many else kind
        choices = self.choices
        if get_origin(kind) is Literal:
            # `parse` may accept other words than the listed ones.
            kind, choices = str, choices or (() if self.parse else get_args(kind))
        return replace(
            self,
            name=name,
            kind=kind,
            default=default,
            many=many,
            choices=choices,
            panel=self.panel or panel,
        )

    @property
    def is_flag(self) -> bool:
        """True if the option has no value."""
        return self.kind is bool

    @property
    def on(self) -> list[str]:
        """Flags that turn on the option."""
        flags = self.flags.split() or [f"--{self.name.rstrip('_').replace('_', '-')}"]
        return [one for one in flags if self.default is not True or not one.startswith(_OFF)]

    @property
    def off(self) -> list[str]:
        """Flags that turn off a default."""
        if self.default is not True:
            return []
        return [f"{_OFF}{one[2:]}" for one in self.on] or self.flags.split()

    @property
    def all_flags(self) -> list[str]:
        """All flags; those that turn it off are last."""
        return [*self.on, *self.off]

    @property
    def flag(self) -> str:
        """Flag for messages: the first long flag."""
        return next((one for one in self.all_flags if one.startswith("--")), self.all_flags[0])

    def value(self, text: str) -> Any:  # noqa: ANN401
        """Return the value of a typed text; usage fault if it is not valid."""
        if self.choices and text not in self.choices:
            *most, last = self.choices
            listed = f"{', '.join(most)} or {last}" if most else last
            raise UsageFault(f"{self.flag} takes {listed}, got {text!r}")
        if self.parse is not None:
            return self.parse(self.flag, text)
        if self.kind not in _NUMBERS:
            return self.kind(text)
        try:
            number = self.kind(text)
        except ValueError:
            raise UsageFault(f"{self.flag} takes {_NUMBERS[self.kind]}") from None
        if self.min is not None and number < self.min:
            raise UsageFault(f"{self.flag} must be greater than or equal to {self.min}")
        if self.max is not None and number > self.max:
            raise UsageFault(f"{self.flag} must be less than or equal to {self.max}")
        return number if self.convert is None else self.convert(number)

    @property
    def typed(self) -> str:
        """Option as typed, with its value."""
        names = ", ".join(sorted(self.off or self.on, key=len))
        return names if self.is_flag else f"{names} {self._takes}"

    @property
    def meaning(self) -> str:
        """Text for help: meaning, choices and default."""
        listed = f" One of {', '.join(self.choices)}." if self._has_many_choices else ""
        default = f" Default: {self._default}." if self._default else ""
        return f"{self.help}{listed}{default}"

    @property
    def _has_many_choices(self) -> bool:
        return len("|".join(self.choices)) > _MAX_SHOWN_CHOICES

    @property
    def _takes(self) -> str:
        if self.metavar or not self.choices:
            return self.metavar or _METAVARS.get(self.kind, "NAME")
        return "WORD" if self._has_many_choices else "|".join(self.choices)

    @property
    def _default(self) -> str:
        value = self.default
        if self.shown is not None:
            return self.shown
        if self.is_flag or value in (REQUIRED, None, "", ()):
            return ""
        if value == ".":
            return "this folder"
        text = ",".join(value) if isinstance(value, tuple) else str(value)
        text = f"{value:g}" if isinstance(value, float) else text
        return text.replace(",", ", ") if len(text) > _MAX_SHOWN_CHOICES else text


class Argument(Option):
    """An argument without a flag."""

    @property
    def on(self) -> list[str]:
        """No flags."""
        return []

    @property
    def typed(self) -> str:
        """Name of the argument, in brackets if optional."""
        name = self.name.upper() + ("..." if self.many else "")
        return name if self.default is REQUIRED else f"[{name}]"


def option(default: T, help: str, flags: str = "", **about: Any) -> T:  # noqa: ANN401
    """Return a dataclass field with an `Option`."""
    return field(default=default, metadata={_OPTION: Option(help, flags, **about)})


class Group(Protocol):
    """Several options that a command receives as one object."""

    def options(self) -> Iterator[Option]:
        """Yield the options."""

    def value(self, typed: Typed) -> Any:  # noqa: ANN401
        """Return the object; `typed` contains the typed values without defaults."""


@dataclass(frozen=True)
class Taker:
    """Command or dataclass with options as keywords.

    Options without a panel of help use the class's `panel`.
    """

    takes: Callable[..., Any]

    @cached_property
    def members(self) -> dict[str, "Option | Group"]:
        """Options and groups by keyword."""
        parameters = inspect.signature(self.takes).parameters
        hints = get_type_hints(self.takes, include_extras=True)
        return {name: self._member(one, hints[name]) for name, one in parameters.items()}

    def _member(self, parameter: inspect.Parameter, hint: Any) -> "Option | Group":  # noqa: ANN401
        kind, *about = get_args(hint) if get_origin(hint) is Annotated else (hint,)
        own = getattr(self.takes, "__dataclass_fields__", {}).get(parameter.name)
        if own is not None and _OPTION in own.metadata:
            about = [own.metadata[_OPTION]]
        if not about:
            return Taker(kind)
        if not isinstance(about[0], Option):
            group: Group = about[0]
            return group
        panel = getattr(self.takes, "panel", "")
        return about[0].of(parameter.name, kind, parameter.default, panel)

    def options(self) -> Iterator[Option]:
        """Yield all options, including those of groups."""
        for one in self.members.values():
            yield from (one,) if isinstance(one, Option) else one.options()

    def value(self, typed: Typed) -> Any:  # noqa: ANN401
        """Return the object made from the typed values."""
        return self.takes(
            **{
                name: typed.get(name, one.default) if isinstance(one, Option) else one.value(typed)
                for name, one in self.members.items()
            }
        )


def _without_none(hint: Any) -> Any:  # noqa: ANN401
    """Return the type of a parameter without None."""
    kinds = [one for one in get_args(hint) if one is not NoneType]
    return kinds[0] if get_origin(hint) in (Union, UnionType) else hint


class AsTyped:
    """All typed values, for a command that rejects some of them."""

    def options(self) -> Iterator[Option]:
        """Yield nothing."""
        return iter(())

    def value(self, typed: Typed) -> Typed:
        """Return the typed values."""
        return typed


@dataclass(frozen=True)
class Hint:
    """Hint after an error: how to get help, and an example."""

    help: str
    example: str


def parse(options: Sequence[Option], words: Sequence[str], hint: Hint) -> dict[str, Any]:
    """Return the typed values by name; usage fault for a wrong one."""
    texts, rest = _texts(options, words, hint)
    for one in options:
        if isinstance(one, Argument) and rest:
            texts[one.name] = [rest.pop(0)] if not one.many else rest
            rest = [] if one.many else rest
    known = {one.name: one for one in options}
    values: dict[str, Any] = {}
    for name, typed in texts.items():
        taken = known[name]
        value = bool if taken.is_flag else taken.value
        values[name] = [*map(value, typed)] if taken.many else value(typed[-1])
    for one in options:
        if one.default is REQUIRED and one.name not in values:
            called = one.name if isinstance(one, Argument) else one.on[0]
            raise UsageFault(f"missing: {called}; for example: {hint.example}")
    if rest:
        raise UsageFault(f"unexpected: {' '.join(rest)}; for example: {hint.example}")
    return {name: values[name] for name in known if name in values}


def _texts(
    options: Sequence[Option], words: Sequence[str], hint: Hint
) -> tuple[dict[str, list[Any]], list[str]]:
    """Return the texts after each flag, in order, and all other words."""
    flags = {flag: one for one in options for flag in one.all_flags}
    texts: dict[str, list[Any]] = {}
    rest: list[str] = []
    left = iter(words)
    for word in left:
        if word == "--":
            return texts, [*rest, *left]
        if word == "-" or not word.startswith("-"):
            rest.append(word)
            continue
        flag, attached, text = word.partition("=")
        if not word.startswith("--"):
            flag, attached, text = word[:2], word[2:], word[2:]
        if flag not in flags:
            raise UsageFault(unknown("option", flag, [*flags], hint))
        one, typed = flags[flag], text if attached else None
        if one.is_flag and attached:
            raise UsageFault(f"Option '{flag}' does not take a value.")
        if not one.is_flag and typed is None and (typed := next(left, None)) is None:
            raise UsageFault(f"Option '{flag}' requires an argument.")
        texts.setdefault(one.name, []).append(flag in one.on if one.is_flag else typed)
    return texts, rest


def unknown(what: str, got: str, known: Sequence[str], hint: Hint) -> str:
    """Return a sentence on an unknown word, with a similar known word."""
    shown = got if what == "option" else f"'{got}'"
    meant = get_close_matches(got, known, n=1, cutoff=_MIN_SIMILARITY)
    return f"there is no {what} {shown}; " + (
        f"did you mean {meant[0]}?" if meant else f"{hint.help} lists all"
    )
