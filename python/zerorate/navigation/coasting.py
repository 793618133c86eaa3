"""Process noise of a navigation filter, from its errors while it coasts without fixes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Final, TypeAlias

import numpy as np

from zerorate._native import NavigationFilter
from zerorate.navigation.alignment import Alignment
from zerorate.navigation.events import Events, pack_fixes
from zerorate.navigation.increments import Increments
from zerorate.noise import NoiseModel, Quantity
from zerorate.record import Recording
from zerorate.record.fixes import Fixes
from zerorate.record.offset import TimeOffset
from zerorate.record.samples import Samples
from zerorate.types import Floats, Integers

Noise: TypeAlias = NoiseModel | Sequence[NoiseModel]
"""Noise of a sensor: one model for all axes, or one model per axis."""

COAST_S: Final = (2.0, 5.0, 10.0)
"""Coasting times at which the filter is compared with fixes, s."""
_USUAL: Final[dict[str, tuple[float, float, Quantity]]] = {
    "gyro": (0.05 * (math.pi / 180.0), 1e-5, "angular rate"),
    "accel": (0.02, 5e-4, "acceleration"),
}
"""Default noise of consumer sensors: white noise, bias random walk, and the quantity."""
_MAX_WAIT_S: Final = 1.5
"""Longest wait of a window for a late fix, s."""
_MIN_BLOCKS: Final = 36
"""Smallest number of positions or velocities for an estimate."""
_MIN_BLOCK_SHARE: Final = 0.9
"""Share of the comparisons that must remain possible with another noise."""
_MAX_HEADING_SIGMA_RAD: Final = 0.15
_STUDENT: Final = 8.0
"""Degrees of freedom of the Student distribution of the errors."""
_MIN_GAINS: Final = (2.0, 5.0)
"""Smallest gain of log likelihood to raise the noise: assumed sensors, and stated sensors."""
_MIN_GAIN_DOWN: Final = 5.0
_MAX_LEVEL: Final = 2.0
"""Largest further factor on the squared noise after the likelihood is maximised."""
_MAX_REJECTED_SHARE: Final = 0.1
_STEP_S: Final = 0.2
"""Time between two steps of the covariance, s."""
_RATES_HZ: Final = (25.0, 50.0)
_FAST_RATE_RAD_S: Final = 0.5
"""Sampling rates for the search, Hz; the lower rate if each axis turns slower than this RMS."""
_PRIOR_LOG: Final = 2.0 * math.log(10.0)
"""Prior standard deviation of the logarithm of a factor on the squared noise."""
_STEPS_LOG: Final = (2.0 * math.log(2.0), math.log(2.0), 0.5 * math.log(2.0))
_MOST, _LEAST = 2.0 * math.log(30.0), 2.0 * math.log(0.03)
_UP: Final = np.array([[0.0, _MOST], [0.0, _MOST], [0.0, 0.0], [0.0, 0.0]])
_DOWN: Final = np.array([[_LEAST, _MOST], [_LEAST, _MOST], [_LEAST, 0.0], [0.0, 0.0]])
"""Ranges of the logarithms: gyro, accelerometer, bias random walks, and vibration."""
_USUAL_VIBRATION: Final = 0.1
_VIBRATION: Final = (0.0, math.log(1.0 + 1.0 / _USUAL_VIBRATION**2))
"""Vibration at which the logarithm is log(2), and the logarithm's range; 0 is no vibration."""


