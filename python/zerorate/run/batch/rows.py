"""The numbers of a replay that go into the summary."""

import math
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from zerorate.run.batch.outcome import Row
from zerorate.run.replay import Score, Summary
from zerorate.run.replay.learned import last_known

__all__ = ["rows_of"]


def rows_of(result: Summary) -> tuple[Row, ...]:
    """Return one row an axis; None where a number means nothing."""
    scores = {(score.axis, score.method): score for score in result.scores}
    history = result.history
    noise, drift = last_known(history.angle_random_walk), last_known(history.rate_random_walk)
    return tuple(
        {
            "axis": axis,
            "unit": result.header.unit,
            "rate": result.header.rate,
            "samples": result.header.n,
            "missing": int(result.seen.missing[i]),
            **_scores("raw", scores[axis, "raw"], result.horizons),
            **_scores("drift", scores[axis, result.method], result.horizons),
            "reduction": _number(scores[axis, result.method].reduction),
            "angle_random_walk": _number(noise[i]),
            "rate_random_walk": _number(drift[i]),
            "bias": _number(history.bias[-1, i]),
            "bias_sigma": _number(history.bias_sigma[-1, i]),
            "time_at_rest": _rest(result, i),
        }
        for i, axis in enumerate(result.header.names)
    )


def _scores(of: str, score: Score, horizons: tuple[float, ...]) -> dict[str, float | None]:
    measures = [("mean", score.mean), ("deviation", score.deviation), *_coasting(score, horizons)]
    return {f"{of}_{name}": _number(value) for name, value in measures}


def _coasting(score: Score, horizons: tuple[float, ...]) -> Iterator[tuple[str, float]]:
    for horizon, value in zip(horizons, score.coasting, strict=True):
        yield f"coasting_{horizon:g}s", value


def _rest(result: Summary, i: int) -> float | None:
    rested = result.seen.at_rest
    return None if rested is None else int(rested[i]) / result.header.rate


def _number(value: float | npt.NDArray[np.float64]) -> float | None:
    # JSON knows neither NaN nor infinity.
    return float(value) if math.isfinite(value) else None
