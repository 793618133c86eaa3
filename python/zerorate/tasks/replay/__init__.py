"""One log through the filters: filtered data, measures of every axis, and learned parameters."""

from zerorate.tasks.replay.allan import AllanCurves
from zerorate.tasks.replay.filters import Output
from zerorate.tasks.replay.history import History
from zerorate.tasks.replay.measures import Score
from zerorate.tasks.replay.result import Replay, Replays, Summary
from zerorate.tasks.replay.task import replay, replay_to_file

__all__ = [
    "AllanCurves",
    "History",
    "Output",
    "Replay",
    "Replays",
    "Score",
    "Summary",
    "replay",
    "replay_to_file",
]
