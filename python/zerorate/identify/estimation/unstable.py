"""Models that have no mean of their own."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from zerorate.identify.models.model import ArmaModel
from zerorate.identify.records import as_record

__all__ = ["with_moments"]


def with_moments(model: ArmaModel, z: npt.ArrayLike) -> ArmaModel:
    """Return the model with mean and deviation of its record where it tells none itself."""
    if model.stationary:
        return model
    record = as_record(z)
    return replace(
        model, record_mean=float(np.nanmean(record)), record_deviation=float(np.nanstd(record))
    )
