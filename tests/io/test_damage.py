"""Damaged and hostile files: one sentence, whatever their bytes do to the reader."""

import os
import socket
import struct
import subprocess
import sys
import zipfile

import numpy as np
import pyarrow as pa
import pyarrow.feather as feather
import pyarrow.parquet as pq
import pytest
from scipy.io import savemat

from support.formats import FORMATS, damaged, written
from zerorate.io import open_log, read_log, read_recording
from zerorate.record import LogError
from zerorate.record.log import check_rate

ROUNDS = {"a.h5": 5, "a.mp4": 12, "stored.mat": 3, "deflated.mat": 3}
"""Behind each damaged one a process is begun anew."""


def sentence(path, read=read_log, **options):
    """Return the one sentence of a refusal."""
    with pytest.raises(LogError) as caught:
        read(path, **options)
    text = str(caught.value)
    assert text.startswith(f"{path}: ")
    assert text.isprintable()
    assert len(text) < len(str(path)) + 400
    return text


def told(path, read, **options):
    """Return what reading a file gives, in words: the log or the recording, or the refusal."""
    try:
        return repr(read(path, **options))
    except LogError as error:
        return str(error)


@pytest.mark.every(6)
@pytest.mark.parametrize("part", range(3))
@pytest.mark.parametrize("name", FORMATS)
def test_damage_is_read_or_refused(tmp_path, name, part):
    """A third of the rounds in a case."""
    path = written(tmp_path, name)
    whole = path.read_bytes()
    assert read_log(path).n == 40
    for seed in range(part, ROUNDS.get(name, 60), 3):
        path.write_bytes(damaged(whole, np.random.default_rng([1, seed])))
        for read in (read_log, read_recording):
            assert told(path, read, rate=100).isprintable()


@pytest.mark.every(3)
@pytest.mark.parametrize("seed", [132, 156, 163])
def test_a_mat_file_never_ends_the_process(tmp_path, seed):
    path = written(tmp_path, "stored.mat")
    path.write_bytes(damaged(path.read_bytes(), np.random.default_rng([9, seed])))
    assert "cannot be read as a MAT file: truncated, damaged" in sentence(path)


def test_a_mat_file_is_read_in_a_thread_of_a_script_without_a_guard(tmp_path):
    path = written(tmp_path, "deflated.mat")
    script = (
        "import threading, zerorate as zr\n"
        f"thread = threading.Thread(target=lambda: print(zr.read_log({str(path)!r}).n))\n"
        "thread.start(); thread.join()\n"
    )
    done = subprocess.run([sys.executable, "-"], input=script, capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("40\n", "")


def test_faults_of_the_system_are_not_the_files(tmp_path, monkeypatch):
    path = written(tmp_path, "a.npy")
    monkeypatch.setattr(np.lib.format, "read_magic", lambda _: os.stat(tmp_path / "gone"))
    with pytest.raises(FileNotFoundError):
        read_log(path)


@pytest.mark.parametrize("fault", [KeyboardInterrupt, SystemExit])
def test_an_interrupt_passes(tmp_path, monkeypatch, fault):
    def interrupted(_):
        raise fault

    monkeypatch.setattr(np.lib.format, "read_magic", interrupted)
    with pytest.raises(fault):
        read_log(written(tmp_path, "a.npy"))


def test_want_of_memory_is_one_sentence(tmp_path, monkeypatch):
    def greedy(*_, **__):
        raise MemoryError

    monkeypatch.setattr(np.lib.format, "read_array", greedy)
    assert "more memory than there is" in sentence(written(tmp_path, "a.npy"))


def test_damage_found_while_a_file_is_read_in_pieces(tmp_path):
    path = tmp_path / "a.parquet"
    columns = {"time_s": np.arange(5000) / 100, "gyro_x": np.arange(5000.0)}
    pq.write_table(pa.table(columns), path, compression="gzip", row_group_size=1000)
    raw = bytearray(path.read_bytes())
    place = len(raw) // 2
    raw[place : place + 300] = b"\xff" * 300
    path.write_bytes(raw)
    text = sentence(path, lambda p: list(open_log(p, rate=100, columns="gyro_x").blocks(100)))
    assert "cannot be read as Parquet" in text


# NumPy's files.


def npy_of(header):
    """Return an .npy file of a header alone."""
    text = header.encode("latin-1") + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,)}", "0 bytes of it"),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (-1,)}", "declares the shape"),
        ("{'descr': '|O', 'fortran_order': False, 'shape': (3,)}", "Python objects"),
        ("{'descr': '<q9', 'fortran_order': False, 'shape': (3,)}", "damaged"),
        ("(" * 200, "damaged"),
        ("-" * 9000 + "1", "cannot be read as an .np"),
        ("__import__('os').getpid()", "damaged"),
        ("{'descr': [('a', '<f8')] * 2, 'fortran_order': 0, 'shape': 3}", "damaged"),
        ("", "damaged"),
    ],
)
@pytest.mark.parametrize("packed", [False, True])
def test_headers_of_npy(tmp_path, header, message, packed):
    path = tmp_path / ("a.npz" if packed else "a.npy")
    if packed:
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("gyro_x.npy", npy_of(header))
    else:
        path.write_bytes(npy_of(header))
    assert message in sentence(path, rate=10)


