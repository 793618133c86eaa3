"""Noise of every axis of one sensor: deviations, models, a second opinion, and warnings."""

import json
import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.noise import AllanResult, FittedModel, NoiseModel, allan, worst_axis
from zerorate.noise.coarse import (
    coarse_model,
    describe_coarse,
    describe_rounding,
    find_coarse,
)
from zerorate.noise.exports import check_doubts
from zerorate.noise.fit import coefficient_of
from zerorate.noise.kinds import KindName, TauGrid
from zerorate.noise.low_pass import Filtered
from zerorate.noise.spectrum import Spectrum, find_low_pass, fit_spectrum
from zerorate.progress import Progress, choose_reporter
from zerorate.record import Log, LogError
from zerorate.record.log import notes_of
from zerorate.types import Floats

# From this number of samples every kind has an averaging time.
_MIN_SAMPLES: Final = 20
_NOTABLE_MISFIT: Final = 0.1
"""Misfit of deviations above which a note is given; standard errors include any misfit."""


@dataclass(frozen=True)
class Axis:
    """Noise of one axis.

    Attributes
    ----------
    name : str
        Name of the column.
    model : FittedModel or None
        Model of the deviation curve; None if nothing can be fitted.
    second : FittedModel or None
        Estimate from the spectrum; None if not requested or not possible.
    doubts : tuple of str
        Reasons why the model is missing or doubtful.
    """

    name: str
    model: FittedModel | None
    second: FittedModel | None
    doubts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Characterisation:
    """Noise of the sensors of one kind in a log.

    Attributes
    ----------
    log : Log
        The recording.
    curve : AllanResult
        Deviations of every axis.
    axes : tuple of Axis
        Models and doubts, one entry per column.
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
        """Model with the largest coefficients of all axes; None if no axis has a model."""
        models = [model for model in self.models if model is not None]
        return worst_axis(models) if models else None

    @property
    def moved(self) -> tuple[bool, ...]:
        """Mask of axes with signs of motion; all axes if most of them have signs."""
        return tuple(doubt.moved for doubt in self.curve.doubts)

    @property
    def notes(self) -> Iterator[str]:
        """Warnings, one sentence each."""
        yield from (doubt_entry.why for doubt_entry in self.curve.doubts if doubt_entry.why)
        yield from self.curve.notes
        yield from dict.fromkeys(doubt for axis in self.axes for doubt in axis.doubts)
        yield from (
            f"{axis.name}: {axis.model.band}"
            for axis in self.axes
            if axis.model is not None and axis.model.band
        )
        yield from self._describe_misfit()

    def _describe_misfit(self) -> Iterator[str]:
        models = ((axis.name, axis.model) for axis in self.axes if axis.model is not None)
        misfits = {
            name: 0.5 * model.misfit for name, model in models if not (model.markov or model.band)
        }
        notable = {name: part for name, part in misfits.items() if part > _NOTABLE_MISFIT}
        if notable:
            listed = ", ".join(f"{name} by {100.0 * part:.0f} %" for name, part in notable.items())
            yield make_sentence(
                f"the model misses the curve: {listed}; noise that is correlated over one time may "
                "explain it, ",
                keyword_argument("markov", "1"),
            )


def characterise_log(
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
    """Estimate the noise coefficients of every axis of a log, as in `zerorate.characterise`.

    Parameters
    ----------
    log : Log
        The recording of sensors of one kind.
    kind, taus, bridge, confidence
        As in `zerorate.allan`.
    markov : int
        Number of Markov terms to estimate. Default 0.
    second_opinion : bool
        Also estimate from the spectrum. Default True.
    progress : callable, optional
        Called with the name of the step and the fraction done. By default a notebook shows a bar.

    Returns
    -------
    Characterisation
        Deviations, a model for each axis, and warnings.

    Raises
    ------
    LogError
        If the log has fewer than 20 samples, or a column has no samples.
    ValueError
        If an argument is not as described.
    """
    _check_samples(log, kind)
    report = choose_reporter(progress)
    report("deviations", 0.0)
    curve = allan(log, kind=kind, taus=taus, bridge=bridge, confidence=confidence)

    axes = []
    # Transforms do not hold the interpreter lock, so they run during the fits.
    with ThreadPoolExecutor(1) as executor:
        columns = [np.ascontiguousarray(z) for z in log.data.T]
        spectra = [executor.submit(Spectrum.of, z, log.rate) for z in columns]
        for i, z in enumerate(columns):
            report("models", i / log.channels)
            axis = _characterise_axis(log, curve.axis(i), z, markov, spectra[i])
            axes.append(axis if second_opinion else replace(axis, second=None))
    return Characterisation(log, curve, tuple(axes))


def models_json(sensors: Sequence[Characterisation], *, doubtful: bool = True) -> str:
    """Return models and notes of all axes of a log as JSON, null for an axis without a model.

    If a model is doubtful and `doubtful` is False, ValueError is raised, as in other exports.
    """
    models = [axis.model for sensor in sensors for axis in sensor.axes if axis.model is not None]
    if not doubtful:
        check_doubts(models)
    texts = {
        axis.name: None if axis.model is None else json.loads(axis.model.to_json())
        for sensor in sensors
        for axis in sensor.axes
    }
    notes = [str(note) for note in collect_notes(sensors)]
    return json.dumps({"axes": texts, "notes": notes}, indent=2) + "\n"


def collect_notes(sensors: Sequence[Characterisation]) -> tuple[str, ...]:
    """Return the sentences on a log and on its sensors, without repetition."""
    notes = [note for sensor in sensors for note in sensor.notes]
    notes += [note for sensor in sensors for note in notes_of(sensor.log, evenly_spaced=True)]
    return tuple(dict.fromkeys(notes))


def _check_samples(log: Log, kind: KindName) -> None:
    if log.n < _MIN_SAMPLES:
        raise LogError(f"{kind} needs at least {_MIN_SAMPLES} samples, the log has {log.n}")
    for name, column in zip(log.names, log.data.T, strict=True):
        if not np.isfinite(column).any():
            raise LogError(
                make_sentence(
                    f"column '{name}' holds no sample: choose others with ",
                    keyword_argument("columns"),
                )
            )


def _characterise_axis(
    log: Log, curve: AllanResult, z: Floats, markov: int, transform: Future[Spectrum]
) -> Axis:
    (name,) = curve.names
    if not np.any(curve.deviation > 0.0):
        return Axis(name, None, None)
    coarse = find_coarse(z, log.rate)
    if coarse is not None:
        note = f"{name}: {describe_coarse(coarse, log.rate, log.unit)}"
        return Axis(name, coarse_model(coarse, log.rate, log.unit), None, (note,))
    rounding = describe_rounding(z, log.rate)
    notes = (f"{name}: {rounding}",) if rounding else ()
    second, _ = _try_fit(lambda: fit_spectrum(transform.result(), log.rate, log.unit))
    filtered = None if second is None else find_low_pass(transform.result(), log.rate)
    if filtered is None or second is None or (markov and filtered.response is None):
        model, doubt = _try_fit(lambda: curve.fit(markov=markov))
        return Axis(name, model, second, (*notes, doubt) if doubt else notes)
    axis = _filtered_axis(name, curve, second, filtered, markov)
    return replace(axis, doubts=(*notes, *axis.doubts))


def _filtered_axis(
    name: str, curve: AllanResult, second: FittedModel, filtered: Filtered, markov: int
) -> Axis:
    """Return an axis with a spectrum that a plain model does not explain."""
    why = "".join(doubt.why for doubt in curve.doubts)
    if filtered.response is not None:
        model, doubt = _try_fit(lambda: curve.fit_behind(filtered, markov))
        why = why or _contradiction(name, model, second)
    elif filtered.holds:
        model, doubt = second, ""
    else:
        model, doubt = _try_fit(curve.fit)
        why = why or f"{name}: the spectrum contradicts every model of its noise"
    if model is not None and why:
        model = replace(model, doubt=why)
    return Axis(name, model, second, tuple(note for note in (doubt, why) if note))


def _contradiction(name: str, model: FittedModel | None, second: FittedModel) -> str:
    """Return a sentence if curve and spectrum give different white noise, otherwise ""."""
    if model is None:
        return ""
    first, other = (coefficient_of(m, "angle_random_walk") for m in (model, second))
    apart = abs(first - other)
    if apart <= max(3.0 * math.hypot(first.sigma, other.sigma), 0.05 * other):
        return ""
    return f"{name}: deviations and spectrum contradict each other on the white noise"


def _try_fit(
    fit: Callable[[], FittedModel | tuple[FittedModel, ...]],
) -> tuple[FittedModel | None, str]:
    """Return a model, or the reason why there is none."""
    try:
        model = fit()
    except ValueError as error:
        return None, str(error)
    assert isinstance(model, FittedModel)  # a single axis has a single model
    return model, ""
