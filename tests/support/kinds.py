"""Kinds of text logs, several inputs of each: the clocks, columns, torn lines and texts of people.

All are of one motion (`truth`), in deg/s and g, drawn anew for every input.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

N = 300
BOOT, EPOCH = 83_514.25, 1_714_560_000.0


@dataclass
class Kind:
    """A text, and what is to be read of it.

    ``said`` are words of a note. One that is refused has words of the refusal, and the arguments
    that it names, with which it is read right.
    """

    name: str
    text: str
    gyro: np.ndarray
    accel: np.ndarray | None = None
    rate: float = 100.0
    said: tuple[str, ...] = ()
    refused: str | None = None
    remedy: dict[str, Any] = field(default_factory=dict)
    file: str = "log.csv"
    options: dict[str, Any] = field(default_factory=dict)
    to: float = 1e-4

    def write(self, folder):
        path = folder / self.file
        path.write_bytes(self.text.encode())
        return path


def truth(seed: int, n: int = N) -> tuple[np.ndarray, np.ndarray]:
    """Return rates, deg/s, and forces, g, shape (n, 3) each."""
    random = np.random.default_rng(seed)
    t = np.arange(n)[:, None] / 100
    turns = np.sin(t * random.uniform(1, 3, 3) + random.uniform(0, 6, 3)) * [25, 15, 10]
    force = [0.02, 0.03, 1.0] + 0.01 * random.normal(size=(n, 3))
    return (turns + 0.05 * random.normal(size=(n, 3))).round(4), force.round(4)


def rows(*columns: Any, sep: str = ",", digits: str = "%.4f") -> str:
    """Return lines of columns: texts as they stand, whole numbers exactly."""

    def cell(value: Any) -> str:
        whole = isinstance(value, (str, int, np.integer))
        return str(value) if whole else digits % value

    wide = [c.T if getattr(c, "ndim", 1) == 2 else [c] for c in columns]
    flat = [list(one) for many in wide for one in many]
    return "".join(sep.join(map(cell, row)) + "\n" for row in zip(*flat, strict=True))


def _times(unit: str, start: float, rate: float = 100.0, n: int = N) -> list[Any]:
    per = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}[unit]
    if unit == "s":
        return [f"{start + i / rate:.4f}" for i in range(n)]
    return [round(start * 1000) * (per // 1000) + round(i * per / rate) for i in range(n)]


def clocks() -> Iterator[Kind]:
    """Yield clocks under other names, and several, coarse and merged ones."""
    names = (
        ("tstamp", "ms"), ("Tiempo", "s"), ("Zeit", "s"), ("ms", "ms"), ("sec", "s"), ("us", "us"),
        ("Time since start in ms ", "ms"), ("Zeitstempel", "ms"), ("tick", "us"), ("T_ESP", "us"),
        ("temps", "s"), ("czas (ms)", "ms"), ("ns", "ns"), ("Timecode", "ms"), ("rtc", "s"),
        ("LogTick", "ms"), ("board_clk", "us"), ("mikros", "us"), ("aika", "s"), ("t0", "ms"),
    )  # fmt: skip
    for seed, (name, unit) in enumerate(names):
        for start in (0.0, 12.34, BOOT):
            gyro, _ = truth(seed)
            text = f"{name},gx_dps,gy_dps,gz_dps\n" + rows(_times(unit, start), gyro)
            yield Kind(f"clock {name.strip()} from {start:g}", text, gyro)
    gyro, _ = truth(77)
    for unit in ("ms", "us", "ns"):
        for start in (0.0, 37.5, BOOT, 1_798_921.641, EPOCH):
            for rate in (50.0, 100.0, 200.0):
                if (unit, start) == ("ns", 0.0) and rate == 50.0:
                    continue
                text = rows(_times(unit, start, rate), gyro, sep="  ")
                name = f"no names, {unit} from {start:g} at {rate:g}"
                yield Kind(name, text, gyro, rate=rate, file="gyro.txt")
    ms, us = _times("ms", 5.0), _times("us", 5.0003)
    for head, columns in (
        ("tickms,tickus", (ms, us)),
        ("uptime_s,clk", ([f"{5 + i // 10 / 10:.1f}" for i in range(N)], us)),
        ("count,ms", (range(N), ms)),
        ("seq,Zeit", (range(7, 7 + N), _times("s", 3.0))),
    ):
        yield Kind(f"two: {head}", f"{head},gx_dps,gy_dps,gz_dps\n" + rows(*columns, gyro), gyro)
    odd = [str(round(1000 + 1.9 * i, 3)) for i in range(N)]
    other = [str(round(5 + 0.04 * i, 3)) for i in range(N)]
    text = "odo,phase,gx_dps,gy_dps,gz_dps\n" + rows(odd, other, gyro)
    yield Kind("two that disagree", text, gyro, rate=25.0, refused="odo", remedy={"time": "phase"})
    text = "sample,gx_dps,gy_dps,gz_dps\n" + rows(range(N), gyro)
    yield Kind("rows counted", text, gyro, refused="give rate", remedy={"rate": 100.0})
    yield from _coarse()


def _coarse() -> Iterator[Kind]:
    """Yield stamps in whole seconds, with and without something finer."""
    for seed, (rate, begin) in enumerate(
        ((100.0, 0.003), (100.0, 0.42), (50.0, 0.7), (31.25, 0.1))
    ):
        n = 754
        gyro, _ = truth(seed, n)
        t = begin + np.arange(n) / rate
        whole = np.floor(t + 1e-9).astype(int)
        ms = np.floor((t - whole) * 1000 + 1e-6).astype(int)
        iso = [f"2021-01-20 21:{50 + s // 60}:{s % 60:02d}" for s in whole]
        for name, column in (("Timestamp", iso), ("time", (whole + 1_611_179_415).tolist())):
            told = f"at {rate:g} from {begin}"
            head = f"{name},Milliseconds,gx_dps,gy_dps,gz_dps\n"
            yield Kind(
                f"{name} and ms {told}", head + rows(column, ms.tolist(), gyro), gyro, rate=rate
            )
            head = f"{name},gx_dps,gy_dps,gz_dps\n"
            yield Kind(f"{name} alone {told}", head + rows(column, gyro), gyro, rate=rate)
            count = [17 + i for i in range(n)]
            head = f"{name},Counter,gx_dps,gy_dps,gz_dps\n"
            yield Kind(f"{name}, counter {told}", head + rows(column, count, gyro), gyro, rate=rate)
            mcu = [round(1000 * (3.2 + x)) for x in t]
            head = f"{name},mcu,gx_dps,gy_dps,gz_dps\n"
            yield Kind(f"{name}, mcu {told}", head + rows(column, mcu, gyro), gyro, rate=rate)
    yield from _with_losses()
    yield from _sent_again()
    for block in (4, 10, 25):
        gyro, _ = truth(block, 700)
        t = [round(3000 + 10 * (i // block) * block) for i in range(700)]
        text = "millis,gx_dps,gy_dps,gz_dps\n" + rows(t, gyro)
        yield Kind(f"blocks of {block}", text, gyro)


def _with_losses() -> Iterator[Kind]:
    """Yield whole seconds beside what tells that twenty rows are lost."""
    gyro, _ = truth(31, 900)
    kept = np.r_[:333, 353:900]
    t = 0.31 + kept / 100
    whole = np.floor(t + 1e-9).astype(int)
    iso = np.array([f"2021-01-20 21:50:{s:02d}" for s in whole])
    holes = gyro.copy()
    holes[333:353] = np.nan
    for name, beside in (
        ("Milliseconds", np.rint(t * 1000).astype(int) % 1000),
        ("usec", np.rint(t * 1e6).astype(int) % 1_000_000),
        ("Counter", 40 + kept),
        ("mcu", np.rint(1000 * (3.2 + t)).astype(int)),
    ):
        text = f"Timestamp,{name},gx_dps,gy_dps,gz_dps\n" + rows(iso, beside, gyro[kept])
        yield Kind(f"lost rows, {name}", text, holes)


def _sent_again() -> Iterator[Kind]:
    """Yield rows of which a third repeats the one before."""
    random = np.random.default_rng(8)
    for n in (200, 900, 2400):
        gyro, _ = truth(n, n)
        twice = np.sort(np.r_[:n, random.choice(n, n // 2, replace=False)])
        head, said = "t_s,gx_dps,gy_dps,gz_dps\n", ("repeat the one before",)
        text = head + rows([f"{i / 100:.2f}" for i in twice], gyro[twice])
        yield Kind(f"rows twice, {n}", text, gyro, said=said)
        if n < 300:
            continue
        t = np.cumsum(random.uniform(0.6, 1.4, int(1.5 * n)) / 150)
        t = t[t < n / 100]
        seen = (t * 100).astype(int)
        if len(np.unique(seen)) < n:  # a sample that was never polled
            seen = np.searchsorted(np.unique(seen), seen)
        text = head + rows([f"{x:.6f}" for x in t], gyro[seen])
        want = gyro[np.unique(seen)]
        yield Kind(f"polled, {n}", text, want, said=said)


def columns() -> Iterator[Kind]:
    """Yield names of columns as people write them, and rows that begin with a word."""
    gyro, force = truth(5)
    s, ms = _times("s", 0.0), _times("ms", 2.0)
    six = rows(s, gyro, force)
    for head in (
        "# time[s], wx(deg/s), wy, wz, ax(g), ay, az",
        "t,Gyro X [deg/s],Gyro Y,Gyro Z,Acc X [g],Acc Y,Acc Z",
        "time_s,gx (°/s),gy,gz,ax (g),ay,az",
        "Time (s),Gyroscope x,Gyroscope y,Gyroscope z (deg/s),Accel x,Accel y,Accel z (g)",
    ):
        yield Kind(f"unit once: {head[:20]}", head + "\n" + six, gyro, force)
    counts = (gyro * 131).astype(int)
    text = "millis,gx,gy,gz\n" + rows(ms, counts & 0xFFFF)
    yield Kind("counts without a sign", text, counts & 0xFFFF, said=("without their sign",))
    for odd in ("gyro_sum_dps", "gyro", "gyro_w", "Gyro_Total", "gyro_mag_dps"):
        head = f"t,gyro_x_dps,gyro_y_dps,gyro_z_dps,{odd}\n"
        yield Kind(f"odd {odd}", head + rows(s, gyro, gyro.sum(axis=1)), gyro)
    for head in (
        "t,GyX,GyY,GyZ,AcX,AcY,AcZ", "t,ωx,ωy,ωz,ax,ay,az",
        "t,角速度X,角速度Y,角速度Z,加速度X,加速度Y,加速度Z",
        "t,陀螺仪x,陀螺仪y,陀螺仪z,加速度x,加速度y,加速度z",
        "t,자이로 X,자이로 Y,자이로 Z,가속도 X,가속도 Y,가속도 Z",
        "t,Гироскоп X,Гироскоп Y,Гироскоп Z,Акселерометр X,Акселерометр Y,Акселерометр Z",
        "t,ジャイロX,ジャイロY,ジャイロZ,加速度X,加速度Y,加速度Z",
    ):  # fmt: skip
        yield Kind(f"letters: {head}", head + "\n" + six, gyro, force, options={"unit": "deg/s"})
    other, _ = truth(6)
    for head in (
        "millis,gx1_dps,gy1_dps,gz1_dps,gx2_dps,gy2_dps,gz2_dps",
        "millis,gx1 (deg/s),gy1 (deg/s),gz1 (deg/s),gx2 (deg/s),gy2 (deg/s),gz2 (deg/s)",
        "millis,GyroX1 [dps],GyroY1 [dps],GyroZ1 [dps],GyroX2 [dps],GyroY2 [dps],GyroZ2 [dps]",
        "millis,gyro_x_1_dps,gyro_y_1_dps,gyro_z_1_dps,gyro_x_2_dps,gyro_y_2_dps,gyro_z_2_dps",
    ):
        yield Kind(f"two: {head[:24]}", head + "\n" + rows(ms, gyro, other), gyro)
    names = "address\tTime(s)\tax(g)\tay(g)\taz(g)\twx(deg/s)\twy(deg/s)\twz(deg/s)\tT(°)\n"
    body = rows(["0x50"] * N, s, force, gyro, np.full(N, 22.5), sep="\t")
    for above in ("StartTime: 2022-08-10 08:58:06.422", "Device WT901\t1.2", "Rate 100Hz"):
        for pads in (0, 4, 8):
            text = above + "\t" * pads + "\n" + names + body
            yield Kind(f"preamble {above[:9]} {pads}", text, gyro, force, file="log.txt")
    commas = "Firmware: 2.1,,,,,,\nlocation: left wrist,,,,,,\n"
    head = "t [s],gx [dps],gy [dps],gz [dps],ax [g],ay [g],az [g]\n"
    long = "".join(f"Setting {i}: {i % 7}.5\n" for i in range(45))
    yield Kind("preamble of many names and values", long + head + six, gyro, force)
    yield Kind("preamble of commas", commas + head + six, gyro, force)
    yield Kind("CR alone", (head + six).replace("\n", "\r"), gyro, force)
    yield Kind("a quote somewhere", 'a "note" by me\n' + head + six, gyro, force)
    tabs = (head + six).replace(",", "\t").replace(".", ",")
    yield Kind("decimal commas between tabs", tabs, gyro, force)
    mixed = head.replace(",", ",\t") + six.replace(".", ";").replace(",", ",\t").replace(";", ",")
    yield Kind("decimal commas between commas and tabs", mixed, gyro, force)
    yield from _labelled(gyro, force, ms)


def _labelled(gyro: Any, force: Any, ms: Any) -> Iterator[Kind]:
    """Yield rows whose sensor is told by a word: first, last, or between."""
    words = (("acc", "gyro"), ("ACCE", "GYRO"), ("Accelerometer", "Gyroscope"), ("A", "G"))
    for accel_word, gyro_word in words:
        for sep in (" ", ",", ";", "\t"):
            for place in ("first", "second", "last"):
                lines = []
                for i in range(N):
                    for word, values in ((accel_word, force), (gyro_word, gyro)):
                        cells = [str(ms[i]), *(f"{v:.4f}" for v in values[i])]
                        cells.insert({"first": 0, "second": 1, "last": 4}[place], word)
                        lines.append(sep.join(cells))
                name = f"rows of {gyro_word}, {place} by {sep!r}"
                text = "\n".join(lines) + "\n"
                given = {"file": "log.txt", "options": {"unit": "deg/s"}}
                yield Kind(name, text, gyro, force, **given)
                if place != "first":
                    continue
                head = sep.join(["sensor", "millis", "x", "y", "z"]) + "\n"
                yield Kind(f"{name}, named", head + text, gyro, force, **given)
    for word, sep in (("gyro", " "), ("GYR", ","), ("$GYRO", ","), ("Gyr:", "\t")):
        text = "".join(f"{word}{sep}{line}\n" for line in rows(ms, gyro, sep=sep).splitlines())
        yield Kind(f"only {word}", text, gyro, file="log.txt", options={"unit": "deg/s"})
    lines = [
        "$VNYMR,+010.1,-000.3,+001.2,+1.0,-0.2,+0.4,"
        + ",".join(f"{v:+010.6f}" for v in (*(force[i] * 9.80665), *np.radians(gyro[i])))
        + "*5A"
        for i in range(N)
    ]
    yield Kind(
        "$VNYMR", "\n".join(lines) + "\n", np.radians(gyro), force * 9.80665, file="log.txt",
        options={"rate": 100.0},
    )  # fmt: skip
    text = (
        "% Gyroscope data: \t'GYRO;AppTimestamp(s);SensorTimestamp(s);Gyr_X(rad/s);Gyr_Y(rad/s)'\n"
    )
    t = _times("s", 100.0)
    for i in range(N):
        a, g = (";".join(f"{v:.6f}" for v in x) for x in (force[i] * 9.80665, np.radians(gyro[i])))
        text += f"ACCE;{i / 100:.3f};{t[i]};{a};3\nGYRO;{i / 100:.3f};{t[i]};{g};3\n"
        if i % 10 == 0:
            text += f"BARO;{i / 100:.3f};{t[i]};962.1;0\nWIFI;{i / 100:.3f};{t[i]};eduroam;-61\n"
    yield Kind(
        "GetSensorData", text, np.radians(gyro), force * 9.80665, file="log.txt",
        options={"unit": "rad/s"},
    )  # fmt: skip


def torn() -> Iterator[Kind]:
    """Yield tables whose first or last line is cut, and one torn inside."""
    gyro, force = truth(9)
    head, body = "t_s,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g\n", rows(_times("s", 0.0), gyro, force)
    lines = body.splitlines()
    for cut in (5, 12, 20, 30):
        said = ("line 301",)
        text = head + body[: -1 - cut]
        yield Kind(f"end cut by {cut}", text, gyro[:-1], force[:-1], said=said)
    for cut in (3, 17, 33):
        yield Kind(f"begun at {cut}, names", lines[0][cut:] + "\n" + head + body, gyro, force)
    semicolons = rows(_times("ms", 0.0), gyro, sep=";")
    for cut in (";-16\n", "3;0.1\n", ";1;-16\n"):
        yield Kind(
            f"begun at {cut.strip()}", cut + semicolons, gyro, said=("line 1",),
            options={"unit": "deg/s"},
        )  # fmt: skip
    for bad in (
        "3.1,2.2",
        "0.99,1.2,3.4,0.1,0,0,1.0,7.1,2",
        "0.99,a#!,0.2,0.1,0,0,1.0",
        "\x1b[0;9",
    ):
        text = head + "\n".join([*lines[:99], bad, *lines[99:]]) + "\n"
        yield Kind(
            f"inside {bad[:12]!r}", text, gyro, force, refused="line 101",
            remedy={"torn": "skip"}, said=("line 101",),
        )  # fmt: skip


def texts() -> Iterator[Kind]:
    """Yield lines of names and numbers that are no table."""
    gyro, force = truth(12)
    us = _times("us", 1.0)
    axes = [*zip(("gx", "gy", "gz", "ax", "ay", "az"), [*gyro.T, *force.T], strict=True)]

    def lines(one: Callable[[int], str]) -> str:
        return "".join(one(i) + "\n" for i in range(N))

    def flat(
        i: int, names: tuple[str, ...] = ("gx", "gy", "gz", "ax", "ay", "az")
    ) -> dict[str, Any]:
        values = (float(v) for v in (*gyro[i], *force[i]))
        return dict(zip(names, values, strict=True))

    given = {"options": {"unit": "deg/s"}, "file": "log.txt"}
    yield Kind("JSON", lines(lambda i: json.dumps({"t": us[i], **flat(i)})), gyro, force, **given)
    yield Kind(
        "JSON nested",
        lines(
            lambda i: json.dumps(
                {"ts": us[i], "gyro": dict(zip("xyz", gyro[i], strict=True)),
                 "accel": dict(zip("xyz", force[i], strict=True)), "dev": "a7"}
            )
        ),
        gyro, force, **given,
    )  # fmt: skip
    yield Kind(
        "JSON arrays",
        lines(lambda i: json.dumps({"ts": us[i], "gyro": [*gyro[i]], "accel": [*force[i]]})),
        gyro, force, **given,
    )  # fmt: skip
    yield Kind(
        "JSON of sensors",
        lines(
            lambda i: "\n".join(
                json.dumps(
                    {"sensor": s, "timestamp": us[i], "value": dict(zip("xyz", v[i], strict=True))}
                )
                for s, v in (("accelerometer", force), ("gyroscope", gyro))
            )
        ),
        gyro, force, **given,
    )  # fmt: skip
    yield Kind(
        "InfluxDB",
        lines(
            lambda i: "imu,host=pi,room=lab\\ 2 "
            + ",".join(f"{k}={v[i]}" for k, v in axes)
            + f" {1_714_560_000_000_000_000 + i * 10_000_000}"
        ),
        gyro, force, **given,
    )  # fmt: skip
    for name, form in (
        ("ESP-IDF", "I ({ms}) MPU6050: gx: {gx} gy: {gy} gz: {gz} ax: {ax} ay: {ay} az: {az}"),
        ("Arduino", "gx: {gx} gy: {gy} gz: {gz}\tax: {ax} ay: {ay} az: {az} t: {ms}"),
        ("equals", "t={ms}, gx={gx}, gy={gy}, gz={gz}, ax={ax}, ay={ay}, az={az};"),
        ("0 t", "0 {ms} GYR: x={gx} y={gy} z={gz} ACC: x={ax} y={ay} z={az}"),
        (
            "Zephyr",
            "[00:00:{sec},{us6}] <inf> imu: gyro x:{gx} y:{gy} z:{gz} accel x:{ax} y:{ay} z:{az}",
        ),
    ):
        body = lines(
            lambda i, form=form: form.format(
                ms=1000 + 10 * i, sec=f"{i // 100:02d}", us6=f"{i % 100 * 10:03d},000",
                **{k: v[i] for k, v in axes},
            )
        )  # fmt: skip
        boot = "I (312) cpu_start: Starting scheduler.\n" if name == "ESP-IDF" else ""
        yield Kind(f"console {name}", boot + body, gyro, force, **given)
    both = lines(
        lambda i: "\n".join(
            f"0 {1000 + 10 * i} {s}: x={v[i][0]} y={v[i][1]} z={v[i][2]}"
            for s, v in (("ACC", force), ("GYR", gyro))
        )
    )
    yield Kind("0 t ACC: x=", both, gyro, force, **given)
    echo = lines(
        lambda i: (
            f"header: \n  seq: {i}\n  stamp: \n    secs: {1_693_464_526 + i // 100}\n"
            f'    nsecs: {i % 100 * 10_000_000}\n  frame_id: "imu"\n'
            "orientation: \n  x: 0.0\n  y: 0.0\n"
            "  z: 0.0\n  w: 0.0\norientation_covariance: [-1.0, 0.0, 0.0]\nangular_velocity: \n"
            + "".join(f"  {a}: {np.radians(v):.8f}\n" for a, v in zip("xyz", gyro[i], strict=True))
            + "angular_velocity_covariance: [0.0, 0.0, 0.0]\nlinear_acceleration: \n"
            + "".join(f"  {a}: {v * 9.80665:.6f}\n" for a, v in zip("xyz", force[i], strict=True))
            + "---"
        )
    )
    yield Kind("rostopic echo", echo, np.radians(gyro), force * 9.80665, file="echo.txt")


def consoles() -> Iterator[Kind]:
    """Yield lines of consoles: stamps before them, vectors behind a word, units behind numbers."""
    gyro, force = truth(21)
    turn = np.radians(gyro).round(7)
    clocked = {"options": {"unit": "deg/s"}, "file": "c.log"}
    free = {"options": {"unit": "deg/s", "rate": 100.0}, "file": "c.log"}

    def lines(form: str, rates: np.ndarray = gyro) -> str:
        return "".join(
            form.format(
                ms=500 + 10 * i, clock=f"12:00:{i // 100:02d}.{i % 100 * 10:03d}",
                g=", ".join(map(str, rates[i])), a=" ".join(map(str, force[i])),
                **dict(zip(("gx", "gy", "gz"), rates[i], strict=True)),
                **dict(zip(("ax", "ay", "az"), force[i], strict=True)),
            )
            + "\n"
            for i in range(N)
        )  # fmt: skip

    pairs = "gx={gx} gy={gy} gz={gz} ax={ax} ay={ay} az={az}"
    for before in (
        "05-01 {clock} 1234 5678 D IMU: ", "2024-05-01 {clock} INFO ", "2024/05/01 {clock} [3] ",
        "May  1 {clock} pi imu[12]: ", "[{clock}] ", "{clock} -> ", "{ms} ms: ", "t={ms} ms ",
    ):  # fmt: skip
        yield Kind(f"before pairs: {before}", lines(before + pairs), gyro, force, **clocked)
    table = "{gx},{gy},{gz}"
    for before in ("[{clock}] ", "[{clock}]: ", "{clock} -> "):
        yield Kind(f"before a table: {before}", lines(before + table), gyro, **clocked)
    for form in (
        "gyro: {g} accel: {a}", "G: {g} A: {a}", "gyro[{g}] accel[{a}]", "Gyro=({g}) Acc=({a})",
        "a/g: {ax} {ay} {az} {gx} {gy} {gz}", "GYR {gx} {gy} {gz} ACC: {ax} {ay} {az}",
        "{{'gx': {gx}, 'gy': {gy}, 'gz': {gz}, 'ax': {ax}, 'ay': {ay}, 'az': {az}}}",
    ):  # fmt: skip
        yield Kind(f"without a clock: {form}", lines(form), gyro, force, **free)
    yield Kind("a line each", lines("{ms} accel: {a}\n{ms} gyro: {g}"), gyro, force, **clocked)
    text = lines(
        "Acceleration X: {ax}, Y: {ay}, Z: {az} g\nRotation X: {gx}, Y: {gy}, Z: {gz} rad/s\n"
        "Temperature: 22.5 degC\n",
        turn,
    )
    yield Kind("units behind", text, turn, force, options={"rate": 100.0}, file="c.log")
    units = "{ms} gx: {gx} deg/s gy: {gy} deg/s gz: {gz} deg/s ax: {ax}g ay: {ay}g az: {az}g"
    yield Kind("unit each", lines(units), gyro, force, file="c.log")
    for word in ("IMU", "$PIMU"):
        text = lines(f"{word},{{ms}},{{ax}},{{ay}},{{az}},{{gx}},{{gy}},{{gz}}\nGPS,{{ms}},48.1,11")
        yield Kind(f"rows of {word}", text, gyro, force, **clocked)


def documents() -> Iterator[Kind]:
    """Yield documents of JSON, measurements of InfluxDB, topics without a name, zeros, rules."""
    gyro, force = truth(22)
    ms = _times("ms", 3.0)
    rows_of = [
        dict(
            zip(
                ("t_ms", "gx", "gy", "gz", "ax", "ay", "az"),
                (ms[i], *gyro[i], *force[i]),
                strict=True,
            )
        )
        for i in range(N)
    ]
    given = {"options": {"unit": "deg/s"}, "file": "log.json"}
    columns = {name: [row[name] for row in rows_of] for name in rows_of[0]}
    for name, made in (
        ("list", rows_of), ("wrapped", {"device": "a", "data": rows_of}), ("columns", columns),
        ("twice wrapped", {"meta": {"n": 1}, "log": {"samples": rows_of}}),
        ("columns within", {"id": 5, "imu": columns}),
    ):  # fmt: skip
        for indent in (None, 2):
            text = json.dumps(made, indent=indent)
            yield Kind(f"JSON document {name} {indent}", text, gyro, force, **given)
    for unit, per in (("s", 1), ("ms", 10**3), ("us", 10**6), ("ns", 10**9)):
        if unit == "s":
            continue  # whole seconds
        text = "".join(
            f"{kind},host=a x={v[i][0]},y={v[i][1]},z={v[i][2]} {EPOCH * per + i * per / 100:.0f}\n"
            for i in range(N)
            for kind, v in (("gyro", gyro), ("accel", force))
        )
        options = {"options": {"unit": "deg/s"}, "file": "log.lp"}
        yield Kind(f"InfluxDB in {unit}", text, gyro, force, **options)
    echo = "".join(
        f"header:\n  stamp:\n    sec: {1714560000 + i // 100}\n"
        f"    nanosec: {i % 100 * 10_000_000}\nvector:\n"
        + "".join(f"  {axis}: {v}\n" for axis, v in zip("xyz", gyro[i], strict=True))
        + "---\n"
        for i in range(N)
    )
    yield Kind("echo of a vector", echo, gyro, file="gyro.txt", options={"unit": "deg/s"})
    head = "t_ms,gx_dps,gy_dps,gz_dps\n"
    lines = rows(ms, gyro).splitlines()
    ruled = [head.strip(), "-----+-----+-----+-----", *lines]
    yield Kind("a rule below names", "\n".join(ruled) + "\n", gyro)
    marked = ["| " + line.replace(",", " | ") + " |" for line in [head.strip(), *lines]]
    marked.insert(1, "|---|:--|--:|---|")
    yield Kind("a table of Markdown", "\n".join(marked) + "\n", gyro)
    commented = "# t gx gy gz\n# ms deg/s deg/s deg/s\n" + rows(ms, gyro, sep=" ")
    yield Kind("names and units in remarks", commented, gyro, file="log.txt")
    yield Kind("minus of a typesetter", (head + "\n".join(lines) + "\n").replace("-", "−"), gyro)
    for at in (20, 170):
        holed = gyro.copy()
        holed[at] = np.nan
        for cut in (0, 6):
            text = head + "\n".join(lines[:at]) + "\n" + lines[at][:cut] + "\0" * 512
            text += lines[at][cut + 2 :] + "\n" + "\n".join(lines[at + 1 :]) + "\n"
            yield Kind(
                f"zeros in row {at} from {cut}", text, holed, refused=f"line {at + 2}",
                remedy={"torn": "skip"}, said=(f"line {at + 2}",),
            )  # fmt: skip
    for first, second in ((gyro, force), (force, gyro)):
        text = rows(ms, first, second)
        yield Kind(
            "six columns without names", text, gyro, force, said=("length of gravity",),
            options={"unit": "deg/s"},
        )  # fmt: skip
    for n in (250, 300, 350):
        rates, _ = truth(n, n)
        for begin in (0.0, 0.005, 0.37):
            seconds = (begin + np.arange(n) / 100 + 1e-9).astype(int)
            text = "time,gx_dps,gy_dps,gz_dps\n"
            text += rows([f"21:50:{second:02d}" for second in seconds], rates)
            yield Kind(f"whole seconds, {n} from {begin}", text, rates, said=("whole seconds",))
    seconds = (np.arange(150) / 100).astype(int).tolist()
    rates, _ = truth(150, 150)
    text = "time_s,gx_dps,gy_dps,gz_dps\n" + rows(seconds, rates)
    yield Kind(
        "no whole second inside", text, rates, refused="no whole second",
        remedy={"rate": 100.0, "time": False},
    )  # fmt: skip


def numbers() -> Iterator[Kind]:
    """Yield numbers as countries, languages and devices write them, and sensors by number."""
    head = "t_s,gx_dps,gy_dps,gz_dps\n"
    for seed in (31, 32):
        gyro = 25.0 * truth(seed)[0].round(2)
        gyro[seed : seed + 40] += 1500.0
        t = [f"{950 + i / 100:,.2f}" for i in range(N)]
        t_plain = [950 + round(i / 100, 2) for i in range(N)]
        told = {"said": ("between thousands",), "to": 1e-3}
        cells = [t, *([f"{v:,.4f}" for v in axis] for axis in gyro.T)]
        quoted = [[f'"{cell}"' for cell in own] for own in cells]
        yield Kind(f"quoted thousands {seed}", head + rows(*quoted), gyro, **told)
        for sep in ";\t":
            text = head.replace(",", sep) + rows(*cells, sep=sep)
            yield Kind(f"thousands by {sep!r} {seed}", text, gyro, **told)
            for mark in ("'", "\u202f", "\u2019", "\u00a0"):
                yield Kind(f"{mark!r} by {sep!r}", text.replace(",", mark), gyro, **told)
            german = text.translate(str.maketrans(",.", ".,"))
            yield Kind(f"points by {sep!r} {seed}", german, gyro, **told)
        plain = "remark; of a\tlog\n" + head + rows(t_plain, np.abs(gyro[:, :2]), gyro[:, 2])
        yield Kind(
            f"commas alone {seed}", plain, np.column_stack([np.abs(gyro[:, :2]), gyro[:, 2]])
        )
        commas = [[f'"{cell}"'.replace(".", ",") for cell in own] for own in cells]
        commas = [[cell.replace(",", "", cell.count(",") - 1) for cell in own] for own in commas]
        said = {"said": ("decimal points",), "to": 1e-3}
        yield Kind(f"quoted decimal commas {seed}", head + rows(*commas), gyro, **said)
        powers = [
            [f"{v:.6E}".replace("E", letter) for v in axis] for axis in gyro.T for letter in "D"
        ]
        for sep in (" ", ",", "  "):
            text = head.replace(",", sep) + rows(_times("s", 3.0), *powers, sep=sep)
            yield Kind(f"Fortran by {sep!r}", text, gyro, said=("Fortran",), to=1e-3, file="a.txt")
        counts = np.rint(gyro * 16).astype(int)
        for form in ("0x{:04X}", "0x{:04x}", "0X{:04X}"):
            own = [[form.format(v & 0xFFFF) for v in axis] for axis in counts.T]
            text = "millis,gx,gy,gz\n" + rows(_times("ms", 2.0), *own)
            yield Kind(f"counts {form}", text, counts, said=("hexadecimal",))
        stamps = [f"0x{v:X}" for v in _times("ms", 32.5)]
        yield Kind("stamps in hexadecimal", head.replace("_s", "_ms") + rows(stamps, gyro), gyro)
    yield from _compact_dates()
    yield from _android()


def _compact_dates() -> Iterator[Kind]:
    """Yield dates and times without marks, over a full minute, hour, or day."""
    for seed, clock in enumerate(("12:00:58.500", "12:59:58.990", "23:59:59.100")):
        gyro, _ = truth(50 + seed)
        start = np.datetime64(f"2024-02-28T{clock}", "ms")
        stamps = (start + 10 * np.arange(N)).astype(str).tolist()
        plain = [stamp.replace("-", "").replace(":", "") for stamp in stamps]
        head = "Timestamp,gx_dps,gy_dps,gz_dps\n"
        for name, own in (
            ("T", plain), ("zone", [f"{one}Z" for one in plain]),
            ("blank", [one.replace("T", " ") for one in plain]),
            ("comma", [f'"{one.replace(".", ",")}"' for one in plain]),
            ("one number", [one.replace("T", "").replace(".", "") for one in plain]),
            ("a low line", [one.replace("T", "_") for one in plain]),
        ):  # fmt: skip
            yield Kind(f"compact dates, {name}, {clock}", head + rows(own, gyro), gyro)


def _android() -> Iterator[Kind]:
    """Yield rows of sensors by the numbers that Android has for them."""
    gyro, force = truth(60)
    rates, metres = np.radians(gyro), force * 9.80665
    ns = [5_000_000_000 + 10_000_000 * i for i in range(N)]
    told = {"said": ("Android",), "file": "log.csv", "to": 1e-3}
    for head, form in (
        ("sensor_type,timestamp,x,y,z\n", "{s},{t},{v}"), ("", "{t},{s},{v}"), ("", "{s},{t},{v}"),
        ("timestamp,sensor,x,y,z\n", "{t},{s},{v}"),
        ("time;type;accuracy;value0;value1;value2\n", "{t};{s};3;{v}"),
        ("timestamp,sensorType,accuracy,values[0],values[1],values[2]\n", "{t},{s},3,{v}"),
    ):  # fmt: skip
        lines = []
        for i in range(N):
            for s, own in ((1, metres), (4, rates), (2, 40.0 * force)):
                v = (";" if ";" in form else ",").join(f"{x:.6f}" for x in own[i])
                lines.append(form.format(s=s, t=ns[i] + 1000 * s, v=v))
        yield Kind(f"Android {form} {head}", head + "\n".join(lines) + "\n", rates, metres, **told)


KINDS = {one.__name__: one for one in (consoles, documents, clocks, columns, torn, texts, numbers)}


def kinds() -> list[Kind]:
    """Return all inputs of all kinds."""
    return [one for make in KINDS.values() for one in make()]
