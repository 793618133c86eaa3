"""The result of a replay: a summary, all series, and the columns of the filtered log."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.numerals import shorten
from zerorate.record import Log
from zerorate.record.log import Header, notes_of
from zerorate.record.names import add_unit_suffix, split_unit
from zerorate.tasks.exclusion_counts import ExclusionCounts
from zerorate.tasks.replay.allan import AllanCurves, allan_curves
from zerorate.tasks.replay.filters import Output, mask_saturated
from zerorate.tasks.replay.history import History
from zerorate.tasks.replay.measures import SampleCounts, Score, onset_samples
from zerorate.types import Booleans, Floats, Integers
from zerorate.views import Result, figure_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Panels: TypeAlias = Literal["usual", "all"]
"""Panels of a result's figure."""

_NO_REST: Final = "no rest yet"
_PROVISIONAL: Final = "provisional"

Columns = dict[str, Floats | Booleans]


@dataclass(frozen=True, eq=False)
class Readings:
    """Quality of the bias of k axes at each of n samples, from earlier samples only.

    Parameters
    ----------
    bias_sigma : ndarray, shape (n, k)
        Standard deviation of the bias, in the unit of the data.
    at_rest : ndarray of bool, shape (n, k)
        True if the filter considered the sensor at rest.
    stuck : ndarray of bool, shape (n, k)
        True if the sensor was stuck at one value.
    """

    bias_sigma: Floats
    at_rest: Booleans
    stuck: Booleans

    @property
    def rest(self) -> Booleans:
        """Mask of rest, shape (n, k), without samples of a stuck sensor, which may have moved."""
        return self.at_rest & ~self.stuck

    def certain_rest(self, rate: float) -> Booleans:
        """Return `rest` without samples in which an undetected motion began, shape (n, k).

        Rest is decided in ticks of a quarter second, or of four samples if that is longer. Motion
        is detected at the end of the tick in which it began, or of the next tick.
        """
        rest = self.rest
        before = onset_samples(rate)
        begins = np.argwhere(rest[:-1] & ~rest[1:])
        for i, axis in begins:
            rest[max(0, i + 1 - before) : i + 1, axis] = False
        return rest


TRUTH_MEAN_S: Final = 10.0
"""Duration of the mean bias to which `DriftFilter.bias_sigma` refers, s."""


def trailing_mean(values: Floats, rate: float) -> Floats:
    """Return at each sample the mean of the last ten seconds, or since the start, (n,)."""
    width = min(max(1, round(TRUTH_MEAN_S * rate)), len(values))
    sums = np.concatenate(([0.0], np.cumsum(values)))
    stops = np.arange(1, len(values) + 1)
    starts = np.maximum(stops - width, 0)
    means: Floats = (sums[stops] - sums[starts]) / (stops - starts)
    return means


@dataclass(frozen=True, eq=False, kw_only=True)
class Summary(Result):
    """Summary of a replay without the samples; `table` and `plot` show the biases.

    Parameters
    ----------
    header : Header
        Description of the filtered log: n samples of k axes.
    method : str
        Chosen method. All following attributes refer to this method.
    output : {"compensated", "estimate"}
        Contents of the filtered log: the raw rate minus its bias, or the bias.
    params : mapping
        Arguments that make the same filter.
    scores : tuple of Score
        Axis by axis: the raw data, then each method.
    compensated_deviation : ndarray, shape (k,)
        Standard deviation of the raw rate minus the bias, in the unit of the log.
    horizons : tuple of float
        Horizons of the coasting errors, s.
    speed : mapping of str to float
        Number of samples processed per second on one core, summed over all axes.
    guard_count : mapping of str to ndarray, shape (k,)
        Number of samples at which the process noise was limited.
    ready : ndarray of bool, shape (k,)
        True if the axis' start-up is over.
    status : tuple of str
        `DriftFilter.status` of each axis at the end.
    restart_count : ndarray, shape (k,)
        Number of restarts of the filter because the initially learned noise was wrong by orders of
        magnitude.
    history : History
        State of the chosen filter over time.
    time_constant : ndarray, shape (k,)
        Time in which the bias follows a step of the samples by 63 %, s.
    sample_counts : SampleCounts
        Counts of missing, resting and stuck samples.
    left_out : ExclusionCounts
        Counts of present samples that the chosen filter left out.
    alarms : tuple of str
        Contradictions in the log, one sentence each.
    error_at_end : ndarray, shape (k,), or None
        Bias at the end minus the mean true bias of the last 10 s, unit of the log. None if the true
        bias is unknown.
    """

    header: Header
    method: str
    output: Output
    params: Mapping[str, Any]
    scores: tuple[Score, ...]
    compensated_deviation: Floats
    horizons: tuple[float, ...]
    speed: Mapping[str, float]
    guard_count: Mapping[str, Integers]
    ready: Booleans
    status: tuple[str, ...]
    restart_count: Integers
    history: History
    time_constant: Floats
    sample_counts: SampleCounts
    left_out: ExclusionCounts
    alarms: tuple[str, ...] = ()
    error_at_end: Floats | None = None

    @property
    def source(self) -> str:
        """Name of the log."""
        return str(self.header.meta.get("source", "the log"))

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on the log's clock, gaps and assumptions, and on the filter."""
        return tuple(notes_on(self))

    @property
    def moved_count(self) -> Integers | None:
        """Number of samples in motion for each axis, shape (k,)."""
        counts = self.sample_counts
        if counts.at_rest_count is None or counts.stuck_count is None:
            return None
        return self.header.n - counts.at_rest_count - counts.stuck_count

    def summary(self) -> "Summary":
        """Return the summary, which has no samples."""
        return Summary(**{field.name: getattr(self, field.name) for field in fields(Summary)})

    @property
    def limit(self) -> float | None:
        """End of the sensor's range, in the unit of the log; None if unknown."""
        limit: float | None = self.params["limit"]
        return limit


