"""Program that reads HDF5, MAT files, bags and videos in a separate process, within limits.

A request is a line of JSON: the name of a function in this module, its arguments, and the limits of
computing time (s) and memory (bytes). An answer is a line of JSON and the bytes of the arrays
listed there. Modules of the package are imported only when needed.
"""

from __future__ import annotations

import importlib
import json
import math
import os
import signal
import sys
from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import IO, Any, Final

import numpy as np

if sys.platform != "win32":  # on Windows the parent limits the time
    import resource

_Array = np.ndarray[Any, Any]
_Node = Any
_Answer = tuple[Any, list[_Array]]


class Refused(Exception):
    """Error with a complete message."""


def main(requests: IO[bytes], answers: IO[bytes]) -> None:
    """Answer requests until the input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles interrupts
    for line in requests:
        request = json.loads(line)
        work, package, compiled = _FUNCTIONS[request["work"]]
        importlib.import_module(package)  # before the limits, which apply only to the file
        _apply_limits(request["seconds"], request["bytes"])
        try:
            result, arrays = work(*request["arguments"])
            answer = {"result": result, "arrays": [(a.dtype.str, a.shape) for a in arrays]}
        except Exception as error:  # damaged bytes can raise any exception
            answer, arrays = _describe_error(error), []
            answer["harmed"] = compiled and not isinstance(error, Refused)
        answers.write(json.dumps(answer).encode() + b"\n")
        for array in (a for a in arrays if a.nbytes):
            raw: Any = np.ascontiguousarray(array).reshape(-1).view(np.uint8)
            answers.write(memoryview(raw))
        answers.flush()


def _describe_error(error: Exception) -> dict[str, Any]:
    text = str(error).strip() or type(error).__name__
    kind = "memory" if isinstance(error, MemoryError) else type(error).__name__
    return {"error": text, "kind": kind, "errno": getattr(error, "errno", None)}


def _apply_limits(seconds: float, size: int) -> None:
    """Set limits of computing time and memory; beyond them, the system ends this process."""
    if sys.platform == "win32":
        return
    used_s = sum(os.times()[:2])
    _set_limit(resource.RLIMIT_CORE, 0)
    _set_limit(resource.RLIMIT_CPU, math.ceil(used_s + seconds))
    try:
        with open("/proc/self/statm") as file:
            used_bytes = int(file.read().split()[5]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return  # other systems do not enforce the limit
    _set_limit(resource.RLIMIT_DATA, used_bytes + size)


def _set_limit(limit: int, value: int) -> None:
    if sys.platform != "win32":
        hard = resource.getrlimit(limit)[1]
        resource.setrlimit(limit, (value if hard < 0 else min(value, hard), hard))


def mat_arrays(path: str, texts: Collection[str]) -> _Answer:
    """Return the names of a MAT file's arrays, and the arrays; `texts` names arrays of texts."""
    from scipy.io import loadmat

    arrays: dict[str, _Array] = {}
    for name, value in loadmat(path).items():
        if not name.startswith("__"):
            arrays.update(_mat_arrays(name, value, texts))
    return list(arrays), list(arrays.values())


def _mat_arrays(name: str, value: _Array, texts: Collection[str]) -> Iterator[tuple[str, _Array]]:
    """Yield a variable, or the fields of a structure, by path."""
    if value.dtype.names is not None and value.size == 1:
        for field in value.dtype.names:
            inner = np.asarray(value[field].reshape(-1)[0])
            yield from _mat_arrays(f"{name}/{field}", inner, texts)
    elif name.rpartition("/")[2] in texts:
        yield name, _join_cells(value) if value.dtype.kind == "O" else value
    elif value.dtype.kind in "fiub" and value.ndim == 2 and value.size > 1:
        yield name, value.reshape(-1) if 1 in value.shape else value


def _join_cells(value: _Array) -> _Array:
    """Return a cell array of strings as an array of NumPy strings."""
    return np.array(["".join(map(str, np.asarray(c).reshape(-1)[:1])) for c in value.reshape(-1)])


def hdf5_listing(path: str, texts: Collection[str], matlab: bool) -> _Answer:
    """Return the contents of an HDF5 file; small arrays are already read.

    Each entry has a name, shape, type, and a unit if stated. `hdf5_values` reads it by its key and
    field; they are None if the array is already read.
    """
    import h5py

    entries: list[dict[str, Any]] = []
    small: list[_Array] = []
    links: list[str | bytes] = []

    def note(name: str | bytes, link: object) -> None:
        if isinstance(link, h5py.ExternalLink):
            links.append(name)

    def add(name: str | bytes, node: _Node) -> None:
        for entry, array in _list_entries(name, node, texts, matlab):
            entries.append(entry)
            small.extend([] if array is None else [array])

    with h5py.File(path) as file:
        file.visititems_links(note)
        if links:
            raise Refused(_describe_external(str(links[0])))
        add("", file)
        file.visititems(add)
    return entries, small


