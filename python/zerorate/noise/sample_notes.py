"""Sentences on a record at rest: steps larger than the noise, and a low-pass."""

from __future__ import annotations

from collections.abc import Iterator

from zerorate.noise.coarse import describe_coarse, describe_rounding, find_coarse
from zerorate.noise.low_pass import band_of
from zerorate.noise.spectrum import Spectrum, find_low_pass
from zerorate.types import Floats


def describe_steps(record: Floats, rate: float, unit: str) -> str:
    """Return the sentence on the steps of one axis, empty if they are insignificant."""
    coarse = find_coarse(record, rate)
    if coarse is not None:
        return describe_coarse(coarse, rate, unit)
    return describe_rounding(record, rate)


def describe_samples(record: Floats, rate: float, unit: str) -> Iterator[str]:
    """Yield the sentences on steps and low-pass of one axis at rest."""
    steps = describe_steps(record, rate, unit)
    if steps:
        yield steps
    try:
        filtered = find_low_pass(Spectrum.of(record, rate), rate)
    except ValueError:
        return
    band = "" if filtered is None else band_of(filtered, rate)
    if band:
        yield band