@dataclass(frozen=True, eq=False, kw_only=True)
class Replay(Summary, Result):
    """A filtered log, as `zerorate.replay` returns it: a `Summary` with all samples.

    Parameters
    ----------
    log : Log
        The log before filtering.
    filtered : mapping of str to ndarray, shape (n, k)
        Bias by method; NaN before an axis' first sample.
    readings : Readings or None
        Quality of the bias at each sample. None for a published method without detection of motion,
        if the output is the estimate.
    truth : ndarray, shape (n, k), or None
        True bias, if it is known.

    Examples
    --------
    >>> import zerorate as zr
    >>> noise = zr.NoiseModel(angle_random_walk=1e-4)
    >>> z, _ = zr.simulate(noise, rate=100.0, duration=60.0, seed=1, axes=3)
    >>> found = zr.replay(0.01 + z, rate=100.0, unit="rad/s")
    >>> found.method, found.to_log().n, bool(abs(found.bias[-1] - 0.01).max() < 1e-4)
    ('auto', 6000, True)
    """

    log: Log
    filtered: Mapping[str, Floats]
    readings: Readings | None
    truth: Floats | None = None

    @property
    def bias(self) -> Floats:
        """The bias by the chosen method, shape (n, k)."""
        return self.filtered[self.method]

    @property
    def saturated(self) -> Booleans | None:
        """Mask of samples at the end of the sensor's range, shape (n, k); None without range."""
        return mask_saturated(self.log.data, self.limit)[1]

    @property
    def lost(self) -> Booleans:
        """Mask of samples with a stuck or saturated sensor, shape (n, k)."""
        lost = np.zeros(self.log.data.shape, dtype=np.bool_)
        for part in (self.saturated, None if self.readings is None else self.readings.stuck):
            if part is not None:
                lost |= part
        return lost

    @cached_property
    def allan(self) -> AllanCurves:
        """Allan deviations of raw data and filtered log; only at rest if rest is known."""
        raw, _ = mask_saturated(self.log.data, self.limit)
        filtered = self.bias if self.output == "estimate" else subtract_bias(raw, self.bias)
        if self.params["motion"] == "hold" and self.readings is not None:
            raw = np.where(self.readings.certain_rest(self.log.rate), raw, np.nan)
        return allan_curves(raw, filtered, self.log.rate)

    def plot(
        self, panels: Panels = "usual", *, ax: "Axes | Sequence[Axes] | None" = None
    ) -> "Figure":
        """Return the figure; ImportError without matplotlib, of the extra ``plot``.

        Parameters
        ----------
        panels : {"usual", "all"}
            "usual": raw rate and biases. "all": also noise, gain or drift, and Allan deviations.
        ax : matplotlib Axes, or a sequence of them, optional
            Axes for the bias of each sensor axis, in order.
        """
        return figure_of(self, panels == "all", ax=ax)

    def to_log(self) -> Log:
        """Return the output of the chosen method as a log: the bias, or the compensated rate.

        With the compensated rate there are extra columns for each axis: bias, its standard
        deviation, rest, a stuck sensor and, if the range is known, saturation.
        """
        if self.output == "estimate":
            return self.log.with_data(self.bias)
        counted, _ = mask_saturated(self.log.data, self.limit)
        filtered = self.log.with_data(subtract_bias(counted, self.bias))
        return replace(filtered, extra={**filtered.extra, **self._extra()})

    def _extra(self) -> Columns:
        if self.readings is None:
            return {}
        readings, saturated = self.readings, self.saturated
        flags = (readings.at_rest, readings.stuck, *(() if saturated is None else (saturated,)))
        columns = (flag.T for flag in flags)
        return extra_columns(
            self.log.names, self.log.unit, self.bias.T, readings.bias_sigma.T, *columns
        )


@dataclass(frozen=True, eq=False)
class Replays(Result):
    """Replays of several logs, in one table and one figure.

    Parameters
    ----------
    results : mapping of str to Summary
        Summaries by the names of the logs.
    """

    results: Mapping[str, Summary]


