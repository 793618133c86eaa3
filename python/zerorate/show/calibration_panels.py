"""The panels of a calibration."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.calibration.fit.joint_fit import DATASHEET
from zerorate.calibration.parameters import ACCEL_BIAS, ACCEL_MATRIX, GYRO_MATRIX
from zerorate.show.scales import band, limits
from zerorate.show.stack import draw_scatter, head, names, shade
from zerorate.show.style import (
    AXIS_COLOURS,
    BLACK,
    BLUE,
    FONT,
    GREY,
    GREY_TEXT,
    ORANGE,
    ROSE,
    SKY,
    VERMILION,
    time_unit,
    write_in_middle,
)
from zerorate.types import Booleans, Floats
from zerorate.units import UNITS, convert

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from zerorate.calibration.calibration import Calibration
    from zerorate.record import Log

_GAP: Final = np.radians(40.0)
"""Angle from the nearest pose beyond which there is a gap."""

_PIXELS: Final = 121
"""Of the side of a half sphere."""

_LEAST: Final = 0.3
"""Part of the error that a data sheet states above which a parameter is not identifiable."""

_RIM: Final = {"+x": (1, 0), "−x": (-1, 0), "+y": (0, 1), "−y": (0, -1)}
_DIAGONAL: Final = (0, 4, 8)
_GROUPS: Final = ("scale", "axes", "bias", "scale", "axes")
_GROUP_COLOURS: Final = (BLUE, BLUE, BLUE, VERMILION, VERMILION)
_NAMES: Final = tuple(f"{i}{j}" for i in "xyz" for j in "xyz")


def draw_log(axes: Axes, calibration: Calibration, log: Log) -> None:
    """Draw the raw samples of a sensor, and behind them the rests that were found."""
    _, seconds = time_unit(log.duration)
    for name, colour, values in zip("xyz", AXIS_COLOURS, log.data.T, strict=False):
        drawn = band(values)
        times = (log.time[0] + drawn.middle / log.rate) / seconds
        draw_scatter(axes, times, drawn, colour, name)
    for used, colour in ((True, SKY), (False, ROSE)):
        spans = [(one.start, one.stop) for one in calibration.rests if one.used is used]
        edges = np.array(spans).reshape(-1, 2).T / seconds
        shade(axes, edges[0], edges[1], colour, alpha=0.35 if used else 0.9)
    axes.set_ylim(*limits(_extremes(_of_interest(calibration, log)), 0.08, 0.08))
    head(axes, f"raw [{log.unit}]")
    names(axes)


def _of_interest(calibration: Calibration, log: Log) -> Floats:
    """Return the samples of rests and turns that were used, all if there are none."""
    shown = np.zeros(log.n, dtype=bool)
    spans = [(one.start, one.stop) for one in calibration.rests if one.used]
    spans += [(one.start, one.stop) for one in calibration.turns if one.used]
    for span in spans:
        first, last = np.searchsorted(log.time, span)
        shown[first:last] = True
    chosen = log.data[shown]
    return chosen if np.isfinite(chosen).any() else log.data


def _extremes(data: Floats) -> Floats:
    """Return the least and the greatest sample, shape (2,), or (0,) if there is none."""
    there = data[np.isfinite(data)]
    return np.array([there.min(), there.max()]) if there.size else there


def draw_poses(axes: Axes, calibration: Calibration) -> None:
    """Draw poses on two half spheres of equal area, and shade where there is none."""
    axes.set_aspect("equal")
    axes.set_axis_off()
    used = np.array([rest.used for rest in calibration.rests], dtype=bool)
    up = np.array([rest.direction for rest in calibration.rests]).reshape(-1, 3)
    for sign, centre in ((1.0, -1.8), (-1.0, 1.8)):
        _draw_half(axes, up, used, sign, centre)
    axes.set_xlim(-3.5, 3.5)
    axes.set_ylim(-1.75, 2.15)


def _draw_half(axes: Axes, up: Floats, used: Booleans, sign: float, centre: float) -> None:
    from matplotlib.patches import Circle

    edge = np.sqrt(2.0)
    _shade_gaps(axes, up[used], sign, centre)
    axes.add_patch(Circle((centre, 0.0), edge, fill=False, lw=0.5, ec=BLACK))
    for axis, (right, top) in _RIM.items():
        at = (centre + 1.12 * edge * right, 1.1 * edge * top)
        axes.text(*at, axis, ha="center", va="center", size=FONT - 0.5, color=GREY_TEXT)
    axes.plot(centre, 0.0, marker="+", ms=4.0, mew=0.5, color=GREY_TEXT)
    name = f"poses with {'+' if sign > 0 else '−'}z up"
    axes.text(centre, 1.9, name, ha="center", va="bottom", size=FONT)
    half = sign * up[:, 2] >= 0.0
    for chosen, face in ((half & used, BLUE), (half & ~used, "none")):
        x, y = _projected(up[chosen], sign)
        axes.plot(centre + x, y, ls="none", marker="o", ms=3.0, mew=0.6, mec=BLUE, mfc=face)


def _shade_gaps(axes: Axes, up: Floats, sign: float, centre: float) -> None:
    side = np.sqrt(2.0) * (2.0 * np.arange(_PIXELS) + 1.0 - _PIXELS) / _PIXELS
    x, y = np.meshgrid(side, side)
    squared = x**2 + y**2
    inside = squared <= 2.0
    width = np.sqrt(np.clip(1.0 - squared / 4.0, 0.0, None))
    points = np.stack((x * width, y * width, sign * (1.0 - squared / 2.0)), axis=-1)
    nearest = (points @ up.T).max(axis=-1) if up.size else np.full(x.shape, -1.0)
    gap = np.where(inside & (nearest < np.cos(_GAP)), 1.0, np.nan)
    from matplotlib.colors import ListedColormap

    place = (centre - np.sqrt(2.0), centre + np.sqrt(2.0), -np.sqrt(2.0), np.sqrt(2.0))
    axes.imshow(
        gap, extent=place, origin="lower", cmap=ListedColormap([ROSE]), zorder=0, aspect="equal"
    )


def _projected(up: Floats, sign: float) -> tuple[Floats, Floats]:
    """Return Lambert's projection of directions about the end of z."""
    stretch = np.sqrt(2.0 / (1.0 + sign * up[:, 2]))
    return up[:, 0] * stretch, up[:, 1] * stretch


