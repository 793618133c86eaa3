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
from zerorate.calibration.magnetometer import MagnetometerCalibration
from zerorate.linear.run import LinearRun
from zerorate.navigation.aids import Aid
from zerorate.navigation.alignment import Alignment
from zerorate.navigation.track import Track
from zerorate.navigation.wheels import Wheels
from zerorate.noise import NoiseModel
from zerorate.record import Recording
from zerorate.record.fixes import Fixes
from zerorate.record.offset import TimeOffset
from zerorate.tasks.trace import Trace

_Method: TypeAlias = Literal["kf", "akf", "fading", "robust", "auto"]
_Status: TypeAlias = Literal[
    "starting",
    "restarting",
    "at rest",
    "provisional",
    "in motion",
    "no rest yet",
    "stuck",
]
_Verdict: TypeAlias = Literal["used", "rejected", "refused"]
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
_MagnetometerState: TypeAlias = Literal["raw", "known", "kept", "withheld"]
_AttitudeStatus: TypeAlias = Literal[
    "starting",
    "clipped",
    "rate missing",
    "wrong unit",
    "wrong unit?",
    "magnetometer stuck",
    "at rest, or on a rate table: bias_limit",
    "disturbed",
    "at rest",
    "moving",
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
    events: _Floats

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
    "FootFilter",
    "GyroArray",
    "ImuCorrector",
    "LinearKalman",
    "MotionDetector",
    "NavigationBank",
    "NavigationFilter",
    "NavigationRecord",
    "PositionFilter",
    "RecursiveLeastSquares",
    "ReplayScores",
    "RestDetector",
    "StreamingAllan",
    "TemperatureFilter",
    "Tilt",
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
    "dataflash_index",
    "denoise",
    "exponential_mean",
    "filter_options",
    "fit_autoregression",
    "foot_lead",
    "foot_track",
    "integrate_rates",
    "lagged_products",
    "log_normal_cdf",
    "longest_factor",
    "longest_quiet",
    "magnet_covariance",
    "magnet_fit",
    "magnet_partition",
    "pack_lz4",
    "parse_rows",
    "position_options",
    "propagate_turns",
    "read_blackbox",
    "read_gopro",
    "read_mcap",
    "register",
    "restore_clipped_rates",
    "reversals",
    "smooth_linear",
    "tilt_options",
    "wavelet_decomposition",
    "without_outliers",
]

__version__: Final[str]

class _FilterOptions(TypedDict, total=False):
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

class _Stream:
    """Members of all classes that take samples one by one."""

    def reset(self) -> None: ...
    def copy(self) -> Self: ...
    def to_bytes(self) -> bytes: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @property
    def channels(self) -> int | None: ...

@final
class DriftFilter(_Stream, Generic[_Number, _Flag]):
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
    def update(self, z: _Sample, moving: bool = False) -> _Number: ...
    def process(
        self,
        z: npt.ArrayLike,
        out: _Floats | None = None,
        threads: int | None = None,
        moving: npt.ArrayLike | None = None,
    ) -> _Floats: ...
    def _replay(
        self,
        z: _Floats,
        out: _Floats,
        noted: tuple[_Floats, _Flags, _Flags] | None = None,
        moving: npt.ArrayLike | None = None,
    ) -> None: ...
    def trace(self, z: npt.ArrayLike, moving: npt.ArrayLike | None = None) -> Trace: ...
    def power_on(self) -> None: ...
    def bias_sigma_over(self, seconds: float) -> _Number: ...
    @staticmethod
    def from_bytes(b: bytes) -> DriftFilter: ...
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    @property
    def estimate(self) -> _Number: ...
    @property
    def angle_random_walk(self) -> _Number: ...
    @property
    def rate_random_walk(self) -> _Number: ...
    @property
    def bias_instability(self) -> _Number: ...
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
    def restart_count(self) -> int | _Counts: ...
    @property
    def saturated_count(self) -> int | _Counts: ...
    @property
    def outlier_count(self) -> int | _Counts: ...
    @property
    def stuck_count(self) -> int | _Counts: ...
    @property
    def ready(self) -> _Flag: ...
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
class MotionDetector(_Stream, Generic[_Flag]):
    @overload
    def __new__(cls, rate: float, *, channels: None = None) -> MotionDetector[bool]: ...
    @overload
    def __new__(cls, rate: float, *, channels: int) -> MotionDetector[_Flags]: ...
    def update(self, z: npt.ArrayLike | None) -> _Flag: ...
    def process(
        self, z: npt.ArrayLike, out: _Flags | None = None, threads: int | None = None
    ) -> _Flags: ...
    @staticmethod
    def from_bytes(b: bytes) -> MotionDetector: ...
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    @property
    def moving(self) -> _Flag: ...
    @property
    def rate(self) -> float: ...