@dataclass(frozen=True, eq=False)
class FoundNoise:
    """Process noise from coasting, as `find_noise` returns it.

    Parameters
    ----------
    gyro, accel : NoiseModel, sequence of three NoiseModel, or None
        Models for `zerorate.NavigationFilter`. None if the noise is unchanged and no model was
        given.
    factors : tuple of float
        Factors on the gyro's white noise, on the accelerometer's white noise, and on the bias
        random walks. All are 1 if the noise is unchanged.
    gain : float
        Increase of the log likelihood of the coasting errors by these factors.
    block_count : int
        Number of positions and velocities compared.
    before, after : ndarray, shape (3,)
        RMS ratio of the horizontal position error to its standard deviation, after coasting for 2,
        5 and 10 s. `before` is with the stated noise, and `after` with the noise found here. 1 is
        consistent, NaN is unknown.
    reason : str
        Reason why the noise is unchanged. Empty if the noise changed.
    vibration : float
        Gyro noise divided by the change of the rate from sample to sample. It is the argument
        ``gyro_vibration`` of the filter.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=300.0, seed=1)
    >>> start = zr.navigation.find_start(drive.recording(), drive.fixes)
    >>> found = zr.navigation.find_noise(drive.recording(), drive.fixes, start)
    >>> nav = zr.NavigationFilter(start, **found.models)
    """

    gyro: Noise | None
    accel: Noise | None
    factors: tuple[float, float, float]
    gain: float
    block_count: int
    before: Floats
    after: Floats
    reason: str = ""
    vibration: float = 0.0

    @property
    def kept(self) -> bool:
        """True if the noise is unchanged."""
        return bool(self.reason)

    @property
    def models(self) -> dict[str, Any]:
        """Noise models and vibration, by the argument names of `NavigationFilter`."""
        models = {**self.white_models, "gyro_vibration": self.vibration or None}
        return {name: model for name, model in models.items() if model is not None}

    @property
    def white_models(self) -> dict[str, Any]:
        """Noise models without vibration; the vibration is valid at one sampling rate only."""
        models = {"gyro": self.gyro, "accel": self.accel}
        return {name: model for name, model in models.items() if model is not None}

    def __str__(self) -> str:
        """Return the noise and its gain, or the reason why the noise is kept."""
        if self.kept:
            return f"the filter's noise is unchanged: {self.reason}"
        gyro, accel, walk = (f"{factor:.2g}" for factor in self.factors)
        before, after = (
            ", ".join(f"{ratio:.2g}" for ratio in ratios) for ratios in (self.before, self.after)
        )
        seconds = ", ".join(f"{seconds:g}" for seconds in COAST_S)
        change = f" and {self.vibration:.2g} of its change from sample to sample"
        return (
            f"the filter's noise is fitted to its errors without fixes: gyro {gyro} times"
            f"{change if self.vibration else ''}, accelerometer {accel} "
            f"times, bias walks {walk} times as stated; log likelihood gains {self.gain:.0f} over "
            f"{self.block_count} blocks, error over sigma after {seconds} s is {after}, was "
            f"{before}"
        )


def find_noise(
    imu: Recording,
    gnss: Fixes,
    start: Alignment,
    *,
    time_offset: float | TimeOffset = 0.0,
    gyro: Noise | None = None,
    accel: Noise | None = None,
    lower: bool | None = None,
    **options: Any,  # noqa: ANN401
) -> FoundNoise:
    """Find the process noise at which a filter's coasting errors match its standard deviation.

    Parameters
    ----------
    imu : Recording
        Recording for ``NavigationFilter.process``, in the axes of the body.
    gnss : Fixes
        Fixes of the receiver.
    start : Alignment
        As in `NavigationFilter`.
    time_offset : float or TimeOffset
        Offset to add to the times of the fixes, s. Find the offset first: a wrong clock looks like
        noise.
    gyro, accel : NoiseModel or sequence of three, optional
        Noise of the sensors, if known. Default: the noise of consumer sensors.
    lower : bool, optional
        True allows noise below the model if this clearly increases the likelihood. Default: True if
        no model is given. By default a given model's noise can only increase.
    **options
        Further options of `NavigationFilter`.

    Returns
    -------
    FoundNoise
        Models for `NavigationFilter`. They equal the given models if no change of the noise is an
        improvement.

    Raises
    ------
    ValueError
        If an option is out of range.

    Notes
    -----
    Every ten seconds a copy of the filter coasts without fixes. It is compared with the fixes after
    2, 5 and 10 s. Three factors on the noise maximise the likelihood of the horizontal errors. The
    errors have Student's distribution with eight degrees of freedom. Each trial runs the whole
    filter once. If errors after 5 and 10 s still exceed their standard deviation, the white noise
    is increased by the ratio of error to standard deviation.

    Vibration faster than the sampling adds noise to the gyro. The model of this noise is a fraction
    of the rate's change from sample to sample, on each axis. It is used only if it increases the
    likelihood of the errors.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=100.0, seed=1)
    >>> start = zr.navigation.find_start(drive.recording(), drive.fixes)
    >>> print(zr.navigation.find_noise(drive.recording(), drive.fixes, start))
    the filter's noise is unchanged: there are 30 positions and velocities to compare, under 36
    """
    samples = Samples.of(imu, mag=False, what="navigation")
    options = {"covariance_step": _STEP_S, **options}
    fixes = TimeOffset.of(time_offset).applied(gnss)
    models = {"gyro": gyro, "accel": accel}
    is_assumed = (gyro is None and accel is None) if lower is None else lower
    every = _Coasting(
        Increments(samples.time, samples.gyro, samples.accel), fixes, start, models, options
    )
    if "gyro_vibration" in options:
        return _search(every, None, is_assumed)
    rate = _RATES_HZ[bool(np.nanmean(samples.gyro**2) > _FAST_RATE_RAD_S**2)]
    steps, few_options = Increments.for_filter(samples, options, rate)
    return _search(_Coasting(steps, fixes, start, models, few_options), every, is_assumed)


