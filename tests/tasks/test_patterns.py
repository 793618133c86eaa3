"""What patterns name: brackets, links, bytes, bad folders; and what a batch has written itself."""

import glob
import os
import sys

import pyarrow.parquet as pq
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from support.batch_work import Here, make_logs
from zerorate.cli import run
from zerorate.tasks.batch import batch
from zerorate.tasks.batch.patterns import find_files

posix = pytest.mark.skipif(sys.platform == "win32", reason="links and names of bytes are of POSIX")


# Four bytes.
LONG = "\U0001f9ed"


@pytest.fixture(autouse=True)
def here(monkeypatch):
    """Without processes, which tests of engines start."""
    monkeypatch.setattr("zerorate.tasks.batch.run.Processes", Here)


def made(folder, *names):
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"")


def found(pattern, folder):
    return sorted(path.relative_to(folder).as_posix() for path in find_files(str(pattern)).files)


PARTS = st.sampled_from(["a", "b", "*", "?", "**", "[ab]", "a*", "*.csv", ".*", "[!a]*", "a.csv"])


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tree")
    names = ("a/a.csv", "a/b/a.csv", "a/b/.c.csv", "b/b.csv", "a.csv", ".a/a.csv", "b/a/a/a.csv")
    made(folder, *names)
    return folder


@given(st.lists(PARTS, min_size=1, max_size=4))
@settings(max_examples=300)
def test_without_links_and_literal_brackets_it_is_glob(tree, parts):
    pattern = str(tree.joinpath(*parts))
    assume(not os.path.isdir(pattern))
    expected = {path for path in glob.glob(pattern, recursive=True) if os.path.isfile(path)}
    assert {str(path) for path in find_files(pattern).files} == expected


@pytest.mark.parametrize("name", ["log[1].csv", "[ab]", "a[", "a]b[c.csv", "log[!1].csv"])
def test_brackets_that_are_in_a_name(tmp_path, name):
    made(tmp_path, name, "log1.csv", "a", "log2.csv")
    assert found(tmp_path / name, tmp_path) == [name]
    assert find_files(str(tmp_path / name)).root == tmp_path


def test_a_folder_is_all_logs_in_it_and_below(tmp_path):
    made(tmp_path, "a.csv", "deep/er/b.PARQUET", "notes.md", "a.png", ".hidden.csv", ".git/c.csv")
    made(tmp_path, "bag/metadata.yaml", "bag/bag_0.db3", "day/metadata.yaml", "day/d.csv")
    names = ["a.csv", "bag", "day/d.csv", "deep/er/b.PARQUET"]
    assert found(tmp_path, tmp_path) == names
    assert find_files(str(tmp_path)).root == tmp_path
    assert found(tmp_path / "bag", tmp_path) == ["bag"]
    assert "bag" in found(tmp_path / "*", tmp_path)
    assert "bag/bag_0.db3" not in found(tmp_path / "**" / "*", tmp_path)


def test_brackets_in_a_folder(tmp_path):
    made(tmp_path, "run[1]/a.csv", "run1/b.csv")
    assert found(tmp_path / "run[1]" / "*.csv", tmp_path) == ["run[1]/a.csv"]
    assert found(tmp_path / "run[12]" / "*.csv", tmp_path) == ["run1/b.csv"]
    assert found(tmp_path / "*" / "*.csv", tmp_path) == ["run1/b.csv", "run[1]/a.csv"]


