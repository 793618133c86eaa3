"""One small recording of a gyro in every format that is read, and damage done to it."""

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.feather as feather
import pyarrow.parquet as pq
from scipy.io import savemat

import zerorate as zr
from support.bags import write_recording
from support.blackboxes import write_blackbox
from support.dataflash import flight as copter
from support.dataflash import write_dataflash, write_text
from support.gopros import write_gopro
from support.tlogs import write_tlog
from support.ulogs import flight, write_ulog

N = 40
COLUMNS = {"time_s": np.arange(N) / 100, "gyro_x_dps": np.random.default_rng(2).normal(size=N)}
_CAMERA = np.random.default_rng(4).integers(-900, 900, (2, N, 3))


def _csv(path):
    rows = zip(*COLUMNS.values(), strict=True)
    lines = [",".join(COLUMNS), *(",".join(map(repr, map(float, row))) for row in rows)]
    path.write_text('# zerorate {"rate": 100.0}\n' + "\n".join(lines) + "\n")


def _npy(path):
    np.save(path, np.rec.fromarrays(COLUMNS.values(), names=list(COLUMNS)))


def _arrow(path, compression="uncompressed"):
    table = pa.table(COLUMNS).replace_schema_metadata({"unit": "deg/s", "names": '["gyro_x_dps"]'})
    feather.write_feather(table, path, compression=compression)


def _hdf5(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("time_s", data=COLUMNS["time_s"])
        file.create_dataset("gyro_x_dps", data=COLUMNS["gyro_x_dps"], compression="gzip")
        file["unit"] = "deg/s"


def _mcap(path):
    rates = np.random.default_rng(3).normal(size=(N, 3))
    names = [f"gyro_{axis}_radps" for axis in "xyz"]
    zr.write_log(zr.Log(1.7e9 + np.arange(N) / 100, 100.0, rates, names, "rad/s"), path)


_WRITERS = {
    "a.csv": _csv,
    "a.npy": _npy,
    "stored.npz": lambda path: np.savez(path, **COLUMNS),
    "deflated.npz": lambda path: np.savez_compressed(path, unit="deg/s", **COLUMNS),
    "a.parquet": lambda path: pq.write_table(pa.table(COLUMNS), path),
    "plain.arrow": _arrow,
    "packed.arrow": lambda path: _arrow(path, "lz4"),
    "a.h5": _hdf5,
    "stored.mat": lambda path: savemat(path, {"imu": COLUMNS, "unit": "deg/s"}),
    "deflated.mat": lambda path: savemat(path, COLUMNS, do_compression=True),
    "a.ulg": lambda path: write_ulog(path, flight(N)),
    "a.bin": lambda path: write_dataflash(path, copter(N)),
    "a.tlog": lambda path: write_tlog(path, N),
    "a.mp4": lambda path: write_gopro(path, *_CAMERA, rate=8),
    "a.bbl": lambda path: write_blackbox(path, 1000 * np.arange(N), np.tile(_CAMERA[0], 5)[:, :14]),
    "packed.mcap": _mcap,
    "a.log": lambda path: write_text(path, copter(N)),
}
FORMATS = (*_WRITERS, "a.bag", "a.db3", "a.mcap")


def written(folder, name):
    """Return the path of the recording in a format, written into a folder."""
    if name in _WRITERS:
        _WRITERS[name](folder / name)
        return folder / name
    return write_recording(folder, name.partition(".")[2], ["/imu"], n=N)


def damaged(raw, rng):
    """Return the bytes with a few of them changed, or a part cut out, repeated or cut off."""
    raw = bytearray(raw)
    at, length = rng.integers(len(raw)), int(rng.integers(1, 40))
    match rng.integers(5):
        case 0:
            del raw[at:]
        case 1:
            del raw[at : at + length]
        case 2:
            raw[at:at] = raw[at : at + length]
        case 3:
            raw[at : at + length] = rng.choice([b"\0", b"\xff", b"\x7f"]) * length
        case _:
            for place in rng.integers(len(raw), size=rng.integers(1, 8)):
                raw[place] = rng.integers(256)
    return bytes(raw)
