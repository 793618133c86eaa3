"""Law 7, one answer: a command and its function give the same files, alarms and notes."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import zerorate as zr
from support.commands import one_line

# Pictures that hold the time at which they were drawn.
VOLATILE = {".svg", ".pdf"}


@dataclass(frozen=True)
class Case:
    """A command's options, and the function's that say the same."""

    command: str
    function: str
    options: tuple[str, ...] = ()
    arguments: dict[str, Any] = field(default_factory=dict)
    saved: dict[str, Any] = field(default_factory=dict)


def drive(folder):
    """Write a drive, its sensors turned and its fixes late, as two tables."""
    made = zr.simulate_drive(duration=150.0, seed=5)
    turned = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    table = {"time_s": made.time}
    for name, values in (("gyro", made.gyro), ("accel", made.accel)):
        unit = "radps" if name == "gyro" else "mps2"
        table |= {f"{name}_{x}_{unit}": (values @ turned.T)[:, i] for i, x in enumerate("xyz")}
    written(folder / "drive.csv", table)
    late = made.fixes.shifted(0.2)
    place = dict(zip(("latitude_deg", "longitude_deg", "height_m"), late.position.T, strict=True))
    way = dict(zip(("north_mps", "east_mps", "down_mps"), late.velocity.T, strict=True))
    written(
        folder / "gnss.csv",
        {"time_s": late.time, **place, **{f"velocity_{k}": v for k, v in way.items()}},
    )
    return (folder / "drive.csv", folder / "gnss.csv")


def written(path, table):
    np.savetxt(
        path, np.column_stack([*table.values()]), "%.10g", ",", header=",".join(table), comments=""
    )


SOURCES = {"navigate": drive}

CASES = {
    "navigate": Case("navigate", "navigate"),
    "navigate, outages": Case(
        "navigate", "navigate", ("--outages", "10", "--tum"), {"outages": 10.0}, {"tum": True}
    ),
    "navigate, smoothed": Case(
        "navigate", "navigate", ("--smooth", "--mount", "none"), {"smooth": True, "mount": "none"}
    ),
    "navigate, wheeled": Case(
        "navigate",
        "navigate",
        ("--vehicle", "wheeled", "--time-offset", "-0.2", "--format", "csv"),
        {"vehicle": "wheeled", "time_offset": -0.2},
        {"format": "csv"},
    ),
}


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    made: dict[str, tuple[Path, ...]] = {}

    def source(command):
        if command not in made:
            made[command] = SOURCES[command](tmp_path_factory.mktemp(command))
        return made[command]

    return source


@pytest.mark.parametrize("name", CASES)
def test_a_command_and_its_function_give_one_answer(call, sources, tmp_path, name):
    case = CASES[name]
    given = sources(case.command)
    code, text, errors = call(case.command, *given, "-o", tmp_path / "command", *case.options)
    result = getattr(zr, case.function)(*given, **case.arguments)
    result.save(tmp_path / "function", **case.saved)
    assert errors == ""
    assert code in (0, 1)
    assert content(tmp_path / "function") == content(tmp_path / "command")
    for sentence in (*result.alarms, *result.notes):
        assert one_line(shown(sentence)) in one_line(text), sentence


def content(folder):
    """Return name and bytes of each file; of a picture, which holds its date, the name alone."""
    return {
        path.relative_to(folder).as_posix(): None if path.suffix in VOLATILE else path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def shown(sentence):
    """Return the beginning of a sentence, before any argument: a shell calls these otherwise."""
    parts = getattr(sentence, "parts", (sentence,))
    return next(part for part in parts if isinstance(part, str))
