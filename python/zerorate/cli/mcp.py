"""``zerorate mcp``: tools for assistants, for the logs in a folder."""

from pathlib import Path
from typing import Annotated

from zerorate.cli.errors import UsageFault
from zerorate.cli.parameters import Argument
from zerorate.tasks.assistant import build_server


def mcp(
    *, folder: Annotated[Path, Argument("Folder of the logs. No file outside of it is read.")]
) -> None:
    """Serve report, check, allan, attitude and navigate to an assistant, on stdin and stdout.

    The protocol is MCP. Each tool takes the path of a log in the folder and returns JSON. Nothing
    is written.
    """
    try:
        server = build_server(folder)
    except (ImportError, NotADirectoryError) as error:
        raise UsageFault(str(error)) from None
    server.run("stdio")