@final
class RecursiveLeastSquares(_Stream, Generic[_Number, _Flag]):
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
    @staticmethod
    def from_bytes(b: bytes) -> RecursiveLeastSquares: ...
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
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

@final
class AllanNoise(_Stream, Generic[_Number]):
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
    @staticmethod
    def from_bytes(b: bytes) -> AllanNoise: ...
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    @property
    def variance(self) -> _Number: ...

@final
class RestDetector(_Stream, Generic[_Flag]):
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
    def update(self, z: _Sample, moving: bool = False) -> _Flag: ...
    def process(
        self,
        z: npt.ArrayLike,
        out: _Flags | None = None,
        threads: int | None = None,
        moving: npt.ArrayLike | None = None,
    ) -> _Flags: ...
    @staticmethod
    def from_bytes(b: bytes) -> RestDetector: ...
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    @property
    def at_rest(self) -> _Flag: ...
    @property
    def rate(self) -> float: ...

@final
class StreamingAllan(_Stream):
    def __new__(cls, rate: float, octaves: int = 16, *, channels: int | None = None) -> Self: ...
    def update(self, z: _Sample) -> None: ...
    def process(self, z: npt.ArrayLike, threads: int | None = None) -> None: ...
    @staticmethod
    def from_bytes(b: bytes) -> StreamingAllan: ...
    @property
    def rate(self) -> float: ...
    @property
    def octaves(self) -> int: ...
    @property
    def samples_seen(self) -> int: ...
    @property
    def taus(self) -> _Floats: ...
    @property
    def deviation(self) -> _Floats: ...
    @property
    def hadamard_deviation(self) -> _Floats: ...
    @property
    def term_count(self) -> _Counts: ...
    @property
    def hadamard_term_count(self) -> _Counts: ...

@final
class Attitude(_Stream, Generic[_Number, _Flag]):
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
        gyro_range: float | None = None,
        magnetometer: MagnetometerCalibration | None = None,
        learn_magnetometer: bool = False,
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
        gyro_range: float | None = None,
        magnetometer: MagnetometerCalibration | None = None,
        learn_magnetometer: bool = False,
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
        gyro: npt.ArrayLike | None,
        accel: npt.ArrayLike | None,
        mag: npt.ArrayLike | None = None,
        *floats: float,
        dt: float | None = None,
    ) -> _Floats: ...
    def process(
        self,
        gyro: npt.ArrayLike,
        accel: npt.ArrayLike,
        mag: npt.ArrayLike | None = None,
        dt: npt.ArrayLike | None = None,
        out: _Floats | None = None,
        threads: int | None = None,
    ) -> _Floats: ...
    def trace(
        self,
        gyro: npt.ArrayLike,
        accel: npt.ArrayLike,
        mag: npt.ArrayLike | None = None,
        dt: npt.ArrayLike | None = None,
    ) -> _AttitudeTrace: ...
    def smooth(
        self,
        gyro: npt.ArrayLike,
        accel: npt.ArrayLike,
        mag: npt.ArrayLike | None = None,
        dt: npt.ArrayLike | None = None,
    ) -> _AttitudeTrace: ...
    def align(
        self, orientation: Any, tilt_sigma: float = 0.01, heading_sigma: float = 0.01
    ) -> None: ...
    def power_on(self) -> None: ...
    @staticmethod
    def from_bytes(b: bytes) -> Attitude: ...
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    @property
    def quaternion(self) -> _Floats: ...
    @property
    def rotation(self) -> Any: ...
    @property
    def euler(self) -> _Floats: ...
    @property
    def heading(self) -> _Number: ...
    @property
    def hard_iron(self) -> _Floats: ...
    @property
    def hard_iron_sigma(self) -> _Floats: ...
    @property
    def up(self) -> _Floats: ...
    @property
    def gravity(self) -> _Floats: ...
    @property
    def linear_acceleration(self) -> _Floats: ...
    @property
    def bias(self) -> _Floats: ...
    @property
    def bias_sigma(self) -> _Floats: ...
    @property
    def gyro_matrix(self) -> _Floats: ...
    @property
    def gyro_matrix_sigma(self) -> _Floats: ...
    @property
    def tilt_sigma(self) -> _Number: ...
    @property
    def heading_sigma(self) -> _Number: ...
    @property
    def at_rest(self) -> _Flag: ...
    @property
    def disturbed(self) -> _Flag: ...
    @property
    def magnetometer_state(self) -> _MagnetometerState | list[_MagnetometerState]: ...
    @property
    def status(self) -> _AttitudeStatus | list[_AttitudeStatus]: ...
    @property
    def rates_left_out(self) -> int | npt.NDArray[np.uint64]: ...
    @property
    def samples_seen(self) -> int: ...
    @property
    def rate(self) -> float: ...
    @property
    def method(self) -> _AttitudeMethod: ...
    @property
    def mag(self) -> bool: ...
    @property
    def gyro_unit(self) -> str: ...
    @property
    def accel_unit(self) -> str: ...

