"""Replay of one log of a batch, as in ``zerorate replay`` without a figure."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from zerorate.calibration.calibration import Calibration
from zerorate.io.sensors import ALL_SENSORS
from zerorate.record.log import LogError, notes_of
from zerorate.tasks.batch.command import Command, LogOutput, LogPath, Quantity, Row, finite_or_none
from zerorate.tasks.replay import Score, Summary, replay_to_file
from zerorate.tasks.replay.history import last_finite
from zerorate.tasks.replay.result import describe_unlearned

if TYPE_CHECKING:
    from zerorate.tasks.batch.task import Settings

_COUNT_COLUMNS: Final = ("n", "missing_count", "saturated_count", "outlier_count", "stuck_count")
_NUMBER_COLUMNS: Final = (
    "rate",
    "raw_mean",
    "raw_deviation",
    "raw_coasting_10s",
    "raw_coasting_60s",
    "bias_mean",
    "bias_deviation",
    "bias_coasting_10s",
    "bias_coasting_60s",
    "reduction",
    "angle_random_walk",
    "rate_random_walk",
    "bias",
    "bias_sigma",
    "time_at_rest",
)


def _replay_log(settings: "Settings", source: LogPath, output: Path) -> LogOutput:
    """Filter a log into a file."""
    reading, calibration_json = dict(settings.reading), settings.calibration
    calibration = None if calibration_json is None else Calibration.from_json(calibration_json)
    replay = partial(
        replay_to_file, source, output, accel=settings.accel, calibration=calibration,
        force=True, data_scale=reading.pop("scale"), **settings.options,
    )  # fmt: skip
    try:
        result = replay(**reading)
    except LogError as error:
        if error.argument != "sensor" or reading["sensor"] is not None:
            raise
        result = replay(**{**reading, "sensor": ALL_SENSORS})
    notes = (
        *result.alarms,
        *notes_of(result.header, evenly_spaced=True),
        *describe_unlearned(result),
    )
    return LogOutput(replay_rows(result), notes)


def replay_rows(result: Summary) -> tuple[Row, ...]:
    """Return one row of counts, scores and learned noise for each axis of a replay."""
    scores = {(score.axis, score.method): score for score in result.scores}
    history = result.history
    noise, drift = last_finite(history.angle_random_walk), last_finite(history.rate_random_walk)
    return tuple(
        {
            "axis": axis,
            "unit": result.header.unit,
            "rate": result.header.rate,
            "n": result.header.n,
            "missing_count": int(result.sample_counts.missing_count[i]),
            **{name: int(counts[i]) for name, counts in vars(result.left_out).items()},
            **_scores("raw", scores[axis, "raw"], result.horizons),
            **_scores("bias", scores[axis, result.method], result.horizons),
            "reduction": finite_or_none(scores[axis, result.method].reduction),
            "angle_random_walk": finite_or_none(noise[i]),
            "rate_random_walk": finite_or_none(drift[i]),
            "bias": finite_or_none(history.bias[-1, i]),
            "bias_sigma": finite_or_none(history.bias_sigma[-1, i]),
            "time_at_rest": _rest_time(result, i),
        }
        for i, axis in enumerate(result.header.names)
    )


def _scores(prefix: str, score: Score, horizons: tuple[float, ...]) -> dict[str, float | None]:
    measures = [
        ("mean", score.mean),
        ("deviation", score.deviation),
        *_coasting_columns(score, horizons),
    ]
    return {f"{prefix}_{name}": finite_or_none(value) for name, value in measures}


def _coasting_columns(score: Score, horizons: tuple[float, ...]) -> Iterator[tuple[str, float]]:
    for horizon, value in zip(horizons, score.coasting, strict=True):
        yield f"coasting_{horizon:g}s", value


def _rest_time(result: Summary, i: int) -> float | None:
    rest_counts = result.sample_counts.at_rest_count
    return None if rest_counts is None else int(rest_counts[i]) / result.header.rate


REPLAY: Final = Command(
    name="replay",
    mark="-zerorate",
    ending=lambda format: f".{format}",
    work=_replay_log,
    columns=dict.fromkeys(_COUNT_COLUMNS, int) | dict.fromkeys(_NUMBER_COLUMNS, float),
    quantities=(
        Quantity("angle_random_walk", "{}/sqrt(Hz)", two_sided=True),
        Quantity("rate_random_walk", "{}/sqrt(s)"),
        Quantity("bias", "{}", sigma="bias_sigma", signed=True),
        Quantity("bias_coasting_10s", "{}·s"),
        Quantity("bias_coasting_60s", "{}·s"),
    ),
)
