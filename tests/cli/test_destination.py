"""Where ``-o`` puts files: a folder or the name of one of them, made if missing."""

import numpy as np
import pytest

from support.commands import check_line, names, one_line
from support.logs import write_gyros
from zerorate.io import read_log
from zerorate.tasks.saving import Destination


@pytest.fixture
def log(tmp_path):
    return write_gyros(tmp_path / "run.csv")


REPLAY = ("replay", ())
CASES = {
    "a folder": (REPLAY, "new", ["run-zerorate.parquet", "run-zerorate.png"]),
    "a folder of folders": (REPLAY, "new/deep", ["run-zerorate.parquet", "run-zerorate.png"]),
    "a folder with a dot": (REPLAY, "v1.2", ["run-zerorate.parquet", "run-zerorate.png"]),
    "a folder that ends as one": (REPLAY, "new.csv/", ["run-zerorate.parquet", "run-zerorate.png"]),
    "a log": (REPLAY, "new/filtered.csv", ["filtered.csv", "filtered.png"]),
    "a log in capitals": (REPLAY, "new/Filtered.NPZ", ["Filtered.npz", "Filtered.png"]),
    "a figure": (REPLAY, "new/shown.svg", ["shown.parquet", "shown.svg"]),
    "dots": (REPLAY, "new/a.b.npz", ["a.b.npz", "a.b.png"]),
    "a curve": (("allan", ()), "new/noise.json", ["noise.json", "noise.png"]),
    "a curve's figure": (("allan", ()), "new/noise.pdf", ["noise.csv", "noise.pdf"]),
    "exports": (
        ("allan", ("--no-figure", "--doubtful", "--export", "json")),
        "new/noise.csv",
        ["noise-models.json", "noise.csv"],
    ),
    "a page": (("identify", ("--no-figure",)), "new/page.html", ["page.html", "page.json"]),
    "numbers": (("identify", ("--no-figure",)), "new/page.json", ["page.html", "page.json"]),
}


@pytest.mark.parametrize("name", CASES)
def test_files(call, log, tmp_path, name):
    (command, options), output, expected = CASES[name]
    code, text, errors = call(command, log, "-o", f"{tmp_path}/{output}", *options)
    assert (code, errors) == (0, "")
    folder = next(path for path in tmp_path.rglob(expected[0])).parent
    assert names(folder) == expected
    assert all(str(folder / one) in one_line(text) for one in expected)


def test_the_files_are_what_their_names_say(call, log, tmp_path):
    for output in ("a.csv", "b.npz", "c.parquet"):
        assert call("replay", log, "-o", tmp_path / "new" / output, "--no-figure")[0] == 0
    found = [read_log(tmp_path / "new" / name).data for name in ("a.csv", "b.npz", "c.parquet")]
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[0], found[2])


def test_a_folder_named_like_a_file_is_a_folder(call, log, tmp_path):
    (tmp_path / "out.csv").mkdir()
    assert call("replay", log, "-o", tmp_path / "out.csv", "--no-figure")[0] == 0
    assert names(tmp_path / "out.csv") == ["run-zerorate.parquet"]


@pytest.mark.parametrize(
    ("command", "output", "options", "match"),
    [
        ("replay", "a.csv", ("--format", "npz"), "-o names a file as csv, but --format says npz"),
        ("replay", "a.svg", ("--figure-format", "png"), "but --figure-format says png"),
        ("replay", "a.h5", (), "-o takes a folder, or a file as parquet, csv, npz"),
        ("replay", "a.png", ("--no-figure",), "-o takes a folder, or a file as"),
        ("allan", "a.parquet", (), "-o takes a folder, or a file as csv"),
        ("identify", "a.csv", (), "-o takes a folder, or a file as html, json"),
        ("replay", "run.csv", (), "-o names the log itself"),
        ("replay", "run.csv", ("--force",), "-o names the log itself"),
        ("replay", "run.csv/new", (), "is not a folder"),
        ("demo", "a.h5", (), "-o takes a folder, or a file as"),
    ],
)
def test_what_is_refused_leaves_nothing(call, log, tmp_path, command, output, options, match):
    before = log.read_bytes()
    source = () if command == "demo" else (log,)
    code, text, errors = call(command, *source, "-o", tmp_path / output, *options)
    assert (code, text) == (2, "")
    check_line(errors, match)
    assert names(tmp_path) == ["run.csv"]
    assert log.read_bytes() == before


def test_a_log_that_cannot_be_read_makes_no_folder(call, tmp_path):
    code, _, _ = call("replay", tmp_path / "none.csv", "-o", tmp_path / "new" / "a.csv")
    assert (code, names(tmp_path)) == (1, [])


def test_simulations_and_comparisons_make_folders_as_well(call, log, tmp_path):
    simulated, numbers = tmp_path / "new" / "deep" / "a.csv", tmp_path / "other" / "a.json"
    assert call("simulate", "mpu6050", "-o", simulated, "--duration", "2")[0] == 0
    assert names(simulated.parent) == ["a-truth.csv", "a.csv"]
    long = write_gyros(tmp_path / "long.csv", n=6000)
    assert call("compare", long, "--methods", "raw", "--json", numbers)[0] == 0
    assert numbers.exists()


@pytest.mark.parametrize("output", ["a", "a.", ".", "..", "a.b", "a.csv.d", ".csv", "x/", "x.csv/"])
def test_other_names_are_folders(tmp_path, monkeypatch, output):
    monkeypatch.chdir(tmp_path)
    place = Destination.of(output, "usual", ["csv"])
    assert (place.base.name, place.named_suffix) == ("usual", "")


def test_a_foreign_suffix_is_no_folder(tmp_path):
    with pytest.raises(ValueError, match="a file as csv"):
        Destination.of(str(tmp_path / "a.xlsx"), "usual", ["csv"])