@final
class GyroArray(_Stream, Generic[_Number]):
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
    def update(self, z: npt.ArrayLike | None) -> _Number: ...
    def process(
        self, z: npt.ArrayLike, out: _Floats | None = None, threads: int | None = None
    ) -> _Floats: ...
    def trace(self, z: npt.ArrayLike) -> _ArrayTrace: ...
    def covariance(self, axis: int = 0) -> tuple[_Floats, _Floats, _Floats]: ...
    def power_on(self) -> None: ...
    @property
    def channels(self) -> int | None: ...
    @staticmethod
    def from_bytes(b: bytes) -> GyroArray: ...
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    @property
    def rate(self) -> float: ...
    @property
    def sensors(self) -> int: ...
    @property
    def axes(self) -> int: ...
    @property
    def labels(self) -> tuple[str, ...]: ...
    @property
    def bias(self) -> _Floats: ...
    @property
    def bias_sigma(self) -> _Floats: ...
    @property
    def weights(self) -> _Floats: ...
    @property
    def health(
        self,
    ) -> tuple[Literal["good", "missing", "saturated", "stuck", "excluded", "disputed"], ...]: ...
    @property
    def at_rest(self) -> _Flags: ...
    @property
    def samples_seen(self) -> int: ...

@final
class ImuCorrector(_Stream, Generic[_Corrected]):
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
    def update(self, z: npt.ArrayLike | None) -> _Corrected: ...
    def process(
        self, z: npt.ArrayLike, out: _Floats | None = None, threads: int | None = None
    ) -> _Corrected: ...
    @staticmethod
    def from_bytes(b: bytes) -> ImuCorrector: ...
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    @property
    def gyro_matrix(self) -> _Floats: ...
    @property
    def gyro_bias(self) -> _Floats: ...
    @property
    def accel_matrix(self) -> _Floats: ...
    @property
    def accel_bias(self) -> _Floats: ...
    @property
    def g_sensitivity(self) -> _Floats: ...
    @property
    def temperature(self) -> _TemperatureCurve | None: ...
    @property
    def bias(self) -> _Floats: ...
    @property
    def force(self) -> _Floats: ...
    @property
    def inputs(self) -> int: ...