@dataclass(frozen=True)
class _Probe:
    """A fix with which a coasting filter is compared.

    `kind` is 0 for a position and 1 for a velocity. `length` is the index of the coasting time.
    `sample` is the first sample at or after the fix.
    """

    kind: int
    length: int
    sample: int
    row: Floats


@dataclass(frozen=True)
class _Window:
    """Sample at which a filter begins to coast, and the fixes to compare it with, by time."""

    sample: int
    probes: tuple[_Probe, ...]


@dataclass(frozen=True, eq=False)
class _Errors:
    """Coasting errors of B blocks: kind, length, squared error over variance, log determinant."""

    blocks: Floats
    rejected_share: float

    @property
    def count(self) -> int:
        return len(self.blocks)

    def log_likelihood(self) -> float:
        """Return the mean log likelihood of a block (Student, scaled to the block's covariance)."""
        nis, log_det = self.blocks[:, 2], self.blocks[:, 3]
        student = (_STUDENT + 2.0) * np.log1p(nis / (_STUDENT - 2.0))
        return float(-0.5 * (log_det + student).mean())

    def ratios(self) -> Floats:
        """Return the RMS ratio of position error to standard deviation, for each coasting time."""
        kind, length, nis = self.blocks[:, 0], self.blocks[:, 1], self.blocks[:, 2]
        own = [nis[(kind == 0) & (length == k)] for k in range(len(COAST_S))]
        return np.array([math.sqrt(0.5 * x.mean()) if len(x) else math.nan for x in own])


