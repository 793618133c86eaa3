from collections.abc import Sequence
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
_Zones: TypeAlias = tuple[float, float] | Literal["published"]
_Motion: TypeAlias = Literal["hold", "ignore"]
_Output: TypeAlias = Literal["compensated", "estimate"]
_Noise: TypeAlias = Literal["allan", "hadamard"]
_Wavelet: TypeAlias = Literal["haar", "db2", "db4", "db8"]
_Shrinking: TypeAlias = Literal["soft", "hard"]
_Outliers: TypeAlias = Literal["keep", "reject"]
_Sample: TypeAlias = SupportsFloat | SupportsIndex | npt.ArrayLike | None
_Floats: TypeAlias = npt.NDArray[np.float64]
_Counts: TypeAlias = npt.NDArray[np.int64]
_Flags: TypeAlias = npt.NDArray[np.bool_]

# What a single signal gives, float and bool, or what channels do, arrays; any of both where an
# annotation does not say.
_Number = TypeVar("_Number", default=Any)
_Flag = TypeVar("_Flag", default=Any)

__all__ = [
    "AllanNoise",
    "DriftFilter",
    "RecursiveLeastSquares",
    "ReplayScores",
    "RestDetector",
    "StreamingAllan",
    "Trace",
    "WaveletDenoiser",
    "__version__",
    "allan_deviations",
    "arma_fit",
    "arma_grid",
    "arma_likelihood",
    "arma_residuals",
    "autoregression_variances",
    "chi_squared_quantile",
    "chi_squared_survival",
    "denoise",
    "exponential_mean",
    "filter_options",
    "fit_autoregression",
    "lagged_products",
    "log_normal_cdf",
    "longest_factor",
    "reversals",
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
    def started(start: _Start, **params: Any) -> DriftFilter: ...
    def update(self, z: _Sample) -> _Number: ...
    def process(
        self, z: npt.ArrayLike, out: _Floats | None = None, threads: int | None = None
    ) -> _Floats: ...
    def _replay(
        self,
        z: _Floats,
        out: _Floats,
        noted: tuple[_Floats, _Flags, _Flags] | None = None,
    ) -> None: ...
    def trace(self, z: npt.ArrayLike) -> Trace: ...
    def reset(self) -> None: ...
    def power_on(self) -> None: ...
    def copy(self) -> Self: ...
    def to_bytes(self) -> bytes: ...
    @staticmethod
    def from_bytes(b: bytes) -> DriftFilter: ...
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def estimate(self) -> _Number: ...
    @property
    def angle_random_walk(self) -> _Number: ...
    @property
    def rate_random_walk(self) -> _Number: ...
    @property
    def bias(self) -> _Number: ...
    @property
    def bias_sigma(self) -> _Number: ...
    @property
    def at_rest(self) -> _Flag: ...
    @property
    def saturated(self) -> _Flag: ...
    @property
    def stuck(self) -> _Flag: ...
    @property
    def status(self) -> _Status | list[_Status]: ...
    @property
    def innovation(self) -> _Number: ...
    @property
    def innovation_variance(self) -> _Number: ...
    @property
    def measurement_noise(self) -> _Number: ...
    @property
    def gain(self) -> _Floats: ...
    @property
    def process_noise(self) -> _Floats: ...
    @property
    def coefficients(self) -> _Floats: ...
    @property
    def covariance(self) -> _Floats: ...
    @property
    def samples_seen(self) -> int: ...
    @property
    def guard_count(self) -> int | _Counts: ...
    @property
    def exit_count(self) -> int | _Counts: ...
    @property
    def restarts(self) -> int | _Counts: ...
    @property
    def saturated_count(self) -> int | _Counts: ...
    @property
    def outlier_count(self) -> int | _Counts: ...
    @property
    def stuck_count(self) -> int | _Counts: ...
    @property
    def ready(self) -> _Flag: ...
    @property
    def channels(self) -> int | None: ...
    @property
    def rate(self) -> float: ...
    @property
    def order(self) -> tuple[int, int] | None: ...
    @property
    def method(self) -> _Method: ...
    @property
    def start(self) -> _Start | None: ...
    @property
    def params(self) -> _Params: ...

@final
class ReplayScores:
    def __new__(
        cls, axes: int, estimates: int, horizons: Sequence[int], delay: int | None = None
    ) -> Self: ...
    def take(
        self,
        raw: _Floats,
        estimates: Sequence[_Floats],
        at_rest: _Flags | None = None,
        truth: _Floats | None = None,
    ) -> None: ...
    def finish(self) -> dict[str, npt.NDArray[Any]]: ...

@final
class Trace:
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
class RecursiveLeastSquares(Generic[_Number, _Flag]):
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
    def update(self, z: _Sample) -> _Number: ...
    def process(
        self, z: npt.ArrayLike, out: _Floats | None = None, threads: int | None = None
    ) -> _Floats: ...
    def reset(self) -> None: ...
    def copy(self) -> Self: ...
    def to_bytes(self) -> bytes: ...
    @staticmethod
    def from_bytes(b: bytes) -> RecursiveLeastSquares: ...
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def coefficients(self) -> _Floats: ...
    @property
    def covariance(self) -> _Floats: ...
    @property
    def samples_seen(self) -> int: ...
    @property
    def ready(self) -> _Flag: ...
    @property
    def order(self) -> tuple[int, int]: ...
    @property
    def channels(self) -> int | None: ...

@final
class AllanNoise(Generic[_Number]):
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
    def update(self, z: _Sample) -> _Number: ...
    def process(
        self, z: npt.ArrayLike, out: _Floats | None = None, threads: int | None = None
    ) -> _Floats: ...
    def reset(self) -> None: ...
    def copy(self) -> Self: ...
    def to_bytes(self) -> bytes: ...
    @staticmethod
    def from_bytes(b: bytes) -> AllanNoise: ...
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def variance(self) -> _Number: ...
    @property
    def channels(self) -> int | None: ...

@final
class RestDetector(Generic[_Flag]):
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
    def update(self, z: _Sample) -> _Flag: ...
    def process(
        self, z: npt.ArrayLike, out: _Flags | None = None, threads: int | None = None
    ) -> _Flags: ...
    def reset(self) -> None: ...
    def copy(self) -> Self: ...
    def to_bytes(self) -> bytes: ...
    @staticmethod
    def from_bytes(b: bytes) -> RestDetector: ...
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def at_rest(self) -> _Flag: ...
    @property
    def rate(self) -> float: ...
    @property
    def channels(self) -> int | None: ...

@final
class StreamingAllan:
    def __new__(cls, rate: float, octaves: int = 16, *, channels: int | None = None) -> Self: ...
    def update(self, z: _Sample) -> None: ...
    def process(self, z: npt.ArrayLike, threads: int | None = None) -> None: ...
    def reset(self) -> None: ...
    def copy(self) -> Self: ...
    def to_bytes(self) -> bytes: ...
    @staticmethod
    def from_bytes(b: bytes) -> StreamingAllan: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def rate(self) -> float: ...
    @property
    def octaves(self) -> int: ...
    @property
    def channels(self) -> int | None: ...
    @property
    def samples_seen(self) -> int: ...
    @property
    def taus(self) -> _Floats: ...
    @property
    def deviation(self) -> _Floats: ...
    @property
    def hadamard_deviation(self) -> _Floats: ...
    @property
    def terms(self) -> _Counts: ...
    @property
    def hadamard_terms(self) -> _Counts: ...

@final
class WaveletDenoiser(Generic[_Number, _Flag]):
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
    def update(self, z: _Sample) -> _Number: ...
    def process(
        self, z: npt.ArrayLike, out: _Floats | None = None, threads: int | None = None
    ) -> _Floats: ...
    def reset(self) -> None: ...
    def copy(self) -> Self: ...
    def to_bytes(self) -> bytes: ...
    @staticmethod
    def from_bytes(b: bytes) -> WaveletDenoiser: ...
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def delay(self) -> int: ...
    @property
    def delay_seconds(self) -> float: ...
    @property
    def sigma(self) -> _Number: ...
    @property
    def missing(self) -> _Flag: ...
    @property
    def samples_seen(self) -> int: ...
    @property
    def rate(self) -> float: ...
    @property
    def wavelet(self) -> _Wavelet: ...
    @property
    def level(self) -> int: ...
    @property
    def mode(self) -> _Shrinking: ...
    @property
    def threshold(self) -> float: ...
    @property
    def channels(self) -> int | None: ...

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
def filter_options() -> list[_Option]: ...
def wavelet_decomposition(z: npt.ArrayLike, wavelet: str, level: int) -> list[_Floats]: ...
