"""Panels of a calibration figure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.calibration.fit.joint_fit import DATASHEET_SPREAD
from zerorate.calibration.parameters import ACCEL_BIAS, ACCEL_MATRIX, GYRO_MATRIX
from zerorate.show.scales import column_quantiles, robust_limits
from zerorate.show.stack import draw_band, shade, write_head, write_names
from zerorate.show.style import (
    AXIS_COLOURS,
    BLACK,
    BLUE,
    FONT_PT,
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

_MAX_POSE_GAP_RAD: Final = np.radians(40.0)
"""Angle to the nearest pose that counts as a gap, rad."""

_SPHERE_PIXELS: Final = 121
"""Side of a half sphere, pixels."""

_MIN_ERROR_RATIO: Final = 0.3
"""Error relative to the data sheet, above which a parameter is not identifiable."""

_RIM_LABELS: Final = {"+x": (1, 0), "−x": (-1, 0), "+y": (0, 1), "−y": (0, -1)}
_DIAGONAL: Final = (0, 4, 8)
_GROUPS: Final = ("scale", "axes", "bias", "scale", "axes")
_GROUP_COLOURS: Final = (BLUE, BLUE, BLUE, VERMILION, VERMILION)
_NAMES: Final = tuple(f"{i}{j}" for i in "xyz" for j in "xyz")


def draw_log(axes: Axes, calibration: Calibration, log: Log) -> None:
    """Draw the raw samples of a sensor, with the rests behind them."""
    _, seconds = time_unit(log.duration)
    for name, colour, values in zip("xyz", AXIS_COLOURS, log.data.T, strict=False):
        quantiles = column_quantiles(values)
        times = (log.time[0] + quantiles.middle / log.rate) / seconds
        draw_band(axes, times, quantiles, colour, name)
    for used, colour in ((True, SKY), (False, ROSE)):
        spans = [(rest.start, rest.stop) for rest in calibration.rests if rest.used is used]
        edges = np.array(spans).reshape(-1, 2).T / seconds
        shade(axes, edges[0], edges[1], colour, alpha=0.35 if used else 0.9)
    axes.set_ylim(*robust_limits(_extremes(_used_samples(calibration, log)), 0.08, 0.08))
    write_head(axes, f"raw [{log.unit}]")
    write_names(axes)


def _used_samples(calibration: Calibration, log: Log) -> Floats:
    """Return the samples of the rests and rotations that were used; all samples without rests."""
    shown = np.zeros(log.n, dtype=bool)
    spans = [
        (span_source.start, span_source.stop)
        for span_source in calibration.rests
        if span_source.used
    ]
    spans += [
        (span_source.start, span_source.stop)
        for span_source in calibration.turns
        if span_source.used
    ]
    for span in spans:
        first, last = np.searchsorted(log.time, span)
        shown[first:last] = True
    samples = log.data[shown]
    return samples if np.isfinite(samples).any() else log.data


def _extremes(data: Floats) -> Floats:
    """Return the smallest and the largest sample, shape (2,), or (0,) without samples."""
    finite = data[np.isfinite(data)]
    return np.array([finite.min(), finite.max()]) if finite.size else finite


def draw_poses(axes: Axes, calibration: Calibration) -> None:
    """Draw the poses on two half spheres (equal-area projection), and shade the gaps."""
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
    for axis, (right, top) in _RIM_LABELS.items():
        position = (centre + 1.12 * edge * right, 1.1 * edge * top)
        axes.text(*position, axis, ha="center", va="center", size=FONT_PT - 0.5, color=GREY_TEXT)
    axes.plot(centre, 0.0, marker="+", ms=4.0, mew=0.5, color=GREY_TEXT)
    name = f"poses with {'+' if sign > 0 else '−'}z up"
    axes.text(centre, 1.9, name, ha="center", va="bottom", size=FONT_PT)
    half = sign * up[:, 2] >= 0.0
    for rows, face in ((half & used, BLUE), (half & ~used, "none")):
        x, y = _project(up[rows], sign)
        axes.plot(centre + x, y, ls="none", marker="o", ms=3.0, mew=0.6, mec=BLUE, mfc=face)


def _shade_gaps(axes: Axes, up: Floats, sign: float, centre: float) -> None:
    side = np.sqrt(2.0) * (2.0 * np.arange(_SPHERE_PIXELS) + 1.0 - _SPHERE_PIXELS) / _SPHERE_PIXELS
    x, y = np.meshgrid(side, side)
    squared = x**2 + y**2
    inside = squared <= 2.0
    width = np.sqrt(np.clip(1.0 - squared / 4.0, 0.0, None))
    points = np.stack((x * width, y * width, sign * (1.0 - squared / 2.0)), axis=-1)
    nearest = (points @ up.T).max(axis=-1) if up.size else np.full(x.shape, -1.0)
    gap = np.where(inside & (nearest < np.cos(_MAX_POSE_GAP_RAD)), 1.0, np.nan)
    from matplotlib.colors import ListedColormap

    extent = (centre - np.sqrt(2.0), centre + np.sqrt(2.0), -np.sqrt(2.0), np.sqrt(2.0))
    axes.imshow(
        gap, extent=extent, origin="lower", cmap=ListedColormap([ROSE]), zorder=0, aspect="equal"
    )


def _project(up: Floats, sign: float) -> tuple[Floats, Floats]:
    """Return Lambert's projection of directions about the positive or negative z axis."""
    stretch = np.sqrt(2.0 / (1.0 + sign * up[:, 2]))
    return up[:, 0] * stretch, up[:, 1] * stretch


