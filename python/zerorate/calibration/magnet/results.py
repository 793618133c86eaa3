"""Result of a magnetometer's fit: parameters, their errors, and advice."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Final

import numpy as np

from zerorate.calibration.magnet.choice import IronChoice
from zerorate.calibration.magnet.fit import BASIS, KNOWN_SIGMA, count_known_directions
from zerorate.calibration.magnet.spans import Span, list_iron_changes
from zerorate.calibration.magnet.sphere import Sphere
from zerorate.calibration.magnet.ticks import Ticks
from zerorate.calibration.magnetometer import IronGroup, MagnetometerCalibration, MagnetometerModel
from zerorate.calibration.parameters import Matrix, Vector
from zerorate.noise.coefficient import Coefficient
from zerorate.types import Floats

_SOFT_IRON_SIGMA: Final = 0.06
_ONE_SIDED_95_Z: Final = 1.645


def sphere_result(
    sphere_fit: Sphere | None,
    begin: float,
    end: float,
    unit: str,
    problems: tuple[str, ...],
    note: str,
    source: str,
) -> MagnetometerCalibration:
    """Return the calibration from a sphere through the field, with hard iron only."""
    unknown = Coefficient(0.0, identifiable=False, upper_bound=np.inf)
    norm = 1.0 if sphere_fit is None else sphere_fit.norm
    matrix, irons, field, advice = np.eye(11), (unknown,) * 3, unknown, []
    iron, raw, corrected, applied = (0.0, 0.0, 0.0), 0.0, 0.0, False
    if sphere_fit is not None:
        matrix = np.diag([_SOFT_IRON_SIGMA**2] * 8 + [1.0] * 3)
        matrix[8:, 8:] = sphere_fit.covariance
        irons = _hard_iron_vector(sphere_fit.iron, sphere_fit.covariance, norm)
        raw, corrected, applied = sphere_fit.raw * norm, sphere_fit.left * norm, sphere_fit.applied
        if applied:
            iron = tuple((sphere_fit.iron * norm).tolist())
        sigma = float(np.sqrt(np.trace(sphere_fit.covariance) / 3.0))
        field = _make_coefficient(
            sphere_fit.radius * norm, sigma * norm, sphere_fit.covered and sigma < KNOWN_SIGMA
        )
        if not sphere_fit.covered:
            advice = ["turn each side of the sensor down once"]
        elif count_known_directions(sphere_fit.covariance) < 3:
            advice = ["record for 40 s or longer"]
    return MagnetometerCalibration(
        irons,
        _soft_iron_matrix(np.zeros(8), np.full(8, np.inf)),
        (unknown,) * 3,
        field,
        unknown,
        "b" if applied else "none",
        (Span(begin, end, "informative" if applied else "still"),),
        (IronGroup(iron, raw, corrected, applied),),
        matrix,
        np.zeros(8),
        norm,
        unit,
        problems,
        tuple(advice),
        (note,),
        source,
    )


def median_field(choice: IronChoice) -> float:
    """Return the median magnitude of the fitted field, in the unit of the samples."""
    return float(np.median(np.linalg.norm(choice.fit.fields, axis=1)))


def gyro_result(
    ticks: Ticks,
    choice: IronChoice | None,
    begin: float,
    unit: str,
    problems: tuple[str, ...],
    notes: tuple[str, ...],
    source: str,
) -> MagnetometerCalibration:
    """Return the calibration from a fit with the gyro, with advice."""
    known: dict[str, Any] = {"norm": ticks.norm, "unit": unit, "notes": notes, "source": source}
    unknown = Coefficient(0.0, identifiable=False, upper_bound=np.inf)
    last = begin + float(ticks.number[-1] + 1) / 10.0
    if choice is None:
        group = IronGroup((0.0, 0.0, 0.0), 0.0, 0.0, False)
        advice = () if problems else ("rotate the sensor about two different axes",)
        soft = _soft_iron_matrix(np.zeros(8), np.full(8, np.inf))
        return MagnetometerCalibration(
            (unknown,) * 3,
            soft,
            (unknown,) * 3,
            unknown,
            unknown,
            "none",
            (Span(begin, last, "still"),),
            (group,),
            np.eye(11),
            np.zeros(8),
            problems=problems,
            advice=advice,
            **known,
        )
    spans = tuple(
        replace(s, start=begin + s.start, stop=min(begin + s.stop, last)) for s in choice.spans
    )
    groups = tuple(
        IronGroup(
            tuple((b * ticks.norm).tolist()), float(r * ticks.norm), float(u * ticks.norm), bool(a)
        )
        for b, r, u, a in zip(choice.iron, choice.raw, choice.left, choice.applied, strict=True)
    )
    durations = [sum(s.stop - s.start for s in spans if s.group == g) for g in range(len(groups))]
    g = int(np.argmax(durations))
    indices = [*range(8), *range(8 + 3 * g, 11 + 3 * g)]
    matrix = choice.covariance[np.ix_(indices, indices)]
    model: MagnetometerModel = "none"
    if choice.applied.any():
        model = "b" if not choice.soft else ("b+symmetric" if max(choice.soft) > 1 else "b+scale")
    field, dip = _field_and_dip(choice, matrix, ticks.norm)
    return MagnetometerCalibration(
        _hard_iron_vector(choice.iron[g], matrix[8:, 8:], ticks.norm),
        _soft_iron_matrix(choice.elements, np.sqrt(np.diagonal(matrix)[:8])),
        _rotation_vector(choice),
        field,
        dip,
        model,
        spans,
        groups,
        matrix,
        choice.elements,
        advice=tuple(_advice(spans, groups, matrix[8:, 8:], unit)),
        residual=_field_residuals(ticks, choice) * ticks.norm,
        **known,
    )


def _field_residuals(ticks: Ticks, choice: IronChoice) -> Floats:
    """Return the residual field of each second relative to the nearest window's field."""
    group = np.zeros(ticks.n, dtype=np.int64)
    for span in choice.spans:
        group[span.tick_indices(ticks)] = span.group
    after = np.searchsorted(choice.ticks.number, ticks.number).clip(1, choice.ticks.n - 1)
    middle = (choice.ticks.number[after] + choice.ticks.number[after - 1]) / 2.0
    nearest = np.where(ticks.number > middle, after, after - 1)
    iron = np.where(choice.applied[:, None], choice.iron, 0.0)[group]
    inverse = np.linalg.inv(np.eye(3) + np.tensordot(choice.elements, BASIS, axes=1))
    rotated = (ticks.rotation @ ((ticks.field - iron) @ inverse.T)[:, :, None])[:, :, 0]
    squares = ((rotated - choice.fit.fields[choice.fit.window[nearest]]) ** 2).sum(axis=1)
    second = ticks.number // 10
    count = np.bincount(second)
    with np.errstate(invalid="ignore"):
        residuals: Floats = np.sqrt(np.bincount(second, squares) / count)
    return residuals


