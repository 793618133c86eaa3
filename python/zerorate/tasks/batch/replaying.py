"""A log of a batch through the filter, as ``zerorate replay`` does it without a figure."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from zerorate.calibration.calibration import Calibration
from zerorate.record.log import notes_of
from zerorate.tasks.batch.command import Command, Made, Quantity, Row, number
from zerorate.tasks.replay import Score, Summary, replay_to_file
from zerorate.tasks.replay.history import last_known
from zerorate.tasks.replay.result import unlearned

if TYPE_CHECKING:
    from zerorate.tasks.batch.task import Settings

_COUNTS: Final = ("n", "missing_count", "saturated_count", "outlier_count", "stuck_count")
_NUMBERS: Final = (
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


def _filtered(settings: "Settings", source: Path, output: Path) -> Made:
    """Filter a log into a file."""
    reading, known = dict(settings.reading), settings.calibration
    result = replay_to_file(
        source,
        output,
        accel=settings.accel,
        calibration=None if known is None else Calibration.from_json(known),
        force=True,
        data_scale=reading.pop("scale"),
        **reading,
        **settings.options,
    )
    notes = (*result.alarms, *notes_of(result.header, even=True), *unlearned(result))
    return Made(_rows(result), notes)


def _rows(result: Summary) -> tuple[Row, ...]:
    scores = {(score.axis, score.method): score for score in result.scores}
    history = result.history
    noise, drift = last_known(history.angle_random_walk), last_known(history.rate_random_walk)
    return tuple(
        {
            "axis": axis,
            "unit": result.header.unit,
            "rate": result.header.rate,
            "n": result.header.n,
            "missing_count": int(result.seen.missing_count[i]),
            **{name: int(counts[i]) for name, counts in vars(result.left_out).items()},
            **_scores("raw", scores[axis, "raw"], result.horizons),
            **_scores("bias", scores[axis, result.method], result.horizons),
            "reduction": number(scores[axis, result.method].reduction),
            "angle_random_walk": number(noise[i]),
            "rate_random_walk": number(drift[i]),
            "bias": number(history.bias[-1, i]),
            "bias_sigma": number(history.bias_sigma[-1, i]),
            "time_at_rest": _rest(result, i),
        }
        for i, axis in enumerate(result.header.names)
    )


def _scores(of: str, score: Score, horizons: tuple[float, ...]) -> dict[str, float | None]:
    measures = [("mean", score.mean), ("deviation", score.deviation), *_coasting(score, horizons)]
    return {f"{of}_{name}": number(value) for name, value in measures}


def _coasting(score: Score, horizons: tuple[float, ...]) -> Iterator[tuple[str, float]]:
    for horizon, value in zip(horizons, score.coasting, strict=True):
        yield f"coasting_{horizon:g}s", value


def _rest(result: Summary, i: int) -> float | None:
    rested = result.seen.at_rest_count
    return None if rested is None else int(rested[i]) / result.header.rate


REPLAY: Final = Command(
    name="replay",
    mark="-zerorate",
    ending=lambda format: f".{format}",
    work=_filtered,
    columns=dict.fromkeys(_COUNTS, int) | dict.fromkeys(_NUMBERS, float),
    compared=(
        Quantity("angle_random_walk", "{}/sqrt(Hz)", both=True),
        Quantity("rate_random_walk", "{}/sqrt(s)"),
        Quantity("bias", "{}", sigma="bias_sigma", signed=True),
        Quantity("bias_coasting_10s", "{}·s"),
        Quantity("bias_coasting_60s", "{}·s"),
    ),
)