@dataclass(eq=False)
class _Coasting:
    """Runs of a filter with a trial noise, and of copies that coast."""

    samples: Increments
    fixes: Fixes
    start: Alignment
    models: dict[str, Noise | None]
    options: dict[str, Any]
    events: Floats = field(init=False)
    event_samples: Integers = field(init=False)
    _memo: dict[tuple[float, ...], _Errors] = field(default_factory=dict)

    def __post_init__(self) -> None:
        events = Events.of(self.fixes)
        self.events = events.rows
        self.event_samples = np.searchsorted(self.samples.time, self.events[:, 0])

    @cached_property
    def windows(self) -> list[_Window]:
        """Coasting windows; they are the same for every trial noise."""
        return list(self._plan(Events.of(self.fixes)))

    def noise(self, theta: Floats) -> dict[str, Noise]:
        """Return the models, scaled by these log factors on their squares."""
        white = dict(zip(_USUAL, np.exp(0.5 * theta[:2]).tolist(), strict=True))
        walk = math.exp(0.5 * theta[2])
        return {
            sensor: _scale(sensor, self.models[sensor], white[sensor], walk) for sensor in _USUAL
        }

    def filter(self, theta: Floats) -> NavigationFilter:
        """Return a filter before its first sample."""
        shaken = {"gyro_vibration": _vibration(theta)}
        options: dict[str, Any] = {**self.noise(theta), **shaken, **self.options}
        return NavigationFilter(self.start, **options)

    def run(self, theta: Floats) -> _Errors:
        """Return the coasting errors with a trial noise."""
        key = tuple(np.round(theta, 9).tolist())
        if key not in self._memo:
            self._memo[key] = self._run(theta)
        return self._memo[key]

    def score(self, theta: Floats) -> float:
        """Return the log likelihood of a noise, with its prior; -inf if there are too few fixes."""
        count = self.run(np.zeros(4)).count
        errors = self.run(theta)
        if errors.count < max(1.0, _MIN_BLOCK_SHARE * count):
            return -math.inf
        # Half the sum: errors after different times in one window are correlated.
        prior = 0.5 * float((theta**2).sum()) / _PRIOR_LOG**2
        return 0.5 * count * errors.log_likelihood() - prior

    def _run(self, theta: Floats) -> _Errors:
        nav, blocks, at = self.filter(theta), list[tuple[float, ...]](), 0
        for window in self.windows:
            self._advance(nav, at, window.sample, fixes=True)
            at = window.sample
            if nav.status == "navigating" and nav.sigma[8] < _MAX_HEADING_SIGMA_RAD:
                blocks += self._coast(nav.copy(), window)
        counts = nav.rejected_count
        rejected = max(counts.values()) / max(1, sum(nav.fix_count.values()))
        return _Errors(np.array(blocks).reshape(-1, 4), rejected)

    def _coast(self, nav: NavigationFilter, window: _Window) -> Iterator[tuple[float, ...]]:
        """Yield the comparison blocks of one window, from a filter that coasts through it."""
        at, samples = window.sample, self.samples
        for probe in window.probes:
            self._advance(nav, at, probe.sample, fixes=False)
            at = probe.sample
            own = slice(at, at + 1)
            output, _ = nav.copy().process_arrays(
                samples.time[own], samples.gyro[own], samples.accel[own], probe.row
            )
            columns = slice(3 * probe.kind, 3 * probe.kind + 2)
            z, sigma = output["innovation"][0, columns], output["innovation_sigma"][0, columns]
            if np.isfinite(z).all():
                nis = float(((z / sigma) ** 2).sum())
                yield probe.kind, probe.length, nis, 2.0 * float(np.log(sigma).sum())

    def _advance(self, nav: NavigationFilter, first: int, stop: int, *, fixes: bool) -> None:
        """Process the samples from `first` until before `stop`, with or without their fixes."""
        if stop <= first:
            return
        samples, rows = self.samples, self.events[:0]
        if fixes:
            due = np.searchsorted(self.event_samples, [first, stop])
            rows = self.events[due[0] : due[1]]
        own = slice(first, stop)
        nav.process_arrays(samples.time[own], samples.gyro[own], samples.accel[own], rows)

    def _plan(self, events: Events) -> Iterator[_Window]:
        """Yield the coasting windows, without the fixes that the gate rejects."""
        samples = self.samples
        output, _ = self.filter(np.zeros(4)).process_arrays(
            samples.time, samples.gyro, samples.accel, self.events
        )
        merged = events.merge(output)
        rows = pack_fixes(self.fixes)
        velocity_time = self.fixes.velocity_time
        times = self.fixes.time, self.fixes.time if velocity_time is None else velocity_time
        good = [merged["nis"][:, kind] <= _gate(self.options) for kind in range(2)]
        singles = [_single(rows, times[kind], good[kind], kind) for kind in range(2)]
        began = np.flatnonzero(merged["verdict"] == 0)
        if not began.size or not len(samples.time):
            return
        taken = np.sort(merged["taken"][np.isfinite(merged["taken"])])
        begin = float(merged["taken"][began[0]])
        while True:
            at = np.searchsorted(taken, begin)
            if at >= len(taken):
                return
            first = int(np.searchsorted(samples.time, taken[at])) + 1
            begin = float(taken[at])
            probes = list(self._probes(singles, begin))
            if probes:
                yield _Window(first, tuple(sorted(probes, key=lambda probe: probe.sample)))
            begin += COAST_S[-1] + 1e-6

    def _probes(self, singles: list[Floats], begin: float) -> Iterator[_Probe]:
        time = self.samples.time
        for kind, rows in enumerate(singles):
            for length, seconds in enumerate(COAST_S):
                k = int(np.searchsorted(rows[:, 0], begin + seconds - 1e-6))
                if k == len(rows) or rows[k, 0] > begin + seconds + _MAX_WAIT_S:
                    break
                sample = int(np.searchsorted(time, rows[k, 0]))
                if sample >= len(time):
                    break
                yield _Probe(kind, length, sample, rows[k : k + 1])


def _gate(options: dict[str, Any]) -> float:
    return float(options.get("gate", 50.0))


def _single(rows: Floats, time: Floats, good: Floats, kind: int) -> Floats:
    """Return the rows of good fixes in time order, with positions only or velocities only."""
    own = rows.copy()
    own[:, 0] = time
    own[:, 4:7] = np.nan if kind == 0 else own[:, 4:7]
    own[:, 1:4] = np.nan if kind == 1 else own[:, 1:4]
    own = own[good]
    ordered: Floats = own[np.argsort(own[:, 0], kind="stable")]
    return ordered


def _scale(sensor: str, model: Noise | None, white: float, walk: float) -> Noise:
    if model is None or isinstance(model, NoiseModel):
        return _scale_axis(sensor, model, white, walk)
    return tuple(_scale_axis(sensor, axis, white, walk) for axis in model)


def _scale_axis(sensor: str, model: NoiseModel | None, white: float, walk: float) -> NoiseModel:
    usual_white, usual_walk, quantity = _USUAL[sensor]
    own = (usual_white, usual_walk) if model is None else model.__noise_densities__(sensor)
    return NoiseModel(
        angle_random_walk=white * own[0],
        rate_random_walk=walk * (usual_walk if own[1] is None else own[1]),
        quantity=quantity,
    )


