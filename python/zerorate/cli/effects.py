"""Options that the chosen method does not know."""

from collections.abc import Collection, Mapping
from typing import Final

import typer

from zerorate.cli.faults import UsageFault
from zerorate.cli.options import Method

__all__ = ["note_on_options"]

_PUBLISHED: Final = frozenset({Method.kf, Method.akf, Method.fading})
_KNOWN_TO: Final[Mapping[str, frozenset[Method]]] = {
    "order": _PUBLISHED,
    "fading": frozenset({Method.fading}),
    "adapt_for": _PUBLISHED,
    "forgetting_factor": _PUBLISHED,
    "process_noise": _PUBLISHED,
    "noise": frozenset({Method.akf, Method.fading}),
}


def note_on_options(
    context: typer.Context, method: Method, beside: Collection[Method] = ()
) -> str | None:
    """Return a note on the options given that the methods beside the chosen one alone know.

    Raises
    ------
    UsageFault
        If none of the methods knows an option that was given.
    """
    given = [name for name in _KNOWN_TO if _was_given(context, name)]
    unknown = [name for name in given if method not in _KNOWN_TO[name]]
    for name in unknown:
        if not _KNOWN_TO[name].intersection(beside):
            raise UsageFault(f"{_option(name)} has no effect on --method {method.value}")
    if not unknown:
        return None
    verb = "acts" if len(unknown) == 1 else "act"
    listed = ", ".join(map(_option, unknown))
    return f"{listed} {verb} on the methods beside {method.value} alone"


def _was_given(context: typer.Context, name: str) -> bool:
    source = context.get_parameter_source(name)
    return source is not None and source.name not in ("DEFAULT", "DEFAULT_MAP")


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"
