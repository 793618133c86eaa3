"""Fit of a record: with or without G in the rotations, of all rests or of a part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from zerorate.calibration.fit.expected_errors import is_expected_valid
from zerorate.calibration.fit.g_sensitivity import RestEstimate, estimate_at_rest
from zerorate.calibration.fit.joint_fit import (
    MAX_SIGMA_RATIO,
    Fit,
    Observations,
    Prior,
    directions,
    forces,
    joint_fit,
    vector_norms,
)
from zerorate.calibration.fit.rests import Stillness, mean_variances
from zerorate.calibration.fit.sensors import Sensor
from zerorate.calibration.fit.turns import TurnRotations, integrate_turns, miss_angles, turn_biases
from zerorate.calibration.record import Rest, Turn
from zerorate.types import Booleans, Floats, Integers

GSensitivity = Literal["auto"] | bool

_SIGNIFICANT_SIGMAS: Final = 3.0
_FOLD_COUNT: Final = 4
_MIN_TRAINING_RESTS: Final = 9


@dataclass(frozen=True, eq=False)
class Record:
    """Two sensors, their rests and rotations, and means at rests as arrays.

    Parameters
    ----------
    gyro, accel
        The sensors.
    rests, turns
        Used rests and rotations.
    stillness
        Thresholds by which the rests were found.
    accel_means, accel_sigmas, gyro_means, gyro_variances
        Means at rests with their standard errors or variances, shape (n, 3).
    """

    gyro: Sensor
    accel: Sensor
    rests: tuple[Rest, ...]
    turns: tuple[Turn, ...]
    stillness: Stillness
    accel_means: Floats
    accel_sigmas: Floats
    gyro_means: Floats
    gyro_variances: Floats

    @classmethod
    def of(
        cls,
        gyro: Sensor,
        accel: Sensor,
        rests: Sequence[Rest],
        turns: Sequence[Turn],
        stillness: Stillness,
    ) -> Record:
        """Return the record of all usable rests and rotations."""
        indices = [index for index, rest in enumerate(rests) if rest.used]
        new_index = {index: new for new, index in enumerate(indices)}
        used = [turn for turn in turns if turn.used]
        places = [(new_index[turn.rests[0]], new_index[turn.rests[1]]) for turn in used]
        still = [rests[index] for index in indices]
        usual, own = mean_variances(gyro, still, stillness)
        return cls(
            gyro=gyro,
            accel=accel,
            rests=tuple(still),
            turns=tuple(replace(t, rests=p) for t, p in zip(used, places, strict=True)),
            stillness=stillness,
            accel_means=np.array([rest.accel for rest in still]).reshape(-1, 3),
            accel_sigmas=np.array([rest.accel_sigma for rest in still]).reshape(-1, 3),
            gyro_means=np.array([rest.gyro for rest in still]).reshape(-1, 3),
            gyro_variances=np.maximum(usual, own),
        )

    @property
    def pairs(self) -> Integers:
        """Rest before and after each turn, shape (m, 2)."""
        return np.array([turn.rests for turn in self.turns], dtype=np.int64).reshape(-1, 2)

    @property
    def spans(self) -> Integers:
        """First and last (exclusive) index of each rotation in the joined samples, shape (m, 2)."""
        ends = np.cumsum([0, *(turn.last - turn.first for turn in self.turns)])
        return np.stack([ends[:-1], ends[1:]], axis=1).astype(np.int64)

    @property
    def middles(self) -> Floats:
        """Times of the middles of the rests, s, shape (n,)."""
        return np.array([0.5 * (rest.start + rest.stop) for rest in self.rests])

    @property
    def lengths(self) -> Floats:
        """Length of each rest, s, shape (n,)."""
        return np.array([rest.stop - rest.start for rest in self.rests])

    def select(self, mask: Booleans) -> Record:
        """Return the record of some rests, and of the rotations between them."""
        new_index = np.cumsum(mask) - 1
        turns = [t for t in self.turns if mask[t.rests[0]] and mask[t.rests[1]]]
        pairs = [(int(new_index[t.rests[0]]), int(new_index[t.rests[1]])) for t in turns]
        return replace(
            self,
            rests=tuple(rest for rest, keep in zip(self.rests, mask, strict=True) if keep),
            turns=tuple(replace(t, rests=pair) for t, pair in zip(turns, pairs, strict=True)),
            accel_means=self.accel_means[mask],
            accel_sigmas=self.accel_sigmas[mask],
            gyro_means=self.gyro_means[mask],
            gyro_variances=self.gyro_variances[mask],
        )

    def biases(self, up: Floats, sensitivity: Floats) -> Floats:
        """Return the gyro's bias in each rotation, without the effect of G at the rests."""
        return turn_biases(self.turns, self.rests, self.gyro_means - up @ sensitivity.T)

    def rates(self, sensors: Sensors) -> Floats:
        """Return the samples of the gyro in all rotations, minus the effect of G, shape (k, 3)."""
        rates = [self.gyro.data[turn.first : turn.last] for turn in self.turns]
        if sensors.sensitivity.any():
            rates = [
                rate - forces(force, sensors.accel, sensors.bias) @ sensors.sensitivity.T
                for rate, force in zip(rates, self.forces, strict=True)
            ]
        return np.concatenate(rates) if rates else np.zeros((0, 3))

    @property
    def forces(self) -> list[Floats]:
        """Raw samples of the accelerometer in each rotation, at the times of the gyro."""
        return [self.accel.resample_at(self.gyro, turn.first, turn.last) for turn in self.turns]


