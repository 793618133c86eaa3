from collections.abc import Callable, Sequence
from types import GenericAlias
from typing import (
    Any,
    Final,
    Generic,
    Literal,
    Required,
    Self,
    SupportsFloat,
    SupportsIndex,
    TypeAlias,
    TypedDict,
    final,
    overload,
)

import numpy as np
import numpy.typing as npt
from typing_extensions import TypeVar

from zerorate.calibration.calibration import Calibration
from zerorate.io import Recording
from zerorate.linear.run import LinearRun
from zerorate.navigation.alignment import Alignment
from zerorate.navigation.fixes import Fixes
from zerorate.navigation.track import Track
from zerorate.noise import NoiseModel

_Method: TypeAlias = Literal["kf", "akf", "fading", "robust", "auto"]
_Status: TypeAlias = Literal[
    "starting",
    "starting anew",
    "at rest",
    "provisional",
    "in motion",
    "no rest yet",
    "stuck",
]
_Navigating: TypeAlias = Literal["waiting", "no heading", "navigating", "coasting", "missing"]
_Zones: TypeAlias = tuple[float, float] | Literal["published"]
_Motion: TypeAlias = Literal["hold", "ignore"]
_Output: TypeAlias = Literal["compensated", "estimate"]
_Noise: TypeAlias = Literal["allan", "hadamard"]
_Wavelet: TypeAlias = Literal["haar", "db2", "db4", "db8"]
_Shrinking: TypeAlias = Literal["soft", "hard"]
_Outliers: TypeAlias = Literal["keep", "reject"]
_Frame: TypeAlias = Literal["enu", "ned", "nwu"]
_AttitudeMethod: TypeAlias = Literal["auto", "complementary", "mahony", "madgwick", "ekf", "ukf"]
_AttitudeStatus: TypeAlias = Literal[
    "starting", "rate missing", "wrong unit", "disturbed", "at rest", "moving"
]
_PositionMethod: TypeAlias = Literal["aided", "moving_average", "kalman", "heading", "strength"]
_Sample: TypeAlias = SupportsFloat | SupportsIndex | npt.ArrayLike | None
_Floats: TypeAlias = npt.NDArray[np.float64]
_Counts: TypeAlias = npt.NDArray[np.int64]
_Flags: TypeAlias = npt.NDArray[np.bool_]

# What a single signal gives, float and bool, or what channels do, arrays; any of both where an
# annotation does not say.
_Number = TypeVar("_Number", default=Any)
_Flag = TypeVar("_Flag", default=Any)
# An array, or two for gyro and accelerometer.
_Corrected = TypeVar("_Corrected", default=Any)

class _AttitudeTrace(TypedDict):
    quaternion: _Floats
    bias: _Floats
    bias_sigma: _Floats
    gyro_matrix: _Floats
    gyro_matrix_sigma: _Floats
    tilt_sigma: _Floats
    heading_sigma: _Floats
    linear_acceleration: _Floats
    at_rest: _Flags
    disturbed: _Flags

class _ArrayTrace(TypedDict):
    rate: _Floats
    bias: _Floats
    weights: _Floats
    used: _Flags
    excluded: _Flags
    disputed: _Flags
    at_rest: _Flags

class _PositionTrace(TypedDict):
    position: _Floats
    sigma: _Floats
    velocity: _Floats
    receiver_error: _Floats
    missing: _Flags
    held: _Flags

class _TemperatureCurve(TypedDict):
    reference: float
    range: Sequence[float]
    coefficients: npt.ArrayLike

__all__ = [
    "AllanNoise",
    "Attitude",
    "DriftFilter",
    "GyroArray",
    "ImuCorrector",
    "LinearKalman",
    "MotionDetector",
    "NavigationFilter",
    "NavigationRecord",
    "PositionFilter",
    "RecursiveLeastSquares",
    "ReplayScores",
    "RestDetector",
    "StreamingAllan",
    "TemperatureFilter",
    "Tilt",
    "Trace",
    "WaveletDenoiser",
    "__version__",
    "allan_deviations",
    "arma_fit",
    "arma_grid",
    "arma_likelihood",
    "arma_residuals",
    "attitude_options",
    "autoregression_variances",
    "check_field",
    "check_fit",
    "check_gyro",
    "check_ticks",
    "chi_squared_quantile",
    "chi_squared_survival",
    "denoise",
    "exponential_mean",
    "filter_options",
    "fit_autoregression",
    "integrate_rates",
    "lagged_products",
    "log_normal_cdf",
    "longest_factor",
    "position_options",
    "propagate_turns",
    "register",
    "reversals",
    "smooth_linear",
    "tilt_options",
    "wavelet_decomposition",
    "without_outliers",
]

__version__: Final[str]

class _FilterOptions(TypedDict, total=False):
    """Options of a filter whose method and output are given apart."""

    order: tuple[int, int]
    fading: float
    adapt_for: float | None
    forgetting_factor: float
    motion: _Motion | None
    limit: float | None
    rest_limit: float | None
    bias_limit: float | None
    outliers: _Outliers
    process_noise: float
    process_noise_memory: float
    noise: _Noise
    startup: float
    scale: float | None
    zones: _Zones
    damping: float
    correction: float

class _StreamOptions(_FilterOptions, total=False):
    """All options of a filter."""

    method: _Method
    output: _Output

class _Params(_StreamOptions, total=False):
    rate: Required[float]
    channels: Required[int | None]

class _Option(TypedDict):
    name: str
    kind: Literal["order", "number", "seconds", "seconds or always", "choice", "pair or word"]
    default: float | str | tuple[int, int] | tuple[float, float] | None
    unit: str
    expected: str
    choices: list[str]
    meaning: str
    methods: list[str]

class _Start(TypedDict):
    offset: float | _Floats
    scale: float | _Floats
    coefficients: _Floats
    covariance: _Floats
    measurement_noise: float | _Floats
    process_noise: float | _Floats
    state_covariance: _Floats