@final
class TemperatureFilter(_Stream, Generic[_Number, _Flag]):
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
    def update(self, z: _Sample, temperature: _Sample = None) -> _Number: ...
    def process(
        self,
        z: npt.ArrayLike,
        temperature: npt.ArrayLike,
        out: _Floats | None = None,
        threads: int | None = None,
    ) -> _Floats: ...
    @staticmethod
    def from_bytes(b: bytes) -> TemperatureFilter: ...
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    @property
    def bias(self) -> _Number: ...
    @property
    def bias_sigma(self) -> _Number: ...
    @property
    def slope(self) -> _Number: ...
    @property
    def slope_sigma(self) -> _Number: ...
    @property
    def at_rest(self) -> _Flag: ...
    @property
    def samples_seen(self) -> int: ...
    @property
    def rate(self) -> float: ...
    @property
    def reference(self) -> float: ...

@final
class Tilt(_Stream, Generic[_Number]):
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
    def update(self, gyro: _Sample, angle: _Sample, dt: float | None = None) -> _Number: ...
    def process(
        self,
        gyro: npt.ArrayLike,
        angle: npt.ArrayLike,
        dt: npt.ArrayLike | None = None,
        out: _Floats | None = None,
        threads: int | None = None,
    ) -> _Floats: ...
    @staticmethod
    def from_bytes(b: bytes) -> Tilt: ...
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    @property
    def angle(self) -> _Number: ...
    @property
    def angle_sigma(self) -> _Number: ...
    @property
    def bias(self) -> _Number: ...
    @property
    def bias_sigma(self) -> _Number: ...
    @property
    def samples_seen(self) -> int: ...
    @property
    def rate(self) -> float: ...
    @property
    def method(self) -> str: ...

@final
class LinearKalman(_Stream, Generic[_Number]):
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
    ) -> _Floats: ...
    def update(
        self, z: _Sample, *, H: npt.ArrayLike | None = None, R: npt.ArrayLike | None = None
    ) -> _Floats: ...
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
    ) -> LinearRun: ...
    @staticmethod
    def from_bytes(b: bytes) -> LinearKalman: ...
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    @property
    def state(self) -> _Floats: ...
    @property
    def covariance(self) -> _Floats: ...
    @property
    def innovation(self) -> _Floats: ...
    @property
    def nis(self) -> _Number: ...
    @property
    def log_likelihood(self) -> _Number: ...
    @property
    def F(self) -> _Floats: ...
    @property
    def H(self) -> _Floats: ...
    @property
    def Q(self) -> _Floats: ...
    @property
    def R(self) -> _Floats: ...
    @property
    def B(self) -> _Floats: ...

@final
class FootFilter(_Stream, Generic[_Number, _Flag]):
    @overload
    def __new__(
        cls,
        rate: float,
        *,
        floor: Literal["level"] | None = None,
        gyro_range: float | None = None,
        channels: None = None,
    ) -> FootFilter[float, bool]: ...
    @overload
    def __new__(
        cls,
        rate: float,
        *,
        floor: Literal["level"] | None = None,
        gyro_range: float | None = None,
        channels: int,
    ) -> FootFilter[_Floats, _Flags]: ...
    def update(self, gyro: npt.ArrayLike | None, accel: npt.ArrayLike | None) -> _Floats: ...
    def process(
        self,
        gyro: npt.ArrayLike,
        accel: npt.ArrayLike,
        out: _Floats | None = None,
        threads: int | None = None,
    ) -> _Floats: ...
    @staticmethod
    def from_bytes(b: bytes) -> FootFilter: ...
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    @property
    def position(self) -> _Floats: ...
    @property
    def velocity(self) -> _Floats: ...
    @property
    def quaternion(self) -> _Floats: ...
    @property
    def gyro_bias(self) -> _Floats: ...
    @property
    def accel_bias(self) -> _Floats: ...
    @property
    def sigma(self) -> _Floats: ...
    @property
    def standing(self) -> _Flag: ...
    @property
    def at_rest(self) -> _Flag: ...
    @property
    def bound(self) -> _Number: ...
    @property
    def stance_count(self) -> int | npt.NDArray[np.uint64]: ...
    @property
    def fastest(self) -> _Number: ...
    @property
    def foot_share(self) -> _Number: ...
    @property
    def rejection_count(self) -> int | npt.NDArray[np.uint64]: ...
    @property
    def relevel_count(self) -> int | npt.NDArray[np.uint64]: ...
    @property
    def samples_seen(self) -> int: ...
    @property
    def delay(self) -> float: ...
    @property
    def rate(self) -> float: ...

