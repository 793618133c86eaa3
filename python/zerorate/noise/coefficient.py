"""Noise coefficient with its uncertainty, and the dataclass field that holds it."""

import math
from typing import Any, Final, Self, overload

from zerorate.faults import ArgumentError

_ONE_SIDED_95: Final = 1.6448536269514722
"""The 0.95 quantile of the standard normal distribution."""


class Coefficient(float):
    """Coefficient of a noise model: a float with its standard error.

    Arithmetic gives plain floats. Comparison and hash use the value.

    Parameters
    ----------
    value : float
        The coefficient, in any unit; finite.
    sigma : float
        Standard error in the same unit. Default 0, for a number that was not estimated.
    identifiable : bool
        True if the record determines the coefficient, or if the number was given and not estimated.
        Default True.
    upper_bound : float, optional
        One-sided 95 % bound. Default: ``value + 1.645 * sigma``. It is required if the coefficient
        is not identifiable; infinity means that the coefficient is unknown.

    Raises
    ------
    ValueError
        If the value or sigma is not finite. If sigma is negative. If the bound is NaN or below the
        value. If the coefficient is not identifiable and has no bound.

    Examples
    --------
    >>> Coefficient(1.2e-4, sigma=3e-6)
    Coefficient(0.00012 ± 3e-06)
    >>> small = Coefficient(0.0, identifiable=False, upper_bound=2e-6)
    >>> small, small.conservative
    (Coefficient(not identifiable, below 2e-06), 2e-06)
    >>> 2.0 * Coefficient(0.5)
    1.0
    """

    __slots__ = ("_identifiable", "_sigma", "_upper_bound")

    _sigma: float
    _identifiable: bool
    _upper_bound: float

    def __new__(
        cls,
        value: float = 0.0,
        sigma: float = 0.0,
        identifiable: bool = True,
        upper_bound: float | None = None,
    ) -> Self:
        """Check the numbers and keep them as plain floats."""
        self = super().__new__(cls, _check_finite("value", value))
        self._sigma = _check_finite("sigma", sigma)
        self._identifiable = bool(identifiable)
        if self._sigma < 0.0:
            raise ArgumentError("sigma", f"must not be negative, got {self._sigma}")
        if upper_bound is None:
            if not identifiable:
                raise ValueError("a coefficient that is not identifiable needs its upper_bound")
            upper_bound = self.value + _ONE_SIDED_95 * self._sigma
        bound = float(upper_bound)
        unbounded = bound == math.inf and not identifiable
        self._upper_bound = bound if unbounded else _check_finite("upper_bound", bound)
        if self._upper_bound < self.value:
            raise ArgumentError(
                "upper_bound", f"must not be below the value {self.value}, got {self._upper_bound}"
            )
        return self

    @property
    def value(self) -> float:
        """The coefficient as a plain float."""
        return float.__float__(self)

    @property
    def sigma(self) -> float:
        """Standard error, in the unit of the value; 0 for a given number."""
        return self._sigma

    @property
    def identifiable(self) -> bool:
        """True if the record determines the coefficient, or if the number was given."""
        return self._identifiable

    @property
    def known(self) -> bool:
        """True if the coefficient has a value or a finite upper bound."""
        return math.isfinite(self._upper_bound)

    @property
    def upper_bound(self) -> float:
        """One-sided 95 % bound; the value itself for a given number, infinity if unknown."""
        return self._upper_bound

    @property
    def conservative(self) -> float:
        """The value, or the upper bound if the value is not identifiable.

        Use it in a filter, where an unknown coefficient must not count as zero. It is infinity for
        an unknown coefficient.
        """
        return self.value if self._identifiable else self._upper_bound

    def scaled(self, factor: float) -> "Coefficient":
        """Return the coefficient multiplied by a factor, to change its unit or to inflate it.

        Parameters
        ----------
        factor : float
            Positive factor that multiplies value, standard error and bound.

        Returns
        -------
        Coefficient
            Scaled coefficient, identifiable if this coefficient is.
        """
        return Coefficient(
            self.value * factor,
            self._sigma * factor,
            self._identifiable,
            self._upper_bound * factor,
        )

    def __reduce__(self) -> tuple[type[Self], tuple[float, float, bool, float]]:
        """Pickle and copy by the four numbers."""
        return type(self), (self.value, self._sigma, self._identifiable, self._upper_bound)

    def __repr__(self) -> str:
        """Return the value with its standard error, or the bound."""
        if not self.known:
            return "Coefficient(unknown)"
        if not self._identifiable:
            return f"Coefficient(not identifiable, below {self._upper_bound:.4g})"
        error = f" ± {self._sigma:.2g}" if self._sigma else ""
        return f"Coefficient({self.value:.4g}{error})"

    __str__ = float.__repr__


def check_positive(name: str, value: float) -> float:
    """Return a number as a float; ValueError if it is not positive and finite."""
    if not (math.isfinite(value) and value > 0.0):
        raise ArgumentError(name, f"must be positive and finite, got {value}")
    return float(value)


def _check_finite(name: str, value: float) -> float:
    number = float(value)
    if not math.isfinite(number):
        raise ArgumentError(name, f"must be finite, got {number}")
    return number


UNKNOWN_COEFFICIENT: Final = Coefficient(0.0, identifiable=False, upper_bound=math.inf)
"""Coefficient that was neither measured nor stated; it counts as absent where a value is needed."""


class CoefficientField:
    """Descriptor of a dataclass field that takes a number and holds a `Coefficient`.

    None is an unknown coefficient, unless the field is required.

    Parameters
    ----------
    signed : bool
        Allow negative numbers. Default False.
    positive : bool
        Exclude zero. Default False.
    required : bool
        The field has no default. Otherwise the default is an unknown coefficient.
    """

    def __init__(
        self, *, signed: bool = False, positive: bool = False, required: bool = False
    ) -> None:
        self._signed = signed
        self._positive = positive
        self._required = required

    def __set_name__(self, owner: type, name: str) -> None:
        """Remember the field's name, for storage and messages."""
        self._name = name

    @overload
    def __get__(self, instance: None, owner: type) -> Coefficient: ...
    @overload
    def __get__(self, instance: object, owner: type) -> Coefficient: ...
    def __get__(self, instance: object | None, owner: type) -> Coefficient:
        """Return the coefficient; on the class, the unknown coefficient as default."""
        if instance is None:
            if self._required:
                # A dataclass treats this as a field without a default.
                raise AttributeError(self._name)
            return UNKNOWN_COEFFICIENT
        value: Coefficient = instance.__dict__[self._name]
        return value

    def __set__(self, instance: object, value: float | None) -> None:
        """Check the number and keep it as a coefficient."""
        instance.__dict__[self._name] = self._check_value(value)

    def _check_value(self, value: Any) -> Coefficient:  # noqa: ANN401
        if value is None and not self._required:
            return UNKNOWN_COEFFICIENT
        try:
            number = float(value)
        except (TypeError, ValueError):
            raise ValueError(f"{self._name} must be a number, got {value!r}") from None
        if not math.isfinite(number):
            raise ValueError(f"{self._name} must be finite, got {number}")
        if number < 0.0 and not self._signed:
            raise ValueError(f"{self._name} must not be negative, got {number}")
        if number == 0.0 and self._positive:
            raise ValueError(f"{self._name} must be positive, got {number}")
        return value if isinstance(value, Coefficient) else Coefficient(number)