@posix
class TestLinks:
    @pytest.mark.parametrize("target", [".", "..", "logs", "../logs"])
    def test_a_loop_leads_nowhere(self, tmp_path, target):
        made(tmp_path, "logs/a.csv", "logs/b.csv")
        (tmp_path / "logs" / "loop").symlink_to(target, target_is_directory=True)
        assert found(tmp_path / "logs" / "**" / "*.csv", tmp_path / "logs") == ["a.csv", "b.csv"]

    def test_folders_that_lead_to_each_other(self, tmp_path):
        made(tmp_path, "x/a.csv", "y/b.csv")
        for i in range(20):
            (tmp_path / "x" / f"y{i}").symlink_to("../y")
            (tmp_path / "y" / f"x{i}").symlink_to("../x")
        assert found(tmp_path / "**" / "*.csv", tmp_path) == ["x/a.csv", "y/b.csv"]

    def test_a_link_to_elsewhere_is_followed(self, tmp_path):
        made(tmp_path, "disk/a.csv", "logs/b.csv")
        (tmp_path / "logs" / "day").symlink_to("../disk")
        assert found(tmp_path / "logs" / "**" / "*.csv", tmp_path) == [
            "logs/b.csv",
            "logs/day/a.csv",
        ]

    def test_a_link_to_a_file_is_kept(self, tmp_path):
        made(tmp_path, "a.csv")
        (tmp_path / "b.csv").symlink_to("a.csv")
        assert found(tmp_path / "*.csv", tmp_path) == ["a.csv", "b.csv"]

    def test_what_is_no_file_is_named(self, tmp_path):
        (tmp_path / "dangling.csv").symlink_to("nothing")
        (tmp_path / "self.csv").symlink_to("self.csv")
        os.mkfifo(tmp_path / "pipe.csv")
        (tmp_path / "folder.csv").mkdir()
        failed = {
            path.name: why for path, why in find_files(str(tmp_path / "*.csv")).failed.items()
        }
        assert failed.pop("pipe.csv") == "no regular file"
        assert failed.pop("dangling.csv") == "a link to nothing"
        assert list(failed) == ["self.csv"]


def test_a_folder_that_cannot_be_read_is_named(tmp_path, monkeypatch):
    made(tmp_path, "open/a.csv", "shut/b.csv")
    listed = os.listdir

    # Not by chmod: root may read anything.
    def refusing(folder):
        if os.fspath(folder).endswith("shut"):
            raise PermissionError(13, "Permission denied", os.fspath(folder))
        return listed(folder)

    monkeypatch.setattr(os, "listdir", refusing)
    result = find_files(str(tmp_path / "**" / "*.csv"))
    assert [path.name for path in result.files] == ["a.csv"]
    assert result.failed == {tmp_path / "shut": "Permission denied"}


def rows(result):
    return pq.read_table(result.summary).to_pylist()


@posix
class TestBatch:
    def test_one_bad_name_costs_no_other(self, tmp_path):
        logs = make_logs(tmp_path / "logs", 2)
        folder = logs[0].parent
        good = logs[0].read_bytes()
        bad = {
            os.fsdecode(b"r\xe9s.csv"): b"time_s,gyro_x\n0,x\n",
            "[x].parquet": b"PAR1",
            LONG * 61 + ".parquet": good,
        }
        for name, content in bad.items():
            (folder / name).write_bytes(content)
        (folder / "long").symlink_to("long")
        os.symlink("nowhere", folder / "gone.csv")
        result = batch(str(tmp_path / "logs" / "**" / "*.*"), tmp_path / "out", workers=1)
        said = {row["log"]: row["status"] for row in rows(result)}
        assert said == {
            "unit0/run00.parquet": "done",
            "unit1/run01.parquet": "done",
            r"unit0/r\xe9s.csv": "failed",
            "unit0/[x].parquet": "failed",
            # Its output's name would have more than 255 bytes.
            f"unit0/{LONG * 61}.parquet": "failed",
            "unit0/gone.csv": "failed",
        }

    def test_names_of_any_bytes_are_filtered(self, tmp_path):
        (log,) = make_logs(tmp_path / "logs", 1)
        log.rename(log.with_name(LONG * 50 + "[1].parquet"))
        text = log.with_name(os.fsdecode(b"r\xe9s.csv"))
        lines = "".join(f"{i / 100},{i % 7}\n" for i in range(2000))
        text.write_text(f"time_s,gyro_x_dps\n{lines}")
        pattern = str(tmp_path / "logs" / "**" / "*.*")
        assert batch(pattern, tmp_path / "out", workers=1).counts == {"done": 2}
        again = batch(pattern, tmp_path / "out", workers=1)
        assert again.counts == {"skipped": 2}
        endings = (r"r\xe9s.csv", "[1].parquet")
        assert all(row["log"].endswith(endings) for row in rows(again))

    def test_a_loop_filters_each_log_once(self, tmp_path):
        make_logs(tmp_path / "logs", 2)
        (tmp_path / "logs" / "loop").symlink_to(".")
        pattern = str(tmp_path / "logs" / "**" / "*.parquet")
        assert batch(pattern, tmp_path / "out", workers=1).counts == {"done": 2}


