"""Replay of an array as plain text: results of each sensor, and gain of the array."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from zerorate.array.accelerometers import FusedAccelerometers
from zerorate.array.rotations import Rotations
from zerorate.numerals import format_or_dash, format_significant, shorten
from zerorate.show.tables import Table, as_text, bullet_list, wrap_prose
from zerorate.tasks.array import SAMPLE_FATES, ArrayReplay
from zerorate.types import Floats

_GAIN_LABELS: Final = ("mean over array", "sensor over array")


def format_array(replay: ArrayReplay) -> str:
    """Return a table with the gains, and a row for each sensor, the plain mean and the array."""
    kinds = [i for i in range(len(SAMPLE_FATES)) if i == 0 or replay.shares[:, i].any()]
    head = ("", *(SAMPLE_FATES[i] for i in kinds), "weight")
    rows = [*_sensor_rows(replay, kinds)]
    if replay.allan is None:
        note = "In % of the samples. The body never rested, so bias and noise are unknown."
        return as_text(Table(array_title(replay), head, tuple(rows), note=note))
    at, axes = replay.allan.second, replay.log.axes
    totals = [
        ("plain mean", replay.allan.mean[:, at]),
        ("array", replay.allan.fused[:, at]),
        *(
            (name, gains[: len(axes), at])
            for name, gains in zip(_GAIN_LABELS, replay.allan.gains(), strict=True)
        ),
    ]
    empty = ("",) * (len(head) - 1)
    deviations = replay.allan.sensors[:, :, at]
    table_rows = [
        (*row, *_format_numbers(deviation)) for row, deviation in zip(rows, deviations, strict=True)
    ]
    if replay.log.sensors > 1:
        table_rows += [(name, *empty, *_format_numbers(values)) for name, values in totals]
    # Keep the deviations in narrow tables: they are the requested result.
    spare = tuple(range(1, len(head)))
    columns = (*head, *_axis_heads(axes))
    table = Table(
        array_title(replay), columns, tuple(table_rows), note=_make_note(replay), spare=spare
    )
    return "\n".join(filter(None, (wrap_prose(_describe_gain(replay)), as_text(table))))


def _format_numbers(values: Floats) -> tuple[str, ...]:
    return tuple(map(format_or_dash, values.tolist()))


def _axis_heads(axes: Sequence[str]) -> tuple[str, ...]:
    return tuple(axes) if len(axes) > 1 else ("Allan",)


def array_title(replay: ArrayReplay) -> str:
    """Return the numbers of sensors and samples, and the rate."""
    log = replay.log
    gyros, samples = _count_noun(log.sensors, "gyro"), _count_noun(log.n, "sample")
    return f"{gyros}, {samples} at {shorten(log.rate, 4)} Hz"


def _count_noun(count: int, thing: str) -> str:
    return f"{count:,} {thing}" if count == 1 else f"{count:,} {thing}s"


def _sensor_rows(replay: ArrayReplay, kinds: Sequence[int]) -> Iterator[tuple[str, ...]]:
    """Yield the label of each sensor, the use of its samples, and its weight at rest."""
    weights = replay.mean_weights.tolist()
    for label, shares, weight in zip(replay.log.labels, replay.shares, weights, strict=True):
        yield label, *map(_format_percent, shares[kinds].tolist()), f"{weight:.3f}"


def _format_percent(share: float) -> str:
    """Return a share in percent; a small share is not rounded to zero."""
    if share == 0.0:
        return "0"
    return f"{100.0 * share:.1f}" if share >= 5e-4 else "<0.1"


def _make_note(replay: ArrayReplay) -> str:
    """Return a note on the columns."""
    assert replay.allan is not None
    seconds = format_significant(float(replay.allan.taus[replay.allan.second]))
    columns = ", ".join(_axis_heads(replay.log.axes))
    return (
        f"{SAMPLE_FATES[0]} and so on: % of the samples. weight: mean weight at rest. {columns}: "
        "Allan deviation "
        f"at rest and {seconds} s, {replay.log.unit}."
    )


def _describe_gain(replay: ArrayReplay) -> str:
    """Return the array's gain over one sensor and over the plain mean; empty for one sensor."""
    assert replay.allan is not None
    sensors = replay.log.sensors
    mean_gain, sensor_gain = (float(gain[-1, replay.allan.second]) for gain in replay.allan.gains())
    if sensors == 1 or not np.isfinite(sensor_gain):
        return ""
    return (
        f"At rest one sensor has {sensor_gain:.2f} times the deviation of the array on all "
        "axes, the "
        f"plain mean {mean_gain:.2f} times; sqrt({sensors}) is {np.sqrt(sensors):.2f}."
    )


