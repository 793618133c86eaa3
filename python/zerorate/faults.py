"""Sentences and errors that know which arguments they are about, however these are written.

Python writes ``rate=100`` where a shell has ``--rate 100``. A `Sentence` is the text as Python
writes it, and keeps its parts, so that `told` can write the arguments in another way. Nobody reads
a sentence to find out what it is about: an error has an ``argument`` for that.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, NamedTuple, Self, TypeAlias

__all__ = [
    "Argument",
    "ArgumentError",
    "Sentence",
    "bare",
    "given",
    "naming",
    "packed",
    "said",
    "sentence_of",
    "told",
    "unpacked",
    "without",
]


class Argument(NamedTuple):
    """An argument that a sentence names, maybe with the value that it should have.

    Attributes
    ----------
    name : str
        Its keyword.
    value : str
        What a shell would have after it; "" for the name alone.
    python : str
        How Python writes both.
    beside : tuple of Argument
        Further ones that only a shell needs.
    """

    name: str
    value: str
    python: str
    beside: "tuple[Argument, ...]" = ()


def given(name: str, value: str = "", python: str | None = None, *beside: Argument) -> Argument:
    """Return an argument as it is given: ``rate=`` or ``rate=100``, or as `python` says."""
    return Argument(name, value, f"{name}={value}" if python is None else python, beside)


def bare(name: str) -> Argument:
    """Return an argument of which the name alone is said, as in 'rate must be positive'."""
    return Argument(name, "", name)


Naming: TypeAlias = Mapping[str, str]
"""What arguments are called, by their keywords: ``--time-unit`` for ``time_unit``.

One that is not among them, as there is no such option, is written as Python has it.
"""


class Sentence(str):
    """A text that names arguments, as Python writes them.

    Attributes
    ----------
    parts : tuple of str and Argument
        What it consists of.
    """

    parts: tuple[str | Argument, ...]

    @classmethod
    def of(cls, *parts: str | Argument) -> Self:
        """Return the sentence of parts, which may be sentences too."""
        flat: list[str | Argument] = []
        for part in parts:
            flat.extend(part.parts if isinstance(part, Sentence) else (part,))
        made = cls("".join(one.python if isinstance(one, Argument) else one for one in flat))
        made.parts = tuple(flat)
        return made

    def __reduce__(self) -> tuple[Callable[..., Self], tuple[str | Argument, ...]]:
        """Let the parts come along to another process."""
        return type(self).of, self.parts

    def each(self, change: Callable[[str], str]) -> Self:
        """Return the sentence with its texts changed, and its arguments as they are."""
        return self.of(*(one if isinstance(one, Argument) else change(one) for one in self.parts))

    def named(self, naming: Naming) -> str:
        """Return the text with the arguments called otherwise, as they are typed in a shell."""
        return "".join(
            _typed(one, naming) if isinstance(one, Argument) else one for one in self.parts
        )


def _typed(argument: Argument, naming: Naming) -> str:
    if argument.name not in naming:
        return argument.python
    own = f"{naming[argument.name]} {argument.value}".rstrip()
    return " ".join((own, *(_typed(one, naming) for one in argument.beside)))


said = Sentence.of


class ArgumentError(ValueError):
    """An argument is not what it must be.

    Parameters
    ----------
    argument : str
        Its keyword, with which the message begins.
    fault : str
        The rest of the sentence: 'must be positive, got -1'.
    """

    def __init__(self, argument: str, fault: str) -> None:
        """Make the sentence."""
        super().__init__(said(bare(argument), " ", fault))
        self.argument = argument
        self._fault = fault

    def __reduce__(self) -> tuple[type[Self], tuple[str, str]]:
        """Let it be raised in another process."""
        return type(self), (self.argument, self._fault)


def sentence_of(error: BaseException) -> str:
    """Return what an error says, as a `Sentence` if it names arguments.

    One of the compiled module begins with the name of its ``argument``.
    """
    text = error.args[0] if error.args else ""
    if isinstance(text, Sentence):
        return text
    text, argument = str(error), getattr(error, "argument", None)
    if argument and text.startswith(argument):
        return said(bare(argument), text.removeprefix(argument))
    return text


def without(text: str, prefix: str) -> str:
    """Return a text, which may be a sentence, without what it begins with."""
    if not isinstance(text, Sentence):
        return text.removeprefix(prefix)
    first, *rest = text.parts
    return said(first if isinstance(first, Argument) else first.removeprefix(prefix), *rest)


def packed(text: str) -> object:
    """Return a text, which may be a sentence, as JSON keeps it."""
    return text.parts if isinstance(text, Sentence) else text


def unpacked(kept: Any) -> str:  # noqa: ANN401
    """Return the text that `packed` gave."""
    return kept if isinstance(kept, str) else said(*map(_part, kept))


def _part(kept: Any) -> str | Argument:  # noqa: ANN401
    if isinstance(kept, str):
        return kept
    return _argument(kept)


def _argument(kept: Any) -> Argument:  # noqa: ANN401
    name, value, python, beside = kept
    return Argument(name, value, python, tuple(map(_argument, beside)))


_NAMING: ContextVar[Naming | None] = ContextVar("naming", default=None)


@contextmanager
def naming(names: Naming) -> Iterator[None]:
    """Let `told`, and with it all tables, call arguments by these names, others as before."""
    before = _NAMING.set({**(_NAMING.get() or {}), **names})
    try:
        yield
    finally:
        _NAMING.reset(before)


def told(text: str) -> str:
    """Return a text as it is shown: by Python's names, unless `naming` says others."""
    names = _NAMING.get()
    return text.named(names) if isinstance(text, Sentence) and names is not None else text
