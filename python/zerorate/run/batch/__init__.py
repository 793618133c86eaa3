"""Many logs through the filter: on the cores of one machine, or on a cluster."""

from zerorate.run.batch.outcome import Outcome
from zerorate.run.batch.result import BatchResult
from zerorate.run.batch.run import run_batch
from zerorate.run.batch.settings import Settings

__all__ = ["BatchResult", "Outcome", "Settings", "run_batch"]
