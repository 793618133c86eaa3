"""Readers of other packages: found by their entry points, and read as every other format."""

import re
from pathlib import Path

import numpy as np
import pytest

import zerorate as zr
from zerorate.cli import run
from zerorate.io.formats import FORMATS, known_formats, known_suffixes
from zerorate.io.plugins import GROUP

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "readers.md"
NAMES = ("gyro_x_dps", "gyro_y_dps", "gyro_z_dps", "accel_x_g", "accel_y_g", "accel_z_g")


def install(folder, name, code, points):
    """Put a package into a folder, as an installer does."""
    folder.mkdir(exist_ok=True)
    (folder / f"{name}.py").write_text(code)
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{GROUP}]\n{points}\n")


def write_acme(path, n=3000, rate=100.0):
    counts = np.random.default_rng(3).normal([0, 0, 0, 0, 0, 16384], 20.0, (n, 6))
    counts = counts.round().astype("<i2")
    path.write_bytes(b"ACME" + np.float32(rate).tobytes() + counts.tobytes())
    return counts


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Install readers, each a name, code and entry points."""
    site = tmp_path / "site"
    monkeypatch.syspath_prepend(site)
    return lambda name, code, points: install(site, name, code, points)


@pytest.fixture
def acme(installed, tmp_path):
    """Install the reader of the page; return a file of its format, and the counts in it."""
    page = PAGE.read_text()
    code = re.search(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)[1]
    point = re.search(r"^```toml\n\[[^\n]*\]\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)[1]
    assert f'[project.entry-points."{GROUP}"]' in page
    assert code.count("\n") <= 24
    installed("acme", code, point.replace('"', ""))
    (tmp_path / "logs").mkdir()
    path = tmp_path / "logs" / "drive.acm"
    return path, write_acme(path)


def test_the_reader_of_the_page_is_used(acme):
    path, counts = acme
    recording = zr.read_recording(path)
    assert (recording.gyro.unit, recording.accel.unit, recording.gyro.rate) == ("deg/s", "g", 100.0)
    np.testing.assert_array_equal(recording.gyro.data, counts[:, :3] * (1 / 131.0))
    assert recording.gyro.meta["sensor"] == "Acme"
    assert zr.read_log(path).meta["format"] == "acm"


def test_every_command_takes_such_files(acme, tmp_path, capsys):
    path, _ = acme
    assert run(["replay", str(path), "-o", str(tmp_path / "out"), "--no-figure"]) == 0
    assert run(["batch", str(path.parent), "-o", str(tmp_path / "many"), "--workers", "1"]) == 0
    assert run(["formats", str(path)]) == 0
    assert "drive.acm is read as acm: by its suffix .acm" in " ".join(
        capsys.readouterr().out.split()
    )
    assert run(["formats"]) == 0
    (line,) = [one for one in capsys.readouterr().out.splitlines() if ".acm" in one]
    assert "file of acme" in line


def test_built_in_formats_come_first_in_the_same_table(acme):
    assert known_formats()[: len(FORMATS)] == FORMATS
    assert known_suffixes()[-1] == ".acm"


def test_a_suffix_of_zerorate_stays_its_own(installed, tmp_path):
    installed("rude", "def read(path):\n    raise ValueError('rude')", ".csv = rude:read")
    log = tmp_path / "log.csv"
    log.write_text("time_s,gyro_x_dps\n" + "".join(f"{i / 100},0.{i % 7}\n" for i in range(200)))
    assert zr.read_log(log).n == 200


def test_two_packages_for_a_suffix_are_an_error(acme, installed):
    installed("other", "def read(path):\n    return {}", ".acm = other:read")
    with pytest.raises(zr.LogError, match=r"two packages read '\.acm': a file of acme and"):
        zr.read_log(acme[0])


FAULTY = {
    "def read(path):\n    raise ValueError('no end')": "a file of faulty: truncated, .*no end",
    "def read(path):\n    raise KeyError(7)": "cannot be read as a file of faulty",
    "def read(path):\n    return 7": "the reader faulty:read does not return columns",
    "def read(path):\n    return {'z': [1]}, {'speed': 1}": "the reader faulty:read does not",
    "def read(path):\n    return {}": "there is no array of samples",
    "def read(path):\n    return {'gyro_x_dps': ['a']}, {}": "expected real numbers",
    "import missing_library": "missing_library",
    "": "cannot be read as a file of faulty",
}


@pytest.mark.parametrize("code", FAULTY)
def test_a_faulty_reader_is_one_sentence_with_the_file(installed, tmp_path, code, monkeypatch):
    monkeypatch.delitem(__import__("sys").modules, "faulty", raising=False)
    installed("faulty", code, ".bad = faulty:read")
    (tmp_path / "log.bad").write_bytes(b"some bytes")
    with pytest.raises((zr.LogError, ImportError), match=FAULTY[code]) as error:
        zr.read_log(tmp_path / "log.bad", rate=100.0)
    assert "\n" not in str(error.value)


def test_columns_of_three_axes_and_a_table_frame_are_taken(installed, tmp_path):
    code = """
import numpy as np
import pandas
def read(path):
    return {"time_s": np.arange(200) / 50.0, "gyro_dps": np.ones((200, 3))}
def frame(path):
    return pandas.DataFrame({"time_s": np.arange(200) / 50.0, "gyro_x_dps": np.ones(200)})
"""
    installed("wide", code, ".wide = wide:read\n.frame = wide:frame")
    for suffix, channels in ((".wide", 3), (".frame", 1)):
        (tmp_path / f"log{suffix}").write_bytes(b"x")
        log = zr.read_log(tmp_path / f"log{suffix}")
        assert (log.rate, log.unit, log.channels) == (50.0, "deg/s", channels)
