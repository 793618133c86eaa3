"""One log through the noise analysis: deviations, models, a second opinion, and doubts."""

from zerorate.noise.characterise.motion import MOVED, largest_step
from zerorate.noise.characterise.result import Axis, Characterisation
from zerorate.noise.characterise.run import characterise

__all__ = ["MOVED", "Axis", "Characterisation", "characterise", "largest_step"]