def _hard_iron_vector(iron: Floats, block: Floats, norm: float) -> Vector:
    sigmas = np.sqrt(np.diagonal(block))
    x, y, z = (
        _make_coefficient(v * norm, s * norm, s < KNOWN_SIGMA)
        for v, s in zip(iron, sigmas, strict=True)
    )
    return x, y, z


def _make_coefficient(value: float, sigma: float, identifiable: bool) -> Coefficient:
    if identifiable:
        return Coefficient(float(value), float(sigma))
    return Coefficient(float(value), float(sigma), False, float(value + _ONE_SIDED_95_Z * sigma))


def _soft_iron_matrix(elements: Floats, sigmas: Floats) -> Matrix:
    matrix = np.eye(3) + np.tensordot(elements, BASIS, axes=1)
    if not np.isfinite(sigmas).all():
        nothing = Coefficient(0.0, identifiable=False, upper_bound=np.inf)
        unity = Coefficient(1.0, identifiable=False, upper_bound=np.inf)
        rows = [[unity if i == j else nothing for j in range(3)] for i in range(3)]
    else:
        size = np.sqrt(np.tensordot(sigmas**2, BASIS**2, axes=1))
        rows = [
            [
                _make_coefficient(matrix[i, j], size[i, j], bool(size[i, j] < _SOFT_IRON_SIGMA))
                for j in range(3)
            ]
            for i in range(3)
        ]
    a, b, c = ((row[0], row[1], row[2]) for row in rows)
    return a, b, c


def _rotation_vector(choice: IronChoice) -> Vector:
    """Return the rotation vector from the antisymmetric elements of a fit of all elements."""
    xy, xz, yz = choice.rotation / np.sqrt(2.0)
    sigmas = choice.rotation_sigma / np.sqrt(2.0)
    values, order = (-yz, xz, -xy), sigmas[::-1]
    x, y, z = (
        _make_coefficient(v, s, bool(s < _SOFT_IRON_SIGMA))
        for v, s in zip(values, order, strict=True)
    )
    return x, y, z


def _field_and_dip(
    choice: IronChoice, matrix: Floats, norm: float
) -> tuple[Coefficient, Coefficient]:
    """Return magnitude and dip of the mean field, with their errors from hard and soft iron."""
    fields = choice.fit.fields
    h, back = fields.mean(axis=0), choice.ticks.inverse_rotation
    turn = choice.ticks.rotation
    sensed = back @ h
    slopes = [-(turn @ (sensed @ element.T)[:, :, None])[:, :, 0].mean(axis=0) for element in BASIS]
    slope = np.column_stack([*slopes, -turn.mean(axis=0)])
    spread = fields.var(axis=0).mean() / len(fields)
    cov = slope @ matrix @ slope.T + np.eye(3) * spread
    size, level = float(np.linalg.norm(h)), float(np.hypot(h[0], h[1]))
    along = h / max(size, 1e-12)
    dip = float(np.arctan2(-h[2], level))
    across = np.array([*(h[:2] / max(level, 1e-12) * np.sin(dip)), np.cos(dip)])
    sigma = float(np.sqrt(along @ cov @ along))
    angle = float(np.sqrt(across @ cov @ across)) / max(size, 1e-12)
    return (
        _make_coefficient(size * norm, sigma * norm, sigma < KNOWN_SIGMA * size),
        _make_coefficient(dip, angle, angle < KNOWN_SIGMA),
    )


def _advice(
    spans: tuple[Span, ...], groups: tuple[IronGroup, ...], block: Floats, unit: str
) -> Iterator[str]:
    size, axes = np.linalg.eigh(block)
    for k in range(3):
        if size[k] >= KNOWN_SIGMA**2:
            x, y, z = axes[:, k] * np.sign(axes[np.abs(axes[:, k]).argmax(), k])
            yield (
                f"turn once about an axis across ({x:.1f}, {y:.1f}, {z:.1f}) of the sensor: along "
                "it the hard iron is not known"
            )
    for start, change in list_iron_changes(spans, [group.hard_iron for group in groups]):
        yield (
            f"the field changed at {start:.0f} s by {change:.3g} {unit} in the sensor: "
            "something was attached or removed"
        )
