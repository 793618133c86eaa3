"""Export of noise models to Kalibr, VINS, ORB-SLAM3, PX4 and ROS."""

import json
import math
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple

from zerorate.faults import keyword_argument, make_sentence
from zerorate.noise.coefficient import Coefficient, check_positive
from zerorate.noise.quantities import UNKNOWN_UNIT_REASON, Quantity, term_of
from zerorate.record.atomic import atomic_path
from zerorate.record.exporting import document_export

if TYPE_CHECKING:
    from zerorate.noise.model import NoiseModel

_CONTINUOUS_TITLE: Final = "noise of an IMU, densities of continuous time."


_FIELDS: Final = ("angle_random_walk", "rate_random_walk")

_UNKNOWN_REASONS: Final = {
    "angle_random_walk": "ten minutes at rest determine it",
    "rate_random_walk": "data sheets seldom state it, hours at rest determine it",
}
_RECORDING_ADVICE: Final = {
    "angle_random_walk": "record ten minutes at rest",
    "rate_random_walk": "record ten hours at rest",
}
"""Advice for a record that does not determine a coefficient."""
_REST_ADVICE: Final = (
    "record the sensor at rest, ten minutes for white noise, ten hours for its walk"
)


class _Setting(NamedTuple):
    """Number in a configuration; `identifiable` is False for an upper bound."""

    name: str
    value: float
    unit: str
    identifiable: bool

    @property
    def remark(self) -> str:
        """Unit of the number, with a note if it is only a bound."""
        return f"{self.unit}{self.doubt}"

    @property
    def doubt(self) -> str:
        """Note on a number that is only a bound."""
        return (
            "" if self.identifiable else "; upper bound at 95 %, the record does not determine it"
        )


def _yaml_line(setting: _Setting) -> Iterator[str]:
    yield f"{setting.name}: {_format_number(setting.value)}  # {setting.remark}"


@dataclass(frozen=True)
class _Estimator:
    """File format of one estimator.

    Parameters
    ----------
    gyro, accelerometer : tuple of str
        Estimator's names of white noise and, if used, random walk, for each sensor.
    lines : callable
        Function that yields the lines of one number. Default: one line of YAML.
    of_samples : bool
        True if white noise means the standard deviation of a sample, after a low-pass if present.
    """

    gyro: tuple[str, ...]
    accelerometer: tuple[str, ...]
    lines: Callable[[_Setting], Iterator[str]] = _yaml_line
    of_samples: bool = False

    def settings(
        self,
        gyro: "NoiseModel",
        accelerometer: "NoiseModel | None",
        inflate: float,
        bounds: bool,
        doubtful: bool,
        rate: float | None = None,
    ) -> list[str]:
        """Return the lines of all numbers: densities, or deviations per step at a rate in Hz."""
        factor = check_positive("inflate", inflate)
        if rate is not None:
            factor *= math.sqrt(check_positive("rate", rate))
        models = (
            _check_quantity(gyro, "angular rate"),
            _check_quantity(accelerometer, "acceleration"),
        )
        if not doubtful:
            check_doubts(model for model in models if model is not None)
        wanted = [
            (name, model, field)
            for model, names in zip(models, (self.gyro, self.accelerometer), strict=True)
            if model is not None
            for name, field in zip(names, _FIELDS, strict=False)
        ]
        if not doubtful:
            _check_determined([getattr(model, field) for _, model, field in wanted])
        lines = (
            line
            for name, model, field in wanted
            for line in self._lines(name, model, field, factor, rate, bounds)
        )
        return [*_warning_lines(models), *lines]

    def _lines(
        self,
        name: str,
        model: "NoiseModel",
        field: str,
        factor: float,
        rate: float | None,
        bounds: bool,
    ) -> Iterator[str]:
        """Yield the line of one number, or a comment if the number is missing."""
        coefficient = getattr(model, field)
        if not coefficient.known:
            return iter([f"# {name}: unknown, so not written; {_UNKNOWN_REASONS[field]}"])
        if not (coefficient.identifiable or bounds):
            why = "the record does not determine it, so not written"
            return iter([f"# {name}: {why}; {_RECORDING_ADVICE[field]}"])
        if self.of_samples and rate is not None and model.low_pass is not None:
            factor *= math.sqrt(model.low_pass.passed_share(rate))
        return self.lines(_make_setting(name, model, field, factor, rate))