@final
class DriftFilter(Generic[_Number, _Flag]):
    """Bias of a gyro, learned and removed sample by sample, for one or more axes.

    Not sure? ``DriftFilter(rate)``: it needs no tuning. It finds rest and motion by itself, learns
    the bias at rest, holds it in motion, and returns each sample minus the bias. It removes the
    slowly changing bias and does not smooth: the noise of the samples stays.

    The other methods are for research. ``"kf"``, ``"akf"`` and ``"fading"`` are those of Fu & Han 2019
    (equations 8 to 31), ``"robust"`` is that of Wu & Ran 2021. Unless ``motion="hold"`` they take
    every sample for rest: they follow motion, and the compensated rate lacks it. Their
    ``process_noise`` has to suit the sensor.

    Samples and results are in one unit, whichever it is. In the first second the bias is the mean so
    far, so keep the sensor still. Without ``rest_limit`` a motion that lasts from the very start can
    be taken for rest, and so for bias; ``status`` is ``"provisional"`` as long as that may be so. A
    sample that is not finite (or ``update(None)``) is missing. One filter serves one thread at a
    time.

    Parameters
    ----------
    rate : float
        Samples a second.
    method : {"auto", "kf", "akf", "fading", "robust"}, default "auto"
        ``"auto"`` tunes itself. ``"kf"`` is a Kalman filter of an ARMA model; ``"akf"`` also adapts
        the measurement noise R with equal weights; ``"fading"`` adapts R with fading memory, and the
        process noise G. ``"robust"`` is ``"akf"`` with zones that leave outliers out.
    channels : int, optional
        Number k of axes side by side; None is a single one. With it ``update`` takes k samples, and
        what is read has k values.
    output : {"compensated", "estimate"}, default "compensated"
        What ``update`` and ``process`` return: the sample minus ``bias``, which has no delay (NaN for
        a missing sample), or the estimate of the bias itself.
    motion : {"hold", "ignore"}, optional
        ``"hold"`` learns at rest only, as a ``RestDetector`` sees it, and takes back what came just
        before a motion was seen (half a second, for ``"auto"`` up to two); ``"ignore"`` takes every
        sample for rest. Default: ``"hold"`` for ``"auto"``, ``"ignore"`` for the others.
    limit : float, optional
        End of the sensor's range, in the samples' unit: a sample of this size or beyond is saturated,
        and missing.

    Other Parameters
    ----------------
    rest_limit : float, optional
        Only ``"auto"``: deviation of the samples within a quarter second, and spread of the means of
        six of these, above which a sensor of this kind cannot be at rest, in the samples' unit;
        3 deg/s suits MEMS gyros. A record may then begin in motion: nothing is learned, and 0 is the
        bias, until the sensor has been still for 2.25 s. Without it the start is taken for rest if it
        looks like noise, ``status`` is ``"provisional"`` until something louder or a minute of
        stillness has been seen, and ``bias_sigma`` is as large as the samples until then.
    bias_limit : float, optional
        Only ``"auto"``: level that is never taken for a bias, in the samples' unit; 20 deg/s suits
        MEMS gyros. A sensor that turns at one rate looks like one at rest.
    order : (int, int), default (2, 1), of ``"robust"`` (1, 0)
        All but ``"auto"``: orders p from 1 to 3 and q from 0 to 3 of the ARMA model of the drift;
        (p, 0) is AR(p).
    process_noise : float, default 0.1
        All but ``"auto"``: process noise G and covariance P at the start, in variances of the
        start-up. Small smooths and is late (1e-6), large follows the signal (1).
    fading : float, default 0.97
        Only ``"fading"``: memory b of R in (0, 1]. Small follows changes of the noise quickly, large
        averages (Fu & Han: 0.95 to 0.99 for an MTi-100, 0.90 to 0.95 for a 3DM-GX4-25).
    process_noise_memory : float, default 0.0
        Only ``"fading"``: samples that the process noise of the start counts for in addition to those
        seen: large keeps it longer.
    noise : {"allan", "hadamard"}, default "allan"
        All but ``"auto"``: variance that R is taken from; ``"hadamard"`` ignores a constant angular
        acceleration.
    outliers : {"keep", "reject"}, default "keep"
        Only ``"kf"``, ``"akf"`` and ``"fading"``: ``"reject"`` keeps from them what ``"auto"`` always
        does, samples more than four deviations from the level of the last quarter seconds, unless
        there are so many of these, or so many in a row, that the sensor moves.
    adapt_for : float or None, default 120.0
        All but ``"auto"``: seconds after the start-up during which the model is learned; None is
        always.
    forgetting_factor : float, default 1.0
        All but ``"auto"``: λ of the model's least squares in (0, 1]. Small forgets old samples
        quickly, 1 never forgets.
    zones : (float, float) or "published", default (4.0, 0.75)
        Only ``"robust"``: (kappa, beta). An innovation beyond kappa deviations of the accepted ones
        is an outlier, unless so many of one sign follow each other (0.03 s, at least three) that
        they are a step; one beyond beta of that is bounded. Large kappa lets outliers through,
        small leaves good samples out. ``"published"`` holds a variance against an innovation, as
        printed: it depends on the unit of the samples, and nothing ends a row of outliers.
    damping : float, default 0.0
        Only ``"robust"``: the part of the gain, from 0 to 1, that is left to an outlier.
    correction : float, default 0.0
        Only ``"robust"``: the part, from 0 to 1, of an innovation between the zones that moves the
        prediction; 0 bounds such an innovation instead, and is better.
    startup : float, default 1.0
        All methods, rarely needed: seconds from which offset, scale and first noise are learned (at
        least ten samples, and until two samples differ).
    scale : float, optional
        All methods, rarely needed: deviation of the noise in the samples' unit where it is known;
        else it is learned.

    Raises
    ------
    ValueError
        A parameter is out of range, or the method does not use it.

    Examples
    --------
    Two minutes of a gyro at rest, in deg/s:

    >>> import numpy as np, zerorate as zr
    >>> z = 0.5 + 0.1 * np.random.default_rng(1).standard_normal(12_000)
    >>> gyro = zr.DriftFilter(rate=100.0)
    >>> rate = gyro.process(z)  # z minus the bias as known at each sample
    >>> gyro.status, round(gyro.bias, 2), gyro.bias_sigma < 0.01
    ('at rest', 0.5, True)
    """

    @overload
    def __new__(
        cls,
        rate: float,
        *,
        method: _Method = "auto",
        channels: None = None,
        output: _Output = "compensated",
        motion: _Motion | None = None,
        limit: float | None = None,
        rest_limit: float | None = None,
        bias_limit: float | None = None,
        order: tuple[int, int] = (2, 1),
        process_noise: float = 0.1,
        fading: float = 0.97,
        process_noise_memory: float = 0.0,
        noise: _Noise = "allan",
        outliers: _Outliers = "keep",
        adapt_for: float | None = 120.0,
        forgetting_factor: float = 1.0,
        zones: _Zones = (4.0, 0.75),
        damping: float = 0.0,
        correction: float = 0.0,
        startup: float = 1.0,
        scale: float | None = None,
    ) -> DriftFilter[float, bool]: ...
    @overload
    def __new__(
        cls,
        rate: float,
        *,
        method: _Method = "auto",
        channels: int,
        output: _Output = "compensated",
        motion: _Motion | None = None,
        limit: float | None = None,
        rest_limit: float | None = None,
        bias_limit: float | None = None,
        order: tuple[int, int] = (2, 1),
        process_noise: float = 0.1,
        fading: float = 0.97,
        process_noise_memory: float = 0.0,
        noise: _Noise = "allan",
        outliers: _Outliers = "keep",
        adapt_for: float | None = 120.0,
        forgetting_factor: float = 1.0,
        zones: _Zones = (4.0, 0.75),
        damping: float = 0.0,
        correction: float = 0.0,
        startup: float = 1.0,
        scale: float | None = None,
    ) -> DriftFilter[_Floats, _Flags]: ...
    @staticmethod
    def started(start: _Start, **params: Any) -> DriftFilter:
        """A filter that is ready at its first sample because its signal is known already.

        ``ArmaModel.to_filter`` makes such filters from a record. R and the weight of Sage-Husa
        stand as if ``startup`` seconds had been spent; ``process_noise`` and ``scale`` of the
        parameters are not used. The method is always asked for by name: ``"auto"`` learns its own
        start.

        Parameters
        ----------
        start : dict
            With channels every array has a first axis (k,). ``offset`` and ``scale``, the mean and
            deviation of the signal; ``coefficients`` [φ…, θ…, c], (p + q + 1,); ``covariance`` of
            [φ…, θ…, c / scale] over the noise variance, samples being centred and scaled,
            (p + q + 1, p + q + 1); variances ``measurement_noise`` R and ``process_noise`` G₀₀;
            ``state_covariance`` P before the first sample, (p + 1, p + 1).
        **params
            Those of ``DriftFilter``, with a ``method`` among ``"kf"``, ``"akf"``, ``"fading"`` and
            ``"robust"``.

        Raises
        ------
        ValueError
            A parameter or a part of the start is missing, of another shape, or out of range.
        TypeError
            A part of the start does not hold numbers.
        """
    def update(self, z: _Sample, moving: bool = False) -> _Number:
        """Takes one sample and returns what ``output`` says at once, the compensated rate unless
        asked otherwise: float to float, with channels (k,) to (k,), in the unit of the sample.

        None or NaN is a missing sample: NaN is returned, or the estimate. ``moving`` says that the body
        is known to move, as a ``MotionDetector`` tells from its accelerometer: what the gyro gives is
        then no bias, however still it stands.
        """
    def process(
        self,
        z: npt.ArrayLike,
        out: _Floats | None = None,
        threads: int | None = None,
        moving: npt.ArrayLike | None = None,
    ) -> _Floats:
        """Filters a batch, equal to the last bit to ``update`` sample by sample.

        Parameters
        ----------
        z : array_like, shape (n,), with channels (n, k)
            Samples; those not finite are missing. A float64 array in C order is read where it
            stands: do not write into it from another thread meanwhile.
        out : ndarray, optional
            A float64 array of the same shape for the result; may be ``z`` itself.
        threads : int, optional
            Threads over which several channels may be spread: as far as they do not share a vector
            register, and as it pays. The result does not depend on it.
        moving : array_like of bool, shape (n,), optional
            Where the body is known to move, as a ``MotionDetector`` tells from its accelerometer; one
            thread does it then. Only with a filter that holds in motion.

        Returns
        -------
        ndarray, float64, shape of ``z``
            What ``output`` says, the compensated rate unless asked otherwise, in the unit of ``z``.
            The interpreter lock is released meanwhile.
        """
    def _replay(
        self,
        z: _Floats,
        out: _Floats,
        noted: tuple[_Floats, _Flags, _Flags] | None = None,
        moving: npt.ArrayLike | None = None,
    ) -> None: ...
    def trace(self, z: npt.ArrayLike, moving: npt.ArrayLike | None = None) -> Trace:
        """Like ``process``, but returns a ``Trace`` of all that the filter knew after each sample."""
    def reset(self) -> None:
        """Back to before the first sample, with the same parameters."""
    def power_on(self) -> None:
        """Forgets the bias, but not what was learned about the noise: for a sensor that was switched
        off and on, whose bias is another one and whose noise is not.

        Raises
        ------
        ValueError
            The method is not ``"auto"``.
        """
    def copy(self) -> Self:
        """An independent object in the same state."""
    def to_bytes(self) -> bytes:
        """Parameters and state as bytes, with versions and a checksum."""
    @staticmethod
    def from_bytes(b: bytes) -> DriftFilter:
        """The object that ``to_bytes`` saved, which goes on equal to the last bit; ValueError
        if the bytes are not one.
        """
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def estimate(self) -> _Number:
        """Estimate after the last sample, in the samples' unit: float, with channels (k,). What ``update``
        returns with ``output="estimate"``; for ``"auto"`` it is ``bias``.
        """
    @property
    def angle_random_walk(self) -> _Number:
        """Density of the white noise as learned, unit of the samples over root Hz: float, with channels
        (k,). For ``"auto"`` of noise slower than a quarter second, for the others from R. NaN until
        it is known.
        """
    @property
    def rate_random_walk(self) -> _Number:
        """How far the bias walks in a root second as learned by ``"auto"``, unit of the samples: float,
        with channels (k,). NaN until it is known, and for the other methods.
        """
    @property
    def bias(self) -> _Number:
        """What the compensated rate is free of, in the samples' unit: float, with channels (k,). Learned
        at rest and held in motion; in the first second the mean so far, 0 before the first sample.
        """
    @property
    def bias_sigma(self) -> _Number:
        """Standard deviation of the bias as the filter sees it, in the samples' unit: float, with
        channels (k,). Of ``"auto"`` as large as the samples while little is known; 0 before the first
        sample, when nothing is.
        """
    @property
    def at_rest(self) -> _Flag:
        """The filter learns, since the sensor is not seen to move: bool, with channels (k,). True from
        the first sample on unless ``rest_limit`` is given, since the start is taken for rest until
        motion is seen (``status`` tells), and always with ``motion="ignore"``.
        """
    @property
    def saturated(self) -> _Flag:
        """The last sample was at or beyond ``limit``: bool, with channels (k,)."""
    @property
    def stuck(self) -> _Flag:
        """The sensor gives the same sample for longer than chance does: bool, with channels (k,)."""
    @property
    def status(self) -> _Status | list[_Status]:
        """What the filter is doing, with channels a list of k: ``"starting"`` (the bias is the mean so
        far), ``"at rest"`` (it learns), ``"provisional"`` (it learns from what looks like rest but may
        be motion, since nothing louder has been seen yet), ``"in motion"`` (it holds the bias),
        ``"no rest yet"`` (the sensor moved before anything was learned; the bias is 0), ``"starting
        anew"`` (the noise learned at the start proved wrong by many orders) or ``"stuck"`` (the
        sensor gives the same sample for longer than chance does; it holds the bias).
        """
    @property
    def innovation(self) -> _Number:
        """The last sample minus its prediction, in the samples' unit, zero if it was missing: float, with
        channels (k,).
        """
    @property
    def innovation_variance(self) -> _Number:
        """Variance that the filter expected of the innovation, samples' unit squared: float, with
        channels (k,).
        """
    @property
    def measurement_noise(self) -> _Number:
        """Measurement noise variance R, samples' unit squared: float, with channels (k,). For ``"auto"``
        the variance of a sample about the bias.
        """
    @property
    def gain(self) -> _Floats:
        """Kalman gain: (p + 1,), with channels (k, p + 1). For ``"auto"``, whose state is the bias alone,
        p is 0.
        """
    @property
    def process_noise(self) -> _Floats:
        """Process noise covariance G of a sample, samples' unit squared: (p + 1, p + 1), with channels
        (k, p + 1, p + 1). For ``"auto"`` (1, 1): variance of the bias's random step from one sample to the next.
        """
    @property
    def coefficients(self) -> _Floats:
        """Model ``[φ…, θ…, c]``, c in the samples' unit: (p + q + 1,), with channels (k, p + q + 1). For
        ``"auto"``, which has no ARMA model, [1].
        """
    @property
    def covariance(self) -> _Floats:
        """State covariance P, samples' unit squared: (p + 1, p + 1), with channels (k, p + 1, p + 1).
        For ``"auto"`` (1, 1).
        """
    @property
    def samples_seen(self) -> int:
        """Samples given so far, missing ones included."""
    @property
    def guard_count(self) -> int | _Counts:
        """How often a step of the process noise was shortened to keep it positive semidefinite: int,
        with channels (k,).
        """
    @property
    def exit_count(self) -> int | _Counts:
        """How often so many outliers of ``"robust"`` followed each other that they were taken for a
        step of the signal: int, with channels (k,).
        """
    @property
    def restart_count(self) -> int | _Counts:
        """How often the scale learned at the start was proved wrong by many orders, upon which noise
        and drift were learned anew: int, with channels (k,).
        """
    @property
    def saturated_count(self) -> int | _Counts:
        """Samples at or beyond ``limit`` so far: int, with channels (k,)."""
    @property
    def outlier_count(self) -> int | _Counts:
        """Samples so far that were left out as outliers, counted a quarter second at a time, by
        ``"robust"`` at once: int, with channels (k,). Zero for a published method that looks for none.
        """
    @property
    def stuck_count(self) -> int | _Counts:
        """Samples so far that a stuck sensor gave, counted a quarter second at a time: int, with channels
        (k,). Zero for a published method that neither rejects outliers nor holds in motion.
        """
    @property
    def ready(self) -> _Flag:
        """The start-up is over: bool, with channels (k,)."""
    @property
    def channels(self) -> int | None:
        """Number of signals, None for a single one."""
    @property
    def rate(self) -> float:
        """Samples a second."""
    @property
    def order(self) -> tuple[int, int] | None:
        """Orders (p, q) of the model; None for ``"auto"``, which has no ARMA model."""
    @property
    def method(self) -> _Method:
        """``"kf"``, ``"akf"``, ``"fading"``, ``"robust"`` or ``"auto"``."""
    @property
    def start(self) -> _Start | None:
        """What ``DriftFilter.started`` was given, None for a filter that learns it from its start-up."""
    @property
    def params(self) -> _Params:
        """Every argument that makes such a filter anew: ``DriftFilter(**f.params)``, or
        ``DriftFilter.started(f.start, **f.params)`` for one that was started.
        """

@final
class ReplayScores:
    """Measures of k axes while a replay passes: of the raw samples and of each estimate of their
    drift.

    Blocks have a row an axis. However a record is cut into them, the measures are the same.

    Parameters
    ----------
    axes, estimates : int
    horizons : sequence of int
        Of the coasting errors, in samples.
    delay : int, optional
        Samples to leave out before each motion, where rest matters; None measures all samples.
    """

    def __new__(
        cls, axes: int, estimates: int, horizons: Sequence[int], delay: int | None = None
    ) -> Self: ...
    def take(
        self,
        raw: _Floats,
        estimates: Sequence[_Floats],
        at_rest: _Flags | None = None,
        truth: _Floats | None = None,
    ) -> None:
        """Takes a block of samples (k, n), the estimates of each method, where the filter learned, and
        the true drift if it is known; the interpreter lock is released.
        """
    def finish(self) -> dict[str, npt.NDArray[Any]]:
        """Ends the record and returns arrays by name: `mean`, `deviation` and `error`, (k, m + 1), the
        raw samples first, `coasting`, (k, m + 1, horizons), unit times samples; of all samples
        `missing`, `present` and `at_rest`, counts, `least` and `most`, (k,).
        """

@final
class Trace:
    """What a filter knew after each of n samples; with k channels every array has a second axis k.

    Attributes
    ----------
    estimate : ndarray, float64, (n,)
        Estimate of the filter, in the unit of the samples; of "auto" the bias.
    innovation : ndarray, float64, (n,)
        Sample minus prediction; zero where the sample is missing.
    innovation_variance : ndarray, float64, (n,)
        Variance S that the filter expected of the innovation.
    gain : ndarray, float64, (n, p + 1)
        Kalman gain; zero where the sample is missing. The state of "auto" is the drift alone: 1 in
        place of p + 1, and of p + q + 1 below.
    measurement_noise : ndarray, float64, (n,)
        Variance R.
    process_noise : ndarray, float64, (n, p + 1, p + 1)
        Covariance G.
    coefficients : ndarray, float64, (n, p + q + 1)
        Model [φ…, θ…, c].
    covariance : ndarray, float64, (n, p + 1, p + 1)
        State covariance P.
    missing : ndarray, bool, (n,)
        The sample was not finite.
    guarded : ndarray, bool, (n,)
        The step of the process noise was shortened to keep it positive semidefinite; of "robust":
        the sample was taken for an outlier.
    bias : ndarray, float64, (n,)
        Bias learned at rest and held in motion, in the unit of the samples.
    bias_sigma : ndarray, float64, (n,)
        Its standard deviation as the filter sees it.
    at_rest : ndarray, bool, (n,)
        The filter learned; always true with ``motion="ignore"``.
    saturated : ndarray, bool, (n,)
        The sample was at or beyond ``limit``.
    stuck : ndarray, bool, (n,)
        The sensor gives the same sample for longer than chance does.
    """

    def __len__(self) -> int: ...
    @property
    def estimate(self) -> _Floats: ...
    @property
    def innovation(self) -> _Floats: ...
    @property
    def innovation_variance(self) -> _Floats: ...
    @property
    def gain(self) -> _Floats: ...
    @property
    def measurement_noise(self) -> _Floats: ...
    @property
    def process_noise(self) -> _Floats: ...
    @property
    def coefficients(self) -> _Floats: ...
    @property
    def covariance(self) -> _Floats: ...
    @property
    def missing(self) -> _Flags: ...
    @property
    def guarded(self) -> _Flags: ...
    @property
    def bias(self) -> _Floats: ...
    @property
    def bias_sigma(self) -> _Floats: ...
    @property
    def at_rest(self) -> _Flags: ...
    @property
    def saturated(self) -> _Flags: ...
    @property
    def stuck(self) -> _Flags: ...

@final
class MotionDetector(Generic[_Flag]):
    """Whether a body moves, told from its accelerometer alone while samples arrive.

    A gyro that turns slowly at one rate gives what one with a bias gives at rest. In the axes of a
    body that turns, gravity turns as well, unless it turns about the vertical. Means of 1, 2, 4, …, 64
    ticks of a quarter second are compared with the ones before: where they differ by more than the
    samples' noise explains, and by more than gravity turned by 0.4 degrees, the body moves. A turn of
    0.4 deg/s about a level axis is seen within 2 s, one of 0.05 deg/s after half a minute. Motion is
    over when none has been seen for half as long again as it took to see, and, for a minute at most,
    when the samples are about as quiet as before it. True says that the body moves, False that nothing
    is known.

    Nothing depends on the unit, nor on the axes. A sample of which an axis is not finite is a missing
    one. One object serves one thread at a time.

    Parameters
    ----------
    rate : float
        Samples a second.
    channels : int, optional
        Number of accelerometers side by side; ``None`` is a single one.

    Raises
    ------
    ValueError
        A parameter is out of range.

    Examples
    --------
    A minute of rest, then one in which a body turns at 2 deg/s about a level axis:

    >>> import numpy as np, zerorate as zr
    >>> rng, t = np.random.default_rng(1), np.arange(12_000) / 100.0
    >>> angle = np.radians(2.0) * np.maximum(t - 60.0, 0.0)
    >>> accel = 9.81 * np.stack((np.zeros_like(t), np.sin(angle), np.cos(angle)), axis=1)
    >>> accel += 0.03 * rng.standard_normal(accel.shape)
    >>> gyro = 0.3 + 2.0 * (t > 60.0) + 0.1 * rng.standard_normal(12_000)
    >>> moving = zr.noise.MotionDetector(rate=100.0).process(accel)
    >>> bool(moving[:6000].any()), float(moving[6200:].mean()) > 0.9
    (False, True)

    What it knows keeps a turn from being learned as a bias:

    >>> plain, told = zr.DriftFilter(rate=100.0), zr.DriftFilter(rate=100.0)
    >>> _, _ = plain.process(gyro), told.process(gyro, moving=moving)
    >>> round(plain.bias, 1), round(told.bias, 1)
    (2.3, 0.3)
    """

    @overload
    def __new__(cls, rate: float, *, channels: None = None) -> MotionDetector[bool]: ...
    @overload
    def __new__(cls, rate: float, *, channels: int) -> MotionDetector[_Flags]: ...
    def update(self, z: npt.ArrayLike) -> _Flag:
        """Takes one sample of the accelerometer, returns whether the body moves: (3,) to bool,
        with channels (k, 3) to (k,).
        """
    def process(
        self, z: npt.ArrayLike, out: _Flags | None = None, threads: int | None = None
    ) -> _Flags:
        """Whether the body moves after each sample of a batch: (n, 3) to (n,), with channels
        (n, k, 3) to (n, k), bool; the interpreter lock is released.
        """
    def reset(self) -> None:
        """Back to before the first sample, with the same parameters."""
    def copy(self) -> Self:
        """An independent object in the same state."""
    def to_bytes(self) -> bytes:
        """Parameters and state as bytes, with versions and a checksum."""
    @staticmethod
    def from_bytes(b: bytes) -> MotionDetector:
        """The object that ``to_bytes`` saved, which goes on equal to the last bit; ValueError
        if the bytes are not one.
        """
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def moving(self) -> _Flag:
        """Whether the body is known to move: bool, with channels (k,)."""
    @property
    def rate(self) -> float:
        """Samples a second."""
    @property
    def channels(self) -> int | None:
        """Number of signals, None for a single one."""

