"""Error for a record that gives no calibration."""

from __future__ import annotations

from typing import TYPE_CHECKING

from zerorate.faults import make_sentence, sentence_of
from zerorate.record.log import LogError

if TYPE_CHECKING:
    from zerorate.calibration.calibration import Calibration


class CalibrationError(LogError):
    """Error for too few rests or rotations; the message states their numbers.

    Attributes
    ----------
    calibration : Calibration or None
        Incomplete result, never valid; None if there is no result.
    """

    def __init__(self, message: str, calibration: Calibration | None = None) -> None:
        """Keep the message to one line."""
        super().__init__(message)
        self.calibration = calibration

    def around(self, before: str = "", after: str = "") -> CalibrationError:
        """Return the error with text before and after its message, such as the name of the log."""
        return CalibrationError(make_sentence(before, sentence_of(self), after), self.calibration)