def notes_on(replay: Summary) -> Iterator[str]:
    """Yield sentences on the log, and on the filter's actions."""
    yield from _log_notes(replay)
    yield from describe_unlearned(replay)
    guarded = int(np.sum(replay.guard_count[replay.method]))
    if guarded:
        steps = replay.header.n * replay.header.channels
        yield (
            f"{replay.method}: {guarded} of {steps} steps of the process noise were shortened to "
            "keep it positive"
        )
    if replay.method != "auto":
        yield from _time_constant_notes(replay)
        yield from _motion_notes(replay)


def _log_notes(replay: Summary) -> Iterator[str]:
    header, missing = replay.header, replay.sample_counts.missing_count
    yield from notes_of(header, evenly_spaced=True)
    if missing.any():
        counts = zip(header.names, missing.tolist(), strict=True)
        listed = ", ".join(f"{name} {n}" for name, n in counts if n)
        yield f"missing samples, predicted and not corrected: {listed} of {header.n}"
    yield from replay.left_out.sentences(header.names, header.n, replay.limit)
    for name, restarts in zip(replay.header.names, replay.restart_count.tolist(), strict=True):
        if restarts:
            times = "once" if restarts == 1 else f"{restarts} times"
            yield (
                f"{name}: the noise learned at the start was wrong by orders of magnitude; noise "
                f"and drift were learned again, {times}"
            )


def _time_constant_notes(replay: Summary) -> Iterator[str]:
    times = {
        name: "longer than the record" if math.isinf(seconds) else f"{shorten(seconds, 3)} s"
        for name, seconds in zip(replay.header.names, replay.time_constant, strict=True)
        if not math.isnan(seconds)
    }
    if times:
        listed = ", ".join(f"{name} {text}" for name, text in times.items())
        yield f"time in which {replay.method} makes 63 % of a step: {listed}"


def _motion_notes(replay: Summary) -> Iterator[str]:
    moved = replay.moved_count
    if moved is None or not moved.any():
        return
    seconds = zip(replay.header.names, moved / replay.header.rate, strict=True)
    listed = ", ".join(f"{name} {shorten(time, 4)} s" for name, time in seconds if time)
    yield (
        f"in motion or before the first rest, where nothing is learned: {listed}; all measures "
        f"are from rest"
    )


def describe_unlearned(replay: Summary) -> Iterator[str]:
    """Yield a sentence on each axis without certain rest in the chosen filter."""
    needed, counts = (
        max(10, round(replay.params["startup"] * replay.header.rate)),
        replay.sample_counts,
    )
    for i, name in enumerate(replay.header.names):
        present, ready = int(counts.present_count[i]), bool(replay.ready[i])
        if present == 0:
            continue
        if not ready and counts.equal[i] and present >= needed:
            yield f"{name}: all samples are equal, so no noise, model or gain was learned"
        elif replay.status[i] == _NO_REST and present >= needed:
            yield f"{name}: no rest was found, so the bias is unknown: a filter learns at rest"
        elif not ready:
            yield (
                f"{name}: start-up not finished: it needs {needed} samples, has {present}: "
                "no noise, model or gain was learned"
            )
        elif replay.status[i] == _PROVISIONAL:
            yield make_sentence(
                f"{name}: the rest may be slow motion: no stronger motion followed, and it did "
                f"not last a minute; ",
                keyword_argument("rest_limit"),
                " distinguishes them",
            )


def subtract_bias(raw: Floats, bias: Floats) -> Floats:
    """Return raw minus bias, NaN where a sample is missing."""
    # Numbers near the largest double overflow if the filter's estimate is also at its limit.
    with np.errstate(over="ignore", invalid="ignore"):
        present = np.isfinite(raw)
        return raw - bias if present.all() else np.where(present, raw - bias, np.nan)


def extra_names(names: Sequence[str], unit: str, limited: bool) -> Iterator[tuple[str, ...]]:
    """Yield the names of the columns next to a compensated log, axis by axis.

    They are bias, its standard deviation, rest, stuck sensor and, with a limit, saturation.
    """
    flags = ("at_rest", "stuck", "saturated") if limited else ("at_rest", "stuck")
    for name in names:
        dimensional, bare = add_unit_suffix(name, unit), split_unit(name)[0]
        of_flags = (f"{flag}_{bare}" for flag in flags)
        yield f"bias_{dimensional}", f"bias_sigma_{dimensional}", *of_flags


def extra_columns(
    names: Sequence[str], unit: str, bias: Floats, sigma: Floats, *flags: Booleans
) -> Columns:
    """Return the extra columns by name, from arrays of shape (k, n)."""
    columns: Columns = {}
    for i, listed in enumerate(extra_names(names, unit, limited=len(flags) > 2)):
        unknown = np.isnan(bias[i])
        known = np.where(unknown, np.nan, sigma[i]) if unknown.any() else sigma[i]
        columns |= zip(listed, (bias[i], known, *(flag[i] for flag in flags)), strict=True)
    return columns