def draw_norm(axes: Axes, calibration: Calibration) -> None:
    """Draw the error of the norm of gravity at every rest, before and after."""
    head(axes, "gravity at rest off [mg]")
    before = 1e3 * np.abs(_raw_norms(calibration))
    after = 1e3 * np.abs([rest.norm_error for rest in calibration.rests])
    _draw_sizes(axes, before, after, [rest.used for rest in calibration.rests])
    axes.set_xlabel("rest")


def draw_carry(axes: Axes, calibration: Calibration) -> None:
    """Draw the error of gravity carried through every turn, before and after."""
    head(axes, "after a turn off [deg]")
    before = np.degrees([turn.residual_raw for turn in calibration.turns])
    after = np.degrees([turn.residual for turn in calibration.turns])
    _draw_sizes(axes, before, after, [turn.used for turn in calibration.turns])
    axes.set_xlabel("turn")


def _draw_sizes(axes: Axes, before: Floats, after: Floats, used: Sequence[bool]) -> None:
    numbers, taken = 1 + np.arange(after.size), np.array(used, dtype=bool)
    seen = np.concatenate((before, after))
    if not np.isfinite(seen).any():
        axes.set_xticks([])
        axes.set_yticks([])
        write_in_middle(axes, "there is none")
        return
    for values, colour, label in ((before, ORANGE, "before"), (after, BLUE, "after")):
        for chosen, face in ((taken, colour), (~taken, "none")):
            axes.plot(
                numbers[chosen],
                values[chosen],
                ls="none",
                marker="o",
                ms=2.4,
                mew=0.6,
                mec=colour,
                mfc=face,
                label=label if chosen is taken and np.isfinite(values).any() else "_",
            )
    axes.set_xlim(0.0, after.size + 1.0)
    axes.set_yscale("log")
    positive = seen[np.isfinite(seen) & (seen > 0.0)]
    if positive.size:
        low, high = np.log10(positive.min()), np.log10(positive.max())
        axes.set_ylim(10.0 ** (low - 0.2), 10.0 ** (high + 0.2))


def _raw_norms(calibration: Calibration) -> Floats:
    """Return |raw|/g - 1 of every rest; of an unknown unit, with one scale for all axes."""
    norms = np.array([np.linalg.norm(rest.accel) for rest in calibration.rests])
    unit = calibration.accel_units[0]
    if unit in UNITS:
        return norms * convert(1.0, unit, "m/s^2") / calibration.gravity - 1.0
    scale = abs(np.linalg.det(calibration.values[ACCEL_MATRIX].reshape(3, 3))) ** (1.0 / 3.0)
    return np.asarray(norms / (scale * calibration.gravity) - 1.0)


