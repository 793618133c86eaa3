"""A file block by block: the same bytes, scores and sentences as of the log in memory."""

import errno
import shutil
import threading

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from zerorate.cli import run
from zerorate.io import open_log, read_log, write_log
from zerorate.io.readers.parquet import RowGroupWriter
from zerorate.record import LogError
from zerorate.show import format_learned, format_notes
from zerorate.tasks.replay.run import filter_to_file, run_filters
from zerorate.tasks.workers import limit_threads

RATE = 100.0
BLOCKS = (1, 97, 1000, 1 << 15)


def samples(n, axes=2, seed=1):
    return 0.5 + 0.1 * np.random.default_rng(seed).standard_normal((n, axes))


def write(path, rows, data, row_group_size=700, **metadata):
    """Write rows of a clock of 100 Hz and what was measured then."""
    names = ["time_s", *(f"gyro_{axis}_dps" for axis in "xyz"[: data.shape[1]])]
    table = pa.table([np.asarray(rows) / RATE, *data.T], names=names)
    table = table.replace_schema_metadata(metadata)
    pq.write_table(table, path, row_group_size=row_group_size)


def regular(path):
    write(path, np.arange(3000), samples(3000))


def short(path):
    write(path, np.arange(40), samples(40))


def one_row(path):
    write(path, [5], samples(1), rate="100")


def gaps(path):
    """Gaps of one sample and of many blocks, and some that end where a block does."""
    rows = np.r_[0:90, 91:97, 98:194, 200:500, 2500:2910, 2911:3300]
    write(path, rows, samples(len(rows)))


def missing(path):
    """Missing samples, a late first one, and an axis without any."""
    data = samples(1600, 3)
    data[:130, 0] = data[400:900, 1] = np.nan
    data[:, 2] = np.inf
    data[1200:1300] = np.nan
    write(path, np.arange(1600), data)


def motion(path):
    data = samples(4000)
    data[1500:2500, 0] += 30.0 * np.sin(np.arange(1000) / 20.0)
    write(path, np.arange(4000), data)


