"""One log through the noise analysis: deviations, models, a second opinion, and doubts."""

from zerorate.characterise.motion import MOVED, largest_step
from zerorate.characterise.result import Axis, Characterisation
from zerorate.characterise.run import characterise

__all__ = ["MOVED", "Axis", "Characterisation", "characterise", "largest_step"]
