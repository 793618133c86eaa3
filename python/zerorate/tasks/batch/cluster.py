"""Workers of a Dask cluster, on this machine or others."""

import logging
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from typing import Any, Final, TypeVar

from zerorate.faults import ArgumentError
from zerorate.tasks.batch.engines import TaskResult, WorkerDeath
from zerorate.tasks.interrupts import block_child_interrupts
from zerorate.tasks.workers import force_single_thread
from zerorate.texts import describe_missing_extra

T = TypeVar("T")
R = TypeVar("R")

_CONNECT_TIMEOUT_S: Final = 30.0


class Cluster:
    """Workers of a client."""

    def __init__(self, client: Any) -> None:  # noqa: ANN401  # its package is optional
        self._client = client

    def run(
        self, work: Callable[[T], R], tasks: Sequence[T], max_running: int | None = None
    ) -> Generator[TaskResult[T, R] | WorkerDeath[T]]:
        """Yield the result of each finished task; an early exit cancels waiting tasks."""
        step = max_running or max(1, len(tasks))
        for first in range(0, len(tasks), step):
            yield from self._run_chunk(work, tasks[first : first + step])

    def _run_chunk(
        self, work: Callable[[T], R], tasks: Sequence[T]
    ) -> Generator[TaskResult[T, R] | WorkerDeath[T]]:
        # Not pure: otherwise a repeated task gets the first failure from the cache.
        futures = self._client.map(work, tasks, pure=False)
        pending = dict(zip(futures, tasks, strict=True))
        del futures
        ends = _import_distributed().as_completed(list(pending))
        try:
            for future in ends:
                yield _task_end(future, pending.pop(future))
                # A result in a worker's memory is computed again if the worker dies.
                future.release()
        finally:
            if pending:
                self._client.cancel(list(pending))


def _task_end(future: Any, task: T) -> TaskResult[T, Any] | WorkerDeath[T]:  # noqa: ANN401
    error = future.exception()
    if error is None:
        return TaskResult(task, future.result())
    from distributed import KilledWorker

    if isinstance(error, KilledWorker):
        return WorkerDeath(task, "every worker process that tried it died")
    return WorkerDeath(task, f"its worker failed: {type(error).__name__}: {error}")


@contextmanager
def local_cluster(count: int) -> Iterator[Cluster]:
    """Yield a cluster with this number of processes on this machine.

    Raises
    ------
    ImportError
        If the package distributed (extra ``cluster``) is not installed.
    """
    if count < 1:
        raise ArgumentError("local_cluster", f"must be at least 1 worker, got {count}")
    distributed = _import_distributed()
    from dask import config as dask_config

    # Repeating a task next to others shows nothing; such tasks run alone later.
    with force_single_thread(), dask_config.set({"distributed.scheduler.allowed-failures": 0}):
        with block_child_interrupts():
            cluster = distributed.LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",
                silence_logs=logging.CRITICAL,
            )
        with cluster, distributed.Client(cluster) as client:
            yield Cluster(client)


@contextmanager
def connect_scheduler(address: str) -> Iterator[Cluster]:
    """Yield the cluster of a running scheduler.

    Raises
    ------
    ConnectionError
        If the scheduler cannot be reached, has no worker within half a minute, or is lost later.
    ImportError
        If the package distributed (extra ``cluster``) is not installed.
    """
    distributed = _import_distributed()
    try:
        client = distributed.Client(address, timeout=_CONNECT_TIMEOUT_S)
    except (OSError, ValueError, TimeoutError):
        raise ConnectionError(f"no scheduler answers at '{address}'") from None
    with _silence_client_log(), client:
        try:
            client.wait_for_workers(1, timeout=_CONNECT_TIMEOUT_S)
        except TimeoutError:
            raise ConnectionError(f"the scheduler at '{address}' has no workers") from None
        try:
            yield Cluster(client)
        except (CancelledError, OSError):
            # A fault of a log is an outcome; an error here means a lost connection.
            raise ConnectionError(
                f"the scheduler at '{address}' is gone: the next run continues from here"
            ) from None


@contextmanager
def _silence_client_log() -> Iterator[None]:
    """Silence the client's log, which shows a lost connection with tracebacks."""
    log = logging.getLogger("distributed.client")
    before = log.level
    log.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        log.setLevel(before)


def _import_distributed() -> Any:  # noqa: ANN401
    try:
        import distributed
    except ImportError:
        raise ImportError(describe_missing_extra("distributed", "cluster")) from None
    return distributed
