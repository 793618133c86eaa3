"""The format of a file by its suffix and its first bytes."""

import subprocess
import sys

import numpy as np
import pytest

from support.formats import FORMATS, N, written
from support.tables import parquet
from zerorate.io import read_log
from zerorate.record import LogError


@pytest.mark.parametrize("suffix", ["parquet", "npy", "npz"])
def test_truncated_files(tmp_path, suffix):
    path = tmp_path / f"a.{suffix}"
    if suffix == "parquet":
        path = parquet(tmp_path, {"wx": np.zeros(100)}, rate="1")
    else:
        (np.save if suffix == "npy" else np.savez)(path, np.zeros(100))
    path.write_bytes(path.read_bytes()[:-50])
    with pytest.raises(LogError, match=r"truncated|damaged"):
        read_log(path, rate=1)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.parquet", b"1,2\n", "by its suffix Parquet, by its content something else"),
        ("a.npy", b"1,2\n", "by its suffix an .npy array"),
        ("a.csv", b"PAR1....", "by its suffix a text table, by its content Parquet"),
        ("a.xyz", b"1", "unknown suffix '.xyz'; known: .csv"),
        ("a.xls", b"1", "a spreadsheet: save the sheet as CSV"),
        ("a.csv.gz", b"1", "compressed: unpack it"),
        ("a", b"1", "unknown suffix ''"),
        ("a.npz", b"", "the file is empty, expected an .npz"),
    ],
)
def test_files_that_lie(tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(LogError) as caught:
        read_log(tmp_path / name)
    assert message in str(caught.value)


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"a\.csv does not exist"):
        read_log(tmp_path / "a.csv")
    with pytest.raises(IsADirectoryError, match="is a folder"):
        read_log(tmp_path)


def test_no_reader_is_loaded_before_it_is_needed():
    extras = "{'pyarrow', 'h5py', 'scipy', 'rosbags', 'pandas', 'polars'}"
    script = f"import sys, zerorate; print({extras} & sys.modules.keys())"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (done.stdout.strip(), done.stderr) == ("set()", "")


@pytest.mark.parametrize("name", FORMATS)
def test_the_name_of_a_file_need_not_be_text(tmp_path, name):
    path = written(tmp_path, name)
    other = path.with_name(f"caf\udce9{path.suffix}")
    path.rename(other)
    if name == "a.db3":
        with pytest.raises(LogError, match=r"caf\\xe9.db3: cannot be read as a ROS 2 bag"):
            read_log(other)
    else:
        assert read_log(other).n == N
