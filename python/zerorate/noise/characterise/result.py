"""What was found out about the sensors of one log."""

from collections.abc import Iterator
from dataclasses import dataclass

from zerorate.io import Log
from zerorate.noise import AllanResult, FittedModel, NoiseModel, worst_axis
from zerorate.noise.characterise.motion import MOVED, Step

__all__ = ["Axis", "Characterisation"]


@dataclass(frozen=True)
class Axis:
    """One axis.

    Attributes
    ----------
    name : str
        Of the column.
    model : FittedModel or None
        Of the deviation curve; None where nothing can be fitted.
    second : FittedModel or None
        Of the spectrum; None where that was not asked for or cannot be.
    step : Step
        The largest change between the means of two seconds.
    doubts : tuple of str
        Why there is no model.
    """

    name: str
    model: FittedModel | None
    second: FittedModel | None
    step: Step
    doubts: tuple[str, ...] = ()

    @property
    def moved(self) -> bool:
        """Whether the record looks as if the sensor moved."""
        return self.step.size > MOVED


@dataclass(frozen=True)
class Characterisation:
    """The sensors of one kind in one log.

    Attributes
    ----------
    log : Log
        The recording.
    curve : AllanResult
        Deviations of every axis.
    axes : tuple of Axis
        Models and doubts, one a column.
    """

    log: Log
    curve: AllanResult
    axes: tuple[Axis, ...]

    @property
    def models(self) -> tuple[FittedModel | None, ...]:
        """The models of the curves."""
        return tuple(axis.model for axis in self.axes)

    @property
    def worst(self) -> NoiseModel | None:
        """One model for all axes that have one, each coefficient the largest; None without."""
        models = [model for model in self.models if model is not None]
        return worst_axis(models) if models else None

    @property
    def notes(self) -> Iterator[str]:
        """What to beware of, a sentence each."""
        yield from (_motion(axis) for axis in self.axes if axis.moved)
        yield from self.curve.notes
        yield from dict.fromkeys(doubt for axis in self.axes for doubt in axis.doubts)
        yield from (
            f"{axis.name}: the model misses the curve by {50.0 * axis.model.misfit:.0f} % "
            "(standard errors include it)"
            for axis in self.axes
            if axis.model is not None and axis.model.misfit > 0.0
        )


def _motion(axis: Axis) -> str:
    return (
        f"{axis.name}: looks as if it moved (at {axis.step.time:g} s its mean over one second "
        f"changes {axis.step.size:.0f} times as much as usual): the numbers describe the motion, "
        "not the sensor"
    )