def test_a_pickle_is_not_loaded(tmp_path):
    np.save(tmp_path / "a.npy", np.array([print, 1], object))
    assert "Python objects" in sentence(tmp_path / "a.npy", rate=10)


def patched(path, local, central, value):
    """Write two bytes at a place of every local and every central header of a ZIP."""
    raw = bytearray(path.read_bytes())
    for mark, place in ((b"PK\3\4", local), (b"PK\1\2", central)):
        at = raw.find(mark)
        while at >= 0:
            struct.pack_into("<H", raw, at + place, value)
            at = raw.find(mark, at + 4)
    path.write_bytes(raw)


@pytest.mark.parametrize(("place", "value"), [((8, 10), 99), ((8, 10), 9), ((6, 8), 1)])
def test_npz_packed_or_locked_in_unknown_ways(tmp_path, place, value):
    path = written(tmp_path, "deflated.npz")
    patched(path, *place, value)
    assert "cannot be read as an .npz: truncated, damaged or of a foreign kind (" in sentence(path)


@pytest.mark.parametrize("name", ["stored.npz", "deflated.npz"])
def test_npz_with_a_wrong_byte(tmp_path, name):
    path = written(tmp_path, name)
    with zipfile.ZipFile(path) as archive:
        info = archive.getinfo("gyro_x_dps.npy")
    raw = bytearray(path.read_bytes())
    raw[info.header_offset + 30 + len(info.filename) + info.compress_size - 20] ^= 0x10
    path.write_bytes(raw)
    assert "damaged" in sentence(path)


# Names of columns.


def test_a_name_twice_in_parquet(tmp_path):
    path = tmp_path / "a.parquet"
    names = ["t_s", "gyro_x", "temp", "gyro_x"]
    pq.write_table(pa.table([np.arange(4.0) + i for i in (0, 10, 20, 30)], names=names), path)
    assert "names must differ, repeated: gyro_x" in sentence(path)
    asked = sentence(path, columns="gyro_x")
    assert "2 columns are named 'gyro_x'; choose one by its index" in asked
    for index, first in ((1, 10), (3, 30)):
        assert read_log(path, columns=index).data[0, 0] == first
        assert next(open_log(path, columns=index).blocks(9))[0, 0] == first


@pytest.mark.parametrize("suffix", ["parquet", "arrow"])
def test_a_name_that_is_no_text(tmp_path, suffix):
    path = tmp_path / f"a.{suffix}"
    table = pa.table({"t_s": np.arange(4.0), "gyro_xxxx": np.arange(4.0)})
    if suffix == "parquet":
        pq.write_table(table, path, store_schema=False)
    else:
        feather.write_feather(table, path, compression="uncompressed")
    path.write_bytes(path.read_bytes().replace(b"gyro_xxxx", b"gyro_\xff\xfe\xffx"))
    sentence(path)


@pytest.mark.parametrize("name", ["gyro_x\nline", "gyro_x\x1b[2J", "gyro_x\ud800"[:-1] + "\u2028"])
def test_names_with_control_characters_are_escaped(tmp_path, name):
    path = tmp_path / "a.parquet"
    pq.write_table(pa.table({"t_s": np.arange(4.0), name: np.arange(4.0)}), path)
    assert read_log(path).names == (name.encode("unicode_escape").decode(),)
    assert "gyro_x\\" in sentence(path, columns="other")