@final
class RecursiveLeastSquares(Generic[_Number, _Flag]):
    """ARMA(p, q) model with a constant, learned while samples arrive.

    Recursive extended least squares of ``y[k] = φ y[k-1…] + θ a[k-1…] + c + a[k]`` with
    a-posteriori residuals a (Fu & Han 2019, equations 8 to 13), on samples centred and scaled by
    what a start-up window says. A sample that is not finite (or ``update(None)``) is missing and teaches
    nothing. One object serves one thread at a time.

    Parameters
    ----------
    order : (int, int), default (2, 1)
        Orders p from 1 to 3 and q from 0 to 3; (p, 0) is AR(p).
    forgetting_factor : float, default 1.0
        λ in (0, 1]: small forgets old samples quickly, 1 never forgets. The covariance never grows
        beyond its start.
    channels : int, optional
        Number of signals side by side; None is a single one.
    startup : int, default 100
        Samples from which offset and scale are learned (and until two samples differ).
    scale : float, optional
        Deviation of the signal in its own unit where it is known; else it is learned.

    Raises
    ------
    ValueError
        A parameter is out of range.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> e = np.random.default_rng(1).standard_normal(20_000)
    >>> y = np.zeros_like(e)
    >>> for k in range(1, len(e)):
    ...     y[k] = 0.8 * y[k - 1] + e[k]
    >>> model = zr.identify.RecursiveLeastSquares(order=(1, 0))
    >>> residuals = model.process(y)
    >>> bool(abs(model.coefficients[0] - 0.8) < 0.02)
    True
    """

    @overload
    def __new__(
        cls,
        order: tuple[int, int] = (2, 1),
        forgetting_factor: float = 1.0,
        *,
        channels: None = None,
        startup: int = 100,
        scale: float | None = None,
    ) -> RecursiveLeastSquares[float, bool]: ...
    @overload
    def __new__(
        cls,
        order: tuple[int, int] = (2, 1),
        forgetting_factor: float = 1.0,
        *,
        channels: int,
        startup: int = 100,
        scale: float | None = None,
    ) -> RecursiveLeastSquares[_Floats, _Flags]: ...
    def update(self, z: _Sample) -> _Number:
        """Takes one sample, returns its a-posteriori residual, zero if it is missing: float to
        float, with channels (k,) to (k,).
        """
    def process(
        self, z: npt.ArrayLike, out: _Floats | None = None, threads: int | None = None
    ) -> _Floats:
        """The residual of each sample of a batch: (n,) to (n,), with channels (n, k) to (n, k);
        the interpreter lock is released.
        """
    def reset(self) -> None:
        """Back to before the first sample, with the same parameters."""
    def copy(self) -> Self:
        """An independent object in the same state."""
    def to_bytes(self) -> bytes:
        """Parameters and state as bytes, with versions and a checksum."""
    @staticmethod
    def from_bytes(b: bytes) -> RecursiveLeastSquares:
        """The object that ``to_bytes`` saved, which goes on equal to the last bit; ValueError
        if the bytes are not one.
        """
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def coefficients(self) -> _Floats:
        """Model ``[φ…, θ…, c]``, c in the unit of the samples: (p + q + 1,), with channels
        (k, p + q + 1).
        """
    @property
    def covariance(self) -> _Floats:
        """Covariance of the coefficients of the centred and scaled samples, over the variance of the
        residuals: (p + q + 1, p + q + 1), with channels (k, p + q + 1, p + q + 1).
        """
    @property
    def samples_seen(self) -> int:
        """Samples given so far, missing ones included."""
    @property
    def ready(self) -> _Flag:
        """The start-up is over: bool, with channels (k,)."""
    @property
    def order(self) -> tuple[int, int]:
        """Orders (p, q) of the model."""
    @property
    def channels(self) -> int | None:
        """Number of signals, None for a single one."""

@final
class AllanNoise(Generic[_Number]):
    """Measurement noise variance R while samples arrive, from the Allan variance at the shortest
    averaging time with fading memory.

    ``R = (1 - w) R + w (z[k] - z[k-1])**2 / 2`` with ``1/w = 1 + fading / w_before`` (Fu & Han 2019,
    equations 17, 18 and 26 to 31). One that is not finite is a missing sample; differences across
    it are left out. One object serves one thread at a time.

    Parameters
    ----------
    fading : float, default 0.97
        Memory b in (0, 1]: the weight of a difference falls by this factor a sample. Small follows
        changes quickly, large averages; 1 weighs all alike and equals the Allan variance of the
        whole record.
    noise : {"allan", "hadamard"}, default "allan"
        First differences, or second differences ``(z[k] - 2 z[k-1] + z[k-2])**2 / 6``, which a
        constant angular acceleration leaves alone.
    floor : float, default 0.0
        Smallest variance to return, in the square of the samples' unit. Equal samples, as a coarsely
        quantised gyro at rest gives them, drive R to zero.
    channels : int, optional
        Number of signals side by side; ``None`` is a single one.

    Raises
    ------
    ValueError
        A parameter is out of range.

    Examples
    --------
    >>> import zerorate as zr
    >>> noise = zr.noise.AllanNoise(fading=1.0)
    >>> float(noise.process([1.0, 2.0, 0.0])[-1])  # ((2-1)**2 + (0-2)**2) / 2 / 2
    1.25
    """

    @overload
    def __new__(
        cls,
        fading: float = 0.97,
        noise: _Noise = "allan",
        floor: float = 0.0,
        *,
        channels: None = None,
    ) -> AllanNoise[float]: ...
    @overload
    def __new__(
        cls,
        fading: float = 0.97,
        noise: _Noise = "allan",
        floor: float = 0.0,
        *,
        channels: int,
    ) -> AllanNoise[_Floats]: ...
    def update(self, z: _Sample) -> _Number:
        """Takes one sample, returns R: float to float, with channels (k,) to (k,)."""
    def process(
        self, z: npt.ArrayLike, out: _Floats | None = None, threads: int | None = None
    ) -> _Floats:
        """R after each sample of a batch: (n,) to (n,), with channels (n, k) to (n, k); the
        interpreter lock is released.
        """
    def reset(self) -> None:
        """Back to before the first sample, with the same parameters."""
    def copy(self) -> Self:
        """An independent object in the same state."""
    def to_bytes(self) -> bytes:
        """Parameters and state as bytes, with versions and a checksum."""
    @staticmethod
    def from_bytes(b: bytes) -> AllanNoise:
        """The object that ``to_bytes`` saved, which goes on equal to the last bit; ValueError
        if the bytes are not one.
        """
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def variance(self) -> _Number:
        """R so far, in the square of the samples' unit: float, with channels (k,)."""
    @property
    def channels(self) -> int | None:
        """Number of signals, None for a single one."""

@final
class RestDetector(Generic[_Flag]):
    """Whether a gyro rests, told from its own output alone while samples arrive.

    Samples are put together to ticks of a quarter of a second, four samples at least. How much they
    vary within a tick at rest, and how far the level of a tick lies from averages of 1, 4 and 16 s,
    is learned; a tick beyond what chance does once in a million ends the rest, 1.5 s near the level
    of the last rest begin the next. Nothing depends on the unit, nor on a constant added.

    The start is taken for rest after 1.5 s that look like noise. If that turns out to be wrong within
    10 s, only what has lasted for 10 s is taken for rest. Slow turning at one rate and a bias
    look alike: a new level that stands still is taken for rest after 10 s and about 11 s for each
    deviation of the samples that it lies off, 60 s at most; so is a new noise, such as an engine's.
    What was known before is kept and returned to in 1.5 s. Turning at less than about half of the
    samples' deviation is not noticed, and passes for drift. An accelerometer tells many of these
    from rest: ``MotionDetector``.

    One that is not finite is a missing sample. A channel is judged by itself. One object serves one
    thread at a time.

    Parameters
    ----------
    rate : float
        Samples a second.
    channels : int, optional
        Number of signals side by side; ``None`` is a single one.
    rest_limit : float, optional
        Deviation of the samples within a tick, and spread of the means of six ticks, above which a
        sensor of this kind cannot be at rest, in the samples' unit; 3 deg/s suits MEMS gyros.
    bias_limit : float, optional
        Level above which it cannot, in the samples' unit.

    Raises
    ------
    ValueError
        A parameter is out of range.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> z = np.random.default_rng(1).standard_normal(6000)
    >>> z[3000:4000] += 50.0 * np.sin(np.arange(1000) / 100.0)
    >>> rest = zr.RestDetector(rate=100.0).process(z)
    >>> (np.flatnonzero(np.diff(rest)) + 1).tolist()  # begins at 1.5 s, ends at 30.25, begins at 41.5
    [149, 3024, 4149]
    """

    @overload
    def __new__(
        cls,
        rate: float,
        *,
        channels: None = None,
        rest_limit: float | None = None,
        bias_limit: float | None = None,
    ) -> RestDetector[bool]: ...
    @overload
    def __new__(
        cls,
        rate: float,
        *,
        channels: int,
        rest_limit: float | None = None,
        bias_limit: float | None = None,
    ) -> RestDetector[_Flags]: ...
    def update(self, z: _Sample, moving: bool = False) -> _Flag:
        """Takes one sample, returns whether the sensor rests: float to bool, with channels (k,)
        to (k,). ``moving`` says that the body is known to move, as a ``MotionDetector`` tells.
        """
    def process(
        self,
        z: npt.ArrayLike,
        out: _Flags | None = None,
        threads: int | None = None,
        moving: npt.ArrayLike | None = None,
    ) -> _Flags:
        """Whether the sensor rests after each sample of a batch: (n,) to (n,), with channels
        (n, k) to (n, k), bool; the interpreter lock is released. ``moving``, bool, (n,), is where the
        body is known to move, as a ``MotionDetector`` tells; one thread does it then.
        """
    def reset(self) -> None:
        """Back to before the first sample, with the same parameters."""
    def copy(self) -> Self:
        """An independent object in the same state."""
    def to_bytes(self) -> bytes:
        """Parameters and state as bytes, with versions and a checksum."""
    @staticmethod
    def from_bytes(b: bytes) -> RestDetector:
        """The object that ``to_bytes`` saved, which goes on equal to the last bit; ValueError
        if the bytes are not one.
        """
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def at_rest(self) -> _Flag:
        """Whether the sensor rests: bool, with channels (k,)."""
    @property
    def rate(self) -> float:
        """Samples a second."""
    @property
    def channels(self) -> int | None:
        """Number of signals, None for a single one."""

@final
class StreamingAllan:
    """Allan and Hadamard deviations at all octaves while samples arrive.

    Averaging times are 1, 2, 4, … samples. The estimators are the fully overlapping ones, which take
    a difference at every sample, and equal those of the whole record to rounding. For that the
    object keeps the last three times the longest averaging time: ``16 * 2**octaves`` bytes a channel,
    1 MiB for 16 octaves, however long the record. Estimators that overlap in part only would need a
    few numbers an octave, and be less certain.

    A sample that is not finite (or ``update(None)``) is missing, and every difference that would
    need it is left out. One object serves one thread at a time.

    Differences are taken of 32 samples together, so the work comes with every 32nd sample, bounded
    and without allocation; what is read is always up to date.

    Parameters
    ----------
    rate : float
        Samples a second; it scales ``taus`` alone.
    octaves : int, default 16
        Number of averaging times, from 1 to 24; 16 reach 32768 samples.
    channels : int, optional
        Number of signals side by side; ``None`` is a single one.

    Raises
    ------
    ValueError
        A parameter is out of range.
    MemoryError
        There is no memory for so many octaves and channels.

    Notes
    -----
    The overlapping Allan and Hadamard variances of Riley, *Handbook of Frequency Stability Analysis*,
    NIST SP 1065 (2008), section 5.2, with rates in place of fractional frequencies: mean squares of
    the second and third differences of the phase over ``2 m**2`` and ``6 m**2``. The phase is the
    running sum of distances from the first sample, or the first after a missing one. If the mean of n
    samples lies D off it, rounding is as noise of deviation ``6e-17 * n * D`` on each sample.

    Examples
    --------
    >>> import zerorate as zr
    >>> allan = zr.StreamingAllan(rate=100.0, octaves=2)
    >>> allan.process([1.0, 2.0, 0.0, 1.0])
    >>> allan.taus.tolist(), allan.term_count.tolist()
    ([0.01, 0.02], [3, 1])
    >>> allan.deviation.round(3).tolist()  # of 1, -2, 1; and of the averages 1.5 and 0.5
    [1.0, 0.707]
    """

    def __new__(cls, rate: float, octaves: int = 16, *, channels: int | None = None) -> Self: ...
    def update(self, z: _Sample) -> None:
        """Takes one sample: a float, with channels (k,)."""
    def process(self, z: npt.ArrayLike, threads: int | None = None) -> None:
        """Takes a batch: (n,), with channels (n, k); the interpreter lock is released."""
    def reset(self) -> None:
        """Back to before the first sample, with the same parameters."""
    def copy(self) -> Self:
        """An independent object in the same state."""
    def to_bytes(self) -> bytes:
        """Parameters and state as bytes, with versions and a checksum."""
    @staticmethod
    def from_bytes(b: bytes) -> StreamingAllan:
        """The object that ``to_bytes`` saved, which goes on equal to the last bit; ValueError
        if the bytes are not one.
        """
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def rate(self) -> float:
        """Samples a second."""
    @property
    def octaves(self) -> int:
        """Number of averaging times."""
    @property
    def channels(self) -> int | None:
        """Number of signals, None for a single one."""
    @property
    def samples_seen(self) -> int:
        """Samples given so far, missing ones included."""
    @property
    def taus(self) -> _Floats:
        """Averaging times in seconds: (octaves,)."""
    @property
    def deviation(self) -> _Floats:
        """Allan deviation in the samples' unit, NaN without a term: (octaves,), with channels
        (octaves, k).
        """
    @property
    def hadamard_deviation(self) -> _Floats:
        """Hadamard deviation, as ``deviation``; a constant angular acceleration leaves it alone."""
    @property
    def term_count(self) -> _Counts:
        """Number of differences in each element of ``deviation``, int64."""
    @property
    def hadamard_term_count(self) -> _Counts:
        """Number of differences in each element of ``hadamard_deviation``, int64."""