def _search(coasting: _Coasting, every: _Coasting | None, is_assumed: bool) -> FoundNoise:
    """Return the best factors: first white noise and random walks, then the vibration."""
    theta = np.zeros(4)
    first = coasting.run(theta)
    kept = FoundNoise(
        coasting.models["gyro"], coasting.models["accel"], (1.0, 1.0, 1.0), 0.0,
        first.count, first.ratios(), first.ratios(),
    )  # fmt: skip
    if first.count < _MIN_BLOCKS:
        few = f"there are {first.count} positions and velocities to compare, under {_MIN_BLOCKS}"
        return replace(kept, reason=few)
    least = coasting.score(theta)
    raised = _climb(coasting, theta, _UP)
    if coasting.score(raised) - least >= _MIN_GAINS[not is_assumed]:
        theta = raised
    if is_assumed:
        lowered = _climb(coasting, theta, _DOWN)
        if coasting.score(lowered) - coasting.score(theta) >= _MIN_GAIN_DOWN:
            theta = lowered
    if theta[0] > 0.0 and every is not None:
        shaken = _find_vibration(every, theta, is_assumed)
        if shaken[3] > 0.0:
            coasting, theta = every, shaken
    if theta.any():
        theta = _level(coasting, theta)
    gain, best = coasting.score(theta) - coasting.score(np.zeros(4)), coasting.run(theta)
    if best.rejected_share > _MAX_REJECTED_SHARE:
        share = f"{best.rejected_share:.0%} of the fixes are rejected, too many to fit a noise"
        return replace(kept, reason=share)
    if not theta.any():
        return replace(kept, reason="no other noise fits the errors without fixes clearly better")
    gyro, accel, walk = np.exp(0.5 * theta[:3]).tolist()
    models = coasting.noise(theta)
    return FoundNoise(
        models["gyro"], models["accel"], (gyro, accel, walk), gain,
        first.count, first.ratios(), best.ratios(), "", _vibration(theta),
    )  # fmt: skip


def _find_vibration(every: _Coasting, theta: Floats, is_assumed: bool) -> Floats:
    """Return the log factors with vibration in place of some or all added gyro noise.

    The gyro noise is not lowered below its start value. Ten seconds of coasting show the noise of
    the vibrating axes, but hardly the noise about down.
    """
    up, down = _UP.copy(), _DOWN.copy()
    up[3] = down[3] = _VIBRATION
    down[0, 0] = 0.0
    coarse = _STEPS_LOG[:2]
    shaken = _climb(every, np.maximum(theta, [0.0, 0.0, _LEAST, 0.0]), up, coarse)
    if every.score(shaken) - every.score(theta) < _MIN_GAINS[not is_assumed]:
        return theta
    if not is_assumed:
        return shaken
    lowered = _climb(every, shaken, down, coarse)
    enough = every.score(lowered) - every.score(shaken) >= _MIN_GAIN_DOWN
    return lowered if enough else shaken


def _vibration(theta: Floats) -> float:
    return min(1.0, _USUAL_VIBRATION * math.sqrt(math.expm1(theta[3])))


def _level(coasting: _Coasting, theta: Floats) -> Floats:
    """Return the log factors after raising the white noise to the RMS of the longer coasts.

    The heavy-tailed likelihood gives large errors little weight, but the standard deviation must
    include them.
    """
    level = float(np.nanmean(coasting.run(theta).ratios()[1:] ** 2))
    if not level > 1.0:
        return theta
    raised = theta.copy()
    raised[:2] = np.minimum(theta[:2] + math.log(min(level, _MAX_LEVEL)), _UP[:2, 1])
    return raised if math.isfinite(coasting.score(raised)) else theta


def _climb(
    coasting: _Coasting, theta: Floats, ranges: Floats, steps: Sequence[float] = _STEPS_LOG
) -> Floats:
    """Return the log factors with the highest likelihood, by steps along one factor at a time."""
    best = coasting.score(theta)
    for step in steps:
        moved = True
        while moved:
            moved = False
            for axis, sign in ((k, sign) for k in range(4) for sign in (1.0, -1.0)):
                while True:
                    new = theta.copy()
                    new[axis] = np.clip(theta[axis] + sign * step, *ranges[axis])
                    if new[axis] == theta[axis] or not (score := coasting.score(new)) > best:
                        break
                    theta, best, moved = new, score, True
    return theta
