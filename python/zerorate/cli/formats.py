"""``zerorate formats``: supported formats, and explanation of a file."""

from pathlib import Path
from typing import Annotated, Final

from zerorate.cli.errors import faults
from zerorate.cli.filter_options import own_flag
from zerorate.cli.parameters import Argument
from zerorate.cli.reading import READING
from zerorate.faults import use_argument_names
from zerorate.io.explaining import explain, list_formats
from zerorate.io.fixes import RECEIVERS
from zerorate.io.packets import PACKETS
from zerorate.show.formats_table import format_explanation, format_formats

_OPTIONS: Final = {name: own_flag(name) for name in READING}
"""Flags of the arguments for reading the file."""


def formats(
    log: Annotated[
        Path | None, Argument("Recording to explain: its format and its columns.")
    ] = None,
) -> None:
    """List the formats that are read and written, or explain how a file is read.

    With a file, lists the evidence for its format, the meaning of each column, and the logs read
    from it.
    """
    if log is None:
        fixes = list_formats(RECEIVERS.values())
        print(format_formats(list_formats(), fixes, PACKETS.values()))
        return
    with use_argument_names(_OPTIONS), faults():
        print(format_explanation(explain(log)))
