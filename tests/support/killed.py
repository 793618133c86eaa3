"""What a process that was killed leaves in a folder."""

import subprocess
import sys

from zerorate.record.atomic import _temporary_name


def dead_process():
    """Return the number of a process that is no more."""
    with subprocess.Popen([sys.executable, "-c", ""]) as process:
        process.wait()
    return process.pid


def temporary_of(target, process, machine=None):
    """Return what `atomic_path` would begin for a file in another process, maybe elsewhere."""
    ours = _temporary_name(target)
    begin, whose, place, _, *rest = ours.split("-")
    return target.with_name("-".join([begin, whose, machine or place, f"{process:x}", *rest]))


def left_by_a_kill(target, machine=None):
    """Write half of a file as a process that was killed; return its path."""
    path = temporary_of(target, dead_process(), machine)
    path.write_bytes(b"half")
    return path


def left_in(folder):
    """Return the names that are hidden, in all folders below."""
    return sorted(path.name for path in folder.rglob(".*") if path.is_file())