@dataclass(frozen=True, eq=False)
class Sensors:
    """Models of both sensors: A, b_a, M and G, in the unit of the fit."""

    accel: Floats
    bias: Floats
    gyro: Floats
    sensitivity: Floats


@dataclass(frozen=True, eq=False)
class Solution:
    """Parameters of both sensors that the record determines.

    Parameters
    ----------
    fit
        Fit of A, b_a and M.
    rest
        Bias of the gyro and G.
    in_turns, with_g
        True if G was subtracted in the rotations; and True if G was estimated.
    identifiable
        Mask of the 18 parameters of the fit that the record determines.
    """

    fit: Fit
    rest: RestEstimate
    in_turns: bool
    with_g: bool
    identifiable: Booleans

    @property
    def sensors(self) -> Sensors:
        """The models of both sensors."""
        fit = self.fit
        return Sensors(fit.accel, fit.bias, fit.gyro, self.rest.sensitivity)

    @property
    def without_g(self) -> Sensors:
        """Models of both sensors without G, as fitted if G was not subtracted in the rotations."""
        return replace(self.sensors, sensitivity=np.zeros((3, 3)))


def solve(record: Record, prior: Prior, g_sensitivity: GSensitivity) -> Solution:
    """Return the solution; parameters that the record does not determine keep their prior value."""
    with_g = g_sensitivity is not False
    fit = _fit_sensors(record, prior, None, np.zeros((3, 3)))
    rest = _estimate_rest(record, fit, prior, with_g)
    in_turns = g_sensitivity is True or bool(_find_significant(rest).any())
    if in_turns:
        fit = _fit_sensors(record, prior, fit, rest.sensitivity)
    identifiable = fit.sigmas <= MAX_SIGMA_RATIO * prior.datasheet
    if not identifiable.all():
        pinned = replace(prior, pinned=~identifiable)
        pinned_fit = _fit_sensors(
            record, pinned, fit, rest.sensitivity if in_turns else np.zeros((3, 3))
        )
        fit = replace(pinned_fit, covariance=fit.covariance)
    return Solution(fit, _estimate_rest(record, fit, prior, with_g), in_turns, with_g, identifiable)


def _find_significant(rest: RestEstimate) -> Booleans:
    return rest.identifiable & (np.abs(rest.sensitivity) > _SIGNIFICANT_SIGMAS * rest.sigmas)