def list_undetermined(model: "NoiseModel", walk: bool = True) -> tuple[str, ...]:
    """Return the undetermined coefficients of estimators, and advice for the next record."""
    return tuple(
        f"{term_of(model.quantity, field).name}: {_RECORDING_ADVICE[field]}"
        for field in (_FIELDS if walk else _FIELDS[:1])
        if (coefficient := getattr(model, field)).known and not coefficient.identifiable
    )


def check_doubts(models: Iterable["NoiseModel"]) -> None:
    """Raise ValueError, with advice for another record, if a model is doubtful.

    Motion of one sensor of an IMU also moves the others.
    """
    doubt = next((model.doubt for model in models if model.doubt), "")
    if doubt:
        writes = " writes the numbers with this warning"
        raise ValueError(
            make_sentence(
                f"{doubt}: {_REST_ADVICE}; ",
                keyword_argument("doubtful", "", "doubtful=True"),
                writes,
            )
        )


def _warning_lines(models: Sequence["NoiseModel | None"]) -> list[str]:
    doubts = (model.doubt for model in models if model is not None and model.doubt)
    bands = (model.band for model in models if model is not None and model.band)
    lines = [f"# WARNING: {doubt}" for doubt in dict.fromkeys(doubts)]
    return [*lines, *(f"# {band}" for band in dict.fromkeys(bands))]


def _check_determined(coefficients: Sequence[Coefficient]) -> None:
    """Raise an error if a record determines no number of a file."""
    stated = [coefficient for coefficient in coefficients if coefficient.known]
    if stated and not any(coefficient.identifiable for coefficient in stated):
        raise ValueError(
            make_sentence(
                f"the record determines none of the numbers: {_REST_ADVICE}; ",
                keyword_argument("doubtful", "", "doubtful=True"),
                " writes their upper bounds",
            )
        )


def write_text(text: str, path: str | os.PathLike[str] | None, force: bool) -> str:
    """Return the text; if a path is given, write it completely or not at all."""
    if path is not None:
        with atomic_path(path, force) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="\n")
    return text


def _make_setting(
    name: str, model: "NoiseModel", field: str, factor: float, rate: float | None
) -> _Setting:
    coefficient = getattr(model, field)
    unit = term_of(model.quantity, field).unit
    if rate is not None:
        unit = unit.removesuffix("/sqrt(Hz)")
    return _Setting(name, coefficient.conservative * factor, unit, coefficient.identifiable)


def _check_quantity(model: "NoiseModel | None", quantity: Quantity) -> "NoiseModel | None":
    if model is not None and model.quantity == "unknown":
        raise ValueError(f"a configuration cannot be written because {UNKNOWN_UNIT_REASON}")
    if model is not None and model.quantity != quantity:
        raise ValueError(
            f"a model of {model.quantity} was given where one of {quantity} was expected: exports "
            "are called on the gyro's model, the other goes to accelerometer="
        )
    return model


def _compose_file(
    title: str,
    accelerometer: object | None,
    inflate: float,
    lines: Sequence[str],
    inflated: str = "Every number is {:g} times the measured one.",
) -> str:
    """Return a file: comments on its content and changes, then the numbers."""
    head = [f"# {title}"]
    if inflate != 1.0:
        head.append(f"# {inflated.format(inflate, inflate**2)}")
    if accelerometer is None:
        head.append("# No accelerometer was given: its lines are left out.")
    return "\n".join([*head, *lines]) + "\n"


def _format_number(value: float) -> str:
    """Return a number with six digits and a decimal point.

    Without the point, PyYAML reads 1e-05 as a string, and ORB-SLAM3 does not accept 0 as a real
    number.
    """
    return f"{value:.5e}"


def _px4_lines(setting: _Setting) -> Iterator[str]:
    low, high = _PX4_RANGES[setting.name]
    outside = "" if low <= setting.value <= high else f"; outside PX4's range {low:g} to {high:g}"
    yield f"# {setting.name}: {setting.remark}{outside}"
    yield f"1\t1\t{setting.name}\t{_format_number(setting.value)}\t{_PX4_FLOAT}"


def _ros_lines(setting: _Setting) -> Iterator[str]:
    variance = _format_number(setting.value**2)
    numbers = ", ".join(variance if i in (0, 4, 8) else "0.0" for i in range(9))
    yield f"{setting.name}: [{numbers}]  # ({setting.unit})^2{setting.doubt}"