@final
class Attitude(Generic[_Number, _Flag]):
    """Which way a body points, from its gyro, accelerometer and, if there is one, magnetometer.

    ``update`` and ``process`` return the orientation, a quaternion w, x, y, z from the axes of the
    sensor to those of the earth. The default method has nothing to tune: it integrates the gyro,
    corrects the tilt ten times a second, learns bias, scale and misalignment of the gyro from
    gravity, and lets the magnetometer touch the heading alone. The others are those of textbooks.

    Sensors may have rates of their own: NaN, ``None`` or a vector of zeros is a missing sample, and
    so is one beyond 1000 rad/s or m/s^2. Zeros of a gyro are a rate as long as it seems to give them at
    rest, as one that is simulated or has a dead band does: after a rate below 5 deg/s, unless it has
    rested with noise, and where it has rested with zeros for some time. A missing rate is the last one for 50 ms. ``dt`` is the time
    since the sample before, s, where it is not ``1 / rate``; more than 1 s is a gap. North is the
    magnetic one; without a magnetometer a level sensor starts along the axes of the frame, and the
    heading drifts. One object serves one thread at a time.

    Parameters
    ----------
    rate : float
        Samples of the gyro a second.
    mag : bool, default True
        Whether a magnetometer may come; with False one that is given is an error, and
        ``heading_sigma`` is that of the drift since the start.
    frame : {"enu", "ned", "nwu"}
        Axes of the earth: east, north, up; north, east, down; north, west, up. Level, with the
        identity, the accelerometer shows +9.81 on z, in "ned" -9.81.
    method : {"auto", "complementary", "mahony", "madgwick", "ekf", "ukf"}
        The filter.
    gyro_unit, accel_unit : str
        Units of the samples, as in `zerorate.units`; of the magnetometer any.
    bias : array_like, shape (3,), DriftFilter or Calibration, optional
        The gyro's output without rotation as it is known before, in ``gyro_unit``: numbers, a
        `DriftFilter` of three channels in that unit, or a `Calibration`, for raw samples, which also
        gives the gyro's matrix.
    bias_sigma : array_like, shape () or (3,), optional
        Its standard deviation; by default 0.05 deg/s of what an object knows, or more if it says so,
        0.5 deg/s of numbers, and 1 deg/s where nothing is known.
    bias_limit : float, optional
        Of "auto", in ``gyro_unit``: the largest bias that such a gyro has; a steadier rate beyond is a
        turn, never a rest. Default 10 deg/s. Small keeps a table that turns slowly from the first
        sample on from passing for a rest, large finds the bias of a bad gyro.
    channels : int, optional
        Bodies side by side; ``None`` is a single one.
    time_constant : float, default 0.5
        Of "complementary", s: tilt and heading come near those of accelerometer and magnetometer by a
        factor of e. Short follows accelerations, long the gyro's bias: an error of b times this.
    kp, ki : float, default 1.0 and 0.3
        Of "mahony", 1/s and 1/s^2: proportional and integral gain. Without the integral no bias is
        learned.
    beta : float, optional
        Of "madgwick", rad/s: speed of the quaternion down the gradient, half that of the body; by
        default 0.041 with a magnetometer and 0.033 without, as in the report.
    gyro_noise, accel_noise : float, default 0.0002 and 0.1
        Of "ekf" and "ukf", rad/s/sqrt(Hz) and m/s^2/sqrt(Hz): white noise, that of the accelerometer with
        the body's own accelerations, some fifty times that of a data sheet.
    mag_noise : float, default 0.1
        Of "ekf" and "ukf", rad/sqrt(Hz): noise of the heading that the magnetometer shows.
    bias_walk : float, default 0.0001
        Of "ekf" and "ukf", rad/s/sqrt(s): random walk of the gyro's bias.

    Raises
    ------
    ValueError
        A parameter is out of its range, or the method has no use for it.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> attitude = zr.Attitude(rate=100.0, mag=False)
    >>> gyro = np.tile([0.0, 0.0, 0.5], (300, 1))  # rad/s about z, upright
    >>> accel = np.tile([0.0, 0.0, 9.81], (300, 1))
    >>> attitude.process(gyro, accel).shape
    (300, 4)
    >>> [round(float(x), 3) + 0.0 for x in attitude.euler]  # roll, pitch, yaw
    [0.0, 0.0, 1.5]
    """

    @overload
    def __new__(
        cls,
        rate: float,
        *,
        mag: bool = True,
        frame: _Frame = "enu",
        method: _AttitudeMethod = "auto",
        gyro_unit: str = "rad/s",
        accel_unit: str = "m/s^2",
        bias: Calibration | DriftFilter | npt.ArrayLike | None = None,
        bias_sigma: npt.ArrayLike | None = None,
        bias_limit: float | None = None,
        channels: None = None,
        time_constant: float = 0.5,
        kp: float = 1.0,
        ki: float = 0.3,
        beta: float | None = None,
        gyro_noise: float = 0.0002,
        accel_noise: float = 0.1,
        mag_noise: float = 0.1,
        bias_walk: float = 0.0001,
    ) -> Attitude[float, bool]: ...
    @overload
    def __new__(
        cls,
        rate: float,
        *,
        mag: bool = True,
        frame: _Frame = "enu",
        method: _AttitudeMethod = "auto",
        gyro_unit: str = "rad/s",
        accel_unit: str = "m/s^2",
        bias: Calibration | DriftFilter | npt.ArrayLike | None = None,
        bias_sigma: npt.ArrayLike | None = None,
        bias_limit: float | None = None,
        channels: int,
        time_constant: float = 0.5,
        kp: float = 1.0,
        ki: float = 0.3,
        beta: float | None = None,
        gyro_noise: float = 0.0002,
        accel_noise: float = 0.1,
        mag_noise: float = 0.1,
        bias_walk: float = 0.0001,
    ) -> Attitude[_Floats, _Flags]: ...
    def update(
        self,
        gyro: npt.ArrayLike,
        accel: npt.ArrayLike,
        mag: npt.ArrayLike | None = None,
        *floats: float,
        dt: float | None = None,
    ) -> _Floats:
        """Takes one sample of each sensor, returns the orientation: (3,) each to (4,), or six or nine
        floats; with channels (k, 3) to (k, 4).
        """
    def process(
        self,
        gyro: npt.ArrayLike,
        accel: npt.ArrayLike,
        mag: npt.ArrayLike | None = None,
        dt: npt.ArrayLike | None = None,
        threads: int | None = None,
    ) -> _Floats:
        """What ``update`` returns for each sample of a batch: (n, 3) each to (n, 4), with channels
        (n, k, 3) to (n, k, 4). ``dt`` is one time or (n,); the interpreter lock is released.
        """
    def trace(
        self,
        gyro: npt.ArrayLike,
        accel: npt.ArrayLike,
        mag: npt.ArrayLike | None = None,
        dt: npt.ArrayLike | None = None,
    ) -> _AttitudeTrace:
        """Like ``process``, but returns all that was known after each sample, as arrays by name:
        quaternion (n, 4), bias, bias_sigma and linear_acceleration (n, 3), gyro_matrix and
        gyro_matrix_sigma (n, 3, 3), tilt_sigma, heading_sigma, at_rest and disturbed (n,); with
        channels (n, k, …).
        """
    def smooth(
        self,
        gyro: npt.ArrayLike,
        accel: npt.ArrayLike,
        mag: npt.ArrayLike | None = None,
        dt: npt.ArrayLike | None = None,
    ) -> _AttitudeTrace:
        """What is known of each sample of a record by all of it: as ``trace``, but offline."""
    def align(
        self, orientation: Any, tilt_sigma: float = 0.01, heading_sigma: float = 0.01
    ) -> None:
        """Goes on from an orientation that is known, at the start or later: a quaternion, w first, or a
        ``scipy`` rotation, of the sensor in the frame; the deviations of its tilt and heading in rad.
        """
    def power_on(self) -> None:
        """Back to before the first sample, but for scale and misalignment of the gyro."""
    def reset(self) -> None:
        """Back to before the first sample, with the same parameters."""
    def copy(self) -> Self:
        """An independent object in the same state."""
    def to_bytes(self) -> bytes:
        """Parameters and state as bytes, with versions and a checksum."""
    @staticmethod
    def from_bytes(b: bytes) -> Attitude:
        """The object that ``to_bytes`` saved, which goes on equal to the last bit; ValueError
        if the bytes are not one.
        """
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def quaternion(self) -> _Floats:
        """From the axes of the sensor to those of the earth, w first: (4,), with channels (k, 4)."""
    @property
    def rotation(self) -> Any:
        """The same as a ``scipy.spatial.transform.Rotation``."""
    @property
    def euler(self) -> _Floats:
        """Roll, pitch and yaw, rad: (3,), with channels (k, 3)."""
    @property
    def heading(self) -> _Number:
        """Direction of the sensor's x axis over ground, clockwise from north, 0 to 2 pi: float, with
        channels (k,).
        """
    @property
    def up(self) -> _Floats:
        """Up, in the axes of the sensor, of length 1: (3,), with channels (k, 3)."""
    @property
    def gravity(self) -> _Floats:
        """What gravity alone makes the accelerometer show, in its unit: (3,), with channels (k, 3)."""
    @property
    def linear_acceleration(self) -> _Floats:
        """The last specific force without gravity, in the accelerometer's axes and unit, NaN if it was
        missing: (3,), with channels (k, 3).
        """
    @property
    def bias(self) -> _Floats:
        """The gyro's output without rotation, in its unit: (3,), with channels (k, 3)."""
    @property
    def bias_sigma(self) -> _Floats:
        """Standard deviation of ``bias``: (3,), with channels (k, 3)."""
    @property
    def gyro_matrix(self) -> _Floats:
        """M in ``rate = M (gyro - bias)``: (3, 3), with channels (k, 3, 3)."""
    @property
    def gyro_matrix_sigma(self) -> _Floats:
        """Standard deviations of the elements of ``gyro_matrix``: (3, 3), with channels (k, 3, 3)."""
    @property
    def tilt_sigma(self) -> _Number:
        """Standard deviation of the angle between the true and the estimated vertical, rad: float, with
        channels (k,).
        """
    @property
    def heading_sigma(self) -> _Number:
        """Standard deviation of the heading, rad; without magnetometer that against the start: float,
        with channels (k,).
        """
    @property
    def at_rest(self) -> _Flag:
        """Whether the body rests: bool, with channels (k,)."""
    @property
    def disturbed(self) -> _Flag:
        """Whether the magnetic field is another than the one known, by its strength or its dip: bool,
        with channels (k,).
        """
    @property
    def status(self) -> _AttitudeStatus | list[_AttitudeStatus]:
        """What is to be known first of all: "starting" (first second), "rate missing", "wrong unit",
        "disturbed", "at rest" or "moving"; with channels a list.
        """
    @property
    def samples_seen(self) -> int:
        """Samples given so far, missing ones included."""
    @property
    def rate(self) -> float:
        """Samples a second."""
    @property
    def method(self) -> _AttitudeMethod:
        """The method that estimates."""
    @property
    def mag(self) -> bool:
        """Whether a magnetometer may come."""
    @property
    def channels(self) -> int | None:
        """Number of signals, None for a single one."""