def nulls(path):
    """Whole numbers, some of which are null in one row group alone."""
    values = np.random.default_rng(2).integers(-50, 50, 2000)
    column = pa.array(values, mask=(np.arange(2000) // 300) == 3)
    table = pa.table({"time_ms": np.arange(2000) * 10, "gyro_x": column})
    pq.write_table(table, path, row_group_size=500)


FILES = (regular, short, one_row, gaps, missing, motion, nulls)
CHOICES = (
    {"methods": ("kf", "auto")},
    {"methods": ("fading",), "output": "estimate"},
    {"methods": ("akf",), "motion": "hold"},
)


def in_memory(path, out, **options):
    result = run_filters(read_log(path), **options)
    write_log(result.to_log(), out)
    return result


@pytest.mark.every(12)
@pytest.mark.parametrize("make", FILES, ids=lambda make: make.__name__)
@pytest.mark.parametrize("options", CHOICES, ids=lambda options: options["methods"][-1])
def test_blocks_make_the_same_file_and_say_the_same(tmp_path, make, options):
    path = tmp_path / "raw.parquet"
    make(path)
    whole = in_memory(path, tmp_path / "whole.parquet", **options)
    for rows in BLOCKS if make is not motion else BLOCKS[1:]:
        summary = filter_to_file(
            open_log(path), tmp_path / "out.parquet", rows=rows, force=True, **options
        )
        assert (tmp_path / "out.parquet").read_bytes() == (tmp_path / "whole.parquet").read_bytes()
        # As text, where NaN equals NaN.
        assert repr(summary.scores) == repr(whole.scores)
        assert format_notes(summary) == format_notes(whole)
        assert format_learned(summary) == format_learned(whole)
        np.testing.assert_array_equal(summary.history.gain, whole.history.gain)


@pytest.mark.parametrize("make", FILES, ids=lambda make: make.__name__)
def test_a_recording_is_the_log_that_is_read_at_once(tmp_path, make):
    path = tmp_path / "raw.parquet"
    make(path)
    log, expected = open_log(path).log(), read_log(path)
    np.testing.assert_array_equal(log.data, expected.data)
    np.testing.assert_array_equal(log.time, expected.time)
    assert (log.rate, log.names, log.unit) == (expected.rate, expected.names, expected.unit)
    assert dict(log.meta) == dict(expected.meta)


@pytest.mark.parametrize("suffix", [".csv", ".npz"])
def test_other_formats_are_read_and_written_from_memory(tmp_path, suffix):
    regular(tmp_path / "raw.parquet")
    write_log(read_log(tmp_path / "raw.parquet"), tmp_path / f"raw{suffix}")
    in_memory(tmp_path / f"raw{suffix}", tmp_path / "whole.csv", methods=["auto"])
    recording = open_log(tmp_path / f"raw{suffix}")
    filter_to_file(recording, tmp_path / "out.csv", methods=["auto"])
    assert (tmp_path / "out.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()


def test_one_thread_does_the_same(tmp_path):
    regular(tmp_path / "raw.parquet")
    recording = open_log(tmp_path / "raw.parquet")
    filter_to_file(recording, tmp_path / "two.parquet", rows=500)
    with limit_threads(1):
        filter_to_file(recording, tmp_path / "one.parquet", rows=500)
    assert (tmp_path / "one.parquet").read_bytes() == (tmp_path / "two.parquet").read_bytes()


class TestFaults:
    """Whichever step fails: its own error, no thread left, and nothing half-written."""

    @pytest.fixture(autouse=True)
    def _leaves_nothing(self, tmp_path):
        regular(tmp_path / "raw.parquet")
        before = threading.active_count()
        yield
        assert threading.active_count() == before
        assert [path.name for path in tmp_path.glob("**/*")] in (["raw.parquet"], [])

    def go(self, folder, **options):
        recording = open_log(folder / "raw.parquet")
        return filter_to_file(recording, folder / "out.parquet", rows=100, **options)

    @pytest.mark.parametrize("method", ["kf", "auto"])
    def test_a_damaged_row_group(self, tmp_path, capsys, method):
        path = tmp_path / "raw.parquet"
        column = pq.read_metadata(path).row_group(3).column(2)
        begin = column.dictionary_page_offset or column.data_page_offset
        raw = bytearray(path.read_bytes())
        raw[begin : begin + 200] = b"\xff" * 200
        path.write_bytes(raw)
        arguments = ["replay", str(path), "-o", str(tmp_path), "--no-figure", "--method", method]
        assert run(arguments) == 1
        error = capsys.readouterr().err
        assert error.startswith(
            f"zerorate: {path}: cannot be read as Parquet: truncated, damaged or"
        )
        assert error.count("\n") == 1

    def test_a_full_disk(self, tmp_path, monkeypatch, capsys):
        def full(self, columns):
            raise OSError(errno.ENOSPC, "No space left on device")

        monkeypatch.setattr(RowGroupWriter, "write", full)
        arguments = ["replay", str(tmp_path / "raw.parquet"), "-o", str(tmp_path), "--no-figure"]
        assert run(arguments) == 1
        message = f"zerorate: {tmp_path}: No space left on device\n"
        assert capsys.readouterr().err == message

    def test_a_folder_that_goes_away(self, tmp_path):
        with pytest.raises(FileNotFoundError):
            self.go(tmp_path, progress=lambda step, done: shutil.rmtree(tmp_path, True))

    def test_an_interrupt(self, tmp_path):
        def interrupt(step, done):
            if done > 0.3:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            self.go(tmp_path, progress=interrupt)

    def test_no_sample_at_all(self, tmp_path):
        write(tmp_path / "raw.parquet", np.arange(500), np.full((500, 2), np.nan))
        with pytest.raises(LogError, match="no axis has a sample"):
            self.go(tmp_path)


def test_progress_rises_to_the_end(tmp_path):
    regular(tmp_path / "raw.parquet")
    calls = []
    filter_to_file(
        open_log(tmp_path / "raw.parquet"),
        tmp_path / "out.parquet",
        rows=1000,
        progress=lambda *call: calls.append(call),
    )
    assert calls == [("filtering", (i + 1) / 3) for i in range(3)]


def test_the_method_alone(tmp_path, capsys):
    regular(tmp_path / "raw.parquet")
    arguments = ["replay", str(tmp_path / "raw.parquet"), "-o", str(tmp_path), "--no-figure"]
    assert run([*arguments]) == 0
    assert "as each method" not in capsys.readouterr().out
    alone = (tmp_path / "raw-zerorate.parquet").read_bytes()
    assert run([*arguments, "--force", "--methods", "all"]) == 0
    rows = capsys.readouterr().out.partition("as each method")[2].split("\n")[3:9]
    methods = ["raw", "kf", "akf", "fading", "robust", "auto"]
    assert [row[12:].split()[0] for row in rows] == methods
    assert (tmp_path / "raw-zerorate.parquet").read_bytes() == alone


def test_gyros_beside_accelerometers_need_columns_of_one_unit(tmp_path, capsys):
    names = ["time_s", "gyro_x_dps", "acc_x_mps2"]
    table = pa.table([np.arange(500) / RATE, *samples(500).T], names=names)
    pq.write_table(table, tmp_path / "raw.parquet")
    assert open_log(tmp_path / "raw.parquet").header.names == ("gyro_x_dps",)
    arguments = ["replay", str(tmp_path / "raw.parquet"), "-o", str(tmp_path), "--no-figure"]
    assert run([*arguments, "--columns", "gyro_x_dps,acc_x_mps2"]) == 1
    assert "the columns differ in unit" in capsys.readouterr().err
    assert run([*arguments, "--columns", "acc_x_mps2"]) == 0
