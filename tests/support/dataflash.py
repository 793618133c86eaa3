"""DataFlash logs of simulated flights, written byte by byte and line by line as ArduPilot does."""

import struct

import numpy as np

HEAD = b"\xa3\x95"
CODES = {"M": "B", "n": "4s", "N": "16s", "Z": "64s", "a": "64s"}
CODES |= {"c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "g": "e"}
SCALES = {"c": 1e-2, "C": 1e-2, "e": 1e-2, "E": 1e-2, "L": 1e-7}
FMT = ("BBnNZ", "Type,Length,Name,Format,Columns")
MULTIPLIERS = {"-": 0.0, "F": 1e-6, "C": 1e-3, "0": 1.0}

IMU = ("QBffffffIIfBBHH", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz")
MAG = ("QBhhhhhhhhhBI", "TimeUS,I,MagX,MagY,MagZ,OfsX,OfsY,OfsZ,MOX,MOY,MOZ,Health,S")
GPS = ("QBBIHBcLLeffffB", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U")
ATT = ("QccccCCCCB", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw,AEKF")
BARO = ("QBffcf", "TimeUS,I,Alt,Press,Temp,CRt")
PARM = ("QNff", "TimeUS,Name,Value,Default")
ISBH = ("QHBBHHQf", "TimeUS,N,type,instance,mul,smp_cnt,SampleUS,smp_rate")
ISBD = ("QHHaaa", "TimeUS,N,seqno,x,y,z")
KINDS = {"IMU": IMU, "MAG": MAG, "GPS": GPS, "ATT": ATT, "BARO": BARO, "PARM": PARM}
KINDS |= {"ISBH": ISBH, "ISBD": ISBD}
LETTERS = {"MAG": "F-CCCCCCCCC-F", "IMU": "F-000000--0----"}
"""What the fields of a kind are multiplied by, where the log tells it."""


def flight(n=100, seed=3, imus=2):
    """Return the messages of a flight at 50 Hz, in the order of time, each a name and a row."""
    rng = np.random.default_rng(seed)
    rows = [("PARM", (900_000, b"INS_GYROFFS_X", 0.0125, 0.0))]
    rows += [("PARM", (900_001, b"SYSID_SW_TYPE", 3.0, 3.0))]
    for k in range(n):
        now = 1_000_000 + 20_000 * k
        for i in range(imus):
            six = rng.standard_normal(6).astype(np.float32).tolist()
            rows.append(("IMU", (now, i, *six, 0, 0, 41.5 + i, 1, 1, 1000, 1000)))
        if k % 5 == 0:
            field = rng.integers(-500, 500, 3).tolist()
            rows.append(("MAG", (now + 40, 0, *field, 1, 2, 3, 0, 0, 0, 1, now)))
            rows.append(("ATT", (now + 60, 0, 3000, 0, -1000, 0, 12000, 0, 0, 3)))
            rows.append(("BARO", (now + 70, 0, 12.5, 94144.0, 3236, 0.0)))
        if k % 10 == 0:
            fixed = 0 if k == 0 else 3
            place = (-353626277 + k, 1491653034 + k, 58882, 5.0, 90.0, 0.5, 0.0, 1)
            rows.append(("GPS", (now + 80, 0, fixed, 100, 2000, 11, 77, *place)))
    return rows


def batch(number, kind, values, sampled, rate=4000.0, mul=1000, instance=0):
    """Return the messages of a batch of samples, (n, 3) in whole numbers."""
    rows = [("ISBH", (sampled, number, kind, instance, mul, len(values), sampled, rate))]
    for k in range(0, len(values), 32):
        part = np.zeros((32, 3), "<i2")
        part[: len(values[k : k + 32])] = values[k : k + 32]
        axes = (part[:, i].tobytes() for i in range(3))
        rows.append(("ISBD", (sampled, number, k // 32, *axes)))
    return rows


def write_dataflash(path, rows, kinds=KINDS, told=True):
    """Write messages, each a name and a row; ``told``: with the units of their fields."""
    used = [name for name in kinds if name in {name for name, _ in rows}]
    if told:
        kinds = {"FMTU": ("QBNN", "TimeUS,FmtType,UnitIds,MultIds"), **kinds}
        kinds = {"MULT": ("Qbd", "TimeUS,Id,Mult"), **kinds}
        used = ["FMTU", "MULT", *used]
    numbers = {"FMT": 128, **{name: 129 + i for i, name in enumerate(used)}}
    every = {"FMT": FMT, **kinds}
    raw = [_message(128, FMT[0], _declaration(numbers[n], n, *every[n])) for n in numbers]

    def add(name, row):
        raw.append(_message(numbers[name], every[name][0], row))

    for letter, factor in MULTIPLIERS.items() if told else ():
        add("MULT", (1, ord(letter), factor))
    for name, letters in LETTERS.items() if told else ():
        if name in used:
            add("FMTU", (1, numbers[name], b"", letters.encode()))
    for name, row in rows:
        add(name, row)
    path.write_bytes(b"".join(raw))
    return path


def _declaration(number, name, letters, columns):
    size = 3 + struct.calcsize(_codes(letters))
    return number, size, name.encode(), letters.encode(), columns.encode()


def _codes(letters):
    return "<" + "".join(CODES.get(letter, letter) for letter in letters)


def _message(number, letters, row):
    return HEAD + bytes([number]) + struct.pack(_codes(letters), *row)


def write_text(path, rows, kinds=KINDS):
    """Write messages as lines of text."""
    used = [name for name in kinds if name in {name for name, _ in rows}]
    lines = ["FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns"]
    for i, name in enumerate(used):
        lines.append(f"FMT, {129 + i}, 0, {name}, {kinds[name][0]}, {kinds[name][1]}")
    for name, row in rows:
        cells = zip(kinds[name][0], row, strict=True)
        lines.append(", ".join([name, *(_cell(letter, value) for letter, value in cells)]))
    path.write_text("\n".join(lines) + "\n")
    return path


def _cell(letter, value):
    if isinstance(value, bytes):
        return value.decode()
    return repr(value) if letter not in SCALES else f"{value * SCALES[letter]:.7f}"
