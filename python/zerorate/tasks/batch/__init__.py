"""Processing of many logs, on the cores of one machine or on a cluster."""

from zerorate.tasks.batch.fleet import Fleet, Outlier
from zerorate.tasks.batch.run import BatchResult, batch
from zerorate.tasks.batch.single import process_log
from zerorate.tasks.batch.task import Outcome, Settings

__all__ = ["BatchResult", "Fleet", "Outcome", "Outlier", "Settings", "batch", "process_log"]