@final
class GyroArray(Generic[_Number]):
    """Many gyros of one body as one, live or at once.

    Each sensor learns its own drift, axis by axis, as a ``DriftFilter`` does; then all are turned into
    the axes of the body. At rest they count by their noise, found from Allan variances over an eighth of
    a second, one and four seconds; in motion, where scale errors decide, nearly alike. A sample far
    from the middle of the others is not used. A sensor that disagrees over a quarter of a second is
    left out, whatever is wrong with it (offset, sign, scale, exchanged axes, noise), until it has agreed
    for 10 s at a rate that would have shown the fault. Of two sensors that disagree nobody knows which is
    wrong: both are used, and ``health`` says ``"disputed"``.

    N sensors have about sqrt(N) times less noise than one, and seldom more than 1.2 times that. A single
    one is a ``DriftFilter``, equal to the last bit. A sample that is not finite is missing, as is one of a
    sensor that is stuck; where nothing is left the rate is NaN. One object serves one thread at a time.

    Parameters
    ----------
    rate : float
        Samples a second.
    sensors : int, optional
        Number of gyros, 1 to 256; may be left out where ``rotations`` or ``calibrations`` say it.
    axes : {3, 1}
        Axes of each gyro.
    rotations : array_like, shape (sensors, 3, 3), optional
        From each sensor's axes to those of the body; by default all are aligned.
    calibrations : sequence of Calibration or of array_like, shape (3, 3), optional
        One a sensor, for samples in the unit of the array: scale and misalignment of each are corrected,
        in its own axes. Biases are learned, and g-sensitivity is left: ``Calibration.apply`` removes it.
    limit : float, optional
        Size at which a sample is at the end of the sensors' range, and missing.
    rest_limit, bias_limit : float, optional
        As of ``DriftFilter``.
    weights : {"auto", "mean", "white"} or array_like, shape (sensors,) or (sensors, axes)
        How much each counts: by noise and scale error; alike; by white noise alone; or as given, such as
        those of ``allan_covariance(z, rate).virtual_gyro()``.
    scale_error : float
        Deviation of the sensors' scale factors, 0 to 1.
    method : {"auto", "centralised"}
        ``"centralised"`` is the published filter of two stages, for comparison: it takes the rate itself
        for a random walk, removes no bias, and lags behind every motion.
    labels : sequence of str, optional
        Names of the sensors; by default ``"1"``, ``"2"``, …

    Raises
    ------
    ValueError
        A parameter is out of range, or an array has another shape.

    References
    ----------
    Method ``"centralised"``: J. Liu, B. He, Y. Zhao, of which only the abstract is at hand; process
    noise and order of both stages are chosen so that they do at rest what it reports.

    Examples
    --------
    Four gyros at rest, one of which fails:

    >>> import numpy as np, zerorate as zr
    >>> rng = np.random.default_rng(1)
    >>> z = [0.5, -0.2, 0.1] + 0.1 * rng.standard_normal((6000, 4, 3))
    >>> array = zr.GyroArray(rate=100.0, sensors=4)
    >>> rate = array.process(z)
    >>> bool(rate[1000:].std() < 0.06), array.health
    (True, ('good', 'good', 'good', 'good'))
    >>> z[:, 2, 0] *= -1.0
    >>> z[::2, :, 0] += 20.0 * np.sign(np.array([1.0, 1.0, -1.0, 1.0]))
    >>> _ = array.process(z)
    >>> array.health
    ('good', 'good', 'excluded', 'good')
    """

    @overload
    def __new__(
        cls,
        rate: float,
        sensors: int | None = None,
        *,
        axes: Literal[1],
        limit: float | None = None,
        rest_limit: float | None = None,
        bias_limit: float | None = None,
        weights: Literal["auto", "mean", "white"] | npt.ArrayLike = "auto",
        scale_error: float = 0.01,
        method: Literal["auto", "centralised"] = "auto",
        labels: Sequence[str] | None = None,
    ) -> GyroArray[float]: ...
    @overload
    def __new__(
        cls,
        rate: float,
        sensors: int | None = None,
        *,
        axes: Literal[3] = 3,
        rotations: npt.ArrayLike | None = None,
        calibrations: Sequence[Calibration | npt.ArrayLike] | None = None,
        limit: float | None = None,
        rest_limit: float | None = None,
        bias_limit: float | None = None,
        weights: Literal["auto", "mean", "white"] | npt.ArrayLike = "auto",
        scale_error: float = 0.01,
        method: Literal["auto", "centralised"] = "auto",
        labels: Sequence[str] | None = None,
    ) -> GyroArray[_Floats]: ...
    @overload
    def __new__(
        cls,
        rate: float,
        sensors: int | None = None,
        *,
        axes: int,
        rotations: npt.ArrayLike | None = None,
        calibrations: Sequence[Calibration | npt.ArrayLike] | None = None,
        limit: float | None = None,
        rest_limit: float | None = None,
        bias_limit: float | None = None,
        weights: Literal["auto", "mean", "white"] | npt.ArrayLike = "auto",
        scale_error: float = 0.01,
        method: Literal["auto", "centralised"] = "auto",
        labels: Sequence[str] | None = None,
    ) -> GyroArray[Any]: ...
    def update(self, z: npt.ArrayLike) -> _Number:
        """Takes one sample of every sensor, returns the rate of the body: (sensors, 3) to (3,), with
        one axis (sensors,) to float; NaN where no sensor is left.
        """
    def process(
        self, z: npt.ArrayLike, out: _Floats | None = None, threads: int | None = None
    ) -> _Floats:
        """What ``update`` returns for each sample of a batch: (n, sensors, 3) to (n, 3), with one axis
        (n, sensors) to (n,); the interpreter lock is released. ``threads`` changes nothing: an array is
        one signal.
        """
    def trace(self, z: npt.ArrayLike) -> _ArrayTrace:
        """Like ``process``, but returns by name what was known after each sample: ``rate`` (n, 3); ``bias``
        (n, sensors, 3) in each sensor's own axes; ``weights`` and ``used`` (n, sensors, 3);
        ``excluded`` (n, sensors), ``disputed`` (n,), and ``at_rest`` (n, 3), which are as the sample
        leaves them. With one axis the last axis is not there.
        """
    def covariance(self, axis: int = 0) -> tuple[_Floats, _Floats, _Floats]:
        """Allan covariances at rest so far, of one axis of the body: averaging times in s (m,), covariances
        (m, sensors, sensors) in the unit of the samples squared, and of how many differences of
        successive means each is (m, sensors, sensors).
        """
    def power_on(self) -> None:
        """The sensors were switched off and on: their biases are forgotten, their noise is not."""
    @property
    def channels(self) -> int | None:
        """Number of signals, None for a single one."""
    def reset(self) -> None:
        """Back to before the first sample, with the same parameters."""
    def copy(self) -> Self:
        """An independent object in the same state."""
    def to_bytes(self) -> bytes:
        """Parameters and state as bytes, with versions and a checksum."""
    @staticmethod
    def from_bytes(b: bytes) -> GyroArray:
        """The object that ``to_bytes`` saved, which goes on equal to the last bit; ValueError
        if the bytes are not one.
        """
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def rate(self) -> float:
        """Samples a second."""
    @property
    def sensors(self) -> int:
        """Number of gyros."""
    @property
    def axes(self) -> int:
        """Axes of each gyro."""
    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the sensors."""
    @property
    def bias(self) -> _Floats:
        """Bias of each sensor in its own axes: (sensors, 3), with one axis (sensors,)."""
    @property
    def weights(self) -> _Floats:
        """Share of each sensor in the last rate, zero where it was not used: (sensors, 3), with one axis
        (sensors,).
        """
    @property
    def health(
        self,
    ) -> tuple[Literal["good", "missing", "saturated", "stuck", "excluded", "disputed"], ...]:
        """How far each sensor can be trusted: ``"good"``, ``"missing"``, ``"saturated"``, ``"stuck"``,
        ``"excluded"`` or ``"disputed"``.
        """
    @property
    def at_rest(self) -> _Flags:
        """Where the body rests: (3,), with one axis (1,)."""
    @property
    def samples_seen(self) -> int:
        """Samples so far, the missing ones included."""

@final
class ImuCorrector(Generic[_Corrected]):
    """Gyro and accelerometer without scale error, misalignment, bias and g-sensitivity, while samples
    arrive or at once.

    ``force = accel_matrix @ (accel - accel_bias)`` and ``rate = gyro_matrix @ (gyro - gyro_bias -
    g_sensitivity @ force)``: the matrices are the inverses of what the sensors make of their input.
    ``Calibration.corrector()`` makes one. Nothing here has a unit but what is given.

    A sample has three numbers (the gyro), six (and the accelerometer) or seven (and the temperature,
    degC). Where an axis of the gyro is missing its three rates are NaN, where one of the
    accelerometer is its three forces are; the gyro is then corrected with the last force known, zero
    before the first. With the temperature missing the last one holds; before the first the bias is
    ``gyro_bias``. One object serves one thread at a time.

    Parameters
    ----------
    gyro_matrix : array_like, shape (3, 3)
        From the raw gyro, less its bias, to the rate.
    gyro_bias : array_like, shape (3,)
        Output of the gyro without input, raw unit, where no temperature is known.
    accel_matrix, accel_bias : array_like, shape (3, 3) and (3,), optional
        Likewise of the accelerometer; by default it is left as it is.
    g_sensitivity : array_like, shape (3, 3), optional
        What a force adds to the gyro, raw unit of the gyro per unit of the corrected force; by
        default nothing.
    temperature : dict, optional
        The gyro's bias over temperature: ``"coefficients"``, shape (3, 1) to (3, 4), are c_0, c_1, …
        of each axis in ``sum(c_k * ((T - reference) / 10)**k)``; ``"reference"`` is a temperature,
        ``"range"`` the least and the highest that the curve was learned at. Beyond them it goes on
        along its tangent for as much as the range is long, and stays.
    inputs : {3, 6, 7}, optional
        Numbers in a sample; by default what the other arguments need. With 7 and without
        ``temperature`` the last one is not used.
    channels : int, optional
        Sensors side by side, all corrected alike; ``None`` is a single one.

    Raises
    ------
    ValueError
        An array of another shape, a number that is not finite or beyond 1e50, or an argument that
        samples of so many numbers have no use for.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> corrector = zr.ImuCorrector(np.eye(3) / 1.02, [0.1, 0.0, -0.1])
    >>> corrector.update([1.12, 0.0, -0.1]).round(6).tolist()
    [1.0, 0.0, 0.0]
    >>> both = zr.ImuCorrector(np.eye(3), np.zeros(3), g_sensitivity=0.1 * np.eye(3))
    >>> gyro, accel = both.process([[0.0, 0.0, 0.1, 0.0, 0.0, 1.0]])
    >>> gyro.tolist(), accel.tolist()
    ([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])
    """

    @overload
    def __new__(
        cls,
        gyro_matrix: npt.ArrayLike,
        gyro_bias: npt.ArrayLike,
        *,
        inputs: Literal[3] | None = None,
        channels: int | None = None,
    ) -> ImuCorrector[_Floats]: ...
    @overload
    def __new__(
        cls,
        gyro_matrix: npt.ArrayLike,
        gyro_bias: npt.ArrayLike,
        *,
        accel_matrix: npt.ArrayLike | None = None,
        accel_bias: npt.ArrayLike | None = None,
        g_sensitivity: npt.ArrayLike | None = None,
        temperature: _TemperatureCurve | None = None,
        inputs: Literal[6, 7] | None = None,
        channels: int | None = None,
    ) -> ImuCorrector[tuple[_Floats, _Floats]]: ...
    def update(self, z: npt.ArrayLike) -> _Corrected:
        """Takes one sample, returns the corrected one: (3,) to the rate (3,), (6,) and (7,) to rate
        and force, (3,) each; with channels all have a first axis (k,).
        """
    def process(
        self, z: npt.ArrayLike, out: _Floats | None = None, threads: int | None = None
    ) -> _Corrected:
        """What ``update`` returns for each sample of a batch: (n, 3) to (n, 3), (n, 6) and (n, 7) to
        two arrays (n, 3), with channels (n, k, 3) and so on; the interpreter lock is released. ``out``
        is for 3 inputs.
        """
    def reset(self) -> None:
        """Back to before the first sample, with the same parameters."""
    def copy(self) -> Self:
        """An independent object in the same state."""
    def to_bytes(self) -> bytes:
        """Parameters and state as bytes, with versions and a checksum."""
    @staticmethod
    def from_bytes(b: bytes) -> ImuCorrector:
        """The object that ``to_bytes`` saved, which goes on equal to the last bit; ValueError
        if the bytes are not one.
        """
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def gyro_matrix(self) -> _Floats:
        """From the raw gyro, less its bias, to the rate: (3, 3)."""
    @property
    def gyro_bias(self) -> _Floats:
        """Bias of the raw gyro where no temperature is known: (3,)."""
    @property
    def accel_matrix(self) -> _Floats:
        """From the raw accelerometer, less its bias, to the force: (3, 3)."""
    @property
    def accel_bias(self) -> _Floats:
        """Bias of the raw accelerometer: (3,)."""
    @property
    def g_sensitivity(self) -> _Floats:
        """What a force adds to the raw gyro: (3, 3)."""
    @property
    def temperature(self) -> _TemperatureCurve | None:
        """The gyro's bias over temperature, as it was given; None without."""
    @property
    def bias(self) -> _Floats:
        """The bias of the raw gyro, as it is taken to be now: (3,), with channels (k, 3)."""
    @property
    def force(self) -> _Floats:
        """The last force known, zero before it: (3,), with channels (k, 3)."""
    @property
    def inputs(self) -> int:
        """Numbers in a sample: 3, 6 or 7."""
    @property
    def channels(self) -> int | None:
        """Number of signals, None for a single one."""

@final
class TemperatureFilter(Generic[_Number, _Flag]):
    """The bias of a gyro and its change with temperature, learned at rest while samples arrive.

    What `update` returns is the bias at the temperature now. It is learned from ticks of a quarter of a
    second at rest, which is found as `RestDetector` finds it, and held in motion, where it goes on
    with the temperature. Kalman filters with the states bias and slope and ``H = [1, T - reference]``
    differ in the random walk of the bias and are weighed by their likelihoods; none need be tuned.

    A thermometer of whole degrees is averaged over as many ticks as lie between two of its steps. A
    rate or a temperature that is not finite is missing: the bias is then held, or learned at the last
    temperature. Before the first rest the bias is zero. One object serves one thread at a time.

    Parameters
    ----------
    rate : float
        Samples a second.
    reference : float, default 25.0
        Temperature that the bias state belongs to, degC; of no consequence once the slope is known.
    slope : float, optional
        What is believed of the slope before any sample, the gyro's unit per kelvin; by default zero,
        with a deviation of one sample's noise per kelvin.
    slope_sigma : float, optional
        Its deviation; by default a slope that is given holds for certain.
    walk : float, optional
        Random walk of the bias, unit per root second; by default it is learned.
    rest_limit, bias_limit : float, optional
        As of `RestDetector`.
    channels : int, optional
        Number of signals side by side; ``None`` is a single one.

    Raises
    ------
    ValueError
        A parameter is out of range.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> t = np.arange(60_000) / 100.0
    >>> temperature = 20.0 + 10.0 * (1.0 - np.exp(-t / 200.0))
    >>> z = 0.5 + 0.03 * (temperature - 25.0)
    >>> z += 0.1 * np.random.default_rng(1).standard_normal(t.size)
    >>> f = zr.TemperatureFilter(100.0)
    >>> bias = f.process(z, temperature)
    >>> round(float(bias[-1]), 2), round(f.slope, 3)
    (0.63, 0.03)
    """

    @overload
    def __new__(
        cls,
        rate: float,
        *,
        reference: float = 25.0,
        slope: float | None = None,
        slope_sigma: float | None = None,
        walk: float | None = None,
        rest_limit: float | None = None,
        bias_limit: float | None = None,
        channels: None = None,
    ) -> TemperatureFilter[float, bool]: ...
    @overload
    def __new__(
        cls,
        rate: float,
        *,
        reference: float = 25.0,
        slope: float | None = None,
        slope_sigma: float | None = None,
        walk: float | None = None,
        rest_limit: float | None = None,
        bias_limit: float | None = None,
        channels: int,
    ) -> TemperatureFilter[_Floats, _Flags]: ...
    def update(self, z: _Sample, temperature: _Sample = None) -> _Number:
        """Takes one sample and its temperature, degC or None, returns the bias: floats to float, with
        channels (k,) and one temperature or (k,) to (k,).
        """
    def process(
        self,
        z: npt.ArrayLike,
        temperature: npt.ArrayLike,
        out: _Floats | None = None,
        threads: int | None = None,
    ) -> _Floats:
        """What ``update`` returns for each sample of a batch: (n,) and (n,) to (n,), with channels (n, k)
        and one temperature for all, (n,), or (n, k) to (n, k); the interpreter lock is released.
        """
    def reset(self) -> None:
        """Back to before the first sample, with the same parameters."""
    def copy(self) -> Self:
        """An independent object in the same state."""
    def to_bytes(self) -> bytes:
        """Parameters and state as bytes, with versions and a checksum."""
    @staticmethod
    def from_bytes(b: bytes) -> TemperatureFilter:
        """The object that ``to_bytes`` saved, which goes on equal to the last bit; ValueError
        if the bytes are not one.
        """
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def bias(self) -> _Number:
        """The bias at the last temperature, zero before the first rest: float, with channels (k,)."""
    @property
    def bias_sigma(self) -> _Number:
        """Standard deviation of ``bias``; before the first rest the largest sample so far, and as long as
        what is taken for rest may be motion no less than the bias: float, with channels (k,).
        """
    @property
    def slope(self) -> _Number:
        """Change of the bias per kelvin: float, with channels (k,)."""
    @property
    def slope_sigma(self) -> _Number:
        """Standard deviation of ``slope``, zero where nothing is known of it yet: float, with channels
        (k,).
        """
    @property
    def at_rest(self) -> _Flag:
        """Whether the gyro rests, and the bias is being learned: bool, with channels (k,)."""
    @property
    def samples_seen(self) -> int:
        """Samples given so far, missing ones included."""
    @property
    def rate(self) -> float:
        """Samples a second."""
    @property
    def reference(self) -> float:
        """Temperature that the bias state belongs to, degC."""
    @property
    def channels(self) -> int | None:
        """Number of signals, None for a single one."""

