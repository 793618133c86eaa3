"""Server of the Model Context Protocol; its tools measure the logs in a folder.

The tools only read files. Paths are relative to the folder. A path outside the folder raises an
error, even by ``..``, a link or an absolute path.
"""

import os
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any, Final, Literal

from zerorate._native import __version__
from zerorate.faults import render_text, sentence_of
from zerorate.io.formats import is_bag_folder
from zerorate.noise.characterise import models_json
from zerorate.progress import report_nothing
from zerorate.record.saved import as_json
from zerorate.tasks.attitude import estimate_attitude
from zerorate.tasks.characterise import characterise
from zerorate.tasks.check import check
from zerorate.tasks.navigate import navigate
from zerorate.tasks.report import report
from zerorate.texts import describe_missing_extra
from zerorate.views import table_of

_VERSION: Final = 1
_MAX_SAMPLES: Final = 50
"""Largest number of samples in an answer."""
_INSTRUCTIONS: Final = (
    "Measures logs of inertial sensors in one folder; paths are relative to it. Begin with report. "
    "If a unit or a rate is missing, the error says so: give unit and rate."
)


class Folder:
    """Folder with the files that may be read.

    Parameters
    ----------
    path : path
        The folder.

    Raises
    ------
    NotADirectoryError
        If the path is not a folder.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.root = Path(path).resolve()
        if not self.root.is_dir():
            raise NotADirectoryError(f"{path} is no folder")

    def find(self, name: str) -> Path:
        """Return the file with this name; ValueError if the file or its link target is outside."""
        path = (self.root / name).resolve()
        inner = (one.resolve() for one in _read_with(path))
        if not all(one.is_relative_to(self.root) for one in (path, *inner)):
            raise ValueError(f"path must be that of a file in the folder, got '{name}'")
        if not path.exists():
            raise ValueError(f"there is no file '{name}' in the folder")
        return path


def _read_with(path: Path) -> list[Path]:
    """Return the files that are read with a folder: its contents, and files in a bag's index."""
    if not path.is_dir():
        return []
    found = list(path.iterdir())
    if is_bag_folder(path):
        lines = (path / "metadata.yaml").read_text(encoding="utf-8", errors="replace").splitlines()
        names = (line.rpartition("- ")[2].rpartition("path: ")[2].strip(" '\"") for line in lines)
        found += [path / name for name in names if name and "\0" not in name]
    return found


def build_server(folder: str | os.PathLike[str]) -> Any:  # noqa: ANN401
    """Return the server whose tools measure the logs below a folder.

    Raises
    ------
    ImportError
        If the package mcp (extra ``mcp``) is not installed.
    NotADirectoryError
        If the path is not a folder.
    """
    try:
        from mcp.server.mcpserver import MCPServer
        from mcp.types import ToolAnnotations
    except ImportError:
        raise ImportError(describe_missing_extra("mcp", "mcp", "zerorate mcp")) from None
    root = Folder(folder)
    server = MCPServer(
        "zerorate", instructions=_INSTRUCTIONS, version=__version__, log_level="WARNING"
    )
    hints = ToolAnnotations(read_only_hint=True, open_world_hint=False)
    for tool in _tools(root):
        server.add_tool(_with_sentences(tool), annotations=hints, structured_output=False)
    return server


def _tools(folder: Folder) -> list[Callable[..., str]]:
    """Return the tools: functions of a path, and in part unit and rate, that return JSON."""

    def report_tool(
        path: str, unit: str | None = None, rate: float | None = None, fixes: str | None = None
    ) -> str:
        """Report on the IMU of a log: clock, samples, noise, vibration, axes. JSON of findings.

        Each finding has a severity (act, look, good), a sentence, a number and a time.
        unit: units of gyro and accelerometer, such as deg/s,g. rate: Hz. fixes: file of a receiver.
        """
        receiver = None if fixes is None else folder.find(fixes)
        made = report(
            folder.find(path), fixes=receiver, progress=report_nothing, unit=unit, rate=rate
        )
        return made.to_json()

    def check_tool(path: str, unit: str | None = None, rate: float | None = None) -> str:
        """Check units, signs and axes of a log's gyro and magnetometer by its motion. JSON.

        unit: units of gyro and accelerometer, such as deg/s,g. rate: Hz.
        """
        return check(folder.find(path), unit=unit, rate=rate).to_json()

    def allan_tool(
        path: str,
        unit: str | None = None,
        rate: float | None = None,
        start: float | None = None,
        stop: float | None = None,
    ) -> str:
        """Measure the noise of a log at rest: noise models of all axes in SI. JSON.

        Angle random walk, bias instability and rate random walk, with standard deviations. A value
        that is not identifiable has an upper bound. unit: such as deg/s,g. rate: Hz. start, stop:
        part of the log, s.
        """
        made = characterise(
            folder.find(path), unit=unit, rate=rate, start=start, stop=stop,
            progress=report_nothing,
        )  # fmt: skip
        return models_json(made.sensors)

    def attitude_tool(
        path: str,
        unit: str | None = None,
        rate: float | None = None,
        frame: Literal["enu", "ned"] = "enu",
    ) -> str:
        """Estimate the orientation over a log from gyro, accelerometer and magnetometer. JSON.

        A table, and some samples of quaternion, angles and their standard deviations. unit: units
        of gyro and accelerometer, such as deg/s,g. rate: Hz. frame: enu or ned.
        """
        made = estimate_attitude(folder.find(path), frame=frame, unit=unit, rate=rate)
        return describe_samples("attitude", made)

    def navigate_tool(
        path: str,
        fixes: str | None = None,
        unit: str | None = None,
        rate: float | None = None,
        smooth: bool = False,
    ) -> str:
        """Find the track of a vehicle from its IMU and its satellite receiver. JSON.

        A table, and some samples of position and velocity with standard deviations. fixes: file of
        the receiver, by default the fixes in the log. unit: such as deg/s,g. rate: Hz. smooth: use
        later fixes, too.
        """
        receiver = None if fixes is None else folder.find(fixes)
        made = navigate(folder.find(path), receiver, smooth=smooth, unit=unit, rate=rate)
        return describe_samples("navigate", made)

    return [report_tool, check_tool, allan_tool, attitude_tool, navigate_tool]


def describe_samples(command: str, result: Any) -> str:  # noqa: ANN401
    """Return a result as JSON: alarms, notes, table, and some evenly spaced samples."""
    log = result.to_log()
    step = -(-log.n // _MAX_SAMPLES)
    units = dict(zip(log.names, log.units, strict=True))
    columns = {"time": log.sampled, **dict(zip(log.names, log.data.T, strict=True)), **log.extra}
    content = {
        "format": f"zerorate {command}",
        "version": _VERSION,
        "source": Path(result.source).name,
        "rate": log.rate,
        "sample_count": log.n,
        "alarms": [render_text(alarm) for alarm in result.alarms],
        "notes": [render_text(note) for note in result.notes],
        "table": table_of(result),
        "units": {"time": "s", **units},
        "samples": {name: values[::step] for name, values in columns.items()},
    }
    return as_json(content, indent=None)


def _with_sentences(tool: Callable[..., str]) -> Callable[..., str]:
    """Return a tool that reports its errors to the client as sentences."""
    from mcp.server.mcpserver.exceptions import ToolError

    @wraps(tool)
    def run(**arguments: Any) -> str:  # noqa: ANN401
        try:
            return tool(**arguments)
        except (ValueError, OSError, ImportError) as error:
            raise ToolError(render_text(sentence_of(error))) from None

    run.__name__ = tool.__name__.removesuffix("_tool")
    return run
