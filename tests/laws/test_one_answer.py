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


def still(folder):
    """Write a gyro and an accelerometer at rest, as one table."""
    random = np.random.default_rng(3)
    time = np.arange(9000) / 100.0
    gyro = 0.4 + 0.1 * random.standard_normal((9000, 3))
    accel = [0.0, 0.0, 1.0] + 0.003 * random.standard_normal((9000, 3))
    table = {"time_s": time}
    table |= {f"gyro_{x}_dps": gyro[:, i] for i, x in enumerate("xyz")}
    written(
        folder / "still.csv",
        table | {f"accel_{x}_g": accel[:, i] for i, x in enumerate("xyz")},
    )
    return (folder / "still.csv",)


def turned(folder):
    """Write a body moved by hand, whose gyro has one wrong sign and states no unit."""
    motion = zr.simulate_motion("hand", duration=60.0, seed=2)
    gyro = np.degrees(motion.gyro) * [1.0, -1.0, 1.0]
    table = {"time_s": motion.time}
    table |= {f"gyro_{x}": gyro[:, i] for i, x in enumerate("xyz")}
    written(
        folder / "hand.csv",
        table | {f"accel_{x}_mps2": motion.accel[:, i] for i, x in enumerate("xyz")},
    )
    return (folder / "hand.csv",)


def board(folder):
    """Write two gyros of one board, the second turned over, as one table."""
    random = np.random.default_rng(4)
    rates = np.zeros((4000, 3))
    rates[1500:3000] = 60.0 * np.sin(np.arange(1500)[:, np.newaxis] / [30.0, 47.0, 71.0])
    table = {"time_s": np.arange(4000) / 100.0}
    for k, signs in enumerate(([1.0, 1.0, 1.0], [-1.0, -1.0, 1.0]), start=1):
        seen = rates * signs + random.standard_normal(3) + 0.1 * random.standard_normal((4000, 3))
        table |= {f"imu{k}_gyro_{x}_dps": seen[:, i] for i, x in enumerate("xyz")}
    written(folder / "board.csv", table)
    return (folder / "board.csv",)


SOURCES = {
    "attitude": hand,
    "navigate": drive,
    "walk": foot,
    "replay": turned,
    "replay --array": board,
    "allan": still,
    "identify": still,
    "compare": still,
}
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
    "replay": Case("replay", "replay", ("--unit", "deg/s"), {"unit": "deg/s"}),
    "replay, put right": Case(
        "replay",
        "replay",
        ("--unit", "deg/s", "--fix", "--no-figure"),
        {"unit": "deg/s", "fix": True},
        {"figure": False},
    ),
    "replay, compared": Case(
        "replay",
        "replay",
        ("--unit", "deg/s", "--methods", "kf,akf", "--bias-limit", "5", "--figure", "all"),
        {"unit": "deg/s", "methods": ["kf", "akf"], "bias_limit": 5.0},
        {"panels": "all"},
    ),
    "replay, published": Case(
        "replay",
        "replay",
        ("--method", "fading", "--fading", "0.9", "--scale", "1/2", "--format", "csv"),
        {"method": "fading", "fading": 0.9, "data_scale": 0.5},
        {"format": "csv"},
    ),
    "replay, array": Case("replay --array", "replay_array"),
    "replay, array, rotations": Case(
        "replay --array", "replay_array", ("--rotations", "find"), {"rotations": "find"}
    ),
    "replay, array, weights": Case(
        "replay --array",
        "replay_array",
        ("--weights", "3,1", "--limit", "200"),
        {"weights": [3.0, 1.0], "limit": 200.0},
    ),
    "replay, array, method": Case(
        "replay --array",
        "replay_array",
        ("--array-method", "centralised", "--format", "npz"),
        {"method": "centralised"},
        {"format": "npz"},
    ),
    "allan": Case("allan", "characterise"),
    "allan, exports": Case(
        "allan",
        "characterise",
        ("--export", "kalibr,px4,json", "--inflate", "10", "--force"),
        {},
        {"export": "kalibr,px4,json", "inflate": 10.0, "force": True},
    ),
    "allan, kind": Case(
        "allan",
        "characterise",
        ("--kind", "ohdev", "--taus", "0.1,1,10", "--no-second-opinion", "--format", "json"),
        {"kind": "ohdev", "taus": [0.1, 1.0, 10.0], "second_opinion": False},
        {"format": "json"},
    ),
    "allan, columns": Case(
        "allan",
        "characterise",
        ("--columns", "gyro_z_dps", "--markov", "1", "--start", "10", "--no-figure"),
        {"columns": "gyro_z_dps", "markov": 1, "start": 10.0},
        {"figure": False},
    ),
    "identify": Case("identify", "identify"),
    "identify, order": Case(
        "identify",
        "identify",
        ("--order", "2,1", "--outliers", "hampel", "--no-figure"),
        {"order": (2, 1), "outliers": "hampel"},
        {"figure": False},
    ),
    "identify, decimated": Case(
        "identify",
        "identify",
        ("--decimate", "4", "--criterion", "bic", "--columns", "gyro_x_dps"),
        {"decimate": 4, "criterion": "bic", "columns": "gyro_x_dps"},
    ),
    "identify, all panels": Case(
        "identify",
        "identify",
        ("--trend", "linear", "--figure", "all", "--stop", "60", "--columns", "gyro_y_dps"),
        {"trend": "linear", "stop": 60.0, "columns": "gyro_y_dps"},
        {"panels": "all"},
    ),
    "compare": Case("compare", "compare"),
    "compare, methods": Case(
        "compare",
        "compare",
        ("--methods", "raw,mean,auto", "--figure-format", "svg"),
        {"methods": ["raw", "mean", "auto"]},
        {"figure_format": "svg"},
    ),
    "compare, faults": Case(
        "compare",
        "compare",
        ("--methods", "raw,kf", "--contaminate", "share=0.01,size=100"),
        {"methods": ["raw", "kf"], "contaminate": ["share=0.01,size=100"]},
    ),
    "compare, columns": Case(
        "compare",
        "compare",
        ("--methods", "raw,auto", "--columns", "gyro_x_dps", "--no-figure"),
        {"methods": ["raw", "auto"], "columns": "gyro_x_dps"},
        {"figure": False},
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
    code, text, errors = call(
        *case.command.split(), *given, "-o", tmp_path / "command", *case.options
    )
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
