"""Options of ``zerorate replay --array``: all gyros of a log as one gyro."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, TypeAlias

from zerorate.array.options import ARRAY_OPTIONS
from zerorate.cli.errors import UsageFault
from zerorate.cli.filter_options import TableOptions, flag, own_flag
from zerorate.cli.parameters import option

_PANEL: Final = "Several gyros of one body"
"""Panel of help for these options."""
_FIND: Final = "find"
_WEIGHTS: Final = ("auto", "mean", "white")
_LIMITS: Final = ("limit", "rest_limit", "bias_limit")
"""Options of the filter that also apply to an array."""


def _fusion_flag(name: str) -> str:
    return "--array-method" if name == "method" else own_flag(name)


FusionOptions: TypeAlias = Annotated[
    Mapping[str, Any],
    TableOptions(
        {name: ARRAY_OPTIONS[name] for name in ("method", "scale_error")}, _PANEL, _fusion_flag
    ),
]
"""Options that only an array has."""


def _parse_weights(flag: str, text: str) -> str | list[float]:
    if text in _WEIGHTS:
        return text
    try:
        return [float(word) for word in text.split(",")]
    except ValueError:
        raise UsageFault(
            f"{flag} takes {', '.join(_WEIGHTS)} or numbers with commas between, got '{text}'"
        ) from None


@dataclass(frozen=True)
class OfArray:
    """Options of an array of gyros."""

    panel: ClassVar = _PANEL

    array: bool = option(
        False,
        "Fuse all gyros of the log, on one body. In --columns, three consecutive columns named x, "
        "y, z are a sensor.",
    )
    rotations: str | None = option(
        None,
        "Rotations of the sensors (JSON file), or find. 'find' estimates them from the log's "
        "motion and writes the file, which may also have positions of accelerometers. Default: "
        "all sensors are aligned.",
        metavar="FILE",
    )
    weights: str | Sequence[float] | None = option(
        None,
        "Weights: auto, mean, white, or numbers: 0.5,0.3,0.2. auto weighs by noise at rest and "
        "by scale errors in motion, mean equally, white by white noise. Default: auto.",
        metavar="WORD",
        parse=_parse_weights,
    )

    @property
    def finds(self) -> bool:
        """True if rotations are to be estimated."""
        return self.rotations == _FIND

    @property
    def file(self) -> Path | None:
        """File of rotations."""
        return None if self.rotations is None or self.finds else Path(self.rotations)

    def arguments(
        self, fusion: Mapping[str, Any], options: Mapping[str, Any]
    ) -> dict[str, Any] | None:
        """Return the arguments of `zerorate.replay_array`; None without --array."""
        if self.array:
            limits = {name: options[name] for name in _LIMITS if name in options}
            weights = _WEIGHTS[0] if self.weights is None else self.weights
            return {"rotations": self.rotations, "weights": weights, **limits, **fusion}
        texts_by_flag = {"--rotations": self.rotations, "--weights": self.weights}
        names = [name for name, value in texts_by_flag.items() if value is not None]
        names += map(_fusion_flag, fusion)
        if names:
            raise UsageFault(f"only --array takes {' and '.join(names)}")
        return None


def check_alone(options: Mapping[str, Any], **typed: bool) -> None:
    """Raise a usage fault for options that have no effect on an array."""
    others = [flag(name) for name in options if name not in ("method", *_LIMITS)]
    others += ["--method"] if options["method"] != "auto" else []
    others += [own_flag(name) for name, is_given in typed.items() if is_given]
    others = ["--figure all" if name == "--figure" else name for name in others]
    if others:
        verb = "has" if len(others) == 1 else "have"
        raise UsageFault(f"{', '.join(others)} {verb} no effect on --array")