_KALIBR: Final = _Estimator(
    gyro=("gyroscope_noise_density", "gyroscope_random_walk"),
    accelerometer=("accelerometer_noise_density", "accelerometer_random_walk"),
)
_VINS: Final = _Estimator(gyro=("gyr_n", "gyr_w"), accelerometer=("acc_n", "acc_w"))
_ORBSLAM3: Final = _Estimator(
    gyro=("IMU.NoiseGyro", "IMU.GyroWalk"), accelerometer=("IMU.NoiseAcc", "IMU.AccWalk")
)
_PX4: Final = _Estimator(
    gyro=("EKF2_GYR_NOISE", "EKF2_GYR_B_NOISE"),
    accelerometer=("EKF2_ACC_NOISE", "EKF2_ACC_B_NOISE"),
    lines=_px4_lines,
)
_ROS: Final = _Estimator(
    gyro=("angular_velocity_covariance",),
    accelerometer=("linear_acceleration_covariance",),
    lines=_ros_lines,
    of_samples=True,
)
_PX4_RANGES: Final = {
    "EKF2_GYR_NOISE": (0.0001, 0.1),
    "EKF2_GYR_B_NOISE": (0.0, 0.01),
    "EKF2_ACC_NOISE": (0.01, 1.0),
    "EKF2_ACC_B_NOISE": (0.0, 0.01),
}
_INFLATED_VARIANCES: Final = (
    "Deviations are {:g} times the measured ones, so covariances {:g} times."
)
_PX4_FLOAT: Final = 9
"""Code of the type MAV_PARAM_TYPE_REAL32."""

_configuration_export = partial(
    document_export,
    returned="""\
    A coefficient that the record does not determine is written as its upper bound at 95 %, with a
    comment. An unknown coefficient has a comment in place of its number.""",
    faults="""\
ValueError
    If `doubtful` is False and a model has a `doubt`. If `doubtful` is False and the record
    determines none of the numbers. If a model has the wrong quantity or an unknown unit. If
    rate or inflate is not positive and finite.""",
    options="""\
bounds : bool
    Write the upper bound of a coefficient that the record does not determine; default True. False
    leaves its line out.
doubtful : bool
    Write numbers of a model with a `doubt`, with a warning in the file; default False.""",
)


@_configuration_export()
def to_kalibr(
    model: "NoiseModel",
    path: str | os.PathLike[str] | None = None,
    *,
    accelerometer: "NoiseModel | None" = None,
    rate: float | None = None,
    rostopic: str = "/imu0",
    inflate: float = 1.0,
    bounds: bool = True,
    doubtful: bool = False,
    force: bool = False,
) -> str:
    """Return the model as an ``imu.yaml`` of Kalibr.

    Parameters
    ----------
    accelerometer : NoiseModel, optional
        Model of quantity "acceleration". Without a model its lines are left out. Kalibr needs them:
        add them by hand.
    rate : float, optional
        ``update_rate``, Hz. Without it the line is left out.
    rostopic : str
        Topic of the recording; default "/imu0".
    inflate : float
        Factor applied to every number, for noise that a record at rest does not show. Default 1. If
        it is not 1, a comment in the file states it.

    Returns
    -------
    str
        Text of the file.

    Notes
    -----
    Noise density is N and random walk is K, both in continuous time. Kalibr converts them to its
    rate. The bias instability B is not a random walk and has no line.

    Examples
    --------
    >>> from zerorate import NoiseModel
    >>> gyro = NoiseModel(angle_random_walk=1e-4, rate_random_walk=1e-6)
    >>> print(gyro.to_kalibr(rate=200.0))
    # Kalibr: noise of an IMU, densities of continuous time.
    # No accelerometer was given: its lines are left out.
    gyroscope_noise_density: 1.00000e-04  # rad/s/sqrt(Hz)
    gyroscope_random_walk: 1.00000e-06  # rad/s^2/sqrt(Hz)
    rostopic: "/imu0"
    update_rate: 2.00000e+02  # Hz
    <BLANKLINE>
    """
    lines = _KALIBR.settings(model, accelerometer, inflate, bounds, doubtful)
    # A JSON string is a double-quoted YAML string, so its content cannot end the line or begin a
    # key.
    lines.append(f"rostopic: {json.dumps(rostopic)}")
    if rate is not None:
        lines.append(f"update_rate: {_format_number(check_positive('rate', rate))}  # Hz")
    return write_text(
        _compose_file(f"Kalibr: {_CONTINUOUS_TITLE}", accelerometer, inflate, lines), path, force
    )


