"""Noise of a gyro or an accelerometer at rest, as the coefficients of IEEE Std 952-1997."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple, Self, TypeVar, get_args

import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.noise.coefficient import Coefficient, CoefficientField, check_positive
from zerorate.noise.densities import densities
from zerorate.noise.exports import to_kalibr, to_orbslam3, to_px4, to_ros, to_vins
from zerorate.noise.json_text import from_json, to_json
from zerorate.noise.low_pass import LowPass, describe_band
from zerorate.noise.quantities import TERMS, UNKNOWN_UNIT_REASON, Quantity, Term
from zerorate.noise.terms import ALLAN, HADAMARD, Markov, Sinusoid, deviation
from zerorate.record.exporting import document_restore
from zerorate.types import Floats
from zerorate.units import canonical, convert, kind
from zerorate.views import Result

T = TypeVar("T")


class DiscreteSigmas(NamedTuple):
    """Standard deviations per sample.

    For an accelerometer, replace rad/s below by m/s^2. If the unit is unknown, rad/s stands for the
    unit of the samples.

    Parameters
    ----------
    white : float
        N sqrt(rate) in rad/s: the standard deviation of one sample's white noise. Its square is the
        measurement noise R of a filter for angular rate.
    walk_step : float
        K / sqrt(rate) in rad/s: the standard deviation of the random walk's step from one sample to
        the next. Its square is the process noise Q of the bias.

    Examples
    --------
    >>> import zerorate as zr
    >>> model = zr.NoiseModel(angle_random_walk=1e-4, rate_random_walk=1e-6)
    >>> sigmas = model.discrete_sigmas(rate=100.0)
    >>> sigmas.white, sigmas.walk_step
    (0.001, 1e-07)
    """

    white: float
    walk_step: float


@dataclass(frozen=True)
class NoiseModel(Result):
    """Noise coefficients of a gyro at rest, in SI units.

    Each coefficient is a `Coefficient`, a float with its standard error. A plain number gets the
    standard error 0; the number 0 means no noise of this kind. A coefficient that is None or not
    given is *unknown*. Curves and simulations leave it out, exports state that it is unknown, and
    its `conservative` value is infinite.

    Parameters
    ----------
    angle_random_walk : float
        N in rad/s/sqrt(Hz): white noise of rate, two-sided density N^2.
    bias_instability : float
        B in rad/s: flicker noise, density B^2 / (2 pi f). The flat part of the Allan deviation is
        0.664 B.
    rate_random_walk : float
        K in rad/s^2/sqrt(Hz), the same as rad/s/sqrt(s): density (K / (2 pi f))^2.
    rate_ramp : float
        R in rad/s^2: a drift of R t. Only this coefficient may be negative.
    quantization : float
        Q in rad: white noise of the angle, with standard deviation Q at every sample. A uniform
        quantizer of the angle by a step q has Q = q / sqrt(12).
    markov : sequence of Markov
        Exponentially correlated noise, any number of terms.
    sinusoid : sequence of Sinusoid
        Sines in the rate, any number of terms.
    quantity : {"angular rate", "acceleration", "unknown"}
        Measured quantity. "acceleration": replace rad/s above by m/s^2; `angle_random_walk` is then
        the velocity random walk in m/s^2/sqrt(Hz). "unknown", for a record without a known unit:
        replace rad/s above by the unit of the samples. A model of this quantity cannot be
        converted, and JSON is its only export.
    doubt : str
        Reason not to trust the numbers, as a sentence. `zerorate.allan` sets it for a record that
        moved or is too short. Exports of a model with a doubt raise an error if `doubtful` is
        False. Default: none.
    low_pass : LowPass, optional
        Filter between noise and samples. The coefficients are valid below its corner. The variance
        of a sample is then less than N^2 times the sampling rate.
    up_to : float, optional
        Frequency in Hz below which the coefficients were estimated. Default: all frequencies.

    Raises
    ------
    ValueError
        If a coefficient is not a finite number. If a coefficient other than the ramp is negative.
        If another field is not as described.

    Notes
    -----
    `zerorate.units.convert` converts data-sheet units (deg/sqrt(h), deg/h) to these units. `print`
    shows a table in data-sheet units.

    Examples
    --------
    >>> model = NoiseModel(angle_random_walk=1e-4, bias_instability=2e-5)
    >>> [round(1e5 * float(s), 3) for s in model.allan_deviation([1.0, 1e4])]
    [10.088, 1.332]
    >>> print(model)
    angle random walk  0.3438  deg/sqrt(h)
    bias instability   4.125   deg/h
    unknown: quantization, rate random walk, rate ramp
    """

    angle_random_walk: CoefficientField = CoefficientField()
    bias_instability: CoefficientField = CoefficientField()
    rate_random_walk: CoefficientField = CoefficientField()
    rate_ramp: CoefficientField = CoefficientField(signed=True)
    quantization: CoefficientField = CoefficientField()
    markov: tuple[Markov, ...] = ()
    sinusoid: tuple[Sinusoid, ...] = ()
    quantity: Quantity = "angular rate"
    doubt: str = ""
    low_pass: LowPass | None = None
    up_to: float | None = None

    to_kalibr = to_kalibr
    to_vins = to_vins
    to_orbslam3 = to_orbslam3
    to_px4 = to_px4
    to_ros = to_ros
    to_json = to_json

    def __post_init__(self) -> None:
        """Raise an error for arguments that are not terms or not a known quantity."""
        object.__setattr__(self, "markov", _check_terms("markov", self.markov, Markov))
        object.__setattr__(self, "sinusoid", _check_terms("sinusoid", self.sinusoid, Sinusoid))
        if self.quantity not in get_args(Quantity):
            known = ", ".join(repr(name) for name in get_args(Quantity))
            raise ArgumentError("quantity", f"must be one of {known}, got {self.quantity!r}")
        if not isinstance(self.doubt, str):
            raise ArgumentError("doubt", f"must be a sentence, got {self.doubt!r}")
        if not isinstance(self.low_pass, LowPass | None):
            raise ArgumentError("low_pass", f"must be a LowPass, got {self.low_pass!r}")
        if self.up_to is not None and not _is_positive(self.up_to):
            raise ArgumentError("up_to", f"must be a frequency above 0 Hz, got {self.up_to}")

    @property
    def band(self) -> str:
        """Frequency band in which the coefficients are valid, in words; empty without limits."""
        return describe_band(self.low_pass, self.up_to)

    @classmethod
    @document_restore
    def from_json(cls, source: str | os.PathLike[str]) -> Self:
        """Return the model that `to_json` wrote, without loss of digits.

        `FittedModel.from_json` also reads the quality of the fit; `NoiseModel.from_json` does not.

        Examples
        --------
        >>> model = NoiseModel(Coefficient(1e-4, sigma=2e-6))
        >>> NoiseModel.from_json(model.to_json()) == model
        True
        """
        return from_json(source, cls)

    def allan_deviation(self, taus: npt.ArrayLike) -> Floats:
        """Return the model's Allan deviation curve.

        Parameters
        ----------
        taus : array_like
            Averaging times, s, positive, any shape.

        Returns
        -------
        ndarray of float64, the shape of `taus`
            Deviation in rad/s (m/s^2 for an accelerometer): the square root of the sum of

            - 3 Q^2/tau^2 + N^2/tau + (2 ln 2/pi) B^2 + K^2 tau/3 + R^2 tau^2/2,
            - (q_c T_c)^2/tau [1 - T_c/(2 tau) (3 - 4 exp(-tau/T_c) + exp(-2 tau/T_c))] for each
              Markov term,
            - Omega_0^2 sin^4(x)/x^2, x = pi f_0 tau, for each sinusoid.

            The curve is for continuous time. For a sampled random walk the deviation at m samples
            is larger by the factor sqrt(1 + 1/(2 m^2)).

        Raises
        ------
        ValueError
            If a tau is not positive and finite.

        Notes
        -----
        IEEE Std 952-1997, annex C, equations of C.1.1 to C.1.7.
        """
        return deviation(self, taus, ALLAN)

    def hadamard_deviation(self, taus: npt.ArrayLike) -> Floats:
        """Return the model's Hadamard deviation curve; a ramp does not affect it.

        Parameters
        ----------
        taus : array_like
            Averaging times, s, positive, any shape.

        Returns
        -------
        ndarray of float64, the shape of `taus`
            Deviation in rad/s (m/s^2 for an accelerometer): the square root of the sum of

            - (10/3) Q^2/tau^2 + N^2/tau + 0.8113 (2 ln 2/pi) B^2 + K^2 tau/6,
            - (q_c T_c)^2/tau [1 - T_c/(6 tau) (10 - 15 e^(-x) + 6 e^(-2 x) - e^(-3 x))],
              x = tau/T_c, for each Markov term,
            - (4/3) Omega_0^2 sin^6(x)/x^2, x = pi f_0 tau, for each sinusoid.

        Raises
        ------
        ValueError
            If a tau is not positive and finite.

        Notes
        -----
        The formula follows from the variance of the third difference of the angle, over 6 tau^2: W.
        J. Riley and D. A. Howe, "Handbook of Frequency Stability Analysis", NIST SP 1065, 2008,
        section 5.2.8.
        """
        return deviation(self, taus, HADAMARD)

    def in_units(self, unit: str) -> Coefficient:
        """Return the coefficient that a unit selects, converted to this unit.

        Parameters
        ----------
        unit : str
            Unit from `zerorate.units`. Its kind selects the coefficient: angle random walk N, rate
            B, rate random walk K, rate ramp R, angle Q. For an accelerometer, use the units of
            acceleration instead.

        Returns
        -------
        Coefficient
            Coefficient with value, standard error and bound converted.

        Raises
        ------
        ValueError
            If the unit is unknown. If no coefficient of this quantity has this kind of unit. If the
            unit of the model is unknown.

        Examples
        --------
        >>> float(round(NoiseModel(angle_random_walk=1e-4).in_units("deg/sqrt(h)"), 4))
        0.3438
        """
        if self.quantity == "unknown":
            raise ValueError(
                f"a coefficient in {canonical(unit)} cannot be given because {UNKNOWN_UNIT_REASON}"
            )
        for term, coefficient in self._coefficients():
            if kind(term.unit) == kind(unit):
                return coefficient.scaled(convert(1.0, term.unit, unit))
        known = ", ".join(f"{term.unit} ({term.name})" for term in TERMS[self.quantity])
        raise ValueError(
            f"a model of {self.quantity} has no coefficient in {canonical(unit)} ({kind(unit)}): "
            f"it has {known}, and what converts to these"
        )

    def discrete_sigmas(self, rate: float) -> DiscreteSigmas:
        """Return the standard deviations for a Kalman filter at a sampling rate.

        Parameters
        ----------
        rate : float
            Sampling rate, Hz.

        Returns
        -------
        DiscreteSigmas
            `white` and `walk_step`. The square of `white` is the measurement noise variance of one
            sample, after the low-pass if there is one. The square of `walk_step` is the process
            noise variance of the bias per sample. A coefficient that is not identifiable counts
            with its upper bound; an unknown coefficient is infinite.

        Raises
        ------
        ValueError
            If the rate is not positive and finite.

        Examples
        --------
        >>> NoiseModel(angle_random_walk=1e-4, rate_random_walk=1e-6).discrete_sigmas(100.0)
        DiscreteSigmas(white=0.001, walk_step=1e-07)
        """
        root = math.sqrt(check_positive("rate", rate))
        white, walk = self.angle_random_walk, self.rate_random_walk
        passed = 1.0 if self.low_pass is None else math.sqrt(self.low_pass.passed_share(rate))
        return DiscreteSigmas(white.conservative * root * passed, walk.conservative / root)

    def __noise_densities__(self, sensor: str) -> tuple[float, float | None]:
        """Return white noise and random walk of a sensor axis' bias, for a `NavigationFilter`."""
        return densities(self, sensor)

    def _coefficients(self) -> Iterator[tuple[Term, Coefficient]]:
        return ((term, getattr(self, term.field)) for term in TERMS[self.quantity])