@final
class Tilt(Generic[_Number]):
    """The tilt about one axis, from the rate about it and the angle that the accelerometer shows.

    It is what is often done with an MPU-6050: the angle of the accelerometer, an arc tangent of two of
    its axes, is noisy but stays; the integral of the gyro is smooth but drifts. The **complementary**
    filter is ``angle = a (angle + gyro dt) + (1 - a) accelerometer`` with ``a = time_constant /
    (time_constant + dt)``: 0.98 for 0.49 s and 100 Hz. A bias b of the gyro leaves exactly ``b *
    time_constant``. The **kalman** filter has the states angle and bias, and learns the bias.

    Any unit of angle will do, if the gyro has that unit a second. It is one axis alone: the rate about
    it is that of the tilt for small angles only, and the arc tangent fails near 90 degrees. `Attitude`
    has neither limit, and takes motion for what it is.

    A rate that is missing (NaN, infinite or None) is the last one for 50 ms, then none; an angle that is
    missing corrects nothing; before the first angle NaN is returned. One object serves one thread at a
    time.

    Parameters
    ----------
    rate : float
        Samples a second.
    method : {"complementary", "kalman"}, default "complementary"
        How rate and angle are joined.
    channels : int, optional
        Number of axes side by side; ``None`` is a single one.
    time_constant : float, default 0.5
        Of the complementary filter, s: short trusts the accelerometer, and its shaking, long the gyro, and
        its bias.
    q_angle, q_bias : float, default 1e-3 and 3e-3
        Of the Kalman filter: variance that angle and bias gain in a second, unit^2/s and
        (unit/s)^2/s.
    r_measure : float, default 3e-2
        Of the Kalman filter: variance of one sample of the accelerometer's angle, unit^2. The same
        number is another filter at another rate. These three are those of the well-known code, for
        degrees at 100 Hz: it comes near the accelerometer in a third of a second.
    p_start : float, default 1.0
        Of the Kalman filter: variance of angle and bias before the first sample, unit^2 and
        (unit/s)^2.

    Raises
    ------
    ValueError
        A parameter is out of range, or is not used by the method.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> gyro = np.full(3000, 0.05)  # the bias, in rad/s, of a sensor at rest
    >>> ay, az = np.zeros(3000), np.full(3000, 9.81)
    >>> accelerometer = np.arctan2(ay, az)
    >>> tilt = zr.Tilt(100.0, time_constant=0.49)
    >>> round(float(tilt.process(gyro, accelerometer)[-1]), 4)  # 0.05 * 0.49
    0.0245
    >>> tilt = zr.Tilt(100.0, method="kalman")
    >>> angle = tilt.process(gyro, accelerometer)
    >>> round(tilt.bias, 4)
    0.05
    """

    @overload
    def __new__(
        cls,
        rate: float,
        *,
        method: Literal["complementary"] = "complementary",
        channels: None = None,
        time_constant: float = 0.5,
    ) -> Tilt[float]: ...
    @overload
    def __new__(
        cls,
        rate: float,
        *,
        method: Literal["complementary"] = "complementary",
        channels: int,
        time_constant: float = 0.5,
    ) -> Tilt[_Floats]: ...
    @overload
    def __new__(
        cls,
        rate: float,
        *,
        method: Literal["kalman"],
        channels: None = None,
        q_angle: float = 0.001,
        q_bias: float = 0.003,
        r_measure: float = 0.03,
        p_start: float = 1.0,
    ) -> Tilt[float]: ...
    @overload
    def __new__(
        cls,
        rate: float,
        *,
        method: Literal["kalman"],
        channels: int,
        q_angle: float = 0.001,
        q_bias: float = 0.003,
        r_measure: float = 0.03,
        p_start: float = 1.0,
    ) -> Tilt[_Floats]: ...
    def update(self, gyro: _Sample, angle: _Sample, dt: float | None = None) -> _Number:
        """Takes a rate and the accelerometer's angle, returns the tilt: floats or None to float, with
        channels (k,) and (k,) to (k,); ``dt`` is the time since the sample before, s, by default one
        period.
        """
    def process(
        self,
        gyro: npt.ArrayLike,
        angle: npt.ArrayLike,
        dt: npt.ArrayLike | None = None,
        out: _Floats | None = None,
        threads: int | None = None,
    ) -> _Floats:
        """What ``update`` returns for each sample of a batch: (n,) and (n,) to (n,), with channels (n, k)
        and (n, k) to (n, k); ``dt`` is one time for all samples or (n,). The interpreter lock is
        released.
        """
    def reset(self) -> None:
        """Back to before the first sample, with the same parameters."""
    def copy(self) -> Self:
        """An independent object in the same state."""
    def to_bytes(self) -> bytes:
        """Parameters and state as bytes, with versions and a checksum."""
    @staticmethod
    def from_bytes(b: bytes) -> Tilt:
        """The object that ``to_bytes`` saved, which goes on equal to the last bit; ValueError
        if the bytes are not one.
        """
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def angle(self) -> _Number:
        """The tilt, NaN before the first angle of the accelerometer: float, with channels (k,)."""
    @property
    def angle_sigma(self) -> _Number:
        """Standard deviation of ``angle``, NaN for method "complementary": float, with channels (k,)."""
    @property
    def bias(self) -> _Number:
        """The gyro's output without rotation, NaN for method "complementary": float, with channels (k,)."""
    @property
    def bias_sigma(self) -> _Number:
        """Standard deviation of ``bias``, NaN for method "complementary": float, with channels (k,)."""
    @property
    def samples_seen(self) -> int:
        """Samples given so far, missing ones included."""
    @property
    def rate(self) -> float:
        """Samples a second."""
    @property
    def method(self) -> str:
        """How rate and angle are joined."""
    @property
    def channels(self) -> int | None:
        """Number of signals, None for a single one."""

@final
class LinearKalman(Generic[_Number]):
    """The linear Kalman filter, with an input, for a model of any kind: ``x = F x + B u + w``,
    ``z = H x + v`` with w of covariance Q and v of covariance R.

    ``predict`` and ``update`` take one step, ``process`` a record; all lead to the same bits. The
    covariance is corrected by Joseph's form, always. ``x0`` and ``P0`` belong to the time before the
    first sample: each sample, the first too, begins with a prediction.

    A measurement that is NaN, infinite or beyond 1e150 is missing, and None stands for a whole vector of
    them: what is left of a vector corrects. A missing input counts as zero. A measurement that those
    before it in its vector determine to rounding corrects nothing. One object serves one thread at a
    time.

    Parameters
    ----------
    F : array_like, shape (n, n)
        What the state becomes in a step; n up to 256. All sizes to 8 states and 4 measurements are
        compiled for themselves.
    H : array_like, shape (m, n)
        What is measured of the state.
    Q, R : array_like, shape (n, n) and (m, m)
        Covariances of what disturbs the state in a step, and of the noise of a measurement. Small Q
        smooths and is late, small R follows the measurements.
    B : array_like, shape (n, p), optional
        What an input does to the state.
    x0 : array_like, shape (n,), or with channels (k, n) too, optional
        Initial state, zero by default.
    P0 : array_like, shape (n, n), optional
        Its covariance. By default nothing is known: a deviation ten thousand times what as many samples
        as there are states tell of each.
    channels : int, optional
        Number of filters side by side with the same matrices; ``None`` is a single one. As long as
        they miss the same samples they share one covariance, which is fast.

    Raises
    ------
    ValueError
        A shape is wrong, a matrix not finite, a covariance not symmetric or not positive
        semidefinite; or P0 is needed, because the measurements tell nothing of some state, or Q and R
        are zero and tell no size.

    References
    ----------
    R. E. Kalman, *J. Basic Engineering* 82(1), 35-45, 1960. R. S. Bucy, P. D. Joseph, *Filtering for
    Stochastic Processes with Applications to Guidance*, 1968, for the form of the covariance.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> F, B = [[1.0, 0.1], [0.0, 1.0]], [[0.005], [0.1]]  # position and velocity, 10 Hz
    >>> kf = zr.LinearKalman(F, [[1.0, 0.0]], 1e-4 * np.eye(2), [[0.25]], B)
    >>> t = 0.1 * np.arange(1, 101)
    >>> z = 0.5 * 2.0 * t**2 + 0.5 * np.random.default_rng(1).standard_normal(100)
    >>> run = kf.process(z, np.full(100, 2.0))  # 2 m/s^2 were commanded
    >>> kf.predict(2.0).round(1).tolist(), kf.update(None).round(1).tolist()
    ([101.9, 20.2], [101.9, 20.2])
    >>> late, best = (abs(found.state[:, 0] - t**2).mean() for found in (run, run.smooth()))
    >>> bool(best < late)
    True
    """

    @overload
    def __new__(
        cls,
        F: npt.ArrayLike,
        H: npt.ArrayLike,
        Q: npt.ArrayLike,
        R: npt.ArrayLike,
        B: npt.ArrayLike | None = None,
        x0: npt.ArrayLike | None = None,
        P0: npt.ArrayLike | None = None,
        channels: None = None,
    ) -> LinearKalman[float]: ...
    @overload
    def __new__(
        cls,
        F: npt.ArrayLike,
        H: npt.ArrayLike,
        Q: npt.ArrayLike,
        R: npt.ArrayLike,
        B: npt.ArrayLike | None = None,
        x0: npt.ArrayLike | None = None,
        P0: npt.ArrayLike | None = None,
        *,
        channels: int,
    ) -> LinearKalman[_Floats]: ...
    def predict(
        self,
        u: _Sample = None,
        *,
        F: npt.ArrayLike | None = None,
        B: npt.ArrayLike | None = None,
        Q: npt.ArrayLike | None = None,
    ) -> _Floats:
        """The state one step on, ``x = F x + B u``, with ``P = F P F.T + Q``: (n,), with channels (k, n).
        ``u`` is (p,), with channels (k, p), or a number for one input; None is no input. Matrices that
        are given count for this step alone; with another B the number of inputs may be another too.
        """
    def update(
        self, z: _Sample, *, H: npt.ArrayLike | None = None, R: npt.ArrayLike | None = None
    ) -> _Floats:
        """The state corrected by a measurement: (n,), with channels (k, n). ``z`` is (m,), with channels
        (k, m), or a number for one measurement; None is missing as a whole. Matrices that are given
        count for this step alone.
        """
    def process(
        self,
        z: npt.ArrayLike,
        u: npt.ArrayLike | None = None,
        *,
        F: npt.ArrayLike | None = None,
        H: npt.ArrayLike | None = None,
        Q: npt.ArrayLike | None = None,
        R: npt.ArrayLike | None = None,
        B: npt.ArrayLike | None = None,
        keep: Literal["all", "state"] = "all",
    ) -> LinearRun:
        """A record from the state as it is: ``predict`` and ``update`` of each sample, as a
        ``zerorate.linear.LinearRun``. ``z`` is (n, m), with channels (n, k, m), and ``u`` (n, p) or
        (n, k, p); the last axis may be left out where it is 1. A matrix that is given counts for this
        record, as it is or one a sample: (n, ., .). ``keep="state"`` keeps the states alone, for many
        filters or long records. The interpreter lock is released.
        """
    def reset(self) -> None:
        """Back to before the first sample, with the same parameters."""
    def copy(self) -> Self:
        """An independent object in the same state."""
    def to_bytes(self) -> bytes:
        """Parameters and state as bytes, with versions and a checksum."""
    @staticmethod
    def from_bytes(b: bytes) -> LinearKalman:
        """The object that ``to_bytes`` saved, which goes on equal to the last bit; ValueError
        if the bytes are not one.
        """
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def state(self) -> _Floats:
        """The state: (n,), with channels (k, n)."""
    @property
    def covariance(self) -> _Floats:
        """Its covariance: (n, n), with channels (k, n, n)."""
    @property
    def innovation(self) -> _Floats:
        """``z - H x`` before the last ``update``, NaN where a measurement was missing and before the first:
        (m,), with channels (k, m).
        """
    @property
    def nis(self) -> _Number:
        """Its square relative to its covariance S, ``y.T S^-1 y``, which is as large as there are
        measurements in the mean where the model is right; NaN if all were missing: float, with channels
        (k,).
        """
    @property
    def log_likelihood(self) -> _Number:
        """Logarithm of the density that the filter predicted for the last measurements, ``-(nis + log
        det(2 pi S)) / 2``; 0 if all were missing, so that a sum over samples is that of a record: float,
        with channels (k,).
        """
    @property
    def F(self) -> _Floats:
        """What the state becomes in a step: (n, n)."""
    @property
    def H(self) -> _Floats:
        """What is measured of the state: (m, n)."""
    @property
    def Q(self) -> _Floats:
        """Covariance of what disturbs the state in a step: (n, n)."""
    @property
    def R(self) -> _Floats:
        """Covariance of the noise of a measurement: (m, m)."""
    @property
    def B(self) -> _Floats:
        """What an input does to the state: (n, p); p is 0 without one."""
    @property
    def channels(self) -> int | None:
        """Number of signals, None for a single one."""

