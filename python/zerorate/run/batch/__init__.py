"""Many logs through the filter: on the cores of one machine, or on a cluster."""

from zerorate.run.batch.run import BatchResult, run_batch
from zerorate.run.batch.task import Outcome, Settings

__all__ = ["BatchResult", "Outcome", "Settings", "run_batch"]
