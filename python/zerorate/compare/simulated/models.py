"""Simulated gyros of all kinds of drift, with their noises known exactly."""

from dataclasses import dataclass
from typing import Final

from zerorate.compare.simulated.checks import check_not_negative
from zerorate.compare.simulated.parts import GaussMarkov, Part, Resonance, WarmUp, flicker

__all__ = ["MODELS", "DeviceModel"]


@dataclass(frozen=True)
class DeviceModel:
    """A gyro at rest: a constant bias, drift, noise that is not drift, and rounding.

    Parameters
    ----------
    name : str
        Unique; the noises that a seed draws depend on it.
    angle_random_walk : float
        White noise in deg/s/sqrt(Hz); the default is a deviation of 0.1 deg/s at 100 Hz.
    rate_random_walk : float
        Random walk of the drift, deg/s/sqrt(s).
    drift : tuple of Part
        What else a drift filter has to find.
    disturbances : tuple of Part
        Coloured noise that is no drift.
    resolution : float
        Step of the output, deg/s; 0 for none.
    turn_on_bias : float
        Deviation of the constant bias, deg/s. No filter is told.
    transient : bool
        Whether the drift dies away: such a model is reported apart.

    Raises
    ------
    ValueError
        If a number is negative or not finite.

    Examples
    --------
    >>> MODELS[2].name, MODELS[2].rate_random_walk
    ('walk', 0.0003)
    """

    name: str
    angle_random_walk: float = 0.01
    rate_random_walk: float = 0.0
    drift: tuple[Part, ...] = ()
    disturbances: tuple[Part, ...] = ()
    resolution: float = 0.0
    turn_on_bias: float = 0.5
    transient: bool = False

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_not_negative(
            self, "angle_random_walk", "rate_random_walk", "resolution", "turn_on_bias"
        )


def _hump(deviation: float) -> tuple[Resonance]:
    """Return a hump at 18 Hz whose poles have the radius 0.97 at 100 Hz."""
    return (Resonance(deviation, 18.0, 0.3283),)


MODELS: Final = (
    DeviceModel("none"),
    DeviceModel("faint slow", drift=(GaussMarkov(0.0015, 600.0),)),
    DeviceModel("walk", rate_random_walk=3e-4),
    DeviceModel("strong walk", rate_random_walk=3e-3),
    DeviceModel("Markov 100 s", drift=(GaussMarkov(0.01, 100.0),)),
    DeviceModel("Markov 10 s", drift=(GaussMarkov(0.02, 10.0),)),
    DeviceModel("two Markov", drift=(GaussMarkov(0.01, 8.0), GaussMarkov(0.01, 300.0))),
    DeviceModel("flicker", drift=flicker(0.002)),
    DeviceModel("flicker + walk", rate_random_walk=2e-4, drift=flicker(0.001)),
    DeviceModel("tactical", angle_random_walk=0.0005, drift=flicker(0.0005)),
    DeviceModel(
        "rounded",
        angle_random_walk=0.005,
        rate_random_walk=3e-4,
        drift=(GaussMarkov(0.004, 60.0),),
        resolution=0.05,
    ),
    DeviceModel(
        "hump",
        angle_random_walk=0.005,
        drift=(GaussMarkov(0.006, 150.0),),
        disturbances=_hump(0.2),
    ),
    DeviceModel(
        "strong hump",
        angle_random_walk=0.005,
        drift=(GaussMarkov(0.006, 150.0),),
        disturbances=_hump(0.6),
    ),
    DeviceModel("coloured", rate_random_walk=3e-4, disturbances=(GaussMarkov(0.05, 0.1),)),
    DeviceModel("warm-up", rate_random_walk=2e-4, drift=(WarmUp(0.1, 300.0),), transient=True),
)
"""Classes of gyro from no drift at all to a warm-up, the transient ones last."""