class TestOutputs:
    def batch(self, pattern, output):
        return batch(str(pattern), output, workers=1)

    @pytest.mark.every(2)
    @pytest.mark.parametrize("pattern", ["**/*", "logs"])
    @pytest.mark.parametrize("output", ["logs", "."])
    def test_wherever_they_lie_they_are_no_inputs(self, tmp_path, pattern, output):
        make_logs(tmp_path / "logs", 2)
        first = self.batch(tmp_path / pattern, tmp_path / output)
        assert first.counts == {"done": 2}
        again = self.batch(tmp_path / pattern, tmp_path / output)
        assert again.counts == {"skipped": 2}
        elsewhere = self.batch(tmp_path / pattern, tmp_path / "other")
        assert elsewhere.counts == {"done": 2}
        assert all("-zerorate" not in one.name for one in elsewhere.outcomes)

    def test_an_output_without_its_record_is_one_all_the_same(self, tmp_path):
        make_logs(tmp_path / "logs", 1)
        self.batch(tmp_path / "logs/*/*.parquet", tmp_path / "logs")
        for record in (tmp_path / "logs").rglob("*.json"):
            record.unlink()
        assert self.batch(tmp_path / "logs/**/*.parquet", tmp_path / "logs").counts == {"done": 1}

    def test_what_was_left_out_is_told(self, tmp_path, capsys):
        make_logs(tmp_path / "logs", 2)
        arguments = ["batch", str(tmp_path / "logs/**/*.parquet"), "-o", str(tmp_path / "logs/out")]
        assert run([*arguments, "--workers", "1"]) == 0
        assert "left out" not in capsys.readouterr().out
        assert run([*arguments, "--workers", "1"]) == 0
        assert "left out: 3 files written by zerorate" in capsys.readouterr().out

    def test_results_are_inputs_where_a_pattern_asks_for_them(self, tmp_path):
        make_logs(tmp_path / "logs", 1)
        self.batch(tmp_path / "logs", tmp_path / "out")
        pattern = tmp_path / "out" / "**" / "*-zerorate.parquet"
        assert self.batch(pattern, tmp_path / "again").counts == {"done": 1}

    @pytest.mark.parametrize("pattern", ["", "*.csv"])
    def test_the_truth_of_a_simulated_log_is_no_log(self, tmp_path, pattern):
        (tmp_path / "logs").mkdir()
        log = tmp_path / "logs" / "unit1.csv"
        assert run(f"simulate MTi-100 -o {log} --duration 20 --axes 1".split()) == 0
        log.with_name("ground-truth.csv").write_bytes(log.read_bytes())
        result = self.batch(tmp_path / "logs" / pattern, tmp_path / "out")
        assert [one.name for one in result.outcomes] == ["ground-truth.csv", "unit1.csv"]
        assert [path.name for path in result.left_out] == ["unit1-truth.csv"]

    @pytest.mark.parametrize("name", ["notes.md", "a-zerorate.csv"])
    def test_a_folder_without_logs(self, tmp_path, name):
        made(tmp_path, f"logs/{name}")
        with pytest.raises(FileNotFoundError, match=r"no file in the folder .* ends in one of"):
            self.batch(tmp_path / "logs", tmp_path / "out")

    def test_nothing_but_outputs_is_no_log(self, tmp_path):
        make_logs(tmp_path / "logs", 1)
        self.batch(tmp_path / "logs/*/*.parquet", tmp_path / "out")
        with pytest.raises(FileNotFoundError, match="but 2 written by zerorate"):
            self.batch(tmp_path / "out/**/*.parquet", tmp_path / "again")

    def test_names_alone_make_no_output(self, tmp_path):
        (log,) = make_logs(tmp_path / "logs", 1)
        log.rename(log.with_name("summary.parquet"))
        assert self.batch(tmp_path / "logs/*/*.parquet", tmp_path / "out").counts == {"done": 1}