def format_accelerometers(replay: ArrayReplay) -> str:
    """Return a table with the gains, and a row for each sensor, their mean and the fusion."""
    fused = replay.accel
    assert fused is not None
    used = fused.weights > 0.0
    shares = (used, ~used & ~fused.excluded, fused.excluded)
    residuals = [format_or_dash(value) for value in fused.residual.tolist()]
    rows = [
        (
            label,
            *(_format_percent(float(kind[:, k].mean())) for kind in shares),
            _format_weight(fused, k),
            residuals[k],
        )
        for k, label in enumerate(replay.log.labels)
    ]
    head: tuple[str, ...] = ("", "used", "missing", "excluded", "weight", f"left, {fused.unit}")
    reference_point = (
        "at the origin of the positions"
        if fused.angular_acceleration is not None
        else ("lever arms not known")
    )
    title = f"Fused accelerometers, {reference_point}"
    allan = replay.accel_allan
    if allan is None:
        return as_text(Table(title, head, tuple(rows), note="In % of the samples."))
    at, empty = allan.second, ("",) * (len(head) - 1)
    table_rows = [
        (*row, *_format_numbers(one))
        for row, one in zip(rows, allan.sensors[:, :, at], strict=True)
    ]
    table_rows += [
        (name, *empty, *_format_numbers(values))
        for name, values in (
            ("plain mean", allan.mean[:, at]),
            ("array", allan.fused[:, at]),
            *((name, g[:3, at]) for name, g in zip(_GAIN_LABELS, allan.gains(), strict=True)),
        )
    ]  # fmt: skip
    note = (
        "used and so on: % of the samples. left: RMS difference of the sensor from the array, "
        "after correction of known lever arms. x, y, z: Allan deviation at rest and "
        f"{format_significant(float(allan.taus[at]))} s, {fused.unit}."
    )
    spare = tuple(range(1, len(head)))
    return as_text(Table(title, (*head, *"xyz"), tuple(table_rows), note=note, spare=spare))


def _format_weight(fused: FusedAccelerometers, sensor: int) -> str:
    """Return the mean weight of a sensor."""
    return f"{float(fused.weights[:, sensor].mean()):.3f}"


def format_rotations(rotations: Rotations) -> str:
    """Return a table of the sensors' rotations relative to the first sensor."""
    rows = [
        (
            label,
            f"{angle:.2f}",
            format_or_dash(error),
            _format_percent(residual),
            _describe_axes(matrix),
        )
        for label, angle, error, residual, matrix in zip(
            rotations.labels,
            rotations.angles,
            rotations.sigma_deg,
            rotations.residuals,
            rotations.matrices,
            strict=True,
        )
    ]
    head = ("", "angle, deg", "error", "residual, %", "nearest axes of the first")
    title = (
        f"Rotations against {rotations.labels[0]}, from {shorten(rotations.seconds, 3)} s of motion"
    )
    return as_text(Table(title, head, tuple(rows)))


def _describe_axes(matrix: Floats) -> str:
    """Return a sensor's axes along the first sensor's axes, such as ``-y, -x, -z``."""
    nearest = np.argmax(np.abs(matrix), axis=1)
    signs = np.where(matrix[np.arange(3), nearest] < 0.0, "-", "")
    return ", ".join(f"{sign}{'xyz'[i]}" for sign, i in zip(signs, nearest, strict=True))


def format_array_replay(replay: ArrayReplay) -> str:
    """Return the results of each sensor, accelerometers and rotations if any, and notes."""
    accel = None if replay.accel is None else format_accelerometers(replay)
    rotations = None if replay.rotation_set is None else format_rotations(replay.rotation_set)
    return "\n\n".join(
        filter(None, (format_array(replay), accel, rotations, bullet_list(replay.notes)))
    )
