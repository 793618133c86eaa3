"""Many methods on the same recordings, each measured by what it costs its user."""

from zerorate.compare.comparison import Comparison, compare
from zerorate.compare.measures import Row
from zerorate.compare.methods import METHODS
from zerorate.compare.reading import read_recording
from zerorate.compare.recording import Kind, Recording

__all__ = ["METHODS", "Comparison", "Kind", "Recording", "Row", "compare", "read_recording"]
