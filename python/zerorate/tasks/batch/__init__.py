"""Many logs at once, on the cores of one machine or on a cluster."""

from zerorate.tasks.batch.fleet import Fleet, Outlier
from zerorate.tasks.batch.run import BatchResult, batch
from zerorate.tasks.batch.task import Outcome, Settings

__all__ = ["BatchResult", "Fleet", "Outcome", "Outlier", "Settings", "batch"]
