"""The stream that a checkpoint goes on with."""

import re
from dataclasses import fields
from pathlib import Path

from zerorate.cli.faults import DataFault, UsageFault
from zerorate.run.live import CheckpointError, LineStream, Settings, SettingsError

__all__ = ["position_of", "resumed"]

_SETTING = re.compile(rf"\b({'|'.join(field.name for field in fields(Settings))})=")
_OPTION = {"output": "output-kind", "beside": "with"}


def position_of(path: Path) -> int:
    """Return the sample that a checkpoint goes on with, 0 where there is none yet."""
    found = _read(path, None)
    return 0 if found is None else found.position


def resumed(path: Path | None, settings: Settings, cells: int | None, force: bool) -> LineStream:
    """Return the stream in a checkpoint, or a new one if there is none, or none of use."""
    new = LineStream(settings, cells)
    if path is None:
        return new
    try:
        return _read(path, settings) or new
    except (DataFault, UsageFault) as fault:
        if force:
            return new
        raise type(fault)(f"{fault}; --force begins anew") from None


def _read(path: Path, settings: Settings | None) -> LineStream | None:
    try:
        return LineStream.from_bytes(path.read_bytes(), settings)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise DataFault(str(error)) from None
    except SettingsError as error:
        raise UsageFault(f"{path}: {_in_options(error)}") from None
    except CheckpointError as error:
        raise DataFault(f"{path}: {error}") from None


def _in_options(error: SettingsError) -> str:
    return _SETTING.sub(lambda found: f"--{_option(found[1])} ", str(error))


def _option(setting: str) -> str:
    return _OPTION.get(setting, setting.replace("_", "-"))
