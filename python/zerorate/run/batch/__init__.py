"""Many logs at once, on the cores of one machine or on a cluster."""

from zerorate.run.batch.fleet import Fleet, Outlier
from zerorate.run.batch.run import BatchResult, run_batch
from zerorate.run.batch.task import Outcome, Settings

__all__ = ["BatchResult", "Fleet", "Outcome", "Outlier", "Settings", "run_batch"]
