"""The way of a log through the analysis."""

from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.io import Log, LogError
from zerorate.noise import AllanResult, FittedModel, allan
from zerorate.noise.characterise.motion import largest_step
from zerorate.noise.characterise.result import Axis, Characterisation
from zerorate.noise.kinds import KindName
from zerorate.noise.spectrum import Spectrum
from zerorate.noise.taus import TauGrid
from zerorate.noise.whittle import fit_spectrum
from zerorate.progress import Progress, silent

__all__ = ["characterise"]

# Every kind has an averaging time from here on.
_LEAST_SAMPLES: Final = 20


def characterise(
    log: Log,
    *,
    kind: KindName = "oadev",
    taus: TauGrid | Sequence[float] = "octave",
    bridge: int = 0,
    confidence: float = 0.683,
    markov: int = 0,
    second_opinion: bool = True,
    progress: Progress | None = None,
) -> Characterisation:
    """Find the noise coefficients of every axis of a log.

    Parameters
    ----------
    log : Log
        The recording of sensors of one kind.
    kind, taus, bridge, confidence
        As of `zerorate.allan`.
    markov : int
        How many Markov terms to find; default none.
    second_opinion : bool
        Whether to estimate from the spectrum as well; default yes.
    progress : callable, optional
        Called with the step's name and the fraction of it that is done.

    Returns
    -------
    Characterisation
        Deviations, a model an axis, and what to beware of.

    Raises
    ------
    LogError
        If the log has fewer than 20 samples, or a column none.
    ValueError
        If an argument is not as described.
    """
    _check_samples(log, kind)
    tell = progress or silent
    tell("deviations", 0.0)
    curve = allan(log, kind=kind, taus=taus, bridge=bridge, confidence=confidence)

    axes = []
    # Transforms need no interpreter lock: they run beside the fits.
    with ThreadPoolExecutor(1) as executor:
        columns = [np.ascontiguousarray(z) for z in log.data.T]
        asked = columns if second_opinion else []
        spectra = [executor.submit(Spectrum.of, z, log.rate) for z in asked]
        for i, z in enumerate(columns):
            tell("models", i / log.channels)
            spectrum = spectra[i] if second_opinion else None
            axes.append(_examined(log, curve.axis(i), z, markov, spectrum))
    return Characterisation(log, curve, tuple(axes))


def _check_samples(log: Log, kind: KindName) -> None:
    if log.n < _LEAST_SAMPLES:
        raise LogError(f"{kind} needs at least {_LEAST_SAMPLES} samples, the log has {log.n}")
    for name, column in zip(log.names, log.data.T, strict=True):
        if not np.isfinite(column).any():
            raise LogError(f"column '{name}' holds no sample: choose others with columns=")


def _examined(
    log: Log,
    curve: AllanResult,
    z: npt.NDArray[np.float64],
    markov: int,
    spectrum: Future[Spectrum] | None,
) -> Axis:
    (name,) = curve.names
    step = largest_step(z, log.rate)
    if not np.any(curve.deviation > 0.0):
        return Axis(name, None, None, step)
    model, doubt = _tried(lambda: curve.fit(markov=markov))
    second = None
    if spectrum is not None:
        second, _ = _tried(lambda: fit_spectrum(spectrum.result(), log.rate, log.unit))
    return Axis(name, model, second, step, (doubt,) if doubt else ())


def _tried(
    fit: Callable[[], FittedModel | tuple[FittedModel, ...]],
) -> tuple[FittedModel | None, str]:
    """Return a model, or why there is none."""
    try:
        model = fit()
    except ValueError as error:
        return None, str(error)
    assert isinstance(model, FittedModel)  # one axis has one model
    return model, ""