def draw_deviations(axes: Axes, calibration: Calibration) -> None:
    """Draw scale error and misalignment of both sensors with their errors."""
    head(axes, "scale (xx yy zz), misalignment [10⁻³]")
    places = [*range(ACCEL_MATRIX.start, ACCEL_MATRIX.stop)]
    places += range(GYRO_MATRIX.start, GYRO_MATRIX.stop)
    at = np.array([*range(9), *range(10, 19)], dtype=np.float64)
    values, sigmas = (1e3 * one for one in _relative(calibration))
    known = calibration.identifiable[places]
    # What the frame fixes at zero says nothing.
    free = ~known | (sigmas > 0.0) | (values != 0.0)
    for chosen, sensor, colour in (
        (at < 9.0, "accelerometer", BLUE),
        (at > 9.0, "gyro", VERMILION),
    ):
        there = chosen & known & free
        axes.errorbar(
            at[there],
            values[there],
            2.0 * sigmas[there],
            ls="none",
            marker="o",
            ms=2.6,
            mew=0.0,
            elinewidth=0.8,
            capsize=1.6,
            capthick=0.6,
            color=colour,
            label=sensor,
        )
        missing = chosen & ~known
        axes.plot(
            at[missing], values[missing], ls="none", marker="o", ms=2.6, mec=colour, mfc="none"
        )
    axes.axhline(0.0, color=BLACK, lw=0.4)
    axes.axvline(9.0, color=GREY, lw=0.6)
    shown = np.concatenate(
        (values - 2.0 * sigmas * known, values + 2.0 * sigmas * known, [-1.0, 1.0])
    )
    axes.set_ylim(*limits(shown, 0.08, 0.08))
    axes.set_xlim(-1.0, 19.0)
    names(axes)


def _relative(calibration: Calibration) -> tuple[Floats, Floats]:
    """Return both matrices over the scale of their rows, less identity, and their errors."""
    values, sigmas = [], []
    for sensor in (calibration.accel, calibration.gyro):
        nominal = 1.0
        if sensor.raw_unit not in UNITS:
            nominal = float(np.mean(np.abs(sensor.scale)))
        for i, row in enumerate(sensor.misalignment):
            for j, one in enumerate(row):
                scale = sensor.scale[i]
                values.append(scale / nominal - 1.0 if i == j else one.value)
                sigmas.append(scale.sigma / nominal if i == j else one.sigma)
    return np.array(values), np.array(sigmas)


def draw_known(axes: Axes, calibration: Calibration) -> None:
    """Draw the error of each parameter over what a data sheet states."""
    head(axes, "how well known: error over a data sheet's")
    groups = [parts[parts > 0.0] for parts in _over_prior(calibration)]
    for i, (parts, colour) in enumerate(zip(groups, _GROUP_COLOURS, strict=True)):
        at = i + np.linspace(-0.25, 0.25, max(parts.size, 2))[: parts.size]
        axes.plot(at, parts, ls="none", marker="o", ms=2.4, mew=0.0, color=colour)
    axes.axhline(_LEAST, color=BLACK, lw=0.6, ls=(0, (4, 2)))
    axes.set_yscale("log")
    axes.set_ylim(0.5 * min([*np.concatenate(groups), 0.1]), 3.0)
    axes.set_xlim(-0.6, len(groups) - 0.4)


def _over_prior(calibration: Calibration) -> Iterator[Floats]:
    """Yield the errors over those that data sheets state, group by group."""
    scale, cross, offset = DATASHEET
    _, sigmas = _relative(calibration)
    scales = np.abs(calibration.accel.scale)
    bias = np.sqrt(np.diagonal(calibration.covariance)[ACCEL_BIAS]) / scales
    for sensor, own in ((calibration.accel, sigmas[:9]), (calibration.gyro, sigmas[9:])):
        yield own[list(_DIAGONAL)] / scale
        yield np.delete(own, _DIAGONAL) / cross
        if sensor.unit == calibration.accel.unit:
            yield convert(bias, sensor.unit, "g") / offset


def name_elements(axes: Axes) -> None:
    """Write the elements of both matrices under their points."""
    axes.set_xticks([*range(9), *range(10, 19)], [*_NAMES, *_NAMES])


def name_groups(axes: Axes) -> None:
    """Write which parameters the points are of."""
    axes.set_xticks(range(len(_GROUPS)), _GROUPS)
