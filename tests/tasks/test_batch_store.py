"""A batch of logs in an object store, by pyarrow."""

import pytest

import zerorate as zr
from support.batch_work import Here, make_logs
from support.object_store import object_store
from zerorate.io.store import list_store
from zerorate.tasks.batch import process_log


@pytest.fixture(autouse=True)
def here(monkeypatch):
    """Without processes, which tests of engines start."""
    monkeypatch.setattr("zerorate.tasks.batch.run.Processes", Here)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("store")


@pytest.fixture(scope="module")
def logs(folder):
    return make_logs(folder / "bucket" / "logs", 3)


@pytest.fixture(scope="module", params=["s3", "file"])
def address(request, folder, logs):
    """Return the function from a path to its address in the store."""
    if request.param == "file":
        yield lambda path: f"file://{folder}/{path}"
        return
    with object_store(folder) as addresses:
        yield addresses


def names(address):
    return [one.path.partition("bucket/")[2] for one in list_store(address).files]


def test_folders_patterns_and_files_are_listed(address):
    every = ["logs/unit0/run00.parquet", "logs/unit0/run02.parquet", "logs/unit1/run01.parquet"]
    patterns = ["bucket/logs", "bucket/logs/", "bucket/**/*.parquet", "bucket/**", "bucket/*/*/*"]
    for pattern in patterns:
        assert names(address(pattern)) == every
    assert names(address("bucket/logs/*1/run*")) == every[2:]
    assert names(address(f"bucket/{every[0]}")) == every[:1]
    assert names(address("bucket/logs/*.parquet")) == []


@pytest.mark.parametrize("command", ["replay", "allan"])
def test_a_batch_gives_what_files_give(tmp_path, address, logs, folder, command):
    stored = zr.batch(address("bucket/logs"), tmp_path / "stored", command=command, workers=1)
    local = zr.batch(folder / "bucket" / "logs", tmp_path / "local", command=command, workers=1)
    assert [one.name for one in stored.outcomes] == [one.name for one in local.outcomes]
    assert [one.rows for one in stored.outcomes] == [one.rows for one in local.outcomes]
    for path in (tmp_path / "local").rglob("*-zerorate*.parquet"):
        other = tmp_path / "stored" / path.relative_to(tmp_path / "local")
        assert other.read_bytes() == path.read_bytes()
    again = zr.batch(address("bucket/logs/**/*.parquet"), tmp_path / "stored", command=command)
    assert again.counts["skipped"] == len(logs)


def test_one_log_of_a_store_needs_no_batch(address, logs):
    rows = process_log(address("bucket/logs/unit0/run00.parquet"), "allan")
    assert [row["axis"] for row in rows] == ["gyro_x"]
    local = process_log(logs[0], "allan")
    assert rows[0]["angle_random_walk"] == local[0]["angle_random_walk"]


def test_a_secret_is_not_shown(address):
    lost = address("bucket/none/none.parquet")
    (row,) = process_log(lost, "allan")
    assert row["status"] == "failed"
    assert "secret" not in f"{row}"
    with pytest.raises(OSError, match="cannot be listed") as error:
        zr.batch(lost, "out", workers=1)
    assert "secret" not in str(error.value)


def test_files_and_addresses_are_not_mixed(address, logs, tmp_path):
    with pytest.raises(ValueError, match="must all be addresses or all be files"):
        zr.batch([address("bucket/logs"), logs[0]], tmp_path)


def test_a_server_without_folders_is_refused(tmp_path):
    with pytest.raises(OSError, match="http://localhost/logs cannot be listed: expected a store"):
        zr.batch("http://localhost/logs", tmp_path)


def test_files_that_zerorate_has_written_are_left_out(address, folder, tmp_path):
    results = folder / "other" / "results"
    zr.batch(folder / "bucket" / "logs" / "unit1", results, workers=1)
    with pytest.raises(FileNotFoundError, match="no log is at"):
        zr.batch(address("other/results"), tmp_path, workers=1)
    named = zr.batch(address("other/results/*-zerorate.parquet"), tmp_path, command="allan")
    assert [one.name for one in named.outcomes] == ["run01-zerorate.parquet"]
