"""Views of series over a record: a panel per quantity, and a table of their sizes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from zerorate.numerals import format_significant, shorten
from zerorate.record.names import split_unit
from zerorate.show.style import (
    AXIS_COLOURS,
    BLACK,
    add_panel,
    new_figure,
    style_panels,
    time_unit,
    write_legend,
    write_title,
)
from zerorate.show.tables import Table, as_text, bullet_list

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.array.accelerometers import FusedAccelerometers
    from zerorate.calibration.rate.angle import Integrated
    from zerorate.denoising import Denoised
    from zerorate.linear.run import LinearRun, SmoothedRun
    from zerorate.record import Log
    from zerorate.tasks.calibrate import Corrected
    from zerorate.tasks.trace import Trace
    from zerorate.types import Floats

# Sizes in mm.
_WIDTH, _PANEL, _LEFT, _BELOW, _ABOVE, _BETWEEN = 130.0, 28.0, 18.0, 10.0, 3.0, 5.0
_COLOURS: Final = (*AXIS_COLOURS, BLACK)
_MAX_POINTS: Final = 4000
"""Largest number of points of a curve; more are not visible."""
_BAND_QUANTILES: Final = ((-1.0, 0.05), (1.0, 0.95))
"""Signs of the edges of a band, and the quantile of each edge that the panel includes."""
_MAX_NAMES: Final = 6
"""Largest number of curves with a name in a panel."""


class _Panel(NamedTuple):
    """Curves of a quantity: values (n, k), names, and standard deviations (n, k) or None."""

    label: str
    values: Floats
    names: tuple[str, ...] = ()
    sigma: Floats | None = None


def plot_integrated(result: Integrated) -> Figure:
    """Return a figure of the angle over time, with two standard deviations."""
    angle = np.degrees(result.angle)[:, None]
    sigma = None if result.sigma is None else np.degrees(result.sigma).reshape(len(angle), -1)
    if sigma is not None and sigma.shape[1] == 1:
        panels = [_Panel("angle [deg]", angle, sigma=sigma)]
    else:
        panels = [_Panel("angle [deg]", angle)]
        panels += [] if sigma is None else [_Panel("σ of the angle [deg]", sigma, tuple("xyz"))]
    return _draw_figure("How far did it rotate?", panels, result.rate)


def format_integrated(result: Integrated) -> str:
    """Return the last angle with its standard deviation, and the number of missing samples."""
    rows = [
        ("angle at the end", f"{format_significant(float(np.degrees(result.angle[-1])), 5)} deg")
    ]
    if result.sigma is not None:
        last = np.atleast_1d(np.degrees(result.sigma[-1]))
        rows.append(
            ("standard deviation", f"{', '.join(map(format_significant, last.tolist()))} deg")
        )
    rows.append(("missing samples", str(int(result.bridged.sum()))))
    title = f"{len(result.angle)} samples at {result.rate:g} Hz, integrated by {result.method}"
    return _append_notes(as_text(Table(title, (), tuple(rows))), result.notes)


def plot_corrected(result: Corrected) -> Figure:
    """Return a figure of the corrected gyro and accelerometer, on the gyro's clock."""
    logs = [log for name, log in result.recording.items() if name.startswith(("gyro", "accel"))]
    same_clock = [log for log in logs if (log.n, log.rate) == (logs[0].n, logs[0].rate)]
    panels = [_Panel(f"{log.names[0]} .. [{log.unit}]", log.data, log.names) for log in same_clock]
    return _draw_figure("What do the corrected sensors show?", panels, logs[0].rate)


def plot_log(log: Log) -> Figure:
    """Return a figure of a log's samples, with a panel per unit and a curve per channel."""
    panels = []
    for unit in dict.fromkeys(log.units):
        channels = [i for i, of_channel in enumerate(log.units) if of_channel == unit]
        names = tuple(split_unit(log.names[i])[0] for i in channels)
        label = f"{names[0]} .. [{unit}]" if len(names) > 1 else f"{names[0]} [{unit}]"
        panels.append(_Panel(label, log.data[:, channels], names))
    return _draw_figure("What was recorded?", panels, log.rate)


def format_log(log: Log) -> str:
    """Return unit, mean, standard deviation, range and missing samples of each channel."""
    rows = []
    for name, unit, values in zip(log.names, log.units, log.data.T, strict=True):
        known = values[np.isfinite(values)]
        measures = (known.mean(), known.std(), known.min(), known.max()) if known.size else ()
        numbers = [format_significant(float(value)) for value in measures] or ["-"] * 4
        rows.append((name, unit, *numbers, str(log.n - known.size)))
    head = ("channel", "unit", "mean", "std", "min", "max", "missing")
    title = f"{log.n} samples at {shorten(log.rate, 4)} Hz, {shorten(log.duration, 4)} s"
    return as_text(Table(title, head, tuple(rows), words=2))