def _is_positive(number: object) -> bool:
    return isinstance(number, int | float) and 0.0 < number < math.inf


def _check_terms(name: str, values: object, kind_: type) -> tuple[Any, ...]:
    terms = tuple(values) if isinstance(values, Iterable) else (None,)
    if not all(isinstance(term, kind_) for term in terms):
        raise ArgumentError(name, f"must be a sequence of {kind_.__name__}, got {values!r}")
    return terms


def worst_axis(models: Iterable[NoiseModel]) -> NoiseModel:
    """Return a noise model with the largest value of each coefficient over the axes.

    Use it for an estimator with one number for all axes.

    Parameters
    ----------
    models : iterable of NoiseModel
        Models, one for each axis, all of one quantity. At least one.

    Returns
    -------
    NoiseModel
        - A coefficient has the largest value of the axes that determine it, with its standard
          error.
        - If no axis determines a coefficient, it has the largest upper bound.
        - A coefficient is unknown only if it is unknown in all axes.
        - Ramps are compared by absolute value.
        - Markov terms and sinusoids come from the axis with the largest sum of their variances.
        - The doubts of all axes are joined. The low-pass filter is the filter with the lowest
          corner.

    Raises
    ------
    ValueError
        If there is no model, or the models differ in quantity.

    Examples
    --------
    >>> x = NoiseModel(angle_random_walk=1e-4, rate_random_walk=3e-6)
    >>> y = NoiseModel(angle_random_walk=2e-4, rate_random_walk=1e-6)
    >>> worst = worst_axis([x, y])
    >>> worst.angle_random_walk, worst.rate_random_walk
    (Coefficient(0.0002), Coefficient(3e-06))
    """
    axes = list(models)
    quantities = {model.quantity for model in axes}
    if len(quantities) != 1:
        listed = ", ".join(sorted(quantities)) or "none"
        raise ValueError(f"the axes must be models of one quantity, got {listed}")
    quantity = quantities.pop()
    filters = [axis.low_pass for axis in axes if axis.low_pass is not None]
    largest = {
        term.field: max((getattr(axis, term.field) for axis in axes), key=_rank_coefficient)
        for term in TERMS[quantity]
    }
    return NoiseModel(
        **largest,
        markov=_choose_largest((axis.markov for axis in axes), _markov_deviation),
        sinusoid=_choose_largest((axis.sinusoid for axis in axes), _sinusoid_deviation),
        quantity=quantity,
        doubt=next((axis.doubt for axis in axes if axis.doubt), ""),
        low_pass=min(filters, key=lambda low_pass: low_pass.corner, default=None),
        up_to=min((axis.up_to for axis in axes if axis.up_to is not None), default=None),
    )


def _rank_coefficient(coefficient: Coefficient) -> tuple[bool, bool, float]:
    """Return the rank of a coefficient: determined first, then bounds, then unknown."""
    size = abs(coefficient.conservative)
    return coefficient.identifiable, coefficient.known, size


def _choose_largest(
    choices: Iterable[tuple[T, ...]], deviation: Callable[[T], float]
) -> tuple[T, ...]:
    return max(choices, key=lambda terms: math.hypot(*map(deviation, terms)))


def _markov_deviation(term: Markov) -> float:
    return term.amplitude.conservative * math.sqrt(term.time / 2.0)


def _sinusoid_deviation(term: Sinusoid) -> float:
    return term.amplitude.conservative / math.sqrt(2.0)