@final
class NavigationBank(_Stream):
    def __new__(
        cls,
        start: Alignment,
        *,
        gyro: NoiseModel | Sequence[NoiseModel] | None = None,
        accel: NoiseModel | Sequence[NoiseModel] | None = None,
        gyro_vibration: float = 0.0,
        antenna: npt.ArrayLike = (0.0, 0.0, 0.0),
        antenna_sigma: npt.ArrayLike = 0.0,
        consider_antenna: bool = False,
        vehicle: Literal["wheeled"] | None = None,
        axle: npt.ArrayLike | None = None,
        wheel_sigma: float | None = None,
        speed_sigma: float | None = None,
        gate: float = 50.0,
        adapt: Literal["inflate", "free", "fixed"] = "inflate",
        covariance_step: float = 0.1,
        kind: Literal["rate", "increment"] = "rate",
        barometer_sigma: float = 0.5,
        barometer_walk: float = 0.02,
        compass_sigma: float = 0.035,
        compass_walk: float = 0.001,
        baseline: npt.ArrayLike | None = None,
        limits: dict[str, float] | None = None,
    ) -> Self: ...
    def update(
        self,
        t: float,
        gyro: npt.ArrayLike | None,
        accel: npt.ArrayLike | None,
        rest: bool = False,
    ) -> _Navigating: ...
    def update_gnss(
        self,
        t: float,
        position: npt.ArrayLike | None,
        velocity: npt.ArrayLike | None = None,
        position_sigma: npt.ArrayLike = 2.0,
        velocity_sigma: npt.ArrayLike = 0.1,
    ) -> _Verdict: ...
    def update_wheels(self, t: float, speed: float | None, sigma: float | None = None) -> bool: ...
    def update_height(
        self, t: float, height: float | None, sigma: float | None = None
    ) -> _Verdict: ...
    def update_pressure(
        self, t: float, pressure: float | None, sigma: float | None = None
    ) -> _Verdict: ...
    def update_heading(self, t: float, heading: float | None, sigma: float = 0.05) -> _Verdict: ...
    def update_baseline(
        self,
        t: float,
        vector: npt.ArrayLike | None,
        baseline: npt.ArrayLike | None = None,
        sigma: npt.ArrayLike = 0.02,
    ) -> _Verdict: ...
    def process(
        self,
        imu: Recording,
        gnss: Fixes | None = None,
        *,
        rest: npt.ArrayLike | None = None,
        wheel_speed: npt.ArrayLike | Wheels | None = None,
        time_offset: float | TimeOffset = 0.0,
        keep: Literal["track"] = "track",
        height: npt.ArrayLike | Aid | None = None,
        pressure: npt.ArrayLike | Aid | None = None,
        heading: npt.ArrayLike | Aid | None = None,
        baseline: npt.ArrayLike | Aid | None = None,
    ) -> Track: ...
    def process_arrays(
        self,
        time: npt.ArrayLike,
        gyro: npt.ArrayLike,
        accel: npt.ArrayLike,
        fixes: npt.ArrayLike,
        rest: npt.ArrayLike | None = None,
        record: Literal[False] = False,
        wheel_speed: npt.ArrayLike | None = None,
        aids: npt.ArrayLike | None = None,
    ) -> tuple[dict[str, Any], None]: ...
    @property
    def channels(self) -> int | None: ...
    @staticmethod
    def from_bytes(b: bytes) -> NavigationBank: ...
    @property
    def position(self) -> _Floats: ...
    @property
    def velocity(self) -> _Floats: ...
    @property
    def quaternion(self) -> _Floats: ...
    @property
    def gyro_bias(self) -> _Floats: ...
    @property
    def accel_bias(self) -> _Floats: ...
    @property
    def sigma(self) -> _Floats: ...
    @property
    def covariance(self) -> _Floats: ...
    @property
    def height_reference(self) -> float: ...
    @property
    def height_reference_sigma(self) -> float: ...
    @property
    def compass_offset(self) -> float: ...
    @property
    def compass_offset_sigma(self) -> float: ...
    @property
    def aid_count(self) -> dict[str, dict[str, int]]: ...
    @property
    def aid_nis(self) -> dict[str, float]: ...
    @property
    def aid_sigma(self) -> dict[str, float]: ...
    @property
    def aid_disturbed(self) -> dict[str, bool]: ...
    @property
    def usable(self) -> dict[str, bool]: ...
    @property
    def limits(self) -> dict[str, float]: ...
    @property
    def wheel_constants(self) -> _Floats: ...
    @property
    def wheel_constants_sigma(self) -> _Floats: ...
    @property
    def nis(self) -> _Floats: ...
    @property
    def learned_sigma(self) -> _Floats: ...
    @property
    def status(self) -> _Navigating: ...
    @property
    def antenna(self) -> _Floats: ...
    @property
    def antenna_sigma(self) -> _Floats: ...
    @property
    def time(self) -> float: ...
    @property
    def samples_seen(self) -> int: ...
    @property
    def fix_count(self) -> dict[str, int]: ...
    @property
    def rejected_count(self) -> dict[str, int]: ...
    @property
    def move_count(self) -> int: ...
    @property
    def last_move(self) -> tuple[float, float] | None: ...
    @property
    def weights(self) -> _Floats: ...
    @property
    def noise_factors(self) -> _Floats: ...

