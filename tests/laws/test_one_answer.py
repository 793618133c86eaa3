"""Law 7, one answer: a command and its function give the same files, alarms and notes."""

import json
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import zerorate as zr
from support.calibrations import write_imu
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
    source: str = ""


@dataclass(frozen=True)
class Given:
    """What a command is given, and its function, where these are not the same."""

    words: tuple[object, ...]
    arguments: tuple[object, ...]


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


def driven(folder):
    """A drive with the fixes of its receiver, as the report takes both."""
    log, gnss = drive(folder)
    return Given((log, "--gnss", gnss), (log, None, gnss))


def turns(folder, seed=3, mirrored=False):
    """Write a session of poses and turns, maybe with an axis of the gyro mirrored."""
    recording = zr.simulation.simulate_session(14, seed=seed, rest=4.0).recording
    sign = np.array([1.0, -1.0, 1.0]) if mirrored else np.ones(3)
    gyro = recording.gyro.with_data(recording.gyro.data * sign)
    logs = {"gyro": gyro, "accel": recording.accel}
    return (write_imu(folder / f"turns{seed}.csv", zr.Recording(logs, "a session")),)


def compass(folder):
    """Write the motion of a hand with iron beside the magnetometer, whose axis is mirrored."""
    recording = zr.simulate_motion("hand", duration=40.0, seed=100).recording()
    mag = recording.mag.with_data(recording.mag.data + np.array([9.0, -14.0, 6.0]))
    logs = {**recording, "mag": mag, "gyro": recording.gyro.with_data(-recording.gyro.data)}
    return (write_imu(folder / "compass.csv", zr.Recording(logs, "a hand")),)


def two_sessions(folder):
    """Write two logs of one device, of which the second has an axis mirrored."""
    return (*turns(folder), *turns(folder, seed=4, mirrored=True))


SOURCES = {
    "attitude": hand,
    "navigate": drive,
    "walk": foot,
    "replay": turned,
    "replay --array": board,
    "allan": still,
    "identify": still,
    "compare": still,
    "calibrate": partial(turns, mirrored=True),
    "compass": compass,
    "report": partial(turns, mirrored=True),
    "report, fixes": driven,
    "report, two": two_sessions,
}
OF_FOOT = ("--unit", "deg/s,m/s^2")

MAGNETOMETER = ("--magnetometer",)
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
        ("--export", "kalibr,px4,json", "--inflate", "10", "--no-bounds", "--doubtful"),
        {},
        {"export": "kalibr,px4,json", "inflate": 10.0, "bounds": False, "doubtful": True},
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


CASES |= {
    "calibrate": Case("calibrate", "calibrate"),
    "calibrate, fixed": Case(
        "calibrate",
        "calibrate",
        ("--fix", "--gravity", "9.81", "--export", "px4,imu_tk"),
        {"fix": True, "gravity": 9.81},
        {"exports": ["px4", "imu_tk"]},
    ),
    "calibrate, frame": Case(
        "calibrate",
        "calibrate",
        ("--frame", "z", "--figure", "all", "--g-sensitivity", "off"),
        {"frame": "z", "g_sensitivity": False},
        {"panels": "all"},
    ),
    "calibrate, prior": Case(
        "calibrate",
        "calibrate",
        ("--prior", "wide", "--saturation", "400", "--stop", "60", "--no-figure"),
        {"prior": "wide", "saturation": 400.0, "stop": 60.0},
        {"figure": False},
    ),
    "magnetometer": Case("calibrate", "calibrate_magnetometer", MAGNETOMETER, source="compass"),
    "magnetometer, place": Case(
        "calibrate",
        "calibrate_magnetometer",
        (*MAGNETOMETER, "--field", "48", "--dip", "65", "--export", "px4", "--doubtful"),
        {"field": 48.0, "dip": float(np.radians(65.0))},
        {"exports": ["px4"], "doubtful": True},
        source="compass",
    ),
    "magnetometer, one iron": Case(
        "calibrate",
        "calibrate_magnetometer",
        (*MAGNETOMETER, "--one-iron", "--no-figure"),
        {"one": True},
        {"figure": False},
        source="compass",
    ),
    "magnetometer, part": Case(
        "calibrate",
        "calibrate_magnetometer",
        (*MAGNETOMETER, "--start", "5", "--figure-format", "pdf"),
        {"start": 5.0},
        {"figure_format": "pdf"},
        source="compass",
    ),
    "report": Case("report", "report"),
    "report, part": Case("report", "report", ("--stop", "50"), {"stop": 50.0}),
    "report, unit": Case("report", "report", ("--unit", "deg/s,g"), {"unit": "deg/s,g"}),
    "report, columns": Case(
        "report",
        "report",
        ("--columns", "gyro_x_dps,gyro_y_dps,gyro_z_dps"),
        {"columns": ("gyro_x_dps", "gyro_y_dps", "gyro_z_dps")},
    ),
    "report, fixes": Case("report", "report", source="report, fixes"),
    "report, two": Case("report", "report", source="report, two"),
    "report, parts of two": Case(
        "report", "report", ("--start", "5"), {"start": 5.0}, source="report, two"
    ),
}


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    made: dict[str, tuple[Path, ...]] = {}

    def source(case):
        name = case.source or case.command
        if name not in made:
            made[name] = SOURCES[name](tmp_path_factory.mktemp(case.command))
        given = made[name]
        return given if isinstance(given, Given) else Given(given, given)

    return source


