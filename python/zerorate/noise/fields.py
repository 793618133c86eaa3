"""Fields of the noise dataclasses: any number in, a checked `Coefficient` out."""

import math
from typing import Any, overload

from zerorate.noise.coefficient import Coefficient

__all__ = ["CoefficientField"]


class CoefficientField:
    """A descriptor that makes a dataclass field take any number and hold a `Coefficient`.

    Parameters
    ----------
    signed : bool
        Whether negative numbers mean something; default no.
    positive : bool
        Whether zero is refused too; default no.
    required : bool
        Whether the field has no default; else that is zero.
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
        """Return the coefficient; on the class, the default zero."""
        if instance is None:
            if self._required:
                # What a dataclass reads as: no default.
                raise AttributeError(self._name)
            return Coefficient()
        value: Coefficient = instance.__dict__[self._name]
        return value

    def __set__(self, instance: object, value: float) -> None:
        """Check the number and keep it as a coefficient."""
        instance.__dict__[self._name] = self._checked(value)

    def _checked(self, value: Any) -> Coefficient:  # noqa: ANN401
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