@final
class NavigationFilter(_Stream):
    def __new__(
        cls,
        start: Alignment,
        *,
        gyro: NoiseModel | Sequence[NoiseModel] | None = None,
        accel: NoiseModel | Sequence[NoiseModel] | None = None,
        gyro_vibration: float = 0.0,
        antenna: npt.ArrayLike = (0.0, 0.0, 0.0),
        antenna_sigma: npt.ArrayLike = 0.0,
        consider_antenna: bool = False,
        vehicle: Literal["wheeled"] | None = None,
        axle: npt.ArrayLike | None = None,
        wheel_sigma: float | None = None,
        speed_sigma: float | None = None,
        gate: float = 50.0,
        adapt: Literal["inflate", "free", "fixed"] = "inflate",
        covariance_step: float = 0.1,
        kind: Literal["rate", "increment"] = "rate",
        barometer_sigma: float = 0.5,
        barometer_walk: float = 0.02,
        compass_sigma: float = 0.035,
        compass_walk: float = 0.001,
        baseline: npt.ArrayLike | None = None,
        limits: dict[str, float] | None = None,
    ) -> Self: ...
    def update(
        self,
        t: float,
        gyro: npt.ArrayLike | None,
        accel: npt.ArrayLike | None,
        rest: bool = False,
    ) -> _Navigating: ...
    def update_gnss(
        self,
        t: float,
        position: npt.ArrayLike | None,
        velocity: npt.ArrayLike | None = None,
        position_sigma: npt.ArrayLike = 2.0,
        velocity_sigma: npt.ArrayLike = 0.1,
    ) -> _Verdict: ...
    def update_wheels(self, t: float, speed: float | None, sigma: float | None = None) -> bool: ...
    def update_height(
        self, t: float, height: float | None, sigma: float | None = None
    ) -> _Verdict: ...
    def update_pressure(
        self, t: float, pressure: float | None, sigma: float | None = None
    ) -> _Verdict: ...
    def update_heading(self, t: float, heading: float | None, sigma: float = 0.05) -> _Verdict: ...
    def update_baseline(
        self,
        t: float,
        vector: npt.ArrayLike | None,
        baseline: npt.ArrayLike | None = None,
        sigma: npt.ArrayLike = 0.02,
    ) -> _Verdict: ...
    def process(
        self,
        imu: Recording,
        gnss: Fixes | None = None,
        *,
        rest: npt.ArrayLike | None = None,
        wheel_speed: npt.ArrayLike | Wheels | None = None,
        time_offset: float | TimeOffset = 0.0,
        keep: Literal["all", "track"] = "all",
        height: npt.ArrayLike | Aid | None = None,
        pressure: npt.ArrayLike | Aid | None = None,
        heading: npt.ArrayLike | Aid | None = None,
        baseline: npt.ArrayLike | Aid | None = None,
    ) -> Track: ...
    def process_arrays(
        self,
        time: npt.ArrayLike,
        gyro: npt.ArrayLike,
        accel: npt.ArrayLike,
        fixes: npt.ArrayLike,
        rest: npt.ArrayLike | None = None,
        record: bool = False,
        wheel_speed: npt.ArrayLike | None = None,
        aids: npt.ArrayLike | None = None,
    ) -> tuple[dict[str, Any], NavigationRecord | None]: ...
    @property
    def channels(self) -> int | None: ...
    @staticmethod
    def from_bytes(b: bytes) -> NavigationFilter: ...
    @property
    def position(self) -> _Floats: ...
    @property
    def velocity(self) -> _Floats: ...
    @property
    def quaternion(self) -> _Floats: ...
    @property
    def gyro_bias(self) -> _Floats: ...
    @property
    def accel_bias(self) -> _Floats: ...
    @property
    def sigma(self) -> _Floats: ...
    @property
    def covariance(self) -> _Floats: ...
    @property
    def height_reference(self) -> float: ...
    @property
    def height_reference_sigma(self) -> float: ...
    @property
    def compass_offset(self) -> float: ...
    @property
    def compass_offset_sigma(self) -> float: ...
    @property
    def aid_count(self) -> dict[str, dict[str, int]]: ...
    @property
    def aid_nis(self) -> dict[str, float]: ...
    @property
    def aid_sigma(self) -> dict[str, float]: ...
    @property
    def aid_disturbed(self) -> dict[str, bool]: ...
    @property
    def usable(self) -> dict[str, bool]: ...
    @property
    def limits(self) -> dict[str, float]: ...
    @property
    def wheel_constants(self) -> _Floats: ...
    @property
    def wheel_constants_sigma(self) -> _Floats: ...
    @property
    def nis(self) -> _Floats: ...
    @property
    def learned_sigma(self) -> _Floats: ...
    @property
    def status(self) -> _Navigating: ...
    @property
    def antenna(self) -> _Floats: ...
    @property
    def antenna_sigma(self) -> _Floats: ...
    @property
    def time(self) -> float: ...
    @property
    def samples_seen(self) -> int: ...
    @property
    def fix_count(self) -> dict[str, int]: ...
    @property
    def rejected_count(self) -> dict[str, int]: ...
    @property
    def move_count(self) -> int: ...
    @property
    def last_move(self) -> tuple[float, float] | None: ...

