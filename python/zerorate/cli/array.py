"""The array of ``zerorate replay --array``: what is typed of all gyros of a log as one."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from zerorate.array.options import ARRAY_OPTIONS
from zerorate.cli.errors import UsageFault
from zerorate.cli.options import flag

ARRAY: Final = "Several gyros of one body"
"""The panel of help."""

ARRAY_CONSTANTS: Final = {name: ARRAY_OPTIONS[name] for name in ("method", "scale_error")}
"""What the filter does not have as well."""

_FIND: Final = "find"
_WORDS: Final = ("auto", "mean", "white")
_USED: Final = ("method", "limit", "rest_limit", "bias_limit")
"""Options of the filter that an array has, too."""


@dataclass(frozen=True)
class OfArray:
    """What is typed of an array of gyros."""

    array: Annotated[
        bool,
        typer.Option(
            help="Make one gyro of all gyros of the log, which belong to one body. Of --columns "
            "three in a row are a sensor if they are named x, y, z."
        ),
    ] = False
    rotations: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="From each sensor's axes to those of the body, and positions for accelerometers "
            "(JSON); 'find' finds rotations from the log's motion and writes them. "
            "Default: all are aligned.",
        ),
    ] = None
    weights: Annotated[
        str | None,
        typer.Option(
            metavar="WORD",
            help="How much each sensor counts: auto (by noise at rest, by scale errors in motion), "
            "mean (alike), white (by white noise), or numbers, e.g. 0.5,0.3,0.2. Default: auto.",
        ),
    ] = None

    @property
    def finds(self) -> bool:
        """Whether rotations are to be found."""
        return self.rotations == _FIND

    @property
    def file(self) -> Path | None:
        """The file of rotations."""
        return None if self.rotations is None or self.finds else Path(self.rotations)

    def arguments(
        self, fusion: Mapping[str, Any], options: Mapping[str, Any]
    ) -> dict[str, Any] | None:
        """Return those of `zerorate.replay_array`; None, or a usage fault, where none is made."""
        given = {"--rotations": self.rotations, "--weights": self.weights}
        names = [name for name, value in given.items() if value is not None]
        names += map(array_flag, fusion)
        weights = _weights(self.weights)
        if self.array:
            limits = {name: options[name] for name in _USED[1:] if name in options}
            return {"rotations": self.rotations, "weights": weights, **limits, **fusion}
        if names:
            raise UsageFault(f"only --array takes {' and '.join(names)}")
        return None


def array_flag(name: str) -> str:
    """Return how a constant of the array is called beside the options of the filter."""
    return "--array-method" if name == "method" else f"--{name.replace('_', '-')}"


def _weights(text: str | None) -> str | list[float]:
    if text is None or text in _WORDS:
        return text or _WORDS[0]
    try:
        return [float(word) for word in text.split(",")]
    except ValueError:
        raise UsageFault(
            f"--weights takes {', '.join(_WORDS)} or numbers with commas between, got '{text}'"
        ) from None


def refuse_with_array(options: Mapping[str, Any], **typed: bool) -> None:
    """Raise a usage fault for what means nothing where one gyro is made of many."""
    others = [flag(name) for name in options if name not in _USED]
    others += ["--method"] if options["method"] != "auto" else []
    others += [f"--{name.replace('_', '-')}" for name, given in typed.items() if given]
    others = ["--figure all" if name == "--figure" else name for name in others]
    if others:
        verb = "has" if len(others) == 1 else "have"
        raise UsageFault(f"{', '.join(others)} {verb} no effect on --array")
