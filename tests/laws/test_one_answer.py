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


def hand(folder):
    """Write the motion of a hand whose gyro has an axis of the wrong sign."""
    made = zr.simulate_motion("hand", duration=40.0, seed=2)
    table = {"time_s": made.time}
    sensors = {"gyro": made.gyro * [1.0, -1.0, 1.0], "accel": made.accel, "mag": made.mag}
    for (name, values), unit in zip(sensors.items(), ("radps", "mps2", "ut"), strict=True):
        table |= {f"{name}_{x}_{unit}": values[:, i] for i, x in enumerate("xyz")}
    table |= {f"mocap{x}": made.quaternion[:, i] for i, x in enumerate("wxyz")}
    written(folder / "hand.csv", table)
    return (folder / "hand.csv",)


def foot(folder):
    """Write a walk faster than the gyro's range, its units in no name."""
    made = zr.simulate_walk(strides=12, seed=3, gyro_range=6.5)
    table = {"time_s": made.time}
    for name, values in (("gyro", np.degrees(made.gyro)), ("accel", made.accel)):
        table |= {f"{name}_{x}": values[:, i] for i, x in enumerate("xyz")}
    written(folder / "foot.csv", table)
    return (folder / "foot.csv",)


def written(path, table):
    np.savetxt(
        path, np.column_stack([*table.values()]), "%.10g", ",", header=",".join(table), comments=""
    )


SOURCES = {"attitude": hand, "navigate": drive, "walk": foot}
OF_FOOT = ("--unit", "deg/s,m/s^2")

CASES = {
    "attitude": Case("attitude", "estimate_attitude"),
    "attitude, north": Case(
        "attitude",
        "estimate_attitude",
        ("--fix", "--at", "48.1,11.6", "--learn-magnetometer", "--bias-limit", "15", "--tum"),
        {"fix": True, "at": (48.1, 11.6), "learn_magnetometer": True, "bias_limit": np.radians(15)},
        {"tum": True},
    ),
    "attitude, offline": Case(
        "attitude",
        "estimate_attitude",
        ("--frame", "ned", "--no-mag", "--offline", "--start", "5", "--no-figure"),
        {"frame": "ned", "mag": False, "offline": True, "start": 5.0},
        {"figure": False},
    ),
    "attitude, named": Case(
        "attitude",
        "estimate_attitude",
        (
            *("--method", "mahony", "--kp", "2", "--clipped", "leave", "--format", "csv"),
            *("--reference", "mocapw,mocapx,mocapy,mocapz", "--reference-heading", "relative"),
        ),
        {
            **{"method": "mahony", "kp": 2.0, "clipped": "leave"},
            **{"reference": "mocapw,mocapx,mocapy,mocapz", "reference_heading": "relative"},
        },
        {"format": "csv"},
    ),
    "walk": Case("walk", "walk", OF_FOOT, {"unit": "deg/s,m/s^2"}),
    "walk, smoothed": Case(
        "walk",
        "walk",
        (*OF_FOOT, "--smooth", "--floor", "level", "--fix"),
        {"unit": "deg/s,m/s^2", "smooth": True, "floor": "level", "fix": True},
    ),
    "walk, on the earth": Case(
        "walk",
        "walk",
        (*OF_FOOT, "--at", "48.1,11.6", "--heading", "90", "--height", "520", "--no-figure"),
        {
            **{"unit": "deg/s,m/s^2", "at": (48.1, 11.6)},
            **{"heading": np.radians(90.0), "height": 520.0},
        },
        {"figure": False},
    ),
    "walk, clipped": Case(
        "walk",
        "walk",
        (*OF_FOOT, "--clipped", "leave", "--format", "csv"),
        {"unit": "deg/s,m/s^2", "clipped": "leave"},
        {"format": "csv"},
    ),
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
