"""Many logs through the filter: on the cores of one machine, or on a cluster."""

from zerorate.batch.outcome import Outcome
from zerorate.batch.result import BatchResult
from zerorate.batch.run import run_batch
from zerorate.batch.settings import Settings

__all__ = ["BatchResult", "Outcome", "Settings", "run_batch"]
