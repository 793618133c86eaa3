"""One log through the filters: filtered data, measures of every axis, and what was learned."""

from zerorate.run.replay.allan import AllanCurves
from zerorate.run.replay.history import History
from zerorate.run.replay.passes import FilterOptions
from zerorate.run.replay.result import Replay, Score, Summary
from zerorate.run.replay.run import replay
from zerorate.run.replay.written import replay_to_file

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