def plot_denoised(result: Denoised) -> Figure:
    """Return a figure of the denoised record, with a curve per column."""
    values = result.signal.reshape(len(result.signal), -1)
    panels = [_Panel("signal", values, _number_names("column", values.shape[1]))]
    return _draw_figure("What remains without noise?", panels, None)


def format_denoised(result: Denoised) -> str:
    """Return level, noise and threshold of each column."""
    parts = (result.level, result.sigma, result.threshold)
    columns = [np.atleast_1d(np.asarray(values, dtype=float)) for values in parts]
    rows = tuple(
        (str(i), f"{level:.0f}", format_significant(sigma, 4), format_significant(threshold, 4))
        for i, (level, sigma, threshold) in enumerate(zip(*columns, strict=True))
    )
    title = f"{len(result.signal)} samples denoised by {result.wavelet}, {result.mode} thresholds"
    return as_text(Table(title, ("column", "level", "sigma", "threshold"), rows))


def plot_linear(result: LinearRun) -> Figure:
    """Return a figure of each state, with two standard deviations if stored, and of the NIS."""
    sigma = _standard_deviations(result.covariance) if result.complete else None
    panels = _make_state_panels(result.state, sigma)
    if result.complete:
        nis = np.asarray(result.nis).reshape(len(result.state), -1)
        panels.append(_Panel("NIS", nis, _number_names("channel", nis.shape[1])))
    return _draw_figure("What does the filter estimate?", panels, None)


def plot_smoothed(result: SmoothedRun) -> Figure:
    """Return a figure of the smoother's states, with two standard deviations."""
    panels = _make_state_panels(result.state, _standard_deviations(result.covariance))
    return _draw_figure("What do later samples add?", panels, None)


def format_linear(result: LinearRun) -> str:
    """Return the last state with standard deviations, the mean NIS and the log likelihood."""
    sigma = _standard_deviations(result.covariance) if result.complete else None
    text = _format_last_state("Linear Kalman filter", result.state, sigma)
    if not result.complete:
        return text
    nis = result.nis[np.isfinite(result.nis)]
    mean = format_significant(float(nis.mean())) if nis.size else "-"
    summary = (
        f"mean NIS {mean}; log-likelihood "
        f"{format_significant(float(result.log_likelihood.sum()), 6)}"
    )
    return f"{text}\n\n  {summary}"


def format_smoothed(result: SmoothedRun) -> str:
    """Return the smoother's last state, with standard deviations."""
    sigma = _standard_deviations(result.covariance)
    return _format_last_state("Linear Kalman filter, smoothed", result.state, sigma)


def plot_trace(result: Trace) -> Figure:
    """Return a figure of the bias with two standard deviations, the innovation, and the noise R."""

    def columns(values: Floats) -> Floats:
        return values.reshape(len(result), math.prod(values.shape[1:]))

    bias = columns(result.bias)
    names = _number_names("channel", bias.shape[1])
    panels = [
        _Panel("bias", bias, names, columns(result.bias_sigma)),
        _Panel("innovation", columns(result.innovation), names),
        _Panel("R", columns(result.measurement_noise), names),
    ]
    return _draw_figure("What does the filter learn?", panels, None)


def format_trace(result: Trace) -> str:
    """Return the last bias of each channel with its sigma, and the numbers of samples."""
    title = f"Drift filter: {len(result)} samples"
    if not len(result):
        return title
    flags = (result.missing, result.guarded, result.saturated, result.stuck, result.at_rest)
    columns = (result.bias[-1], result.bias_sigma[-1], *(flag.sum(axis=0) for flag in flags))
    rows = tuple(
        (
            str(c),
            format_significant(float(bias), 5),
            format_significant(float(sigma)),
            *map(str, counts),
        )
        for c, (bias, sigma, *counts) in enumerate(zip(*map(np.atleast_1d, columns), strict=True))
    )
    head = ("channel", "bias", "sigma", "missing", "guarded", "saturated", "stuck", "at rest")
    return as_text(Table(title, head, rows))


def plot_fused(result: FusedAccelerometers) -> Figure:
    """Return a figure of the fused acceleration, and the share of each sensor."""
    panels = [
        _Panel(f"acceleration [{result.unit}]", result.accel, tuple("xyz")),
        _Panel("weights", result.weights, _number_names("sensor", result.weights.shape[1])),
    ]
    return _draw_figure("What do the fused accelerometers show?", panels, None)