@_configuration_export()
def to_vins(
    model: "NoiseModel",
    path: str | os.PathLike[str] | None = None,
    *,
    rate: float | None = None,
    accelerometer: "NoiseModel | None" = None,
    inflate: float = 1.0,
    bounds: bool = True,
    doubtful: bool = False,
    force: bool = False,
) -> str:
    """Return the model as the IMU lines of a VINS-Mono or VINS-Fusion configuration.

    Parameters
    ----------
    rate : float, optional
        Rate of the IMU messages that VINS integrates, Hz. If it is given, the file has standard
        deviations per sample, as VINS expects. Default: densities of continuous time, as in most
        published configurations.
    accelerometer : NoiseModel, optional
        Model of quantity "acceleration". Without a model its lines are left out.
    inflate : float
        Factor applied to every number. Default 1. If it is not 1, a comment in the file states it.
        Users of VINS often choose 10 or more, for vibration and other effects that the noise model
        of VINS omits.

    Returns
    -------
    str
        Lines of the configuration.

    Notes
    -----
    The preintegration adds (dt gyr_w)^2 to the variance of the bias at every step of dt. The growth
    of a random walk, K^2 dt, therefore needs gyr_w = K sqrt(rate). With gyr_w = K the bias is
    sqrt(rate) times too stable, and users often increase `inflate` to compensate. gyr_n = N
    sqrt(rate) is the standard deviation of one sample. The midpoint rule assumes that both ends of
    a step are independent, and adds half of N^2 dt.

    Examples
    --------
    >>> from zerorate import NoiseModel
    >>> gyro = NoiseModel(angle_random_walk=1e-4, rate_random_walk=1e-6)
    >>> print(gyro.to_vins(rate=100.0, inflate=10.0))
    # VINS: noise of an IMU at 100 Hz, deviations per sample.
    # Every number is 10 times the measured one.
    # No accelerometer was given: its lines are left out.
    gyr_n: 1.00000e-02  # rad/s
    gyr_w: 1.00000e-04  # rad/s^2
    <BLANKLINE>
    """
    lines = _VINS.settings(model, accelerometer, inflate, bounds, doubtful, rate)
    title = f"VINS: {_CONTINUOUS_TITLE}"
    if rate is not None:
        title = f"VINS: noise of an IMU at {rate:g} Hz, deviations per sample."
    return write_text(_compose_file(title, accelerometer, inflate, lines), path, force)


@_configuration_export()
def to_orbslam3(
    model: "NoiseModel",
    path: str | os.PathLike[str] | None = None,
    *,
    rate: float | None = None,
    accelerometer: "NoiseModel | None" = None,
    inflate: float = 1.0,
    bounds: bool = True,
    doubtful: bool = False,
    force: bool = False,
) -> str:
    """Return the model as the IMU lines of an ORB-SLAM3 settings file.

    Parameters
    ----------
    rate : float, optional
        ``IMU.Frequency``, Hz. Without it the line is left out. ORB-SLAM3 needs it: add it by hand.
    accelerometer : NoiseModel, optional
        Model of quantity "acceleration". Without a model its lines are left out. ORB-SLAM3 needs
        them: add them by hand.
    inflate : float
        Factor applied to every number except the rate. Default 1. If it is not 1, a comment in the
        file states it.

    Returns
    -------
    str
        Lines for a settings file.

    Notes
    -----
    Noise is N and walk is K, both in continuous time. ORB-SLAM3 multiplies the noise by the root of
    ``IMU.Frequency`` and divides the walk by this root.

    Examples
    --------
    >>> from zerorate import NoiseModel
    >>> gyro = NoiseModel(angle_random_walk=1e-4, rate_random_walk=1e-6)
    >>> print(gyro.to_orbslam3(rate=200.0))
    # ORB-SLAM3: noise of an IMU, densities of continuous time.
    # No accelerometer was given: its lines are left out.
    IMU.NoiseGyro: 1.00000e-04  # rad/s/sqrt(Hz)
    IMU.GyroWalk: 1.00000e-06  # rad/s^2/sqrt(Hz)
    IMU.Frequency: 2.00000e+02  # Hz
    <BLANKLINE>
    """
    lines = _ORBSLAM3.settings(model, accelerometer, inflate, bounds, doubtful)
    if rate is not None:
        lines.append(f"IMU.Frequency: {_format_number(check_positive('rate', rate))}  # Hz")
    return write_text(
        _compose_file(f"ORB-SLAM3: {_CONTINUOUS_TITLE}", accelerometer, inflate, lines), path, force
    )