@final
class NavigationRecord:
    def __len__(self) -> int: ...
    def smoothed(self, deviations: bool = True) -> dict[str, Any]: ...

@final
class PositionFilter(_Stream, Generic[_Number, _Flag]):
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
    ) -> _Floats: ...
    def process(
        self,
        position: npt.ArrayLike,
        speed: npt.ArrayLike | None = None,
        cn0: npt.ArrayLike | None = None,
        rest: npt.ArrayLike | None = None,
        dt: npt.ArrayLike | None = None,
        out: _Floats | None = None,
        threads: int | None = None,
    ) -> _Floats: ...
    def trace(
        self,
        position: npt.ArrayLike,
        speed: npt.ArrayLike | None = None,
        cn0: npt.ArrayLike | None = None,
        rest: npt.ArrayLike | None = None,
        dt: npt.ArrayLike | None = None,
    ) -> _PositionTrace: ...
    @staticmethod
    def from_bytes(b: bytes) -> PositionFilter: ...
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    @property
    def position(self) -> _Floats: ...
    @property
    def sigma(self) -> _Number: ...
    @property
    def velocity(self) -> _Floats: ...
    @property
    def receiver_error(self) -> _Floats: ...
    @property
    def missing(self) -> _Flag: ...
    @property
    def held(self) -> _Flag: ...
    @property
    def samples_seen(self) -> int: ...
    @property
    def rate(self) -> float: ...
    @property
    def method(self) -> _PositionMethod: ...

