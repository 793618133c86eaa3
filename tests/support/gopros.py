"""Videos without pictures, with the telemetry of a GoPro, written byte by byte."""

import struct

import numpy as np

TICK, TSMP, STNM, SIUN, SCAL, TMPC = b"TICK", b"TSMP", b"STNM", b"SIUN", b"SCAL", b"TMPC"


def write_gopro(path, gyro, accel, rate=200, scale=(3755, 418), more=(), lost=None, fixes=None):
    """Write whole numbers (n, 3) and (n / 2, 3) in packets of a second; return the path.

    ``more`` are further entries of both streams, as pairs of a key and a text. Without any values
    there are exposures alone. ``lost`` is the second of a packet that is left out, ``fixes`` are
    latitudes and longitudes, deg, and heights, m, at 18 Hz.
    """
    packets = []
    for second in range(max(2, -(-len(gyro) // rate))):
        if second == lost:
            continue
        streams = b""
        for key, values, own, factor, unit, name in (
            (b"GYRO", gyro, rate, scale[0], b"rad/s", b"Gyroscope (z,x,y)"),
            (b"ACCL", accel, rate // 2, scale[1], b"m/s\xb2", b"Accelerometer (z,x,y)"),
        ):
            end = (second + 1) * own
            rows = np.asarray(values[end - own : end], ">i2")
            entries = [
                _entry(TSMP, b"L", 4, struct.pack(">I", min(end, len(values)))),
                _entry(TICK, b"L", 4, struct.pack(">I", 5000 + 1000 * second)),
                _entry(STNM, b"c", 1, name),
                *(_entry(k, b"c", 1, text) for k, text in more),
                _entry(SIUN, b"c", len(unit), unit),
                _entry(SCAL, b"s", 2, struct.pack(">h", factor)),
                _entry(TMPC, b"f", 4, struct.pack(">f", 40.0 + second)),
                _entry(key, b"s", 6, rows.tobytes()),
            ]
            streams += _entry(b"STRM", b"\0", 1, b"".join(entries))
        if len(gyro) == 0:
            name = _entry(STNM, b"c", 1, b"Exposure time")
            shut = _entry(b"SHUT", b"f", 4, struct.pack(">3f", 0.1, 0.2, 0.3))
            streams = _entry(b"STRM", b"\0", 1, name + shut)
        if fixes is not None:
            streams += _fix_stream(fixes[18 * second : 18 * (second + 1)], second)
        packets.append(_entry(b"DEVC", b"\0", 1, streams))
    head = _box(b"ftyp", b"mp41" + bytes(4) + b"mp41")
    path.write_bytes(head + _box(b"mdat", b"".join(packets)) + _movie(packets, len(head) + 8))
    return path


def _fix_stream(fixes, second):
    whole = np.column_stack([fixes * (1e7, 1e7, 1e3), np.zeros((len(fixes), 2))]).round()
    entries = [
        _entry(TICK, b"L", 4, struct.pack(">I", 5000 + 1000 * second)),
        _entry(b"GPSF", b"L", 4, struct.pack(">I", 3)),
        _entry(SCAL, b"l", 4, struct.pack(">5i", 10**7, 10**7, 1000, 1000, 100)),
        _entry(b"GPS5", b"l", 20, whole.astype(">i4").tobytes()),
    ]
    return _entry(b"STRM", b"\0", 1, b"".join(entries))


def _entry(key, kind, size, raw):
    return key + kind + struct.pack(">BH", size, len(raw) // size) + raw + bytes(-len(raw) % 4)


def _box(name, *parts):
    raw = b"".join(parts)
    return struct.pack(">I", 8 + len(raw)) + name + raw


def _movie(packets, at):
    count, ticks = len(packets), 1000
    sizes = [len(packet) for packet in packets]
    places = np.cumsum([at, *sizes[:-1]]).tolist()
    matrix = struct.pack(">9I", 1 << 16, 0, 0, 0, 1 << 16, 0, 0, 0, 1 << 30)
    length = struct.pack(">2I", ticks, count * ticks)
    table = _box(
        b"stbl",
        _box(b"stsd", struct.pack(">2I", 0, 1), _box(b"gpmd", bytes(6), b"\0\1", bytes(4))),
        _box(b"stts", struct.pack(">4I", 0, 1, count, ticks)),
        _box(b"stsc", struct.pack(">5I", 0, 1, 1, 1, 1)),
        _box(b"stsz", struct.pack(f">3I{count}I", 0, 0, count, *sizes)),
        _box(b"stco", struct.pack(f">2I{count}I", 0, count, *places)),
    )
    named = struct.pack(">2I4s", 0, 0, b"meta") + bytes(12) + b"\x09GoPro MET"
    own = _box(
        b"mdia",
        _box(b"mdhd", bytes(12), length, bytes(4)),
        _box(b"hdlr", named),
        _box(
            b"minf",
            _box(b"gmhd", _box(b"gmin", bytes(16))),
            _box(b"dinf", _box(b"dref", struct.pack(">2I", 0, 1), _box(b"url ", b"\0\0\0\1"))),
            table,
        ),
    )
    track = struct.pack(">6I", 15, 0, 0, 1, 0, count * ticks) + bytes(16) + matrix + bytes(8)
    about = bytes(12) + length + struct.pack(">IHH", 1 << 16, 256, 0) + bytes(8) + matrix
    return _box(
        b"moov",
        _box(b"mvhd", about, bytes(24), struct.pack(">I", 2)),
        _box(b"trak", _box(b"tkhd", track), own),
    )
