"""The commands of the program."""

from typing import Annotated

import typer

from zerorate import __version__
from zerorate.cli.allan import allan
from zerorate.cli.batch import batch
from zerorate.cli.compare import compare
from zerorate.cli.demo import demo
from zerorate.cli.identify import identify
from zerorate.cli.replay import replay
from zerorate.cli.simulate import simulate
from zerorate.cli.stream import stream

__all__ = ["app", "invoke"]

app = typer.Typer(
    name="zerorate",
    help="Models, measures and removes the random drift of MEMS gyroscopes.",
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"zerorate {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and end."
        ),
    ] = False,
) -> None:
    """Models, measures and removes the random drift of MEMS gyroscopes."""


for _command in (replay, batch, compare, allan, identify, demo, simulate, stream):
    app.command()(_command)


def invoke(arguments: list[str]) -> int:
    """Run a command and return its exit code; faults are raised."""
    program = typer.main.get_command(app)
    code = program.main(args=arguments, prog_name="zerorate", standalone_mode=False)
    return int(code or 0)