@final
class WaveletDenoiser(_Stream, Generic[_Number, _Flag]):
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
    @staticmethod
    def from_bytes(b: bytes) -> WaveletDenoiser: ...
    def __class_getitem__(cls, key: Any) -> GenericAlias: ...
    @property
    def delay(self) -> int: ...
    @property
    def delay_seconds(self) -> float: ...
    @property
    def sigma(self) -> _Number: ...
    @property
    def missing_count(self) -> int | _Counts: ...
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
def foot_track(
    time: npt.ArrayLike,
    gyro: npt.ArrayLike,
    accel: npt.ArrayLike,
    level: bool,
    restore: bool,
    record: bool,
) -> tuple[dict[str, Any], NavigationRecord | None]: ...
def foot_lead(
    time: npt.ArrayLike,
    gyro: npt.ArrayLike,
    accel: npt.ArrayLike,
    quaternion: npt.ArrayLike,
    biases: npt.ArrayLike,
) -> tuple[_Floats, _Floats, _Floats]: ...
def restore_clipped_rates(
    gyro: npt.ArrayLike, dt: float
) -> tuple[_Floats, list[tuple[int, float, float, int]], _Floats]: ...
def propagate_turns(
    rates: npt.ArrayLike,
    steps: npt.ArrayLike,
    spans: npt.ArrayLike,
    biases: npt.ArrayLike,
    matrix: npt.ArrayLike,
) -> tuple[_Floats, _Floats, _Floats, _Floats]: ...
def dataflash_index(
    raw: npt.NDArray[np.uint8],
) -> tuple[list[tuple[int, bytes, bytes, bytes, int, npt.NDArray[np.uint64]]], int, int]: ...
def read_gopro(
    raw: npt.NDArray[np.uint8], wanted: Sequence[bytes]
) -> (
    tuple[
        bytes,
        list[tuple[bytes, bytes, bytes, bytes, _Floats, _Floats]],
        list[bytes],
        tuple[int, int],
    ]
    | None
): ...
def read_blackbox(
    raw: npt.NDArray[np.uint8], wanted: Sequence[str]
) -> list[tuple[list[tuple[str, str]], list[str], list[npt.NDArray[np.int64]], int, int]]: ...
def read_mcap(
    raw: npt.NDArray[np.uint8],
    wanted: Sequence[int],
    limit: int,
    kept: Sequence[tuple[int, int]],
) -> tuple[
    str,
    list[tuple[int, str, str, str, str, bytes]],
    tuple[
        npt.NDArray[np.uint16],
        npt.NDArray[np.uint64],
        npt.NDArray[np.uint64],
        npt.NDArray[np.uint64],
        npt.NDArray[np.uint8],
    ],
]: ...
def pack_lz4(raw: npt.NDArray[np.uint8]) -> bytes: ...
def parse_rows(
    text: bytes,
    begin: int,
    end: int,
    delimiter: int | None,
    point: int,
    places: Sequence[int],
    whole: Sequence[bool],
    missing: Sequence[bytes],
    out: _Floats,
) -> bool: ...
def longest_quiet(
    means: npt.ArrayLike, gyro: float, accel: float, turned: float, bias: float
) -> tuple[int, int]: ...
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
def magnet_partition(
    number: npt.NDArray[np.int64],
    turned: npt.ArrayLike,
    rotation: npt.ArrayLike,
    noise: float,
    walks: Sequence[float],
) -> list[tuple[float, list[tuple[int, int, bool]]]]: ...
def magnet_fit(
    rotation: npt.ArrayLike,
    field: npt.ArrayLike,
    turned: npt.ArrayLike,
    group: npt.NDArray[np.int64],
    window: npt.NDArray[np.int64],
    elements: npt.ArrayLike,
) -> tuple[_Floats, _Floats, _Floats, float, _Floats]: ...
def magnet_covariance(
    rotation: npt.ArrayLike,
    field: npt.ArrayLike,
    group: npt.NDArray[np.int64],
    window: npt.NDArray[np.int64],
    elements: npt.ArrayLike,
    fit: tuple[_Floats, _Floats, _Floats, float, _Floats],
    doubt: Sequence[float],
) -> _Floats: ...
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