def draw_norm(axes: Axes, calibration: Calibration) -> None:
    """Draw the error of gravity's norm at each rest, before and after calibration."""
    write_head(axes, "error of gravity at rest [mg]")
    before = 1e3 * np.abs(_raw_norm_errors(calibration))
    after = 1e3 * np.abs([rest.norm_error for rest in calibration.rests])
    _draw_sizes(axes, before, after, [rest.used for rest in calibration.rests])
    axes.set_xlabel("rest")


def draw_turn_error(axes: Axes, calibration: Calibration) -> None:
    """Draw the error of gravity after each rotation, before and after calibration."""
    write_head(axes, "error after a rotation [deg]")
    before = np.degrees([turn.residual_raw for turn in calibration.turns])
    after = np.degrees([turn.residual for turn in calibration.turns])
    _draw_sizes(axes, before, after, [turn.used for turn in calibration.turns])
    axes.set_xlabel("turn")


def _draw_sizes(axes: Axes, before: Floats, after: Floats, used: Sequence[bool]) -> None:
    numbers, used_mask = 1 + np.arange(after.size), np.array(used, dtype=bool)
    sizes = np.concatenate((before, after))
    if not np.isfinite(sizes).any():
        axes.set_xticks([])
        axes.set_yticks([])
        write_in_middle(axes, "there is none")
        return
    for values, colour, label in ((before, ORANGE, "before"), (after, BLUE, "after")):
        for rows, face in ((used_mask, colour), (~used_mask, "none")):
            axes.plot(
                numbers[rows],
                values[rows],
                ls="none",
                marker="o",
                ms=2.4,
                mew=0.6,
                mec=colour,
                mfc=face,
                label=label if rows is used_mask and np.isfinite(values).any() else "_",
            )
    axes.set_xlim(0.0, after.size + 1.0)
    axes.set_yscale("log")
    positive = sizes[np.isfinite(sizes) & (sizes > 0.0)]
    if positive.size:
        low, high = np.log10(positive.min()), np.log10(positive.max())
        axes.set_ylim(10.0 ** (low - 0.2), 10.0 ** (high + 0.2))


def _raw_norm_errors(calibration: Calibration) -> Floats:
    """Return |raw|/g - 1 at each rest; an unknown unit is replaced by one scale for all axes."""
    norms = np.array([np.linalg.norm(rest.accel) for rest in calibration.rests])
    unit = calibration.accel_units[0]
    if unit in UNITS:
        return norms * convert(1.0, unit, "m/s^2") / calibration.gravity - 1.0
    scale = abs(np.linalg.det(calibration.values[ACCEL_MATRIX].reshape(3, 3))) ** (1.0 / 3.0)
    return np.asarray(norms / (scale * calibration.gravity) - 1.0)


