"""Tables of deviation curves, and figures of models and covariances as curves."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.noise.model import NoiseModel
from zerorate.noise.quantities import TERMS, choose_display_unit, si_unit
from zerorate.numerals import format_significant, shorten
from zerorate.show.arma_table import arma_name
from zerorate.show.style import (
    AXIS_COLOURS,
    BLACK,
    BLUE,
    add_panel,
    new_figure,
    style_panels,
    write_legend,
    write_title,
)
from zerorate.show.tables import Table, as_text, bullet_list

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.array.covariance import AllanCovariance
    from zerorate.identification.arma_model import ArmaModel
    from zerorate.noise.dynamic import DynamicAllan
    from zerorate.noise.result import AllanResult

_CURVE_STYLES: Final = [(colour, way) for way in ("-", "--", ":") for colour in AXIS_COLOURS]
"""Styles of successive curves: three colours that all readers distinguish, then dashes."""
# Sizes in mm.
_WIDTH, _HEIGHT, _LEFT, _BELOW, _ABOVE = 100.0, 70.0, 16.0, 10.0, 8.0
_UNITS: Final = {"angular rate": "rad/s", "acceleration": "m/s²", "unknown": "unit"}


def format_allan_result(result: AllanResult) -> str:
    """Return the deviations with bounds at each averaging time, in a data-sheet unit."""
    shown = choose_display_unit(result)
    head = ("tau, s", *(name or "deviation" for name in result.names))
    rows = tuple(
        (f"{shorten(tau, 4)}", *(_format_bounded(axis, i, shown.factor) for axis in result.axes))
        for i, tau in enumerate(result.taus)
    )
    title = f"{result.kind}, {shown.unit}: deviation (bounds at {100.0 * result.confidence:g} %)"
    return _append_notes(as_text(Table(title, head, rows, words=0)), result.notes)


def _format_bounded(axis: AllanResult, i: int, factor: float) -> str:
    middle, low, high = (
        float(values[i]) * factor for values in (axis.deviation, axis.lower, axis.upper)
    )
    if not np.isfinite(middle):
        return "-"
    bounds = (format_significant(bound) if np.isfinite(bound) else "∞" for bound in (low, high))
    return f"{format_significant(middle)} ({' to '.join(bounds)})"


def format_dynamic(result: DynamicAllan) -> str:
    """Return the smallest, median and largest deviation of all windows, per averaging time."""
    shown = choose_display_unit(result)
    rows = tuple(
        (f"{shorten(tau, 4)}", *_format_spread(shown.factor * values))
        for tau, values in zip(result.taus, result.deviation.T, strict=True)
    )
    title = f"{result.kind}, {shown.unit}, in {len(result.times)} windows of {result.window:g} s"
    return as_text(Table(title, ("tau, s", "least", "median", "largest"), rows, words=0))


def _format_spread(values: np.ndarray) -> tuple[str, str, str]:
    finite = values[np.isfinite(values)]
    if not finite.size:
        return "-", "-", "-"
    smallest, middle, largest = float(finite.min()), float(np.median(finite)), float(finite.max())
    return format_significant(smallest), format_significant(middle), format_significant(largest)


def plot_noise_model(model: NoiseModel) -> Figure:
    """Return a figure of a model's Allan deviation, and the deviation of each term."""
    figure, axes = _make_panel("Which Allan deviation does the model predict?")
    taus = np.logspace(-3.0, 5.0, 161)
    axes.loglog(taus, model.allan_deviation(taus), color=BLACK, lw=1.2, label="all terms")
    for (name, part), (colour, way) in zip(_split_terms(model), _CURVE_STYLES * 2, strict=False):
        axes.loglog(taus, part.allan_deviation(taus), color=colour, lw=0.8, ls=way, label=name)
    axes.set_xlabel("averaging time [s]")
    axes.set_ylabel(f"deviation [{_UNITS[model.quantity]}]")
    style_panels([axes])
    write_legend(axes, "upper right", 2, 2.0)
    return figure


