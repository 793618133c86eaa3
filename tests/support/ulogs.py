"""ULog files of simulated flights, written byte by byte as PX4 does."""

import struct

import numpy as np

MAGIC = b"ULog\x01\x12\x35"
TYPES = {"u8": "uint64_t", "u4": "uint32_t", "u1": "uint8_t", "i4": "int32_t", "f4": "float"}
TYPES |= {"f8": "double", "i2": "int16_t"}


def flight(n=400, period=5000, start=1_000_000, seed=5):
    """Return the topics of one IMU at 200 Hz: a gyro, rad/s, and an accelerometer, m/s^2."""
    rng = np.random.default_rng(seed)
    gyro, accel = rng.standard_normal((2, n, 3)).astype(np.float32)
    combined = {
        "timestamp": stamps(n, period, start),
        "gyro_rad": gyro,
        "accelerometer_timestamp_relative": np.zeros(n, np.int32),
        "accelerometer_m_s2": accel,
    }
    return {("sensor_combined", 0): combined}


def stamps(n, period, start=1_000_000):
    """Return stamps in microseconds."""
    return (start + period * np.arange(n)).astype(np.uint64)


def sensor(n, period, values, temperature=None, **more):
    """Return a topic such as ``sensor_gyro``, of one vector and a temperature."""
    fields = {"timestamp": stamps(n, period), **more}
    fields |= {axis: values[:, i].astype(np.float32) for i, axis in enumerate("xyz")}
    if temperature is not None:
        fields["temperature"] = np.full(n, temperature, np.float32)
    return fields


def write_ulog(path, topics, dropouts=(), parameters=None):
    """Write topics by name and instance, each of fields (n,) or (n, k); return the path.

    ``dropouts`` are pairs of a time, us, and a duration, ms, ``parameters`` numbers by name.
    """
    raw = [MAGIC + b"\x01" + struct.pack("<Q", 0), message("B", bytes(40))]
    for name, value in (parameters or {}).items():
        kind, form = ("int32_t", "<i") if isinstance(value, int) else ("float", "<f")
        key = f"{kind} {name}".encode()
        raw.append(message("P", bytes([len(key)]) + key + struct.pack(form, value)))
    for name in dict.fromkeys(name for name, _ in topics):
        fields = next(f for (other, _), f in topics.items() if other == name)
        listed = "".join(f"{_type(values)} {field};" for field, values in fields.items())
        raw.append(message("F", f"{name}:{listed}".encode()))
    timed = []
    for number, ((name, instance), fields) in enumerate(topics.items()):
        raw.append(message("A", struct.pack("<BH", instance, number) + name.encode()))
        columns = [np.asarray(values) for values in fields.values()]
        for i, stamp in enumerate(fields["timestamp"]):
            row = b"".join(
                column[i].astype(column.dtype.newbyteorder("<")).tobytes() for column in columns
            )
            timed.append((int(stamp), message("D", struct.pack("<H", number) + row)))
    timed += [(stamp, message("O", struct.pack("<H", lost))) for stamp, lost in dropouts]
    raw += [message for _, message in sorted(timed, key=lambda pair: pair[0])]
    path.write_bytes(b"".join(raw))
    return path


def _type(values):
    kind = TYPES[np.asarray(values).dtype.str[1:]]
    return kind if values.ndim == 1 else f"{kind}[{values.shape[1]}]"


def message(kind, data):
    """Return a message of one kind, such as ``"D"``, around its bytes."""
    return struct.pack("<HB", len(data), ord(kind)) + data