def draw_deviations(axes: Axes, calibration: Calibration) -> None:
    """Draw the scale errors and misalignments of both sensors, with their errors."""
    write_head(axes, "scale (xx yy zz), misalignment [10⁻³]")
    indices = [*range(ACCEL_MATRIX.start, ACCEL_MATRIX.stop)]
    indices += range(GYRO_MATRIX.start, GYRO_MATRIX.stop)
    positions = np.array([*range(9), *range(10, 19)], dtype=np.float64)
    values, sigmas = (1e3 * matrix for matrix in _relative_matrices(calibration))
    known = calibration.identifiable[indices]
    # Leave out elements that the frame fixes at zero.
    free = ~known | (sigmas > 0.0) | (values != 0.0)
    for of_sensor, sensor, colour in (
        (positions < 9.0, "accelerometer", BLUE),
        (positions > 9.0, "gyro", VERMILION),
    ):
        drawn = of_sensor & known & free
        axes.errorbar(
            positions[drawn],
            values[drawn],
            2.0 * sigmas[drawn],
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
        missing = of_sensor & ~known
        axes.plot(
            positions[missing],
            values[missing],
            ls="none",
            marker="o",
            ms=2.6,
            mec=colour,
            mfc="none",
        )
    axes.axhline(0.0, color=BLACK, lw=0.4)
    axes.axvline(9.0, color=GREY, lw=0.6)
    shown = np.concatenate(
        (values - 2.0 * sigmas * known, values + 2.0 * sigmas * known, [-1.0, 1.0])
    )
    axes.set_ylim(*robust_limits(shown, 0.08, 0.08))
    axes.set_xlim(-1.0, 19.0)
    write_names(axes)


def _relative_matrices(calibration: Calibration) -> tuple[Floats, Floats]:
    """Return both matrices divided by their row scales, minus identity, and their errors."""
    values, sigmas = [], []
    for sensor in (calibration.accel, calibration.gyro):
        nominal = 1.0
        if sensor.raw_unit not in UNITS:
            nominal = float(np.mean(np.abs(sensor.scale)))
        for i, row in enumerate(sensor.misalignment):
            for j, element in enumerate(row):
                scale = sensor.scale[i]
                values.append(scale / nominal - 1.0 if i == j else element.value)
                sigmas.append(scale.sigma / nominal if i == j else element.sigma)
    return np.array(values), np.array(sigmas)


def draw_parameter_errors(axes: Axes, calibration: Calibration) -> None:
    """Draw the error of each parameter relative to data-sheet values."""
    write_head(axes, "standard error over a data sheet's")
    groups = [parts[parts > 0.0] for parts in _errors_over_datasheet(calibration)]
    for i, (parts, colour) in enumerate(zip(groups, _GROUP_COLOURS, strict=True)):
        positions = i + np.linspace(-0.25, 0.25, max(parts.size, 2))[: parts.size]
        axes.plot(positions, parts, ls="none", marker="o", ms=2.4, mew=0.0, color=colour)
    axes.axhline(_MIN_ERROR_RATIO, color=BLACK, lw=0.6, ls=(0, (4, 2)))
    axes.set_yscale("log")
    axes.set_ylim(0.5 * min([*np.concatenate(groups), 0.1]), 3.0)
    axes.set_xlim(-0.6, len(groups) - 0.4)


def _errors_over_datasheet(calibration: Calibration) -> Iterator[Floats]:
    """Yield the errors relative to data-sheet values, group by group."""
    scale, cross, offset = DATASHEET_SPREAD
    _, sigmas = _relative_matrices(calibration)
    scales = np.abs(calibration.accel.scale)
    bias = np.sqrt(np.diagonal(calibration.covariance)[ACCEL_BIAS]) / scales
    for sensor, sensor_sigmas in ((calibration.accel, sigmas[:9]), (calibration.gyro, sigmas[9:])):
        yield sensor_sigmas[list(_DIAGONAL)] / scale
        yield np.delete(sensor_sigmas, _DIAGONAL) / cross
        if sensor.unit == calibration.accel.unit:
            yield convert(bias, sensor.unit, "g") / offset


def name_elements(axes: Axes) -> None:
    """Write the names of the matrix elements below their points."""
    axes.set_xticks([*range(9), *range(10, 19)], [*_NAMES, *_NAMES])


def name_groups(axes: Axes) -> None:
    """Write the names of the parameter groups below their points."""
    axes.set_xticks(range(len(_GROUPS)), _GROUPS)
