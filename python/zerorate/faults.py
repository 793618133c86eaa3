"""Sentences and errors that name arguments, for Python and for the shell.

Python writes ``rate=100``, a shell writes ``--rate 100``. A `Sentence` is the text in Python's
form. It also keeps its parts, and `render_text` can then write the arguments in the shell's form.
Code that needs the argument of an error reads its ``argument`` attribute.
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
    """An argument named in a sentence, with its value if any.

    Attributes
    ----------
    name : str
        Keyword of the argument.
    value : str
        Value as typed in a shell; "" to write only the name.
    python : str
        Name and value as in Python code: ``rate=100``.
    shell_only : tuple of Argument
        Further arguments that only the shell command needs.
    """

    name: str
    value: str
    python: str
    shell_only: "tuple[Argument, ...]" = ()


def keyword_argument(
    name: str, value: str = "", python: str | None = None, *shell_only: Argument
) -> Argument:
    """Return an argument with its value, ``rate=100``, or in the form given by `python`."""
    return Argument(name, value, f"{name}={value}" if python is None else python, shell_only)


def bare_argument(name: str) -> Argument:
    """Return an argument without a value, as in 'rate must be positive'."""
    return Argument(name, "", name)


Naming: TypeAlias = Mapping[str, str]
"""Shell names of arguments by keyword: ``--time-unit`` for ``time_unit``.

An argument without an entry keeps its name in Python.
"""


class Sentence(str):
    """A text that names arguments, in Python's form.

    Attributes
    ----------
    parts : tuple of str and Argument
        Texts and arguments of the sentence, in order.
    """

    parts: tuple[str | Argument, ...]

    @classmethod
    def of(cls, *parts: str | Argument) -> Self:
        """Return a sentence made of texts, arguments and sentences."""
        flat: list[str | Argument] = []
        for part in parts:
            flat.extend(part.parts if isinstance(part, Sentence) else (part,))
        made = cls("".join(item.python if isinstance(item, Argument) else item for item in flat))
        made.parts = tuple(flat)
        return made

    def __reduce__(self) -> tuple[Callable[..., Self], tuple[str | Argument, ...]]:
        """Keep the parts when the sentence is pickled for another process."""
        return type(self).of, self.parts

    def map_texts(self, change: Callable[[str], str]) -> Self:
        """Return the sentence with `change` applied to its texts; its arguments stay the same."""
        return self.of(
            *(part if isinstance(part, Argument) else change(part) for part in self.parts)
        )

    def with_names(self, naming: Naming) -> str:
        """Return the text with the names of arguments replaced, for example by shell names."""
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
    """Error for an argument with an invalid value.

    Parameters
    ----------
    argument : str
        Keyword of the argument; the message begins with it.
    fault : str
        Rest of the message: 'must be positive, got -1'.
    """

    def __init__(self, argument: str, fault: str) -> None:
        """Build the message."""
        super().__init__(make_sentence(bare_argument(argument), " ", fault))
        self.argument = argument
        self._fault = fault

    def __reduce__(self) -> tuple[type[Self], tuple[str, str]]:
        """Make the error picklable, so another process can raise it."""
        return type(self), (self.argument, self._fault)


def sentence_of(error: BaseException) -> str:
    """Return the message of an error, as a `Sentence` if it names arguments.

    Messages of the compiled module begin with the name of their ``argument``.
    """
    text = error.args[0] if error.args else ""
    if isinstance(text, Sentence):
        return text
    text, argument = str(error), getattr(error, "argument", None)
    if argument and text.startswith(argument):
        return make_sentence(bare_argument(argument), text.removeprefix(argument))
    return text


def strip_prefix(text: str, prefix: str) -> str:
    """Return a text or sentence without its prefix."""
    if not isinstance(text, Sentence):
        return text.removeprefix(prefix)
    first, *rest = text.parts
    return make_sentence(
        first if isinstance(first, Argument) else first.removeprefix(prefix), *rest
    )


def pack_text(text: str) -> object:
    """Return a text or sentence as an object for JSON."""
    return text.parts if isinstance(text, Sentence) else text


def unpack_text(content: Any) -> str:  # noqa: ANN401
    """Return the text or sentence from the output of `pack_text`."""
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
    """Set the argument names that `render_text` and all tables write within ``with``."""
    before = _NAMING.set({**(_NAMING.get() or {}), **names})
    try:
        yield
    finally:
        _NAMING.reset(before)


def render_text(text: str) -> str:
    """Return a text with the argument names of `use_argument_names`, or Python's names."""
    names = _NAMING.get()
    return text.with_names(names) if isinstance(text, Sentence) and names is not None else text