@final
class NavigationFilter:
    """Position, velocity and attitude of a vehicle from its gyro, accelerometer and satellite receiver.

    A loosely coupled Kalman filter of 15 errors: position, velocity, orientation and the biases of gyro
    and accelerometer. The sensors are integrated at every sample; fixes of the receiver, rest and wheels
    correct what drifts. Body axes are forward, right, down; the earth's north, east, down, WGS84.

    A position or velocity is taken if its normalised innovation squared is at most ``gate``. After ten in
    a row that are not, the filter is taken to be wrong and goes where the next one is (``move_count``); in the first second after an outage there is no
    gate. A fix may be up to a second late. Without a known heading the filter waits, and with ``vehicle=
    "wheeled"`` takes it from the course above 1 m/s.

    A rate or force that is not finite, or beyond 1e4 rad/s or m/s^2, is missing: the one before for a
    tenth of a second, then nothing is known of it and the deviations grow. After a gap of more than a
    second, or two without a gyro, the filter waits for a fix; biases are kept. One object serves one
    thread at a time.

    Parameters
    ----------
    start : Alignment
        What is known before the first sample, as ``zr.align`` returns it.
    gyro, accel : NoiseModel or sequence of three, optional
        Noise of the sensors, rad/s and m/s^2, the same for all axes or one each; by default that of
        consumer sensors: 0.05 deg/s/sqrt(Hz) and 0.02 m/s^2/sqrt(Hz).
    antenna : array_like, shape (3,), default (0, 0, 0)
        From the sensor to the antenna, body axes, m.
    vehicle : {None, "wheeled"}, default None
        "wheeled": it does not slip sideways and does not leave the ground, used five times a second above
        1 m/s.
    axle : array_like, shape (3,), optional
        Of "wheeled": from the sensor to the axle that does not steer, body axes, m.
    wheel_sigma : float, optional
        Of "wheeled": deviation of the velocity across, m/s, default 0.3.
    gate : float, default 50.0
        Normalised innovation squared, of three degrees of freedom, above which a fix is not taken.
    adapt : {"inflate", "free", "fixed"}, default "inflate"
        "inflate" raises the noise that the receiver tells to the Allan variance of the innovations, "free"
        lowers it as well, "fixed" believes the receiver.
    covariance_step : float, default 0.1
        Time between two steps of the covariance, s.
    kind : {"rate", "increment"}, default "rate"
        Whether samples are rates and forces, or their integrals since the sample before.

    Raises
    ------
    ValueError
        A parameter is out of range, or is not used.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> drive = zr.simulate_drive(duration=120.0, seed=1)
    >>> start = zr.align(drive.recording(), latitude=48.0, heading="course")
    >>> nav = zr.NavigationFilter(start)
    >>> track = nav.process(drive.recording(), drive.fixes)
    >>> def horizontal(track):
    ...     errors = track.errors(drive.truth_position)[track.time > 60.0, :2]
    ...     return float(np.sqrt((errors**2).sum(axis=1).mean()))
    >>> horizontal(track) < 1.5, horizontal(track.smooth()) < 0.8  # m, of fixes of 2 m
    (True, True)
    """

    def __new__(
        cls,
        start: Alignment,
        *,
        gyro: NoiseModel | Sequence[NoiseModel] | None = None,
        accel: NoiseModel | Sequence[NoiseModel] | None = None,
        antenna: npt.ArrayLike = (0.0, 0.0, 0.0),
        vehicle: Literal["wheeled"] | None = None,
        axle: npt.ArrayLike | None = None,
        wheel_sigma: float | None = None,
        gate: float = 50.0,
        adapt: Literal["inflate", "free", "fixed"] = "inflate",
        covariance_step: float = 0.1,
        kind: Literal["rate", "increment"] = "rate",
    ) -> Self: ...
    def update(
        self, t: float, gyro: npt.ArrayLike, accel: npt.ArrayLike, rest: bool = False
    ) -> _Navigating:
        """Takes one sample of the sensors: its time, s, and gyro and accelerometer, rad/s and m/s^2, (3,);
        ``rest`` says that the vehicle is known to stand. Returns ``status``; ValueError if the time is not
        later than that of the sample before, which changes nothing.
        """
    def update_gnss(
        self,
        t: float,
        position: npt.ArrayLike,
        velocity: npt.ArrayLike | None = None,
        position_sigma: npt.ArrayLike = 2.0,
        velocity_sigma: npt.ArrayLike = 0.1,
    ) -> Literal["used", "rejected", "refused"]:
        """Takes a fix of the receiver: when it was measured, s, latitude and longitude, deg, and height, m,
        (3,); velocity north, east, down, m/s, (3,) or None; their deviations, one or three axes. Returns
        "used", "rejected" or "refused". The gate judges position and velocity apart; a fix is rejected if
        its position is, or the velocity of one without a position. It is refused if it is over a second
        old, a tenth of a second ahead of the sensors, without a number, or beyond 89.5 deg. ValueError if
        a deviation is not positive.
        """
    def process(
        self,
        imu: Recording,
        gnss: Fixes | None = None,
        *,
        rest: npt.ArrayLike | None = None,
        time_offset: float = 0.0,
        keep: Literal["all", "track"] = "all",
    ) -> Track:
        """Takes a recording with a gyro and an accelerometer on one clock, and the fixes of a receiver;
        returns the `Track`: what a loop over ``update`` and ``update_gnss`` would have said after each
        sample, and the smoother. ``rest``, bool (n,), says where the vehicle is known to stand;
        ``time_offset`` is added to the times of the fixes, s. ``keep="track"`` leaves out what the
        smoother needs, 2.8 kB a step of the covariance: for long records.
        """
    def process_arrays(
        self,
        time: npt.ArrayLike,
        gyro: npt.ArrayLike,
        accel: npt.ArrayLike,
        fixes: npt.ArrayLike,
        rest: npt.ArrayLike | None = None,
        record: bool = False,
    ) -> tuple[dict[str, Any], NavigationRecord | None]:
        """What ``process`` does, with arrays: times (n,), samples (n, 3), and of m fixes the rows time,
        position (deg, deg, m), velocity, deviations of both, shape (m, 13), NaN where a fix tells nothing.
        A fix is taken after the first sample that is not before it. Returns by name what is known after
        each sample, and of each fix its ``verdict`` (used, rejected, refused, or 3 if it comes after the
        last sample), ``nis`` (m, 2) and when it was ``taken``, s; with ``record`` also what the smoother
        needs, else None. The interpreter lock is released.
        """
    @property
    def channels(self) -> int | None:
        """Number of signals, None for a single one."""
    def reset(self) -> None:
        """Back to before the first sample, with the same parameters."""
    def to_bytes(self) -> bytes:
        """Parameters and state as bytes, with versions and a checksum."""
    @staticmethod
    def from_bytes(b: bytes) -> NavigationFilter:
        """The object that ``to_bytes`` saved, which goes on equal to the last bit; ValueError
        if the bytes are not one.
        """
    def copy(self) -> NavigationFilter:
        """An independent object in the same state."""
    def __copy__(self) -> NavigationFilter: ...
    def __deepcopy__(self, _memo: Any) -> NavigationFilter: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def position(self) -> _Floats:
        """Latitude and longitude, deg, and height, m, of the sensor; NaN before the first fix: (3,)."""
    @property
    def velocity(self) -> _Floats:
        """North, east and down, m/s; NaN before the first fix: (3,)."""
    @property
    def quaternion(self) -> _Floats:
        """Quaternion w, x, y, z from the body's axes to north, east, down: (4,)."""
    @property
    def gyro_bias(self) -> _Floats:
        """Bias of the gyro, rad/s: (3,)."""
    @property
    def accel_bias(self) -> _Floats:
        """Bias of the accelerometer, m/s^2: (3,)."""
    @property
    def sigma(self) -> _Floats:
        """Standard deviations at the last step of the covariance: position and velocity north, east and
        down, m and m/s, orientation about these axes, rad, biases of gyro and accelerometer, rad/s and
        m/s^2; NaN before the first fix: (15,).
        """
    @property
    def covariance(self) -> _Floats:
        """Covariance of the errors at its last step, in the order of ``sigma``; that of the velocity is
        ``v_estimated - exp(-[phi x]) v`` with phi the error of the orientation, those of biases are true
        less estimated: (15, 15).
        """
    @property
    def nis(self) -> _Floats:
        """Normalised innovations squared of the last position and velocity, 3 on average in a filter that
        is consistent; NaN before the first: (2,).
        """
    @property
    def learned_sigma(self) -> _Floats:
        """Standard deviations of the receiver that the innovations show, position and velocity, m and m/s;
        NaN until ten pairs of fixes were seen: (2, 3).
        """
    @property
    def status(self) -> _Navigating:
        """ "waiting" for a fix, "no heading", "navigating", "coasting" without fixes for two seconds, or
        "missing": without samples of a sensor for a tenth of a second.
        """
    @property
    def antenna(self) -> _Floats:
        """From the sensor to the antenna, body axes, m: (3,)."""
    @property
    def time(self) -> float:
        """Time of the last sample, s; NaN before the first."""
    @property
    def samples_seen(self) -> int:
        """Samples of the sensors given so far, missing ones included."""
    @property
    def fix_count(self) -> dict[str, int]:
        """Fixes so far by what became of them: "used", "rejected", "refused"."""
    @property
    def rejected_count(self) -> dict[str, int]:
        """What the gate has rejected so far, counted apart: "positions" and "velocities"."""
    @property
    def move_count(self) -> int:
        """How often the filter went where the positions are, after ten in a row that were rejected."""
    @property
    def last_move(self) -> tuple[float, float] | None:
        """When it last did so, s, and how far it was, m; None if it never did."""

@final
class NavigationRecord:
    """The steps of a filter over a batch, as the smoother needs them: 2.8 kB each."""

    def __len__(self) -> int: ...
    def smoothed(self) -> dict[str, Any]:
        """What all fixes say of each of K steps, as arrays by name: ``sample``, the index of the sample that
        it ends at; ``begins``, whether the filter began there; the errors of what it knew ``before`` and
        ``after`` the measurements there, and their deviations ``sigma``, (K, 15) in the order of
        `NavigationFilter.sigma`.
        """