@pytest.mark.parametrize("name", CASES)
def test_a_command_and_its_function_give_one_answer(call, sources, tmp_path, name):
    case = CASES[name]
    given = sources(case)
    words = (*given.words, "-o", tmp_path / "command", *case.options)
    code, text, errors = call(*case.command.split(), *words)
    result = getattr(zr, case.function)(*given.arguments, **case.arguments)
    result.save(tmp_path / "function", **case.saved)
    assert code in (0, 1)
    assert (errors == "") == (code == 0)
    assert content(tmp_path / "function") == content(tmp_path / "command")
    message = one_line("\n".join((text, *pages(tmp_path / "command"))))
    for sentence in (*result.alarms, *result.notes):
        assert one_line(shown(sentence)) in message, sentence


def pages(folder):
    """Yield the sentences of reports: a terminal shows those that need a person."""
    for path in folder.glob("*-report.json"):
        found = json.loads(path.read_text(encoding="utf-8"))
        yield from found.get("notes", ())
        for one in found.get("findings", found.get("changes", ())):
            for finding in (one, one.get("before"), one.get("after")):
                yield (finding or {}).get("text", "")


GYRO = ("gyro_x_dps", "gyro_y_dps", "gyro_z_dps")
BATCHES = {
    "replay": (("--columns", ",".join(GYRO)), {"columns": GYRO}),
    "replay, kf": (
        ("--columns", ",".join(GYRO), "--method", "kf", "--format", "csv"),
        {"columns": GYRO, "method": "kf", "format": "csv"},
    ),
    "allan": (("--command", "allan", "--unit", "deg/s,g"), {"command": "allan", "unit": "deg/s,g"}),
    "report": (("--report", "--start", "2"), {"command": "report", "start": 2.0}),
}


@pytest.mark.parametrize("name", BATCHES)
def test_a_batch_and_its_function_give_one_answer(call, sources, tmp_path, name):
    """But for the seconds that they took, which the records and the summary hold."""
    options, arguments = BATCHES[name]
    logs = sources(Case("batch", "batch", source="report, two")).words
    broken = tmp_path / "broken.csv"
    broken.write_text("gyro_x\n")
    words = (*logs, broken, "-o", tmp_path / "command", "--workers", 1, *options)
    code, text, _ = call("batch", *words)
    result = zr.batch([*logs, broken], tmp_path / "function", workers=1, **arguments)
    assert code == 1
    found, expected = content(tmp_path / "function"), content(tmp_path / "command")
    assert {*found} == {*expected}
    timed = {name for name in found if name.endswith((".json", "summary.parquet"))}
    timed -= {name for name in found if name.endswith("-models.json")}
    assert len(found) > len(timed)
    assert all(found[name] == expected[name] for name in {*found} - timed)
    for sentence in (*result.alarms, *result.notes):
        assert one_line(shown(sentence)) in one_line(text) or name == "report", sentence
    assert len(result.alarms) == 1
    (summary, *_) = result.save(tmp_path / "saved" / "all.parquet", figure=False)
    assert summary.read_bytes() == result.summary.read_bytes()


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
