"""Records about their mean, in the size that squares and sums of them bear."""

import numpy as np
import numpy.typing as npt

from zerorate.noise.records import power_of_two

__all__ = ["centred", "size_of", "with_gaps"]

Floats = npt.NDArray[np.float64]


def with_gaps(record: Floats) -> Floats:
    """Return the record with NaN for all that is not finite; itself if nothing is."""
    finite = np.isfinite(record)
    return record if finite.all() else np.where(finite, record, np.nan)


def centred(record: Floats) -> Floats:
    """Return the samples that are there less their mean, at most about 1 in size.

    For what does not depend on the unit. The mean is found about one of the samples, so that an
    offset costs no precision, and the unit is a power of two, so that it rounds nothing.
    """
    finite = np.isfinite(record)
    present = record if finite.all() else record[finite]
    scaled = present / size_of(present)
    scaled -= scaled[0]
    scaled -= scaled.mean()
    # Once more: a record that hardly differs is small now.
    scaled /= size_of(scaled)
    if present is record:
        return scaled
    whole = np.full(record.size, np.nan)
    whole[finite] = scaled
    return whole


def size_of(values: Floats) -> float:
    """Return a power of two near the largest of finite values, 1 if all are 0."""
    return power_of_two(values) if np.any(values) else 1.0