@final
class PositionFilter(Generic[_Number, _Flag]):
    """Positions from the fixes of a receiver that stands or moves slowly, without most of their wandering.

    A fix is metres east and north of some point near by. What the receiver or others may tell besides:
    ``speed``, its Doppler velocity east and north in m/s; ``cn0``, the strength of the signals in dB-Hz;
    ``rest``, whether the platform is known to stand, as a ``RestDetector`` or a wheel tells.

    - **aided** uses all of them: Doppler moves the position, rest lets it stand, fixes of weak signals
      count less, and the slow error of the receiver is a state, so that its wandering is not followed.
    - **moving_average** is the mean of the last ``window`` fixes: late by half of them in motion.
    - **kalman** takes the velocity for constant but for a white acceleration.
    - **heading** does not take a step shorter than ``step`` that turns the course by more than ``turn``.
    - **strength** is "kalman" with fixes of weak signals trusted less: a variance of ``sigma**2 *
      10**((45 - cn0) / 10)`` below 45 dB-Hz (the sigma-epsilon form).

    The last four stand in papers and are here to compare with. **Nothing here removes the slow error
    itself**: metres that stay for minutes look like a place. It is averaged over what was seen of it.

    What is missing is NaN or None: of a fix it is predicted, not corrected; an unknown velocity is the
    last one, to ``acceleration`` times the time since; an unknown strength is a strong one. What a method
    has no use for it does not look at. Before the first fix NaN is returned. One object serves one thread
    at a time.

    Parameters
    ----------
    rate : float
        Fixes a second.
    method : {"aided", "moving_average", "kalman", "heading", "strength"}, default "aided"
        What is made of them.
    channels : int, optional
        Number of receivers side by side; ``None`` is a single one.
    window : int, default 10
        Of "moving_average": fixes, 1 to 64.
    sigma : float, default 0.7
        Of "aided", "kalman" and "strength": white noise of a fix of strong signals, an axis, m. Small
        follows the fixes.
    process_noise : float, default 0.5
        Of "kalman" and "strength": power spectral density of the acceleration, m^2/s^3. Small smooths
        and is late in turns.
    step, turn : float, default 3.0 and pi / 3
        Of "heading": m and rad.
    error_sigma, error_time : float, default 2.5 and 120.0
        Of "aided": slow error of the receiver, an axis, m, and the time in which it is forgotten, s.
        Large ones hold more against the fixes.
    speed_sigma : float, default 0.1
        Of "aided": white noise of the Doppler velocity, an axis, m/s.
    acceleration : float, default 1.0
        Of "aided": how fast the velocity may change while it is unknown, m/s^2.

    Raises
    ------
    ValueError
        A parameter is out of range, or is not used by the method.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> rng = np.random.default_rng(1)
    >>> fixes = 5.0 + 0.7 * rng.standard_normal((300, 2))  # it stands at (5, 5)
    >>> path = zr.PositionFilter(1.0).process(fixes, rest=np.ones(300, bool))
    >>> raw, aided = (np.hypot(*np.diff(x, axis=0).T).sum() for x in (fixes, path))
    >>> round(raw), round(aided)  # metres that were drawn
    (362, 34)
    >>> live = zr.PositionFilter(1.0)
    >>> for fix in fixes:
    ...     position = live.update(fix, speed=(0.0, 0.0), cn0=42.0)
    >>> position.round(1).tolist(), round(live.sigma, 1)
    ([4.9, 4.9], 1.9)
    """

    @overload
    def __new__(
        cls,
        rate: float,
        *,
        method: Literal["aided"] = "aided",
        channels: None = None,
        sigma: float = 0.7,
        error_sigma: float = 2.5,
        error_time: float = 120.0,
        speed_sigma: float = 0.1,
        acceleration: float = 1.0,
    ) -> PositionFilter[float, bool]: ...
    @overload
    def __new__(
        cls,
        rate: float,
        *,
        method: Literal["aided"] = "aided",
        channels: int,
        sigma: float = 0.7,
        error_sigma: float = 2.5,
        error_time: float = 120.0,
        speed_sigma: float = 0.1,
        acceleration: float = 1.0,
    ) -> PositionFilter[_Floats, _Flags]: ...
    @overload
    def __new__(
        cls,
        rate: float,
        *,
        method: Literal["moving_average"],
        channels: None = None,
        window: int = 10,
    ) -> PositionFilter[float, bool]: ...
    @overload
    def __new__(
        cls, rate: float, *, method: Literal["moving_average"], channels: int, window: int = 10
    ) -> PositionFilter[_Floats, _Flags]: ...
    @overload
    def __new__(
        cls,
        rate: float,
        *,
        method: Literal["kalman", "strength"],
        channels: None = None,
        sigma: float = 0.7,
        process_noise: float = 0.5,
    ) -> PositionFilter[float, bool]: ...
    @overload
    def __new__(
        cls,
        rate: float,
        *,
        method: Literal["kalman", "strength"],
        channels: int,
        sigma: float = 0.7,
        process_noise: float = 0.5,
    ) -> PositionFilter[_Floats, _Flags]: ...
    @overload
    def __new__(
        cls,
        rate: float,
        *,
        method: Literal["heading"],
        channels: None = None,
        step: float = 3.0,
        turn: float = 1.0471975511965976,
    ) -> PositionFilter[float, bool]: ...
    @overload
    def __new__(
        cls,
        rate: float,
        *,
        method: Literal["heading"],
        channels: int,
        step: float = 3.0,
        turn: float = 1.0471975511965976,
    ) -> PositionFilter[_Floats, _Flags]: ...
    def update(
        self,
        position: npt.ArrayLike,
        speed: npt.ArrayLike | None = None,
        cn0: _Sample = None,
        rest: _Sample = None,
        dt: float | None = None,
    ) -> _Floats:
        """Takes a fix, returns the position, m east and north: (2,) to (2,), with channels (k, 2) to
        (k, 2). ``speed`` is of the shape of ``position``, ``cn0`` and ``rest`` are a number and a bool,
        with channels (k,); ``dt`` is the time since the fix before, s, by default one period.
        """
    def process(
        self,
        position: npt.ArrayLike,
        speed: npt.ArrayLike | None = None,
        cn0: npt.ArrayLike | None = None,
        rest: npt.ArrayLike | None = None,
        dt: npt.ArrayLike | None = None,
        out: _Floats | None = None,
        threads: int | None = None,
    ) -> _Floats:
        """What ``update`` returns for each fix of a batch: (n, 2) to (n, 2), with channels (n, k, 2) to
        (n, k, 2); ``cn0`` and ``rest`` are (n,), with channels (n, k); ``dt`` is one time for all fixes
        or (n,). The interpreter lock is released.
        """
    def trace(
        self,
        position: npt.ArrayLike,
        speed: npt.ArrayLike | None = None,
        cn0: npt.ArrayLike | None = None,
        rest: npt.ArrayLike | None = None,
        dt: npt.ArrayLike | None = None,
    ) -> _PositionTrace:
        """Like ``process``, but returns all that was known after each fix, as arrays by name: position,
        velocity and receiver_error (n, 2), sigma, missing and held (n,); with channels (n, k, …).
        ``missing`` says where there was no fix, ``held`` where "heading" did not take it.
        """
    def reset(self) -> None:
        """Back to before the first sample, with the same parameters."""
    def copy(self) -> Self:
        """An independent object in the same state."""
    def to_bytes(self) -> bytes:
        """Parameters and state as bytes, with versions and a checksum."""
    @staticmethod
    def from_bytes(b: bytes) -> PositionFilter:
        """The object that ``to_bytes`` saved, which goes on equal to the last bit; ValueError
        if the bytes are not one.
        """
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def position(self) -> _Floats:
        """East and north, m, NaN before the first fix: (2,), with channels (k, 2)."""
    @property
    def sigma(self) -> _Number:
        """Standard deviation of ``position``, an axis, m; NaN for "moving_average" and "heading": float,
        with channels (k,).
        """
    @property
    def velocity(self) -> _Floats:
        """Velocity east and north, m/s: of "aided" the last that was given, zero at rest; NaN for
        "moving_average" and "heading": (2,), with channels (k, 2).
        """
    @property
    def receiver_error(self) -> _Floats:
        """Slow error that "aided" takes the receiver to have, m east and north, else NaN: (2,), with
        channels (k, 2).
        """
    @property
    def missing(self) -> _Flag:
        """Whether the last fix was missing: bool, with channels (k,)."""
    @property
    def held(self) -> _Flag:
        """Whether "heading" did not take the last fix: bool, with channels (k,)."""
    @property
    def samples_seen(self) -> int:
        """Fixes given so far, missing ones included."""
    @property
    def rate(self) -> float:
        """Fixes a second."""
    @property
    def method(self) -> _PositionMethod:
        """What is made of the fixes."""
    @property
    def channels(self) -> int | None:
        """Number of signals, None for a single one."""

@final
class WaveletDenoiser(Generic[_Number, _Flag]):
    """Wavelet denoising while samples arrive, late by a known number of samples.

    A decimated bank of Daubechies' filters splits the signal into octaves; details smaller than
    ``threshold`` deviations of the noise are taken away (VisuShrink), and the rest is put together
    again. What ``update`` returns belongs to the sample ``delay`` samples ago, ``(2**level - 1) *
    (taps - 1) + 1``, to the last bit of that number: with ``threshold=0`` it is that sample, to
    rounding. **At equal delay a linear-phase low-pass is better nearly always**: docs/explanation/wavelets.md.

    The deviation of the noise is learned from the finest octave, by counting how many details lie
    within it: no outlier moves it by more than any other sample. Sixteen details begin it, and before
    that nothing is taken away. Motion that is quick enough to reach the finest octave passes for noise
    in time; the longer the filter, the quicker it must be.

    One that is not finite (or ``update(None)``) is a missing sample: the last one before it is taken
    for it, and the noise learns nothing from details that it is in. Before the first sample NaN is
    returned. One object serves one thread at a time.

    Parameters
    ----------
    rate : float
        Samples a second: it says how fast the noise is followed (a factor of e in some 10 s), and
        what ``delay_seconds`` is.
    wavelet : {"haar", "db2", "db4", "db8"}, default "db2"
        2, 4, 8 or 16 taps. Short ones delay less, long ones tell motion from noise better.
    level : int, default 3
        Octaves that are denoised, from 1 to 10: each halves the variance of white noise and doubles
        the delay.
    mode : {"hard", "soft"}, default "hard"
        Details above the threshold stay, or come nearer to zero by it: soft is smoother at rest and
        bends motion.
    threshold : float, default 4.0
        In deviations of the noise; 4 is that of VisuShrink for 3000 samples. 0 takes nothing away.
    channels : int, optional
        Number of signals side by side; ``None`` is a single one.

    Raises
    ------
    ValueError
        A parameter is out of range.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> denoiser = zr.WaveletDenoiser(rate=200.0, level=3)
    >>> denoiser.delay, denoiser.delay_seconds
    (22, 0.11)
    >>> z = 5.0 + np.random.default_rng(1).standard_normal(20_000)
    >>> x = denoiser.process(z)
    >>> round(float(x[10_000:].std()), 2)  # 1 / sqrt(2**3) = 0.35
    0.34
    """

    @overload
    def __new__(
        cls,
        rate: float,
        wavelet: _Wavelet = "db2",
        level: int = 3,
        mode: _Shrinking = "hard",
        threshold: float = 4.0,
        *,
        channels: None = None,
    ) -> WaveletDenoiser[float, bool]: ...
    @overload
    def __new__(
        cls,
        rate: float,
        wavelet: _Wavelet = "db2",
        level: int = 3,
        mode: _Shrinking = "hard",
        threshold: float = 4.0,
        *,
        channels: int,
    ) -> WaveletDenoiser[_Floats, _Flags]: ...
    def update(self, z: _Sample) -> _Number:
        """Takes one sample, returns the denoised one of ``delay`` samples ago: float to float, with
        channels (k,) to (k,).
        """
    def process(
        self, z: npt.ArrayLike, out: _Floats | None = None, threads: int | None = None
    ) -> _Floats:
        """What ``update`` returns for each sample of a batch: (n,) to (n,), with channels (n, k)
        to (n, k); the interpreter lock is released.
        """
    def reset(self) -> None:
        """Back to before the first sample, with the same parameters."""
    def copy(self) -> Self:
        """An independent object in the same state."""
    def to_bytes(self) -> bytes:
        """Parameters and state as bytes, with versions and a checksum."""
    @staticmethod
    def from_bytes(b: bytes) -> WaveletDenoiser:
        """The object that ``to_bytes`` saved, which goes on equal to the last bit; ValueError
        if the bytes are not one.
        """
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def delay(self) -> int:
        """By how many samples what is returned is late."""
    @property
    def delay_seconds(self) -> float:
        """The same in seconds."""
    @property
    def sigma(self) -> _Number:
        """Deviation of the noise so far, in the samples' unit, zero before it is known: float, with
        channels (k,).
        """
    @property
    def missing_count(self) -> int | _Counts:
        """Samples that were missing so far: int, with channels (k,)."""
    @property
    def samples_seen(self) -> int:
        """Samples given so far, missing ones included."""
    @property
    def rate(self) -> float:
        """Samples a second."""
    @property
    def wavelet(self) -> _Wavelet:
        """Name of the wavelet."""
    @property
    def level(self) -> int:
        """Octaves that are denoised."""
    @property
    def mode(self) -> _Shrinking:
        """What is left of a coefficient: "hard" or "soft"."""
    @property
    def threshold(self) -> float:
        """In deviations of the noise."""
    @property
    def channels(self) -> int | None:
        """Number of signals, None for a single one."""

def register(**rules: Callable[..., Any]) -> None: ...
def autoregression_variances(
    z: npt.ArrayLike, order: int, method: str, constant: bool
) -> tuple[_Floats, int]: ...
def chi_squared_quantile(probability: float, edf: npt.ArrayLike) -> _Floats: ...
def chi_squared_survival(value: float, freedom: float) -> float: ...
def denoise(
    z: npt.ArrayLike,
    wavelet: str,
    level: int | str,
    rho: float | None,
    mode: str,
    approximation: bool,
) -> tuple[_Floats, _Counts, _Floats, _Floats]: ...
def propagate_turns(
    rates: npt.ArrayLike,
    steps: npt.ArrayLike,
    spans: npt.ArrayLike,
    biases: npt.ArrayLike,
    matrix: npt.ArrayLike,
) -> tuple[_Floats, _Floats, _Floats, _Floats]: ...
def check_ticks(
    time: npt.ArrayLike, values: npt.ArrayLike, start: float, count: int
) -> _Floats: ...
def check_gyro(
    rates: npt.ArrayLike, forces: npt.ArrayLike
) -> tuple[_Floats, _Floats, _Floats, npt.NDArray[np.uint64], int]: ...
def check_fit(
    rates: npt.ArrayLike,
    forces: npt.ArrayLike,
    starts: Sequence[int] | npt.NDArray[np.integer[Any]],
    length: int,
    bias: Sequence[float] | _Floats,
    fits: bool,
) -> tuple[_Floats, _Floats, _Floats]: ...
def check_field(
    rates: npt.ArrayLike, fields: npt.ArrayLike
) -> tuple[_Floats, _Floats, npt.NDArray[np.uint64], int]: ...
def integrate_rates(rates: npt.ArrayLike, steps: npt.ArrayLike, method: str) -> _Floats: ...
def exponential_mean(z: npt.ArrayLike, gain: float) -> _Floats: ...
def log_normal_cdf(x: npt.ArrayLike) -> _Floats: ...
def lagged_products(z: npt.ArrayLike, lags: int) -> tuple[_Floats, _Counts]: ...
def reversals(z: npt.ArrayLike) -> tuple[int, int, float]: ...
def without_outliers(
    z: npt.ArrayLike, width: int, threshold: float, least_deviation: float
) -> tuple[_Floats, _Counts]: ...
def allan_deviations(
    z: npt.ArrayLike,
    factors: Sequence[int] | _Counts,
    kind: str = "oadev",
    bridge: int = 0,
    threads: int | None = None,
) -> tuple[_Floats, _Counts, _Counts]: ...
def fit_autoregression(
    z: npt.ArrayLike, order: int, method: str, constant: bool
) -> tuple[_Floats, float, float, _Floats, int, float]: ...
def longest_factor(kind: str, n: int) -> int: ...
def arma_residuals(
    z: npt.ArrayLike,
    phi: Sequence[float],
    theta: Sequence[float],
    centre: float,
    constant: float,
) -> _Floats: ...
def arma_fit(
    z: npt.ArrayLike,
    p: int,
    q: int,
    constant: bool,
    exact: bool,
    start: Sequence[float] | _Floats | None = None,
) -> tuple[
    tuple[_Floats, _Floats, float, float, _Floats],
    tuple[int, float, float, float, float, float],
    tuple[bool, bool, bool, int],
]: ...
def arma_grid(
    z: npt.ArrayLike, p: int, q: int
) -> tuple[_Floats, _Flags, _Counts, int, list[_Floats]]: ...
def arma_likelihood(
    z: npt.ArrayLike,
    phi: Sequence[float] | _Floats,
    theta: Sequence[float] | _Floats,
    mean: float,
) -> tuple[float, float, int]: ...
def attitude_options() -> list[_Option]: ...
def filter_options() -> list[_Option]: ...
def position_options() -> list[_Option]: ...
def tilt_options() -> list[_Option]: ...
def wavelet_decomposition(z: npt.ArrayLike, wavelet: str, level: int) -> list[_Floats]: ...
def smooth_linear(
    state: npt.ArrayLike,
    covariance: npt.ArrayLike,
    F: npt.ArrayLike,
    Q: npt.ArrayLike,
    B: npt.ArrayLike | None = None,
    u: npt.ArrayLike | None = None,
) -> tuple[_Floats, _Floats]: ...
