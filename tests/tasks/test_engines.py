"""Engines: every task ends once, whatever becomes of the workers."""

import os
from contextlib import closing

import dask.config
import psutil
import pytest
from distributed import LocalCluster

from support import batch_work
from zerorate.tasks.batch import batch
from zerorate.tasks.batch import cluster as clusters
from zerorate.tasks.batch.cluster import connect_scheduler, local_cluster
from zerorate.tasks.batch.engines import Processes, TaskResult, WorkerDeath, run_with_retry
from zerorate.tasks.workers import force_single_thread


def tasks(folder, count=8):
    return [(str(folder), number) for number in range(count)]


def ran(folder):
    return sorted(int(line) for line in (folder / "ran.txt").read_text().split())


@pytest.fixture(scope="module")
def address():
    """Address of a scheduler with two workers that somebody else has started."""
    settings = {"distributed.scheduler.allowed-failures": 0}
    with (
        dask.config.set(settings),
        LocalCluster(
            n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0"
        ) as cluster,
    ):
        yield cluster.scheduler_address


@pytest.fixture(params=["processes", "cluster"])
def engine(request):
    if request.param == "processes":
        yield Processes(2)
        return
    with connect_scheduler(request.getfixturevalue("address")) as cluster:
        yield cluster


@pytest.mark.every(2)
def test_a_task_that_kills_its_workers_is_named_and_the_others_run_once(engine, tmp_path):
    listed = tasks(tmp_path)
    ends = list(run_with_retry(engine, batch_work.die_at_three, listed))
    died = [end for end in ends if isinstance(end, WorkerDeath)]
    answers = {end.task[1]: end.answer for end in ends if isinstance(end, TaskResult)}
    assert [end.task for end in died] == [listed[3]]
    assert "worker process" in died[0].reason
    assert answers == {number: 10 * number for number in range(8) if number != 3}
    assert sorted(set(ran(tmp_path))) == sorted(answers)


def test_processes_name_the_signal_and_repeat_nothing(tmp_path):
    *_, last = run_with_retry(Processes(2), batch_work.die_at_three, tasks(tmp_path))
    assert last.reason == "its worker process was ended by SIGKILL"
    assert ran(tmp_path) == [0, 1, 2, 4, 5, 6, 7]


def test_a_task_whose_worker_died_once_succeeds_alone(tmp_path):
    *_, last = run_with_retry(Processes(2), batch_work.die_once_at_three, tasks(tmp_path))
    assert last.answer == 30
    assert ran(tmp_path) == list(range(8))


def test_leaving_early_ends_the_workers(tmp_path):
    others = workers_here()
    with closing(Processes(2).run(batch_work.note_and_answer, tasks(tmp_path))) as ends:
        next(ends)
        assert workers_here() > others
    assert workers_here() == others


def workers_here():
    children = psutil.Process().children(recursive=True)
    return {child.pid for child in children if "--multiprocessing-fork" in child.cmdline()}


def test_workers_have_one_thread_and_the_parent_its_own_setting(monkeypatch):
    names = ("RAYON_NUM_THREADS", "OPENBLAS_NUM_THREADS")
    monkeypatch.setenv(names[0], "5")
    monkeypatch.delenv(names[1], raising=False)
    (end,) = Processes(1).run(batch_work.environment, [names])
    assert end.answer == ["1", "1"]
    assert (os.environ[names[0]], names[1] in os.environ) == ("5", False)
    with force_single_thread():
        assert os.environ[names[1]] == "1"


@pytest.mark.parametrize("count", [0, -1])
def test_no_worker_is_no_engine(count):
    with pytest.raises(ValueError, match=f"workers must be at least 1, got {count}"):
        Processes(count)
    with pytest.raises(ValueError, match="at least 1 worker"), local_cluster(count):
        pass


def test_a_batch_on_a_running_scheduler(address, tmp_path):
    batch_work.make_logs(tmp_path / "logs", 3)
    pattern = str(tmp_path / "logs" / "*" / "*")
    result = batch(pattern, tmp_path / "out", scheduler=address)
    assert result.counts == {"done": 3}
    assert batch(pattern, tmp_path / "out", scheduler=address).counts == {"skipped": 3}


def test_no_scheduler_at_an_address(monkeypatch):
    monkeypatch.setattr(clusters, "_CONNECT_TIMEOUT_S", 0.3)
    expected = "no scheduler answers at 'tcp://127.0.0.1:9'"
    with pytest.raises(ConnectionError, match=expected), connect_scheduler("tcp://127.0.0.1:9"):
        pass
