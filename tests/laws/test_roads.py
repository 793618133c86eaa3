"""One log by every road gives the same bytes."""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
from distributed import LocalCluster

from support import roads
from support.checks import assert_same_bits
from zerorate import Log, read_log, write_log
from zerorate.cli import run
from zerorate.tasks.batch import batch

BY_METHOD = pytest.mark.parametrize("method", roads.METHODS)
FORMATS = ("parquet", "csv", "npy")
NAMES = [f"gyro_{i}" for i in range(roads.CHANNELS)]


@pytest.fixture(scope="module")
def z():
    return roads.log()


@pytest.fixture(scope="module")
def expected(z):
    """The answers of each method, computed when they are first asked for."""
    known = {}

    def answers(method):
        if method not in known:
            known[method] = roads.alone(z, method)
        return known[method]

    return answers


@pytest.fixture(scope="module")
def logs(z, tmp_path_factory):
    """The log as files, by their suffix."""
    folder = tmp_path_factory.mktemp("logs")
    paths = {suffix: folder / f"run.{suffix}" for suffix in FORMATS}
    log = Log(np.arange(roads.N) / roads.RATE, roads.RATE, z, NAMES, "deg/s")
    write_log(log, paths["parquet"])
    write_log(log, paths["csv"])
    np.save(paths["npy"], z)
    return paths


def replayed(source, method, folder):
    """The file that a replay writes."""
    folder.mkdir()
    told = []
    if source.suffix == ".npy":
        columns = ",".join(map(str, range(roads.CHANNELS)))
        told = ["--rate", str(roads.RATE), "--unit", "deg/s", "--columns", columns]
    options = ["-o", str(folder), "--no-figure", *roads.options(method), *told]
    assert run(["replay", str(source), *options]) == 0
    return folder / "run-zerorate.parquet"


@pytest.fixture(scope="module")
def replays(logs, tmp_path_factory):
    """What a replay of the Parquet file writes, by method."""
    folder = tmp_path_factory.mktemp("replays")
    return {method: replayed(logs["parquet"], method, folder / method) for method in roads.METHODS}


class TestTheLog:
    """That it holds what makes the roads differ, if they can."""

    def test_samples_are_missing_at_different_places(self, z):
        missing = np.isnan(z)
        assert missing[:, roads.SILENT].all()
        patterns = {missing[:, i].tobytes() for i in range(roads.CHANNELS)}
        assert len(patterns) == roads.CHANNELS

    @pytest.mark.parametrize("method", ["auto", "holding"])
    def test_its_motion_is_seen(self, z, method):
        at_rest = roads.make(method).trace(z).at_rest
        moving = ~np.delete(at_rest, roads.SILENT, axis=1)
        assert moving[roads.MIDDLE].all()
        assert not moving[roads.MOTION.start - 1].any()
        assert not moving[-1].any()


@BY_METHOD
@pytest.mark.parametrize("road", roads.IN_PYTHON)
def test_in_python(z, expected, road, method):
    assert_same_bits(roads.IN_PYTHON[road](z, method), expected(method))


@pytest.fixture(scope="module")
def other_process():
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor:
        yield executor


@BY_METHOD
def test_to_another_process(z, expected, other_process, method):
    def there(f, rest):
        return other_process.submit(roads.process, f, rest).result()

    assert_same_bits(roads.handed_on(there)(z, method), expected(method))


@pytest.mark.every(3)
@BY_METHOD
def test_through_pipes(z, expected, tmp_path, method):
    assert_same_bits(roads.by_pipes(z, method, tmp_path / "state"), expected(method))


def as_written(answers, z):
    """A file holds no estimate from before a channel's first sample."""
    begun = np.logical_or.accumulate(~np.isnan(z), axis=0)
    return np.where(begun, answers, np.nan)


@BY_METHOD
@pytest.mark.parametrize("suffix", FORMATS)
def test_replayed(z, logs, expected, tmp_path, suffix, method):
    written = replayed(logs[suffix], method, tmp_path / "out")
    assert_same_bits(read_log(written).data, as_written(expected(method), z))


def batched(logs, method, folder, **engine):
    result = batch(str(logs["parquet"]), folder, **roads.METHODS[method], **engine)
    assert result.counts == {"done": 1}
    return folder / "run-zerorate.parquet"


@pytest.mark.every(3)
@BY_METHOD
def test_in_a_batch_of_processes(logs, replays, tmp_path, method):
    written = batched(logs, method, tmp_path, workers=1)
    assert written.read_bytes() == replays[method].read_bytes()


@pytest.fixture(scope="module")
def scheduler():
    with LocalCluster(
        n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0"
    ) as cluster:
        yield cluster.scheduler_address


@pytest.mark.every(3)
@BY_METHOD
def test_in_a_batch_on_a_cluster(logs, replays, scheduler, tmp_path, method):
    written = batched(logs, method, tmp_path, scheduler=scheduler)
    assert written.read_bytes() == replays[method].read_bytes()