@_configuration_export(".params")
def to_px4(
    model: "NoiseModel",
    path: str | os.PathLike[str] | None = None,
    *,
    rate: float = 100.0,
    accelerometer: "NoiseModel | None" = None,
    inflate: float = 1.0,
    bounds: bool = True,
    doubtful: bool = False,
    force: bool = False,
) -> str:
    """Return the model as parameters of PX4's EKF2, in the format of QGroundControl.

    Parameters
    ----------
    rate : float
        Steps of the filter per second, Hz: the inverse of ``EKF2_PREDICT_US``, not the sampling
        rate. Default 100, as in PX4.
    accelerometer : NoiseModel, optional
        Model of quantity "acceleration". Without a model its lines are left out.
    inflate : float
        Factor applied to every number. Default 1. If it is not 1, a comment in the file states it.
        PX4's default values are for a vibrating vehicle, and far above the values of a sensor at
        rest.

    Returns
    -------
    str
        Parameters, with a comment for a number outside PX4's range.

    Notes
    -----
    EKF2 takes standard deviations per step, not densities. At every step of dt it adds (dt
    EKF2_GYR_NOISE)^2 to the variance of the angle, and (dt EKF2_GYR_B_NOISE)^2 to the variance of
    the bias. These two terms must be N^2 dt and K^2 dt. The parameters are therefore N sqrt(rate),
    rad/s, and K sqrt(rate), rad/s^2.

    Examples
    --------
    >>> from zerorate import NoiseModel
    >>> gyro = NoiseModel(angle_random_walk=1e-4, rate_random_walk=1e-6)
    >>> print(gyro.to_px4().expandtabs(2))
    # PX4 EKF2: noise of an IMU, deviations per filter step at 100 Hz.
    # No accelerometer was given: its lines are left out.
    # Vehicle-Id Component-Id Name Value Type
    # EKF2_GYR_NOISE: rad/s
    1 1 EKF2_GYR_NOISE  1.00000e-03 9
    # EKF2_GYR_B_NOISE: rad/s^2
    1 1 EKF2_GYR_B_NOISE  1.00000e-05 9
    <BLANKLINE>
    """
    lines = _PX4.settings(model, accelerometer, inflate, bounds, doubtful, rate)
    title = f"PX4 EKF2: noise of an IMU, deviations per filter step at {rate:g} Hz."
    lines.insert(0, "# Vehicle-Id Component-Id Name Value Type")
    return write_text(_compose_file(title, accelerometer, inflate, lines), path, force)


@_configuration_export()
def to_ros(
    model: "NoiseModel",
    path: str | os.PathLike[str] | None = None,
    *,
    rate: float,
    accelerometer: "NoiseModel | None" = None,
    inflate: float = 1.0,
    bounds: bool = True,
    doubtful: bool = False,
    force: bool = False,
) -> str:
    """Return the model as the covariances of ``sensor_msgs/Imu``, also for robot_localization.

    Parameters
    ----------
    rate : float
        Messages per second, Hz. If a driver averages samples before it publishes, give the rate of
        its messages.
    accelerometer : NoiseModel, optional
        Model of quantity "acceleration". Without a model its line is left out.
    inflate : float
        Factor applied to the standard deviations; covariances grow with its square. Default 1. If
        it is not 1, a comment in the file states it.

    Returns
    -------
    str
        YAML of the arrays of nine numbers, row by row, for every message of a driver.

    Notes
    -----
    The diagonal is N^2 rate, the variance of one message's white noise. The message has no field
    for the random walk of the bias, and robot_localization does not estimate a gyro bias. Therefore
    publish rates without bias. If the first element is -1, the message has no orientation
    (``sensor_msgs/Imu.msg``).

    Examples
    --------
    >>> from zerorate import NoiseModel
    >>> gyro = NoiseModel(angle_random_walk=1e-4)
    >>> print(gyro.to_ros(rate=100.0))  # doctest: +ELLIPSIS
    # sensor_msgs/Imu: covariances of one message at 100 Hz, row by row.
    ...
    # No accelerometer was given: its lines are left out.
    angular_velocity_covariance: [1.00000e-06, 0.0, 0.0, 0.0, 1.00000e-06, ...]  # (rad/s)^2
    orientation_covariance: [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    <BLANKLINE>
    """
    lines = _ROS.settings(model, accelerometer, inflate, bounds, doubtful, rate)
    lines.append(f"orientation_covariance: [{', '.join(['-1.0', *['0.0'] * 8])}]")
    title = "\n# ".join(
        (
            f"sensor_msgs/Imu: covariances of one message at {rate:g} Hz, row by row.",
            "They are of white noise alone, N^2 rate: the walk of the bias has no place in them.",
            "robot_localization does not estimate a gyro bias: publish the compensated rate.",
            "The -1 says that the message holds no orientation.",
        )
    )
    return write_text(
        _compose_file(title, accelerometer, inflate, lines, _INFLATED_VARIANCES), path, force
    )
