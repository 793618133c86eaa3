"""Sentences and errors that know which arguments they are about, however these are written.

Python writes ``rate=100`` where a shell has ``--rate 100``. A `Sentence` is the text as Python
writes it, and keeps its parts, so that `render_text` can write the arguments in another way. Nobody
reads a sentence to find out what it is about: an error has an ``argument`` for that.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, NamedTuple, Self, TypeAlias

__all__ = [
    "Argument",
    "ArgumentError",
    "Sentence",
    "bare_argument",
    "keyword_argument",
    "make_sentence",
    "pack_text",
    "render_text",
    "sentence_of",
    "strip_prefix",
    "unpack_text",
    "use_argument_names",
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
    shell_only : tuple of Argument
        Further ones that only a shell needs.
    """

    name: str
    value: str
    python: str
    shell_only: "tuple[Argument, ...]" = ()


def keyword_argument(
    name: str, value: str = "", python: str | None = None, *shell_only: Argument
) -> Argument:
    """Return an argument as it is given: ``rate=`` or ``rate=100``, or as `python` says."""
    return Argument(name, value, f"{name}={value}" if python is None else python, shell_only)


def bare_argument(name: str) -> Argument:
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
        made = cls("".join(item.python if isinstance(item, Argument) else item for item in flat))
        made.parts = tuple(flat)
        return made

    def __reduce__(self) -> tuple[Callable[..., Self], tuple[str | Argument, ...]]:
        """Let the parts come along to another process."""
        return type(self).of, self.parts

    def map_texts(self, change: Callable[[str], str]) -> Self:
        """Return the sentence with its texts changed, and its arguments as they are."""
        return self.of(
            *(part if isinstance(part, Argument) else change(part) for part in self.parts)
        )

    def with_names(self, naming: Naming) -> str:
        """Return the text with the arguments called otherwise, as they are typed in a shell."""
        return "".join(
            _shell_text(part, naming) if isinstance(part, Argument) else part for part in self.parts
        )


def _shell_text(argument: Argument, naming: Naming) -> str:
    if argument.name not in naming:
        return argument.python
    own = f"{naming[argument.name]} {argument.value}".rstrip()
    return " ".join((own, *(_shell_text(extra, naming) for extra in argument.shell_only)))


make_sentence = Sentence.of


class ArgumentError(ValueError):
    """An argument is not as required.

    Parameters
    ----------
    argument : str
        Its keyword, with which the message begins.
    fault : str
        The rest of the sentence: 'must be positive, got -1'.
    """

    def __init__(self, argument: str, fault: str) -> None:
        """Make the sentence."""
        super().__init__(make_sentence(bare_argument(argument), " ", fault))
        self.argument = argument
        self._fault = fault

    def __reduce__(self) -> tuple[type[Self], tuple[str, str]]:
        """Let it be raised in another process."""
        return type(self), (self.argument, self._fault)


def sentence_of(error: BaseException) -> str:
    """Return the sentence of an error, as a `Sentence` if it names arguments.

    One of the compiled module begins with the name of its ``argument``.
    """
    text = error.args[0] if error.args else ""
    if isinstance(text, Sentence):
        return text
    text, argument = str(error), getattr(error, "argument", None)
    if argument and text.startswith(argument):
        return make_sentence(bare_argument(argument), text.removeprefix(argument))
    return text


def strip_prefix(text: str, prefix: str) -> str:
    """Return a text, which may be a sentence, without its prefix."""
    if not isinstance(text, Sentence):
        return text.removeprefix(prefix)
    first, *rest = text.parts
    return make_sentence(
        first if isinstance(first, Argument) else first.removeprefix(prefix), *rest
    )


def pack_text(text: str) -> object:
    """Return a text, which may be a sentence, as JSON keeps it."""
    return text.parts if isinstance(text, Sentence) else text


def unpack_text(content: Any) -> str:  # noqa: ANN401
    """Return the text that `pack_text` gave."""
    return content if isinstance(content, str) else make_sentence(*map(_part, content))


def _part(content: Any) -> str | Argument:  # noqa: ANN401
    if isinstance(content, str):
        return content
    return _argument(content)


def _argument(content: Any) -> Argument:  # noqa: ANN401
    name, value, python, shell_only = content
    return Argument(name, value, python, tuple(map(_argument, shell_only)))


_NAMING: ContextVar[Naming | None] = ContextVar("naming", default=None)


@contextmanager
def use_argument_names(names: Naming) -> Iterator[None]:
    """Let `render_text`, and with it all tables, call arguments by these names."""
    before = _NAMING.set({**(_NAMING.get() or {}), **names})
    try:
        yield
    finally:
        _NAMING.reset(before)


def render_text(text: str) -> str:
    """Return a text as it is shown: by Python's names, unless `use_argument_names` says others."""
    names = _NAMING.get()
    return text.with_names(names) if isinstance(text, Sentence) and names is not None else text
