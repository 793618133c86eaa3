"""The commands of the program."""

from importlib import import_module
from typing import Annotated, Final

import typer

from zerorate import __version__

__all__ = ["invoke", "program"]

_COMMANDS: Final = (
    "replay",
    "batch",
    "compare",
    "allan",
    "identify",
    "demo",
    "simulate",
    "stream",
)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"zerorate {__version__}")
        raise typer.Exit


def _root(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and end."
        ),
    ] = False,
) -> None:
    """Models, measures and removes the random drift of MEMS gyroscopes."""


def program(first: str = "") -> typer.Typer:
    """Return the program, with the one command that is called if its name comes first."""
    app = typer.Typer(
        name="zerorate",
        help="Models, measures and removes the random drift of MEMS gyroscopes.",
        add_completion=False,
        pretty_exceptions_enable=False,
    )
    app.callback()(_root)
    # Each command imports what it works with: all of them take longer than many a log.
    for name in (first,) if first in _COMMANDS else _COMMANDS:
        app.command()(getattr(import_module(f"zerorate.cli.{name}"), name))
    return app


def invoke(arguments: list[str]) -> int:
    """Run a command and return its exit code; faults are raised."""
    command = typer.main.get_command(program(arguments[0]))
    code = command.main(args=arguments, prog_name="zerorate", standalone_mode=False)
    return int(code or 0)
