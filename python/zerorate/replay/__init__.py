"""One log through the filters: filtered data, measures of every axis, and what was learned."""

from zerorate.replay.allan import AllanCurves
from zerorate.replay.history import History
from zerorate.replay.passes import FilterOptions
from zerorate.replay.result import Replay, Score, Summary
from zerorate.replay.run import replay
from zerorate.replay.written import replay_to_file

__all__ = [
    "AllanCurves",
    "FilterOptions",
    "History",
    "Replay",
    "Score",
    "Summary",
    "replay",
    "replay_to_file",
]