def test_empty_names_in_mat(tmp_path):
    path = tmp_path / "a.mat"
    savemat(path, {"gyro": np.arange(4.0), "s": {"gyro_x": np.arange(4.0)}})
    raw = path.read_bytes()
    named, unnamed = struct.pack("<HH", 1, 4) + b"gyro", struct.pack("<HH", 1, 0) + bytes(4)
    path.write_bytes(raw.replace(named, unnamed))
    assert path.read_bytes() != raw
    for read in (read_log, read_recording):
        assert told(path, read, rate=10).isprintable()


# What a file says of itself.

DEEP = "[" * 100_000
HOSTILE = [
    "null",
    "[]",
    "5",
    DEEP,
    '{"rate": "x"}',
    '{"rate": [100]}',
    '{"rate": {}}',
    '{"rate": true}',
    '{"rate": -1}',
    '{"rate": 0}',
    '{"rate": NaN}',
    '{"rate": Infinity}',
    '{"rate": 1e400}',
    '{"rate": ' + "9" * 400 + "}",
    '{"rate": ' + "9" * 5000 + "}",
    '{"rate": 10, "unit": 5}',
    '{"rate": 10, "sensor": ["a"]}',
    '{"rate": 10, "names": "wx"}',
    '{"rate": 10, "names": [1, 2]}',
    '{"rate": 10, "names": {"a": 1}}',
    '{"rate": 10, "names": [' + DEEP,
]


@pytest.mark.parametrize("text", HOSTILE)
def test_hostile_metadata_of_a_text_table(tmp_path, text):
    path = tmp_path / "a.csv"
    path.write_text(f"# zerorate {text}\ntime,wx\n1,2\n3,4\n5,6\n")
    sentence(path)


@pytest.mark.parametrize(
    "text", ['{"rate": 10, "sensor": "a\\u2028\\ud800"}', '{"unit": "\\u0007"}']
)
def test_metadata_that_cannot_be_printed(tmp_path, text):
    path = tmp_path / "a.csv"
    path.write_text(f"# zerorate {text}\ntime_s,wx\n0.1,2\n0.2,4\n0.3,6\n")
    log = read_log(path)
    assert str(log.meta.get("sensor", log.unit)).isprintable()


@pytest.mark.parametrize("rate", ["x", "nan", "-1", "1e400", "9" * 5000, b"\xff"])
def test_hostile_metadata_of_parquet(tmp_path, rate):
    path = tmp_path / "a.parquet"
    table = pa.table({"gyro_x": np.arange(4.0)}).replace_schema_metadata(
        {"rate": rate, "names": DEEP}
    )
    pq.write_table(table, path)
    sentence(path)


@pytest.mark.parametrize("rate", [10**400, -1, 0, True, None, "1", float("nan"), 1j])
def test_rates_that_are_none(rate):
    with pytest.raises(ValueError, match="rate must be a positive finite number of Hz"):
        check_rate(rate)


# What is no file.


@pytest.mark.skipif(os.name != "posix", reason="needs pipes with names")
@pytest.mark.parametrize("name", ["a.csv", "a.parquet", "a.mat", "a.ulg"])
def test_a_pipe_is_refused_at_once(tmp_path, name):
    os.mkfifo(tmp_path / name)
    for read in (read_log, read_recording, open_log):
        with pytest.raises(OSError, match="is a pipe, a socket or a device, expected a file"):
            read(tmp_path / name)


@pytest.mark.skipif(os.name != "posix", reason="needs sockets with names")
def test_sockets_devices_and_pipes_in_a_bag_are_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as one:
        one.bind("a.csv")
        for path in ("a.csv", "/dev/zero"):
            with pytest.raises(OSError, match="is a pipe, a socket or a device"):
                read_log(path)
    os.mkdir("bag")
    (tmp_path / "bag" / "metadata.yaml").write_text("rosbag2_bagfile_information:\n")
    os.mkfifo("bag/run.db3")
    with pytest.raises(OSError, match=r"run\.db3 is a pipe"):
        read_log("bag")


def test_a_file_that_is_open_elsewhere_is_read(tmp_path):
    path = written(tmp_path, "a.csv")
    with open(path, "a"):
        assert read_log(path).n == 40
