"""Bias of a gyro by temperature: learned at rest, predicted, removed."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from zerorate.calibration.temperature import files
from zerorate.calibration.temperature.blocks import Blocks, average_blocks
from zerorate.calibration.temperature.fit import (
    KELVINS_PER_UNIT,
    MAX_DEGREE,
    MIN_SPANS_K,
    Fit,
    fit_axes,
    powers,
)
from zerorate.calibration.temperature.thermometer import (
    hold_last,
    interpolate_steps,
    mask_impossible,
    remove_leaps,
)
from zerorate.faults import ArgumentError
from zerorate.noise.coefficient import UNKNOWN_COEFFICIENT, Coefficient
from zerorate.numerals import shorten
from zerorate.record.exporting import document_restore
from zerorate.record.log import Log, LogError
from zerorate.record.missing import floats
from zerorate.record.named import columns_of, convert_to_unit, names_of, rate_of, unit_of
from zerorate.record.names import UNKNOWN_UNIT
from zerorate.types import Booleans, Floats
from zerorate.views import Result

if TYPE_CHECKING:
    pass

_DEFAULT_REFERENCE_DEGC: Final = 25.0
"""Reference temperature for a record without temperatures, degC."""

_MAX_TIME_CORRELATION: Final = 0.95
"""Largest correlation of temperature and time with separable effects."""

_MIN_BLOCKS: Final = 4
_MAX_VALUE: Final = 1e150
_SIGNIFICANT_SIGMAS: Final = 3.0
_ONE_SIDED_95_Z: Final = 1.6448536269514722


class TemperatureBias(NamedTuple):
    """Predicted bias at a temperature.

    Parameters
    ----------
    value
        Bias, unit of the samples.
    sigma
        Standard error of the bias, unit of the samples.
    extrapolated
        True if the temperature is unknown or outside the range of the record.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> temperature = np.linspace(20.0, 40.0, 18_000)
    >>> z = 0.5 + 0.03 * temperature + 0.05 * np.random.default_rng(1).standard_normal(18_000)
    >>> bias = zr.TemperatureModel.fit(z, temperature, rate=10.0).predict(30.0)
    >>> round(float(bias.value), 1), bool(bias.extrapolated)
    (1.4, False)
    """

    value: Floats
    sigma: Floats
    extrapolated: Booleans


@dataclass(frozen=True, eq=False)
class TemperatureModel(Result):
    """Bias of a gyro by temperature, from a record at rest.

    `TemperatureModel.fit` makes a model. In the temperature range of the record, the bias of an
    axis is the sum of ``c_k ((T - reference) / 10)^k``. Outside the range the bias follows the
    tangent for one more width of the range, then stays constant.

    Parameters
    ----------
    coefficients
        c_0 to c_3 of each axis, unit of the samples, shape (k, 4).
    covariance
        Covariance of each axis' coefficients, shape (k, 4, 4).
    degrees
        Degree of the polynomial of each axis, 0 to 3.
    reference
        Middle of the temperature range, degC.
    range
        Lowest and highest temperature of the record, degC.
    slopes
        Slope of the bias at the reference temperature, per kelvin, for each axis. Not identifiable
        for degree zero.
    hystereses
        Bias during warming minus bias during cooling, at equal temperature, for each axis. Unknown
        if the record lacks warming or cooling.
    time_correlation
        Correlation of temperature and time; zero if either is constant.
    step
        Resolution of a coarse thermometer, K; zero for a fine thermometer.
    names, unit
        Names of the axes, and unit of their samples.
    notes
        Sentences on gaps and other properties of the record.
    blocks
        Block means to which the model was fitted; None for a model read from a file.
    single
        True for a single axis: returned arrays then have no dimension for axes.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> temperature = 40.0 - 20.0 * np.exp(-np.arange(18_000) / 4000.0)
    >>> z = 0.5 + 0.03 * (temperature - 25.0) + 0.05 * rng.standard_normal(18_000)
    >>> model = TemperatureModel.fit(z, temperature, rate=10.0)
    >>> model.degree, model.slope
    (1, Coefficient(0.03008 ± 0.0002))
    >>> value, sigma, extrapolated = model.predict(45.0)
    >>> round(float(value), 2), bool(extrapolated)
    (1.1, True)
    """

    coefficients: Floats
    covariance: Floats
    degrees: tuple[int, ...]
    reference: float
    range: tuple[float, float]
    slopes: tuple[Coefficient, ...]
    hystereses: tuple[Coefficient, ...]
    time_correlation: float
    step: float
    names: tuple[str, ...]
    unit: str = "unit"
    notes: tuple[str, ...] = ()
    blocks: Blocks | None = None
    single: bool = False

    @classmethod
    def fit(
        cls,
        z: Log | npt.ArrayLike,
        temperature: Log | npt.ArrayLike | None,
        rate: float | None = None,
        max_degree: int = 3,
        *,
        rests: npt.ArrayLike | None = None,
        unit: str | None = None,
    ) -> Self:
        """Fit a model to a record.

        Parameters
        ----------
        z : Log, or array_like of shape (n,) or (n, k)
            Output of the gyro; NaN marks missing samples.
        temperature : Log, or array_like of shape (n,), or None
            Temperature, degC. A missing value is replaced by the last known value. If `temperature`
            is a Log, `z` must also be a Log; the first channel is interpolated at the times of `z`.
            None: no temperature.
        rate : float, optional
            Sampling rate, Hz. Required if `z` is an array.
        max_degree : int
            Highest degree of the polynomial, 0 to 3. Default 3. A straight line needs a range of 1
            K, a parabola 8 K, a cubic 15 K. BIC chooses the degree within these limits.
        rests : array_like of bool, shape (n,), optional
            Mask of samples at rest. Default: rests are detected by their variance, and rotation at
            a constant rate then counts as rest.
        unit : str, optional
            Unit of the samples. Default: the unit of the Log, or ``"unit"``.

        Raises
        ------
        ValueError
            If shapes disagree, the rate is missing, `max_degree` is not valid, or no sample is at
            rest.
        TypeError
            If an argument is not an array of real numbers.
        LogError
            If the temperature's Log does not overlap the record.

        Notes
        -----
        Means of five seconds are modelled as the sum of polynomial, random walk and white noise.
        Coefficients and standard errors are means over possible strengths of the random walk,
        weighted by its restricted likelihood. The level c_0 is the bias level at the end of the
        record, because later data start there. PX4 and ArduPilot fit a cubic by least squares and
        hold it constant outside the range. Chen et al. 2013 assume 0.1 deg/s/degC above 25 degC.
        """
        record = _Record.of(z, temperature, rate, rests, unit)
        if not (isinstance(max_degree, int) and 0 <= max_degree <= MAX_DEGREE):
            raise ArgumentError(
                "max_degree", f"must be a whole number from 0 to 3, got {max_degree!r}"
            )
        blocks = average_blocks(record.rates, record.temperature, record.rate, record.rests)
        if blocks.count.size < _MIN_BLOCKS:
            raise ValueError(
                f"a temperature model needs {_MIN_BLOCKS} means of samples at rest, and "
                f"{len(record.rates) / record.rate:g} s have {blocks.count.size}"
            )
        low, high = _temperature_range(blocks.temperature)
        reference = 0.5 * (low + high)
        axes = fit_axes(blocks, reference, max_degree)
        model = cls(
            coefficients=np.array([axis.coefficients for axis in axes]),
            covariance=np.array([axis.covariance for axis in axes]),
            degrees=tuple(axis.degree for axis in axes),
            reference=reference,
            range=(low, high),
            slopes=tuple(_slope_coefficient(axis) for axis in axes),
            hystereses=tuple(_hysteresis_coefficient(axis, record.step) for axis in axes),
            time_correlation=_time_correlation(blocks.time, blocks.temperature),
            step=record.step,
            names=record.names,
            unit=record.unit,
            blocks=blocks,
            single=record.single,
        )
        model = model.scaled(record.factor)
        return replace(model, notes=tuple(_notes(model, blocks, record.outlier_count)))

    @property
    def axes(self) -> int:
        """Number of axes."""
        return len(self.degrees)

    @property
    def degree(self) -> int | tuple[int, ...]:
        """Degree of the polynomial: a tuple over the axes, or one int if `single`."""
        return self.degrees[0] if self.single else self.degrees

    @property
    def slope(self) -> Coefficient | tuple[Coefficient, ...]:
        """Bias per kelvin in mid-range: a tuple over the axes, or one value if `single`."""
        return self.slopes[0] if self.single else self.slopes

    @property
    def hysteresis(self) -> Coefficient | tuple[Coefficient, ...]:
        """Warming bias minus cooling bias: a tuple over the axes, or one value if `single`."""
        return self.hystereses[0] if self.single else self.hystereses

    @property
    def span(self) -> float:
        """Temperature range of the record, K."""
        return self.range[1] - self.range[0]

    @property
    def time_separable(self) -> bool:
        """True if the correlation of temperature and time is at most 0.95."""
        return abs(self.time_correlation) <= _MAX_TIME_CORRELATION

    @property
    def curve(self) -> dict[str, Any]:
        """Reference, range and coefficients as plain numbers, for `ImuCorrector`."""
        return {
            "coefficients": self.coefficients.tolist(),
            "reference": self.reference,
            "range": self.range,
        }

    def predict(self, temperature: npt.ArrayLike) -> TemperatureBias:
        """Return the bias at a temperature.

        Parameters
        ----------
        temperature : array_like, any shape
            Temperature, degC. For a missing value the result is the bias in the middle of the
            range, with a standard deviation for the whole range.

        Returns
        -------
        TemperatureBias
            ``extrapolated`` has the shape of `temperature`. ``value`` and ``sigma`` have a further
            axis of length k if the model is not `single`. Sigma is the standard error at the end of
            the record. Sigma includes the steps of a coarse thermometer and, outside the range, the
            curvature that the tangent omits.
        """
        temperatures = floats(temperature, "temperature")
        known = np.isfinite(temperatures)
        T = np.where(known, temperatures, self.reference)
        rows = self._rows(T)
        value = rows @ self.coefficients.T
        variance = np.stack([((rows @ P) * rows).sum(axis=-1) for P in self.covariance], axis=-1)
        doubt = self._doubt(T, known)
        sigma = np.sqrt(np.maximum(variance, 0.0) + doubt**2)
        extrapolated = ~known | (self.range[0] > T) | (self.range[1] < T)
        if self.single:
            value, sigma = value[..., 0], sigma[..., 0]
        return TemperatureBias(value, sigma, extrapolated)

    def _rows(self, T: Floats) -> Floats:
        """Return the regressors of the coefficients: powers, or their tangent outside the range."""
        inside, beyond = self._parts(T)
        rows = powers(inside, self.reference)
        if beyond.any():
            x = (inside - self.reference) / KELVINS_PER_UNIT
            by = np.stack([np.zeros_like(x), np.ones_like(x), 2.0 * x, 3.0 * x**2], axis=-1)
            rows = rows + by * (beyond / KELVINS_PER_UNIT)[..., np.newaxis]
        return rows

    def _parts(self, T: Floats) -> tuple[Floats, Floats]:
        """Return the nearest temperature inside the range, and the distance to it."""
        inside = np.clip(T, *self.range)
        return inside, np.clip(T - inside, -self.span, self.span)

    def _doubt(self, T: Floats, known: Booleans) -> Floats:
        """Return the standard error that the covariance of the coefficients does not include."""
        inside, beyond = self._parts(T)
        c = self.coefficients
        x = ((inside - self.reference) / KELVINS_PER_UNIT)[..., np.newaxis]
        slope = (c[:, 1] + 2.0 * c[:, 2] * x + 3.0 * c[:, 3] * x**2) / KELVINS_PER_UNIT
        curvature = (c[:, 2] + 3.0 * c[:, 3] * x) / KELVINS_PER_UNIT**2
        beyond = beyond[..., np.newaxis]
        curved = np.abs(curvature * beyond**2) + np.abs(c[:, 3] * (beyond / KELVINS_PER_UNIT) ** 3)
        unsure = np.where(known, self.step, self.span)[..., np.newaxis] / np.sqrt(12.0)
        return np.asarray(np.hypot(curved, slope * unsure))

    def remove(
        self, z: Log | npt.ArrayLike, temperature: Log | npt.ArrayLike
    ) -> Log | npt.NDArray[np.float64]:
        """Return samples minus the predicted bias at their temperature.

        Parameters
        ----------
        z : Log, or array_like of shape (n,) or (n, k)
            Output of the gyro, in the unit of the model.
        temperature : Log, or array_like of shape (n,)
            Temperature, degC. A missing value is replaced by the last known value, and the steps of
            a coarse thermometer are smoothed. If all temperatures are missing, the bias in the
            middle of the range is subtracted.

        Returns
        -------
        Log or ndarray
            Samples, in the type and shape of `z`.

        Raises
        ------
        ValueError
            If shapes disagree with each other or with the model.
        LogError
            If the temperature's Log does not overlap the record.
        """
        data = columns_of(z, "z")
        if data.shape[1:] not in ({(self.axes,), ()} if self.axes == 1 else {(self.axes,)}):
            raise ArgumentError(
                "z", f"must have {self.axes} axes as the model has, got {data.shape}"
            )
        T = _sample_temperatures(z, temperature, len(data), 1.0 if self.step else None).known
        if not np.isfinite(T).all():
            T = np.full(len(data), self.reference)
        # The errors are not needed here and take longer than the bias.
        cleaned = data - (self._rows(T) @ self.coefficients.T).reshape(data.shape)
        return z.with_data(cleaned) if isinstance(z, Log) else cleaned

    def scaled(self, factor: float, unit: str | None = None) -> Self:
        """Return the model for samples multiplied by a positive number."""
        blocks = self.blocks
        return replace(
            self,
            coefficients=self.coefficients * factor,
            covariance=self.covariance * factor**2,
            slopes=tuple(coefficient.scaled(factor) for coefficient in self.slopes),
            hystereses=tuple(coefficient.scaled(factor) for coefficient in self.hystereses),
            unit=self.unit if unit is None else unit,
            blocks=None if blocks is None else blocks.scaled(factor),
        )

    to_json = files.to_json
    to_px4 = files.to_px4
    to_ardupilot = files.to_ardupilot

    @classmethod
    @document_restore
    def from_json(cls, source: str | os.PathLike[str]) -> Self:
        """Return the model that `to_json` wrote."""
        return files.from_json(source, cls)

    def __repr__(self) -> str:
        """Return degrees, range and unit."""
        low, high = self.range
        degrees = ", ".join(map(str, self.degrees))
        return f"TemperatureModel(degree {degrees}; {low:.1f} to {high:.1f} degC; {self.unit})"


class _Record(NamedTuple):
    """Rates (n, k), their temperature (n,), and the properties of both.

    Rates are in units of `factor`, which is near the largest rate, so that squares stay finite.
    """

    rates: Floats
    temperature: Floats
    rate: float
    rests: Booleans | None
    names: tuple[str, ...]
    unit: str
    single: bool
    step: float
    factor: float
    outlier_count: int

    @classmethod
    def of(
        cls,
        z: Log | npt.ArrayLike,
        temperature: Log | npt.ArrayLike | None,
        rate: float | None,
        rests: npt.ArrayLike | None,
        unit: str | None,
    ) -> _Record:
        data = floats(z, "z")
        if data.ndim not in (1, 2) or 0 in data.shape:
            raise ArgumentError(
                "z", f"must have shape (n,) or (n, k) with samples, got {data.shape}"
            )
        rate, single = rate_of(rate, z), data.ndim == 1
        rates = data.reshape(len(data), -1)
        largest = np.max(np.abs(rates), where=np.isfinite(rates), initial=0.0)
        if largest > _MAX_VALUE:
            raise ArgumentError("z", f"must be within {_MAX_VALUE:g}, got {largest:g}")
        factor = 2.0 ** np.round(np.log2(max(largest, 1.0 / _MAX_VALUE)))
        rates = np.where(np.isfinite(rates), rates, np.nan) / factor
        reading = _sample_temperatures(z, temperature, len(rates), rate)
        names = names_of(z) or _default_names(rates.shape[1])
        unit = unit_of(unit, z) or UNKNOWN_UNIT
        return cls(
            rates=rates,
            temperature=reading.known,
            rate=rate,
            rests=_parse_mask(rests, len(rates)),
            names=names,
            unit=unit,
            single=single,
            step=reading.step,
            factor=float(factor),
            outlier_count=reading.outlier_count,
        )


def _default_names(axes: int) -> tuple[str, ...]:
    return ("gyro",) if axes == 1 else tuple(f"gyro {i}" for i in range(axes))


def _parse_mask(rests: npt.ArrayLike | None, n: int) -> Booleans | None:
    if rests is None:
        return None
    mask = np.asarray(rests)
    if mask.shape != (n,) or mask.dtype != np.bool_:
        raise ArgumentError(
            "rests", f"must be {n} values, True or False, got shape {mask.shape} of {mask.dtype}"
        )
    return mask


class _ThermometerReading(NamedTuple):
    """Temperature of each sample (NaN if unknown), step of the thermometer, number of outliers."""

    known: Floats
    step: float = 0.0
    outlier_count: int = 0


def _sample_temperatures(
    z: Log | npt.ArrayLike,
    temperature: Log | npt.ArrayLike | None,
    n: int,
    rate: float | None,
) -> _ThermometerReading:
    """Return the temperature of each sample.

    For an array without a rate, the thermometer is assumed fine.
    """
    if temperature is None:
        return _ThermometerReading(np.full(n, np.nan))
    if isinstance(temperature, Log):
        if not isinstance(z, Log):
            raise ValueError("a Log of temperatures needs z to be a Log, for its clock")
        return _resample_temperature(z, temperature)
    values = floats(temperature, "temperature")
    if values.shape not in ((n,), (n, 1), ()):
        raise ArgumentError("temperature", f"must have shape ({n},) as z has, got {values.shape}")
    values = np.broadcast_to(values.reshape(-1), (n,))
    if rate is None:
        return _ThermometerReading(hold_last(values))
    return _read_thermometer(np.arange(n) / rate, values)


def _resample_temperature(z: Log, temperature: Log) -> _ThermometerReading:
    time = temperature.sampled
    if time[-1] < z.sampled[0] or time[0] > z.sampled[-1]:
        raise LogError("the temperature and the gyro have no time in common")
    known = convert_to_unit(temperature, "degC", "temperature").reshape(temperature.n, -1)
    reading = _read_thermometer(time, known[:, 0])
    if not np.isfinite(reading.known).all():
        return _ThermometerReading(np.full(z.n, np.nan))
    return reading._replace(known=np.interp(z.sampled, time, reading.known))


def _read_thermometer(time: Floats, temperature: Floats) -> _ThermometerReading:
    """Return the readings of a thermometer on its own clock, without outliers."""
    possible, outlier_count = remove_leaps(time, mask_impossible(temperature))
    filled = hold_last(possible)
    if not np.isfinite(filled).all():
        return _ThermometerReading(filled)
    return _ThermometerReading(*interpolate_steps(time, filled), outlier_count)


def _temperature_range(temperature: Floats) -> tuple[float, float]:
    if not np.isfinite(temperature).all():
        return _DEFAULT_REFERENCE_DEGC, _DEFAULT_REFERENCE_DEGC
    return float(temperature.min()), float(temperature.max())


def _time_correlation(time: Floats, temperature: Floats) -> float:
    if time.size < 3 or not np.isfinite(temperature).all():
        return 0.0
    deviations = time - time.mean(), temperature - temperature.mean()
    sizes = [float(np.sqrt(deviation @ deviation)) for deviation in deviations]
    if min(sizes) <= 1e-9 * np.abs(temperature).max():
        return 0.0
    return float(np.clip(deviations[0] @ deviations[1] / sizes[0] / sizes[1], -1.0, 1.0))


def _slope_coefficient(axis: Fit) -> Coefficient:
    if not np.isfinite(axis.slope_sigma):
        return UNKNOWN_COEFFICIENT
    if axis.degree:
        return Coefficient(axis.slope, axis.slope_sigma)
    bound = abs(axis.slope) + _ONE_SIDED_95_Z * axis.slope_sigma
    return Coefficient(0.0, axis.slope_sigma, False, bound)


def _hysteresis_coefficient(axis: Fit, step: float) -> Coefficient:
    """Return the hysteresis with the error from the steps of a coarse thermometer."""
    if not np.isfinite(axis.hysteresis_sigma):
        return UNKNOWN_COEFFICIENT
    unsure = abs(axis.slope) * step / np.sqrt(12.0)
    return Coefficient(axis.hysteresis, float(np.hypot(axis.hysteresis_sigma, unsure)))


def _notes(model: TemperatureModel, blocks: Blocks, outlier_count: int) -> Sequence[str]:
    notes = []
    if outlier_count:
        have = "temperature leaps" if outlier_count == 1 else "temperatures leap"
        notes.append(
            f"{outlier_count} {have} by 10 K and more at once and back within seconds, which no "
            f"gyro does: left out."
        )
    if not np.isfinite(blocks.temperature).all():
        notes.append("There is no temperature: the record's bias is used at any temperature.")
    elif model.span < MIN_SPANS_K[0]:
        notes.append(
            f"Temperature moved by {shorten(model.span)} K only: the slope is not "
            "identifiable below "
            f"{MIN_SPANS_K[0]:g} K. Record a warm-up from cold."
        )
    if model.span >= MIN_SPANS_K[0] and not model.time_separable:
        notes.append(
            "Temperature and time went together (correlation "
            f"{model.time_correlation:.2f}): a drift in time cannot be distinguished from one of "
            "temperature. Let it cool down and warm up again in the same record."
        )
    if model.step > 0.0:
        notes.append(f"The thermometer moves in steps of {model.step:g} K: read between them.")
    notes += [
        f"{name}: the bias at equal temperature differs by {shorten(hysteresis)} ± "
        f"{shorten(hysteresis.sigma, 1)} "
        f"{model.unit} between warming and cooling: the thermometer is not at the gyro's "
        "temperature, or the gyro has a memory."
        for name, hysteresis in zip(model.names, model.hystereses, strict=True)
        if hysteresis.known and abs(hysteresis) > _SIGNIFICANT_SIGMAS * hysteresis.sigma
    ]
    if blocks.still < 0.5:
        notes.append(
            f"Only {shorten(100.0 * blocks.still)} % of the record is at rest and was used."
        )
    return notes
