"""Work for the engines that worker processes can import, and logs for batches."""

import os
import pickle
import signal
from pathlib import Path

import numpy as np

from zerorate import Log, write_log
from zerorate.tasks.batch.engines import Processes, TaskResult


class Here(Processes):
    """This process in place of workers, for what does not ask which process works.

    A worker takes as long to start as a short log to filter. Work, tasks and answers are pickled.
    """

    def run(self, work, tasks, at_once=None):
        for task in tasks:
            function, given = pickle.loads(pickle.dumps((work, task)))
            yield TaskResult(task, pickle.loads(pickle.dumps(function(given))))


def note_and_answer(task):
    """Note that a task runs; `task` is (folder, number)."""
    folder, number = task
    with (Path(folder) / "ran.txt").open("a") as file:
        file.write(f"{number}\n")
    return number * 10


def die_at_three(task):
    """Kill the worker whenever the task is number three."""
    if task[1] == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return note_and_answer(task)


def die_once_at_three(task):
    """Kill the worker the first time that the task is number three."""
    mark = Path(task[0]) / "died"
    if task[1] == 3 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGSEGV)
    return note_and_answer(task)


def environment(names):
    """Return variables as the worker sees them."""
    return [os.environ.get(name) for name in names]


def make_logs(folder, count, n=2000, axes=1):
    """Write logs into two folders and return their paths by name."""
    paths = []
    for i in range(count):
        path = folder / f"unit{i % 2}" / f"run{i:02d}.parquet"
        path.parent.mkdir(parents=True, exist_ok=True)
        data = 0.5 + 0.1 * np.random.default_rng(i).standard_normal((n, axes))
        names = [f"gyro_{axis}" for axis in "xyz"[:axes]]
        write_log(Log(np.arange(n) / 100.0, 100.0, data, names, "deg/s"), path)
        paths.append(path)
    return sorted(paths)