def format_fused(result: FusedAccelerometers) -> str:
    """Return each sensor's share, exclusions and residual."""
    rows = tuple(
        (
            f"sensor {k}",
            f"{weight:.3f}",
            shorten(100.0 * out),
            format_significant(float(left)),
        )
        for k, (weight, out, left) in enumerate(
            zip(
                result.weights.mean(axis=0),
                result.excluded.mean(axis=0),
                result.residual,
                strict=True,
            )
        )
    )
    head = ("", "weight", "left out, %", f"difference, {result.unit}")
    return as_text(Table("Fused accelerometers", head, rows))


def _make_state_panels(state: Floats, sigma: Floats | None) -> list[_Panel]:
    """Return a panel per state, with a curve per channel."""
    values = state.reshape(len(state), -1, state.shape[-1])
    names = _number_names("channel", values.shape[1])
    spread = None if sigma is None else sigma.reshape(values.shape)
    return [
        _Panel(f"x[{i}]", values[:, :, i], names, None if spread is None else spread[:, :, i])
        for i in range(values.shape[2])
    ]


def _standard_deviations(covariance: Floats) -> Floats:
    deviations: Floats = np.sqrt(np.maximum(np.einsum("...ii->...i", covariance), 0.0))
    return deviations


def _format_last_state(title: str, state: Floats, sigma: Floats | None) -> str:
    last = np.atleast_2d(state[-1])
    spread = None if sigma is None else np.atleast_2d(sigma[-1])
    rows = tuple(
        (
            f"channel {c}" if len(last) > 1 else "",
            f"x[{i}]",
            format_significant(float(value), 5),
            "-" if spread is None else format_significant(float(spread[c, i])),
        )
        for c, row in enumerate(last)
        for i, value in enumerate(row)
    )
    head = ("", "state", "at the end", "sigma")
    return as_text(Table(f"{title}: {len(state)} samples", head, rows, words=2))


def _number_names(what: str, count: int) -> tuple[str, ...]:
    return tuple(f"{what} {i}" for i in range(count)) if count > 1 else ()


def _append_notes(text: str, notes: Sequence[str]) -> str:
    return f"{text}\n\n{bullet_list(notes)}" if notes else text


def _draw_figure(title: str, panels: Sequence[_Panel], rate: float | None) -> Figure:
    """Return a figure with the panels below each other, over seconds or samples."""
    height = _BELOW + _ABOVE + len(panels) * (_PANEL + _BETWEEN)
    figure = new_figure(_WIDTH, height)
    axes: list[Axes] = []
    for i, panel in enumerate(panels):
        bottom = _BELOW + (len(panels) - 1 - i) * (_PANEL + _BETWEEN)
        width, first_panel = _WIDTH - _LEFT - 4.0, axes[0] if axes else None
        axes.append(add_panel(figure, _LEFT, bottom, width, _PANEL, first_panel))
        label = _draw_panel(axes[-1], panel, rate)
    for above in axes[:-1]:
        above.tick_params(labelbottom=False)
    axes[-1].set_xlabel(label)
    style_panels(axes)
    write_title(figure, title)
    return figure


def _draw_panel(axes: Axes, panel: _Panel, rate: float | None) -> str:
    """Draw the curves of a panel, and return the label of its time axis."""
    n = len(panel.values)
    unit, length = ("sample", 1.0) if rate is None else time_unit(n / rate)
    step = max(1, n // _MAX_POINTS)
    times = np.arange(0, n, step) / ((rate or 1.0) * length)
    for i, values in enumerate(panel.values[::step].T):
        colour = _COLOURS[i % len(_COLOURS)]
        name = panel.names[i] if i < min(len(panel.names), _MAX_NAMES) else None
        axes.plot(times, values, lw=0.7, color=colour, label=name)
        if panel.sigma is not None:
            spread = 2.0 * panel.sigma[::step, i]
            axes.fill_between(
                times, values - spread, values + spread, color=colour, alpha=0.2, lw=0
            )
    axes.set_ylabel(panel.label)
    if panel.sigma is not None and n:
        # Otherwise the large values at the start would hide all later values.
        spread = 2.0 * panel.sigma
        low, high = (
            np.nanquantile(panel.values + sign * spread, part) for sign, part in _BAND_QUANTILES
        )
        axes.set_ylim(low - 0.1 * (high - low), high + 0.1 * (high - low))
    if panel.names:
        write_legend(axes, "upper right", len(panel.names[:_MAX_NAMES]))
    return unit if rate is None else f"time [{unit}]"
