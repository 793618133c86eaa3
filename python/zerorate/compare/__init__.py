"""Many methods on the same recordings, each measured by what it costs its user."""

from zerorate.compare.methods import METHODS
from zerorate.compare.result import Comparison, Row
from zerorate.compare.run import compare
from zerorate.compare.trial import Kind, Trial, read_trial

__all__ = ["METHODS", "Comparison", "Kind", "Row", "Trial", "compare", "read_trial"]
