"""Has the compiler write other names for the folders of this machine."""

import os
import subprocess
from pathlib import Path

__all__ = ["remap"]


def remap() -> None:
    """Set what cargo then adds to its flags, for the wheel and for what shall share its build.

    Cargo's configuration knows no variables, and RUSTFLAGS would take the place of its flags: those
    of one target are added to them.
    """
    cargo = Path(os.environ.get("CARGO_HOME", Path.home() / ".cargo"))
    names = {cargo: "cargo", Path(__file__).parent.parent: "zerorate"}
    paths = {str(form): name for path, name in names.items() for form in (path, path.resolve())}
    # The variable is split at blanks.
    flags = [
        f"--remap-path-prefix={path}={name}" for path, name in paths.items() if " " not in path
    ]
    variable = f"CARGO_TARGET_{_target().upper().replace('-', '_')}_RUSTFLAGS"
    os.environ[variable] = " ".join([os.environ.get(variable, ""), *flags]).strip()


def _target() -> str:
    told = subprocess.run(["rustc", "-vV"], capture_output=True, text=True, check=True).stdout
    host = next(line.split()[1] for line in told.splitlines() if line.startswith("host:"))
    return os.environ.get("CARGO_BUILD_TARGET", host)