def hdf5_values(path: str, key: str, field: str | None, max_bytes: int) -> _Answer:
    """Return the values of a data set, or of one of its fields."""
    import h5py

    with h5py.File(path) as file:
        node = file[key.encode("utf-8", "surrogateescape")]
        _check_written(node, key)
        if node.nbytes > max_bytes:
            raise Refused(
                f"'{key}' declares {node.nbytes} bytes, far more than a file of this size"
            )
        return None, [_to_texts(node[()] if field is None else node[field])]


_Entry = tuple[dict[str, Any], _Array | None]


def _list_entries(
    key: str | bytes, node: _Node, texts: Collection[str], matlab: bool
) -> Iterator[_Entry]:
    """Yield the entries of a group or data set with a path in the file."""
    name = str(key)  # names that are not text are bytes
    if name.startswith("#"):
        return
    if not hasattr(node, "dtype"):
        for key_name in texts:
            if key_name in node.attrs:
                yield _read_entry(
                    f"{name}/{key_name}".lstrip("/"), _to_texts(np.asarray(node.attrs[key_name]))
                )
        return
    if node.is_virtual or node.external:
        raise Refused(_describe_external(name))
    if node.shape is None:
        return
    if node.dtype.names is not None:
        for field in node.dtype.names:
            yield (
                _unread_entry(f"{name}/{field}", key, node, node.dtype[field]) | {"field": field},
                None,
            )
    elif name.rpartition("/")[2] in texts:
        yield _read_entry(name, _read_scalar(node, matlab))
    elif node.dtype.kind in "fiub" and node.ndim in (1, 2):
        yield _unread_entry(name, key, node, node.dtype) | {"unit": _find_unit(node)}, None


def _read_entry(name: str, array: _Array) -> _Entry:
    return {"name": name, "key": None}, array


def _unread_entry(name: str, key: str | bytes, node: _Node, kind: np.dtype[Any]) -> dict[str, Any]:
    path = key if isinstance(key, str) else key.decode("utf-8", "surrogateescape")
    return {"name": name, "key": path, "field": None, "shape": node.shape, "dtype": kind.str}


def _describe_external(name: str) -> str:
    return f"'{name}' lies in another file, expected an HDF5 file that holds all its data"


def _check_written(node: _Node, name: str) -> None:
    """Raise an error if a data set is larger than its written data: the rest would be zeros."""
    if node.chunks is None:
        written = node.id.get_storage_size() // node.dtype.itemsize
    else:
        written = node.id.get_num_chunks() * math.prod(node.chunks)
    if written < node.size:
        raise Refused(f"'{name}' declares {node.size} values, but only {written} were written")


def _find_unit(node: _Node) -> str | None:
    units = (node.attrs.get(key) for key in ("unit", "units"))
    return next((unit for unit in units if isinstance(unit, str)), None)


def _read_scalar(node: _Node, matlab: bool) -> _Array:
    if matlab and node.attrs.get("MATLAB_class") == b"char":
        return np.array("".join(map(chr, node[()].reshape(-1))))
    return _to_texts(np.asarray(node[()]))


def _to_texts(array: _Array) -> _Array:
    """Return bytes and Python strings as NumPy strings, other arrays unchanged."""
    if array.dtype.kind not in "OS":
        return array
    flat = array.reshape(-1).tolist()
    texts = [t.decode(errors="replace") if isinstance(t, bytes) else str(t) for t in flat]
    return np.array(texts, dtype=np.str_).reshape(array.shape)


def bag_topics(path: str) -> _Answer:
    """Return the topics of a ROS recording with messages of a sensor."""
    from zerorate.io.readers import ros

    return ros.list_topics(Path(path)), []


def bag_columns(path: str, topic: str, wanted: list[int]) -> _Answer:
    """Return columns of the messages of a topic."""
    from zerorate.io.readers import ros

    return None, ros.read_columns(Path(path), topic, wanted)


def camera_sensors(path: str) -> _Answer:
    """Return telemetry-parser's contents of a file: the camera, its sensors, and the rest."""
    from zerorate.io.readers import camera

    content = camera.find_sensors(Path(path))
    sensors = [
        {"sensor": sensor.sensor, "names": sensor.names, "axes": sensor.axes, "note": sensor.note}
        for sensor in content.sensors
    ]
    result = {"camera": content.camera, "sensors": sensors, "others": content.others}
    return result, [column for sensor in content.sensors for column in sensor.columns]


_FUNCTIONS: Final[dict[str, tuple[Callable[..., _Answer], str, bool]]] = {
    "mat_arrays": (mat_arrays, "scipy.io", True),
    "hdf5_listing": (hdf5_listing, "h5py", True),
    "hdf5_values": (hdf5_values, "h5py", True),
    "bag_topics": (bag_topics, "zerorate.io.readers.ros", False),
    "bag_columns": (bag_columns, "zerorate.io.readers.ros", False),
    "camera_sensors": (camera_sensors, "zerorate.io.readers.camera", True),
}
"""Functions by name, with the necessary module, and a flag if damage may corrupt the memory."""


if __name__ == "__main__":
    # Output of a library must not mix with the answers.
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(2, 1)
        main(sys.stdin.buffer, out)
