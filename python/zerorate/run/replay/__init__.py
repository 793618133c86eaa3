"""One log through the filters: filtered data, measures of every axis, and what was learned."""

from zerorate.run.replay.allan import AllanCurves
from zerorate.run.replay.filters import Output
from zerorate.run.replay.history import History
from zerorate.run.replay.measures import Score
from zerorate.run.replay.result import Replay, Summary
from zerorate.run.replay.run import replay, replay_to_file

__all__ = [
    "AllanCurves",
    "History",
    "Output",
    "Replay",
    "Score",
    "Summary",
    "replay",
    "replay_to_file",
]