def _fit_sensors(record: Record, prior: Prior, start: Fit | None, sensitivity: Floats) -> Fit:
    start_point = prior if start is None else start
    sensors = Sensors(start_point.accel, start_point.bias, start_point.gyro, sensitivity)
    return joint_fit(_make_observations(record, sensors, prior), prior, start)


def _make_observations(record: Record, sensors: Sensors, prior: Prior) -> Observations:
    up = directions(record.accel_means, sensors.accel, sensors.bias)
    rates = record.rates(sensors)
    biases, spans = record.biases(up, sensors.sensitivity), record.spans
    period = 1.0 / record.gyro.rate

    def carry(matrix: Floats) -> TurnRotations:
        return integrate_turns(rates, period, spans, biases, matrix)

    pairs, (_, size) = record.pairs, prior.sizes
    return Observations(
        means=record.accel_means,
        sigmas=record.accel_sigmas,
        pairs=pairs,
        seconds=np.asarray((spans[:, 1] - spans[:, 0] - 1) * period, dtype=np.float64),
        averaging_time=record.lengths[pairs].sum(axis=1),
        integrate=carry,
        white=size * float(np.sqrt(record.stillness.floor["gyro"].mean() * period)),
        rounding_sigma=size * float(np.sqrt(record.stillness.rounding("gyro").mean())),
    )


def _estimate_rest(record: Record, fit: Fit, prior: Prior, with_g: bool) -> RestEstimate:
    up = directions(record.accel_means, fit.accel, fit.bias)
    return estimate_at_rest(
        record.gyro_means,
        record.gyro_variances,
        record.stillness.rounding("gyro"),
        record.middles,
        up,
        1.0 / prior.sizes[1],
        with_g,
    )


def compute_errors(record: Record, sensors: Sensors) -> tuple[Floats, Floats, TurnRotations]:
    """Return |f|/g - 1 at rests, the error angles of rotations in rad, and the rotations."""
    force = forces(record.accel_means, sensors.accel, sensors.bias)
    size = vector_norms(force)
    up = force / size[:, np.newaxis]
    turns = integrate_turns(
        record.rates(sensors),
        1.0 / record.gyro.rate,
        record.spans,
        record.biases(up, sensors.sensitivity),
        sensors.gyro,
    )
    pairs = record.pairs
    return size - 1.0, miss_angles(turns.rotations, up[pairs[:, 0]], up[pairs[:, 1]]), turns


def compute_held_out_errors(
    record: Record, prior: Prior, solution: Solution
) -> tuple[Floats, Floats] | None:
    """Return the errors of `compute_errors` at rests and rotations excluded from the fit.

    Each quarter of the rests, in the order of time, is left out in turn, with the rotations that
    begin or end in it. The result is None if three quarters of the rests are too few, or determine
    the sensors badly. The errors would then not characterise the whole fit.
    """
    count = len(record.rests)
    if count * (_FOLD_COUNT - 1) // _FOLD_COUNT < _MIN_TRAINING_RESTS:
        return None
    fold = np.arange(count) * _FOLD_COUNT // count
    norms, misses = np.zeros(count), np.zeros(len(record.turns))
    # A rotation from one quarter to the next is excluded from both fits; the later quarter counts
    # it.
    own = fold[record.pairs].max(axis=1)
    for k in range(_FOLD_COUNT):
        part = record.select(fold != k)
        rest = _estimate_rest(part, solution.fit, prior, solution.with_g)
        sensitivity = rest.sensitivity if solution.in_turns else np.zeros((3, 3))
        fit = _fit_sensors(part, prior, solution.fit, sensitivity)
        if not is_expected_valid(fit, solution.fit.directions[fold == k], prior.sizes[1]):
            return None
        sensors = Sensors(fit.accel, fit.bias, fit.gyro, sensitivity)
        norm, miss, _ = compute_errors(record, sensors)
        norms[fold == k], misses[own == k] = norm[fold == k], miss[own == k]
    return norms, misses
