"""What was typed wrongly, in plain words: by what a command takes, not by what typer says of it."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from enum import Enum
from typing import Any, Final, get_args

_ALIKE: Final = 0.8
_NUMBERS: Final = {float: "a number", int: "a whole number"}


@dataclass(frozen=True)
class Hint:
    """What helps on with a command that was mistyped: a way to its help, and an example."""

    help: str
    example: str


def flags_of(command: Any, others: Mapping[str, str]) -> dict[str, str]:  # noqa: ANN401
    """Return how the arguments that a sentence may name are called as options of a command.

    `others` are those of which the option has another name, or stands for an argument of one.
    """
    options = [_flag(one) for one in command.params if one.opts[0].startswith("-")]
    return {flag.lstrip("-").replace("-", "_"): flag for flag in options} | dict(others)


def in_plain_words(
    error: Any,  # noqa: ANN401
    taken: Callable[..., None] | None,
    typed: Sequence[str],
    hint: Hint,
) -> str:
    """Return what is wrong with what was typed, and how it is right.

    Parameters
    ----------
    error : Exception
        A usage error of typer, whose classes have no names that are the same in each version.
    taken : callable or None
        The function of the command, whose annotations say what it takes.
    typed : sequence of str
        What stands after the command.
    hint : Hint
        What helps on.
    """
    parameter = getattr(error, "param", None)
    if parameter is not None and hasattr(error, "param_type"):
        called = parameter.opts[0] if _is_option(parameter) else parameter.name.lower()
        return f"missing: {called}; for example: {hint.example}"
    if hasattr(error, "possibilities"):
        return unknown("option", error.option_name, error.possibilities or (), hint)
    if parameter is not None and taken is not None:
        told = _refused(parameter, taken, _parsed(error.ctx, typed)[0].get(parameter.name))
        return told or error.format_message()
    extra = _extra(error, typed) if taken is not None else []
    if extra:
        return f"unexpected: {' '.join(extra)}; for example: {hint.example}"
    text: str = error.format_message()
    return text


def unknown(what: str, got: str, known: Sequence[str], hint: Hint) -> str:
    """Return a sentence on a word that is not known, with one that may have been meant."""
    shown = got if what == "option" else f"'{got}'"
    meant = get_close_matches(got, known, n=1, cutoff=_ALIKE)
    return f"there is no {what} {shown}; " + (
        f"did you mean {meant[0]}?" if meant else f"{hint.help} lists all"
    )


def _refused(parameter: Any, taken: Callable[..., None], value: object) -> str | None:  # noqa: ANN401
    """Return what an option takes in place of a value, by the annotation of its parameter."""
    kind, about = annotated(inspect.signature(taken, eval_str=True).parameters[parameter.name])
    called = _flag(parameter)
    if isinstance(kind, type) and issubclass(kind, Enum):
        *most, last = (str(one.value) for one in kind)
        choices = f"{', '.join(most)} or {last}" if most else last
        return f"{called} takes {choices}, got {value!r}"
    if kind not in _NUMBERS:
        return None
    try:
        number = kind(value)
    except (TypeError, ValueError):
        return f"{called} takes {_NUMBERS[kind]}"
    if about.min is not None and number < about.min:
        return f"{called} must be greater than or equal to {about.min}"
    return f"{called} must be less than or equal to {about.max}"


def annotated(parameter: inspect.Parameter) -> tuple[Any, Any]:
    """Return the type that a parameter takes beside None, and what typer knows of it."""
    given, about = get_args(parameter.annotation)[:2]
    kinds = [one for one in get_args(given) if one is not type(None)]
    return (kinds[0] if kinds else given), about


def _parsed(context: Any, typed: Sequence[str]) -> tuple[dict[str, Any], list[str]]:  # noqa: ANN401
    """Return the texts of each parameter, and the words that are of none."""
    options, rest, _ = context.command.make_parser(context).parse_args(args=list(typed))
    return options, rest


def _extra(error: Any, typed: Sequence[str]) -> list[str]:  # noqa: ANN401
    """Return the words that a command does not take, if these are its fault."""
    # One with a name of its own is of an option that lacks its value, which cannot be parsed.
    if type(error).__name__ != "UsageError" or error.ctx is None:
        return []
    return _parsed(error.ctx, typed)[1]


def _is_option(parameter: Any) -> bool:  # noqa: ANN401
    return bool(parameter.opts[0].startswith("-"))


def _flag(parameter: Any) -> str:  # noqa: ANN401
    """Return the option as help names it: the first that is written out."""
    names: list[str] = parameter.opts
    return next((one for one in names if one.startswith("--")), names[0])
