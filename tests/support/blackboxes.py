"""Blackbox logs of a flight controller, encoded field by field."""

import numpy as np

NAMES = (
    *("loopIteration", "time"),
    *(f"gyroADC[{axis}]" for axis in range(3)),
    *(f"accSmooth[{axis}]" for axis in range(3)),
    *(f"motor[{index}]" for index in range(4)),
    *(f"debug[{index}]" for index in range(4)),
)
N_FIELDS = len(NAMES)
# A signed field may have any of these encodings, one that fills several fields only with others.
SINGLE, BY_MASK, THREE, FOUR, THREE_VARIABLE = 0, 6, 7, 8, 10
INTRA_EVERY = 16


def write_blackbox(path, time, values, encodings=(BY_MASK, THREE, SINGLE, FOUR), **headers):
    """Write times, us, and whole numbers (n, 3 + 3 + 4 + 4); return the path.

    ``encodings`` are those of the differences of gyro, accelerometer, motors and debug values.
    ``headers`` replace or add lines.
    """
    path.write_bytes(encode(time, values, encodings, **headers))
    return path


def encode(time, values, encodings=(BY_MASK, THREE, SINGLE, FOUR), **headers):
    """Return the bytes of a log."""
    inter = [9, SINGLE, *np.repeat(encodings, (3, 3, 4, 4)).tolist()]
    lines = {
        "Data version": 2,
        "Field I name": ",".join(NAMES),
        "Field I signed": "0,0" + ",1" * (N_FIELDS - 2),
        "Field I predictor": "0,0" + ",0" * 6 + ",11,5,5,5" + ",0" * 4,
        "Field I encoding": "1,1" + ",0" * (N_FIELDS - 2),
        "Field P predictor": "6,2,1,1,1,1,1,1,3,3,3,3,0,8,1,1",
        "Field P encoding": ",".join(map(str, inter)),
        "Field S name": "flightModeFlags",
        "Field S signed": "0",
        "Field S predictor": "0",
        "Field S encoding": "1",
        "Firmware revision": "Betaflight 4.4.2 (test) STM32F7X2",
        "Board information": "TEST BOARD",
        "gyro_scale": "0x3f800000",
        "acc_1G": 2048,
        "motorOutput": "158,2047",
    } | {key.replace("_0", " "): text for key, text in headers.items()}
    head = "H Product:Blackbox flight data recorder by Nicholas Sherlock\n" + "".join(
        f"H {key}:{text}\n" for key, text in lines.items()
    )
    rows = np.column_stack([np.arange(len(time)), time, values]).astype(np.int64)
    frames = [_frame(rows, index, inter) for index in range(len(rows))]
    return head.encode() + b"S\x05" + b"".join(frames) + b"E\xffEnd of log\0"


def _frame(rows, index, inter):
    row = rows[index]
    begin = index - index % INTRA_EVERY
    if index == begin:
        raw = bytearray(b"I") + _unsigned(row[0]) + _unsigned(row[1] & 0xFFFFFFFF)
        expected = [0] * 6 + [158, *[row[8]] * 3] + [0] * 4
        for value, predicted in zip(row[2:], expected, strict=True):
            raw += _signed(value - predicted)
        return bytes(raw)
    last, before = rows[index - 1], rows[max(index - 2, begin)]
    mean = np.fix((last + before) / 2).astype(np.int64)
    expected = [0, 2 * last[1] - before[1], *last[2:8], *mean[8:12], 0, 1500, *last[14:]]
    differences = [int(value - guess) for value, guess in zip(row, expected, strict=True)]
    raw, at = bytearray(b"P"), 1
    while at < N_FIELDS:
        run = next((k for k in range(at, N_FIELDS) if inter[k] != inter[at]), N_FIELDS) - at
        count, part = _ENCODERS[inter[at]](differences[at : at + min(run, 8)])
        raw += part
        at += count
    return bytes(raw)


def _unsigned(value):
    raw, value = bytearray(), int(value)
    while value > 127:
        raw.append(value & 127 | 128)
        value >>= 7
    return raw + bytes([value])


def _signed(value):
    value = int(value)
    return _unsigned((value << 1 ^ value >> 31) & 0xFFFFFFFF)


def _single(values):
    return 1, _signed(values[0])


def _by_mask(values):
    if len(values) == 1:
        return 1, _signed(values[0])
    mask = sum(1 << k for k, value in enumerate(values) if value)
    return len(values), bytes([mask]) + b"".join(_signed(value) for value in values if value)


def _fit(values, *bits):
    return all(-(1 << b - 1) <= v < 1 << b - 1 for v, b in zip(values, bits, strict=True))


def _pack(head, values, bits):
    number = head
    for value, width in zip(values, bits, strict=True):
        number = number << width | value & (1 << width) - 1
    return 3, number.to_bytes((2 + sum(bits)) // 8, "big")


def _of_bytes(values):
    sizes = [next(n for n in (1, 2, 3, 4) if _fit([v], 8 * n)) for v in values]
    head = 3 << 6 | sum(n - 1 << 2 * k for k, n in enumerate(sizes))
    tail = (v.to_bytes(n, "little", signed=True) for v, n in zip(values, sizes, strict=True))
    return 3, bytes([head]) + b"".join(tail)


def _three(values):
    values = values[:3]
    if _fit(values, 2, 2, 2):
        return _pack(0, values, (2, 2, 2))
    if _fit(values, 4, 4, 4):
        first, second, third = (value & 15 for value in values)
        return 3, bytes([1 << 6 | first, second << 4 | third])
    if _fit(values, 6, 6, 6):
        return 3, bytes([2 << 6 | values[0] & 63, values[1] & 63, values[2] & 63])
    return _of_bytes(values)


def _three_variable(values):
    values = values[:3]
    for head, bits in ((0, (2, 2, 2)), (1, (5, 5, 4)), (2, (8, 7, 7))):
        if _fit(values, *bits):
            return _pack(head, values, bits)
    return _of_bytes(values)


def _four(values):
    tags, bits = 0, ""
    for k, value in enumerate(values[:4]):
        width = next(n for n in (0, 4, 8, 16) if (value == 0 if n == 0 else _fit([value], n)))
        tags |= (0, 4, 8, 16).index(width) << 2 * k
        bits += f"{value & (1 << width) - 1:0{width}b}" if width else ""
    bits += "0" * (-len(bits) % 8)
    return 4, bytes([tags, *(int(bits[k : k + 8], 2) for k in range(0, len(bits), 8))])


_ENCODERS = {
    SINGLE: _single,
    BY_MASK: _by_mask,
    THREE: _three,
    FOUR: _four,
    THREE_VARIABLE: _three_variable,
}
