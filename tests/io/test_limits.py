"""What a file may cost to read: files that declare or unpack to far more than they hold."""

import signal
import subprocess
import sys
import zipfile

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.feather as feather
import pyarrow.parquet as pq
import pytest
from scipy.io import savemat

from support.formats import written
from zerorate.io import limits, read_log, read_recording
from zerorate.io.readers import isolated
from zerorate.record import LogError

N = 3_000_000
ZEROS = np.zeros(3 * N)


def zeros_npz(path):
    np.savez_compressed(path, gyro_x=ZEROS)


def zeros_parquet(path):
    pq.write_table(pa.table({"gyro_x": ZEROS}), path, compression="zstd")


def zeros_arrow(path):
    table = pa.table({"gyro_x": ZEROS})
    feather.write_feather(table, path, compression="zstd", chunksize=N)


def zeros_hdf5(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("gyro_x", data=ZEROS, compression="gzip", chunks=(N,))


def zeros_mat(path):
    savemat(path, {"gyro_x": ZEROS}, do_compression=True)


BOMBS = {
    "a.npz": zeros_npz,
    "a.parquet": zeros_parquet,
    "a.arrow": zeros_arrow,
    "a.h5": zeros_hdf5,
    "a.mat": zeros_mat,
}


@pytest.mark.parametrize("name", BOMBS)
def test_what_swells_when_it_is_unpacked_is_refused(tmp_path, name):
    BOMBS[name](tmp_path / name)
    told = r"would take \d.* MB of memory, more than 20 times|needs more memory|far more than a"
    for read in (read_log, read_recording):
        with pytest.raises(LogError, match=told):
            read(tmp_path / name, rate=100)


def test_limits_follow_the_size(tmp_path):
    small, large = tmp_path / "small", tmp_path / "large"
    small.write_bytes(b"")
    with large.open("wb") as file:
        file.truncate(10**9)
    assert limits.max_bytes(large) - limits.max_bytes(small) == 20 * 10**9
    assert limits.max_seconds(large) <= 5 + 1000
    # A folder costs as much as what is in it.
    assert limits.max_seconds(tmp_path) == limits.max_seconds(large)


@pytest.mark.every(3)
@pytest.mark.parametrize("mark", [";", "\t", ","])
def test_a_text_of_a_million_columns_is_refused_at_once(tmp_path, mark):
    (tmp_path / "a.csv").write_text("1" + mark * 1_000_000 + "\n")
    with pytest.raises(LogError, match="the table has 1000001 columns, expected at most 16384"):
        read_log(tmp_path / "a.csv", rate=100)


def test_an_npz_that_declares_more_than_it_can_hold(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,)}\n"
        magic = b"\x93NUMPY\x03\x00" + len(header).to_bytes(4, "little")
        archive.writestr("gyro_x.npy", magic + header)
    with pytest.raises(LogError, match="declares the shape"):
        read_log(tmp_path / "a.npz", rate=100)


# The process isolated.


@pytest.mark.skipif(sys.platform == "win32", reason="the signals are those of POSIX")
@pytest.mark.parametrize("asleep", [False, True])
def test_a_library_that_never_comes_back_is_ended(tmp_path, monkeypatch, asleep):
    """As h5py on some files; here a module of its name that computes, or waits, for ever."""
    path = written(tmp_path, "a.h5")
    (tmp_path / "h5py.py").write_text(
        f"import time\ndef File(path):\n    while True: time.sleep(0.01) if {asleep} else None\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(limits, "_BASE_SECONDS", 0.2)
    monkeypatch.setattr(isolated, "_CLOCK_S_PER_CPU_S", 2.0 if asleep else 100.0)
    isolated._worker.end()
    with pytest.raises(LogError, match="would take more than 0 s, as in no sound file"):
        read_log(path)
    monkeypatch.undo()
    assert read_log(path).n == 40


@pytest.mark.skipif(sys.platform == "win32", reason="the signals are those of POSIX")
def test_a_process_that_was_killed_is_begun_anew(tmp_path):
    path = written(tmp_path, "a.h5")
    read_log(path)
    isolated._worker._process.send_signal(signal.SIGKILL)
    isolated._worker._process.wait()
    assert read_log(path).n == 40


def test_a_damaged_file_leaves_no_process_to_the_next(tmp_path):
    path = written(tmp_path, "a.h5")
    read_log(path)
    before = isolated._worker._process
    assert read_log(path).n == 40
    assert isolated._worker._process is before
    (tmp_path / "b.h5").write_bytes(path.read_bytes()[:900])
    with pytest.raises(LogError, match="truncated, damaged"):
        read_log(tmp_path / "b.h5")
    assert isolated._worker._process is None


FORKED = """
import multiprocessing as mp, sys
import zerorate as zr
read = lambda: zr.read_log(sys.argv[1]).n
assert read() == 40
with mp.get_context("fork").Pool(2) as pool:
    print(pool.map(zr.read_log, [sys.argv[1]] * 4)[3].n, read())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="needs fork without the frameworks of macOS")
def test_a_forked_process_begins_its_own(tmp_path):
    path = written(tmp_path, "a.h5")
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", FORKED, path], capture_output=True, text=True
    )
    assert (done.stdout, done.stderr) == ("40 40\n", "")