def _split_terms(model: NoiseModel) -> Iterator[tuple[str, NoiseModel]]:
    """Yield a model for each term that is not zero."""
    for term in TERMS[model.quantity]:
        value = getattr(model, term.field)
        if value.known and value.identifiable and float(value) != 0.0:
            yield term.name, NoiseModel(**{term.field: value}, quantity=model.quantity)
    for markov in model.markov:
        yield "Markov noise", NoiseModel(markov=(markov,), quantity=model.quantity)
    for wave in model.sinusoid:
        yield "sinusoid", NoiseModel(sinusoid=(wave,), quantity=model.quantity)


def plot_arma_model(model: ArmaModel) -> Figure:
    """Return a figure of a model's spectral density over frequency, relative to the rate."""
    figure, axes = _make_panel(f"Which spectrum does {arma_name(model)} expect?")
    frequencies = np.logspace(-5.0, np.log10(0.5), 400)
    axes.loglog(frequencies, model.spectrum(frequencies, 1.0), color=BLUE, lw=1.0)
    axes.set_xlabel("frequency over sampling rate")
    axes.set_ylabel("density [unit² of the record times samples]")
    style_panels([axes])
    return figure


def plot_allan_covariance(result: AllanCovariance) -> Figure:
    """Return a figure of each gyro's Allan deviation, and of the mean correlation of all pairs."""
    full_height = 1.5 * _HEIGHT
    figure = new_figure(_WIDTH, full_height)
    left, width = 0.16 * _WIDTH, 0.8 * _WIDTH
    above = add_panel(figure, left, 0.42 * full_height, width, 0.5 * full_height)
    below = add_panel(figure, left, 0.09 * full_height, width, 0.26 * full_height, above)
    deviations = np.sqrt(np.einsum("tii->ti", result.matrix))
    for k, (name, curve) in enumerate(zip(result.names, deviations.T, strict=True)):
        colour, way = _CURVE_STYLES[k % len(_CURVE_STYLES)]
        above.loglog(result.tau, curve, lw=0.8, color=colour, ls=way, label=name)
    pairs = result.correlation[:, *np.triu_indices(len(result.names), 1)]
    below.semilogx(result.tau, pairs.mean(axis=1), color=BLUE, lw=1.0)
    below.fill_between(result.tau, pairs.min(axis=1), pairs.max(axis=1), color=BLUE, alpha=0.15)
    below.axhline(0.0, color=BLACK, lw=0.5)
    above.set_ylabel(f"Allan deviation [{result.unit}]")
    below.set_ylabel("correlation of pairs")
    below.set_xlabel("averaging time [s]")
    above.tick_params(labelbottom=False)
    style_panels([above, below])
    write_legend(above, "upper right", 4)
    write_title(figure, "Do the gyros share their noise?")
    return figure


def format_allan_covariance(result: AllanCovariance) -> str:
    """Return each gyro's Allan deviation and the mean correlation, per averaging time."""
    deviations = np.sqrt(np.einsum("tii->ti", result.matrix))
    pairs = result.correlation[:, *np.triu_indices(len(result.names), 1)]
    rows = tuple(
        (
            f"{shorten(tau, 4)}",
            *(format_significant(float(one)) for one in row),
            _format_mean(of_pairs),
        )
        for tau, row, of_pairs in zip(result.tau, deviations, pairs, strict=True)
    )
    unit = si_unit(result.unit)[1] if result.unit == "unit" else result.unit
    title = f"Allan deviation of several gyros, {unit}"
    head = ("tau, s", *result.names, "correlation")
    return _append_notes(as_text(Table(title, head, rows, words=0)), result.notes)


def _format_mean(pairs: np.ndarray) -> str:
    return f"{pairs.mean():+.2f}" if pairs.size and np.isfinite(pairs).all() else "-"


def _make_panel(title: str) -> tuple[Figure, Axes]:
    figure = new_figure(_WIDTH, _HEIGHT)
    axes = add_panel(figure, _LEFT, _BELOW, _WIDTH - _LEFT - 4.0, _HEIGHT - _BELOW - _ABOVE)
    write_title(figure, title)
    return figure, axes


def _append_notes(text: str, notes: tuple[str, ...]) -> str:
    return f"{text}\n\n{bullet_list(notes)}" if notes else text
