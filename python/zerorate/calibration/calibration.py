"""Result of a calibration: parameters, their errors, and the data of the fit."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import TYPE_CHECKING, Literal, Self

import numpy as np

from zerorate.calibration.exports import to_ardupilot, to_imu_tk, to_kalibr, to_px4
from zerorate.calibration.frames import convert_frame, gyro_to_accel
from zerorate.calibration.gyro_prior import gyro_correction, gyro_prior
from zerorate.calibration.json_text import from_json, to_json
from zerorate.calibration.parameters import (
    ACCEL_BIAS,
    ACCEL_MATRIX,
    G_SENSITIVITY,
    GYRO_BIAS,
    GYRO_MATRIX,
    PARAMETERS,
    Frame,
    Matrix,
    Vector,
    make_coefficient,
)
from zerorate.calibration.record import Origin, Rest, Turn
from zerorate.calibration.removal import (
    apply,
    apply_accel,
    apply_gyro,
    convert_units,
    corrector,
    with_temperature,
)
from zerorate.noise.coefficient import Coefficient
from zerorate.record.exporting import document_restore
from zerorate.types import Booleans, Floats
from zerorate.views import Result, figure_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.calibration.temperature import TemperatureModel
    from zerorate.record import Recording


@dataclass(frozen=True)
class SensorCalibration:
    """Error model of one sensor with three axes.

    ``raw = matrix @ true + bias``. For a gyro ``g_sensitivity @ force`` is added, with the force in
    g.

    Parameters
    ----------
    matrix
        Response of the sensor to its input, from the corrected unit to the raw unit, shape (3, 3).
    scale
        Diagonal of the matrix: with 1.02 the raw samples are 2 % too large.
    misalignment
        Elements off the diagonal, each divided by the scale of its row, rad; zero on the diagonal.
    bias
        Output for zero input, raw unit.
    g_sensitivity
        g-sensitivity of a gyro, raw unit per g; zeros for an accelerometer.
    raw_unit, unit
        Unit of the raw samples, and unit of the corrected samples.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> gyro = zr.simulation.simulate_session(6, seed=1).truth.gyro
    >>> gyro.raw_unit, gyro.unit, bool(np.allclose(gyro.correction @ gyro.matrix, np.eye(3)))
    ('deg/s', 'deg/s', True)
    """

    matrix: Matrix
    scale: Vector
    misalignment: Matrix
    bias: Vector
    g_sensitivity: Matrix
    raw_unit: str
    unit: str

    @property
    def correction(self) -> Floats:
        """The inverse of the matrix: ``true = correction @ (raw - bias)``, shape (3, 3)."""
        return np.linalg.inv(np.array(self.matrix))


@dataclass(frozen=True, eq=False)
class Calibration(Result):
    """Calibration of an accelerometer and a gyroscope.

    The model is ``raw_accel = A f + b_a`` and ``raw_gyro = W w + b_g + G f``; the term G f takes f
    in g. ``accel`` and ``gyro`` hold the parameters of each sensor, each with its standard error.

    Parameters
    ----------
    values
        All parameters, in the order of `parameters`, shape (33,).
    covariance
        Covariance of the parameters, shape (33, 33); zero for fixed parameters.
    identifiable
        Mask of the parameters that the record determines, shape (33,). The other parameters keep
        their prior value.
    accel_units, gyro_units
        Unit of the raw samples, and unit of the corrected samples.
    gravity
        Local gravity, m/s^2.
    frame
        Axes that the body shares with the accelerometer. "x": the x axis and the x-y plane, so that
        A is lower triangular. "z": the z axis and the y-z plane. "symmetric": none, A is symmetric.
    rests, turns
        All rests and rotations that were found.
    norm_error, norm_error_raw
        RMS of ``|f| / g - 1`` at rests: ``norm_error`` after calibration, ``norm_error_raw`` before
        it. If `held_out`, ``norm_error`` is from rests excluded from the fit.
    carry_error, carry_error_raw
        RMS angle, rad, between gravity propagated through a rotation and gravity measured after it:
        ``carry_error`` after calibration, ``carry_error_raw`` before it. If `held_out`,
        ``carry_error`` is from rotations excluded from the fit.
    held_out
        True if these errors come from rests and rotations excluded from the fit. False if three
        quarters of the rests are too few for a fit.
    problems
        Reasons why the calibration is not valid; empty if it is valid.
    advice
        Advice for the next record.
    notes
        Assumptions of the calibration, one sentence each.
    rate
        Sampling rate of the gyro, Hz.
    temperature
        Mean temperature of the record, degC; None if unknown.
    origin
        Recording and channels of the samples.
    temperature_model
        Bias of the gyro by temperature, in its raw unit; None by default. `with_temperature` adds a
        model.
    alarms
        Contradictions that `zerorate.calibrate` found in the recording.
    recording
        Recording for the figure, or None. Files do not contain it.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.calibration import Calibration
    >>> values = np.zeros(33)
    >>> values[[0, 4, 8, 12, 16, 20]] = 1.0, 1.0, 1.0, 1.02, 1.0, 1.0
    >>> values[21:24] = 0.5, -0.2, 0.1
    >>> units = {"accel_units": ("g", "g"), "gyro_units": ("deg/s", "deg/s")}
    >>> known = {"covariance": np.zeros((33, 33)), "identifiable": np.ones(33, dtype=bool)}
    >>> calibration = Calibration(values, **known, **units, gravity=9.81, rate=100.0)
    >>> calibration.gyro.scale[0], calibration.valid
    (Coefficient(1.02), True)
    >>> calibration.apply_gyro([102.5, -0.2, 0.1]).round(6).tolist()
    [100.0, 0.0, 0.0]
    """

    values: Floats
    covariance: Floats
    identifiable: Booleans
    accel_units: tuple[str, str]
    gyro_units: tuple[str, str]
    gravity: float
    rate: float
    frame: Frame = "x"
    rests: tuple[Rest, ...] = ()
    turns: tuple[Turn, ...] = ()
    norm_error: float = float("nan")
    norm_error_raw: float = float("nan")
    carry_error: float = float("nan")
    carry_error_raw: float = float("nan")
    held_out: bool = False
    problems: tuple[str, ...] = ()
    advice: tuple[str, ...] = ()
    notes: tuple[str, ...] = field(default=(), kw_only=True)
    temperature: float | None = field(default=None, kw_only=True)
    temperature_model: TemperatureModel | None = field(default=None, kw_only=True)
    origin: Origin = field(default_factory=Origin, kw_only=True)
    alarms: tuple[str, ...] = field(default=(), kw_only=True)
    recording: Recording | None = field(default=None, kw_only=True, repr=False)

    apply = apply
    apply_accel = apply_accel
    apply_gyro = apply_gyro
    corrector = corrector
    to_ardupilot = to_ardupilot
    to_imu_tk = to_imu_tk
    to_json = to_json
    to_kalibr = to_kalibr
    to_px4 = to_px4
    with_temperature = with_temperature

    @classmethod
    @document_restore
    def from_json(cls, source: str | os.PathLike[str]) -> Self:
        """Return the calibration that `to_json` wrote, without loss of digits."""
        return from_json(source, cls)

    @property
    def source(self) -> str:
        """Name of the calibrated recording."""
        return self.origin.source or "the recording"

    def to_frame(self, frame: Frame) -> Calibration:
        """Return the same calibration for other axes of the body, with its covariance.

        Parameters
        ----------
        frame : {"x", "z", "symmetric"}
            Axes that the body shares with the accelerometer. "x", as in Kalibr: the x axis and the
            x-y plane. "z", as in imu_tk: the z axis and the y-z plane. "symmetric": as close as
            possible to all three axes, with a symmetric matrix.

        Returns
        -------
        Calibration
            Calibration with parameters, covariance, rests and rotation axes in the new axes.

        Raises
        ------
        ValueError
            If the frame is unknown, or the accelerometer's axes are left-handed.
        """
        return convert_frame(self, frame)

    def in_units(self, *, gyro: str | None = None, accel: str | None = None) -> Calibration:
        """Return the same calibration for raw samples in other units.

        The units of corrected samples stay.

        Parameters
        ----------
        gyro, accel : str, optional
            Units of `zerorate.units`. Default: unchanged.

        Raises
        ------
        ValueError
            If a unit does not fit its sensor, or the unit of the raw samples is unknown.
        """
        return convert_units(self, gyro or self.gyro_units[0], accel or self.accel_units[0])

    def plot(
        self,
        recording: Recording | None = None,
        panels: Literal["usual", "all"] = "usual",
        *,
        ax: Axes | Sequence[Axes] | None = None,
    ) -> Figure:
        """Return the figure of the calibration, 180 mm wide.

        Parameters
        ----------
        recording : Recording, optional
            The calibrated recording, for a panel of the raw log with its rests. Default: the
            recording that `zerorate.calibrate` kept.
        panels : {"usual", "all"}
            "usual": the usual panels. "all": also the raw log of the gyro.
        ax : matplotlib Axes, or a sequence of them, optional
            Axes for the panels, in the order of the figure. The first panel shows the length of
            gravity at rest before and after calibration. The recording is not drawn.

        Raises
        ------
        ImportError
            If matplotlib (extra ``plot``) is not installed.
        """
        return figure_of(
            self, (recording or self.recording) if ax is None else None, panels == "all", ax=ax
        )

    def __repr__(self) -> str:
        """Return one line with the verdict and the data."""
        rests, turns = (
            sum(entry.used for entry in entries) for entries in (self.rests, self.turns)
        )
        state = "valid" if self.valid else "not valid"
        return f"Calibration({state}; {rests} rests and {turns} turns; frame {self.frame!r})"

    def __gyro_prior__(self, unit: str) -> tuple[Floats, Floats, Floats]:
        """Return bias, matrix and its standard deviations for an `Attitude` in this unit."""
        return gyro_prior(self, unit)

    def __gyro_correction__(self, name: str) -> Floats:
        """Return a sensor's correction matrix in its samples' unit, for a `GyroArray`."""
        return gyro_correction(self, name)

    @property
    def gyro_to_accel(self) -> Vector:
        """Rotation vector of C in v_accel = C v_gyro, rad, between the sensors.

        The axes of each sensor are here its own x axis and a y axis in its x-y plane. In these axes
        the matrix of the sensor is lower triangular. The result is the same in every frame.
        """
        return gyro_to_accel(self)

    @property
    def valid(self) -> bool:
        """True if the calibration has no problem."""
        return not self.problems

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters, in the order of ``values`` and ``covariance``."""
        return PARAMETERS

    @property
    def accel(self) -> SensorCalibration:
        """Error model of the accelerometer."""
        return self._sensor(ACCEL_MATRIX, ACCEL_BIAS, None, self.accel_units)

    @property
    def gyro(self) -> SensorCalibration:
        """Error model of the gyroscope."""
        return self._sensor(GYRO_MATRIX, GYRO_BIAS, G_SENSITIVITY, self.gyro_units)

    def _sensor(
        self, matrix: slice, bias: slice, sensitivity: slice | None, units: tuple[str, str]
    ) -> SensorCalibration:
        coefficients = self._coefficients(matrix)
        scale = (coefficients[0], coefficients[4], coefficients[8])
        zeros = (Coefficient(0.0),) * 9
        return SensorCalibration(
            matrix=_as_matrix(coefficients),
            scale=scale,
            misalignment=_as_matrix(self._misalignment(matrix)),
            bias=_as_vector(self._coefficients(bias)),
            g_sensitivity=_as_matrix(
                zeros if sensitivity is None else self._coefficients(sensitivity)
            ),
            raw_unit=units[0],
            unit=units[1],
        )

    def _coefficients(self, elements: slice) -> tuple[Coefficient, ...]:
        sigmas = np.sqrt(np.diagonal(self.covariance)[elements])
        known = zip(self.values[elements], sigmas, self.identifiable[elements], strict=True)
        return tuple(make_coefficient(v, s, bool(i)) for v, s, i in known)

    def _misalignment(self, elements: slice) -> tuple[Coefficient, ...]:
        """Return each element divided by the diagonal of its row, with its error to first order."""
        matrix, covariance = self.values[elements], self.covariance[elements, elements]
        ratios = []
        for i, j in product(range(3), range(3)):
            if i == j:
                ratios.append(Coefficient(0.0))
                continue
            element, scale = 3 * i + j, 4 * i
            ratio = matrix[element] / matrix[scale]
            gradient = np.zeros(9)
            gradient[element], gradient[scale] = 1.0 / matrix[scale], -ratio / matrix[scale]
            sigma = float(np.sqrt(gradient @ covariance @ gradient))
            ratios.append(
                make_coefficient(ratio, sigma, bool(self.identifiable[elements][element]))
            )
        return tuple(ratios)


def _as_vector(coefficients: tuple[Coefficient, ...]) -> Vector:
    return coefficients[0], coefficients[1], coefficients[2]


def _as_matrix(coefficients: tuple[Coefficient, ...]) -> Matrix:
    return _as_vector(coefficients[:3]), _as_vector(coefficients[3:6]), _as_vector(coefficients[6:])
