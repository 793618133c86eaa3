"""Decision between hypotheses by their costs in windows; alarms need high certainty.

A hypothesis is a unit and one of 48 senses of the axes. Its cost in a window is the variance of
gravity, transformed by the gyro under this hypothesis, over gravity squared.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np

from zerorate.checks.axis_permutations import IDENTITY, SENSES, count_mistakes, shared_rows
from zerorate.types import Booleans, Floats, Integers

Status = Literal["agrees", "partly seen", "unit only", "cannot tell", "doubt", "mistake"]

_MAX_EXPLAINED_RMS: Final = 0.25
"""Largest root of the cost at which a hypothesis explains a window."""
_MIN_WINDOWS: Final = 4
_TIE_RATIO: Final = 2.0


@dataclass(frozen=True, eq=False)
class Costs:
    """Costs of hypotheses in windows.

    Parameters
    ----------
    costs : ndarray, shape (units, senses, windows)
        Costs; the first is the cost of the stated hypothesis.
    null : ndarray, shape (windows,)
        Costs of force or field in sensor axes, without any gyro.
    floor : float
        Root of the smallest cost that a model reaches.
    """

    costs: Floats
    null: Floats
    floor: float

    def telling(self) -> tuple[Costs, Booleans]:
        """Return the windows that a hypothesis explains, if they are at least half of all."""
        explained = self.costs.min(axis=(0, 1)) < _MAX_EXPLAINED_RMS**2
        if 2 * explained.sum() < len(explained):
            explained[:] = True
        return Costs(self.costs[..., explained], self.null[explained], self.floor), explained


@dataclass(frozen=True, eq=False)
class Decision:
    """Remaining hypotheses.

    Parameters
    ----------
    status : str
        Status, as in `zerorate.checks.Finding`.
    unit : int
        Index of the best unit; 0 is the stated unit.
    remaining : ndarray of int
        Senses that the data do not distinguish from the best sense.
    likely : int
        Remaining sense with the fewest mistakes; if there are several, the best of them.
    decisive : ndarray of bool, shape (windows,)
        Windows in which the best hypothesis is better by a factor of 2 than the stated hypothesis
        or the others.
    ratio : float
        Cost of the stated hypothesis over the cost of the best.
    other_units : bool
        True if hypotheses of other units also remain.
    """

    status: Status
    unit: int
    remaining: Integers
    likely: int
    decisive: Booleans
    ratio: float
    other_units: bool = False


class _Margin(NamedTuple):
    ratio: float
    share: float
    telling: int
    where: Booleans


def _compare_costs(worse: Floats, better: Floats, floor: float) -> _Margin:
    """Return the advantage of one hypothesis over another, and the windows in its favour."""
    high, low = worse + floor**2, better + floor**2
    d = np.log(high / low).clip(-3.0, 3.0)
    total = float(np.abs(d).sum())
    share = float(np.maximum(d, 0.0).sum()) / total if total > 0.0 else 0.0
    where = np.abs(d) > np.log(2.0)
    return _Margin(float(high.sum() / low.sum()), share, int(where.sum()), where)


def _is_beaten(costs: Costs, candidate: Floats, best: Floats) -> bool:
    margin = _compare_costs(candidate, best, costs.floor)
    return margin.ratio >= 2.0 and margin.share >= 0.75 and margin.telling >= 3


def _find_quiet_units(costs: Costs) -> Booleans:
    """Return the units with equal costs of all senses, as in too slow a rotation."""
    means, null = costs.costs.mean(axis=2), float(costs.null.mean())
    floor = costs.floor**2
    tied = means.max(axis=1) + floor <= _TIE_RATIO * (means.min(axis=1) + floor)
    return np.asarray(tied & (means.max(axis=1) < 2.0 * (null + floor)))


def decide(costs: Costs, *, refit: Callable[[], Floats] | None = None) -> Decision:
    """Return the hypotheses that remain after all windows.

    Parameters
    ----------
    costs : Costs
        Costs of all hypotheses.
    refit : callable, optional
        Function called before an alarm. It returns the stated hypothesis' costs, shape (windows,),
        after a fit of scale errors and a delay.
    """
    if costs.costs.shape[2] < _MIN_WINDOWS:
        return _decide_nothing("cannot tell", costs)
    costs, explained = costs.telling()
    quiet = _find_quiet_units(costs) if costs.costs.shape[0] > 1 else np.zeros(1, dtype=bool)
    best = _find_best(costs, quiet)
    tied = _find_tied(costs, best, quiet)
    if tied[0, IDENTITY]:
        return _decide_agreement(costs, tied, explained)
    unit_only = _is_unit_only(costs, best, quiet)
    given_costs = costs.costs[0, IDENTITY]
    if not _is_sure(costs, given_costs, best, unit_only):
        return _decide_nothing("doubt", costs, explained)
    if refit is not None:
        given_costs = np.minimum(given_costs, refit()[explained])
        if not _is_sure(costs, given_costs, best, unit_only):
            return _decide_nothing("doubt", costs, explained)
    margin = _compare_costs(given_costs, costs.costs[best], costs.floor)
    where = _expand_windows(margin.where, explained)
    remaining = np.flatnonzero(tied[best[0]])
    if unit_only:
        return Decision("unit only", best[0], np.arange(48), IDENTITY, where, margin.ratio)
    other_units = int(tied.sum()) > len(remaining)
    if other_units and best[0] != 0:
        # Several units are indistinguishable, and the stated unit is not the best: name none.
        return _decide_nothing("doubt", costs, explained)
    return Decision(
        "mistake",
        best[0],
        remaining,
        _simplest_sense(costs, best[0], remaining),
        where,
        margin.ratio,
        other_units,
    )


def _find_best(costs: Costs, quiet: Booleans) -> tuple[int, int]:
    means = costs.costs.mean(axis=2) + costs.floor**2
    best = np.unravel_index(int(means.argmin()), means.shape)
    if quiet[best[0]] and not quiet.all():
        loud = np.where(quiet[:, np.newaxis], np.inf, means)
        other = np.unravel_index(int(loud.argmin()), means.shape)
        if means[other] <= _TIE_RATIO * means[best]:
            best = other
    return int(best[0]), int(best[1])


def _find_tied(costs: Costs, best: tuple[int, int], quiet: Booleans) -> Booleans:
    units, senses, _ = costs.costs.shape
    tied = np.zeros((units, senses), dtype=bool)
    for unit, sense in np.ndindex(units, senses):
        tied[unit, sense] = not _is_beaten(costs, costs.costs[unit, sense], costs.costs[best])
    if not quiet[best[0]] and not quiet[0]:
        tied[quiet] = False
    return tied


def _is_unit_only(costs: Costs, best: tuple[int, int], quiet: Booleans) -> bool:
    if quiet[best[0]]:
        return True
    low, null = float(costs.costs[best].mean()), float(costs.null.mean())
    return best[0] != 0 and not null >= _TIE_RATIO * low


def _is_sure(costs: Costs, given_costs: Floats, best: tuple[int, int], unit_only: bool) -> bool:
    """Return True if the stated hypothesis is certainly worse than the best."""
    low, floor = costs.costs[best], costs.floor
    margin = _compare_costs(given_costs, low, floor)
    if margin.telling < _MIN_WINDOWS or margin.share < 0.9:
        return False
    if _robust_ratio(given_costs, low, floor) < 4.0:
        return False
    if low.mean() >= _MAX_EXPLAINED_RMS**2 or low.mean() > costs.null.mean() / 0.8 + floor**2:
        return False
    if unit_only:
        senses = (_compare_costs(c, low, floor).ratio for c in costs.costs[0])
        return min(_compare_costs(given_costs, low, floor).ratio, *senses) >= 16.0
    if costs.null.mean() >= _TIE_RATIO * low.mean():
        return margin.ratio >= 4.0
    return margin.ratio >= 6.0 and _compare_costs(given_costs, costs.null, floor).ratio >= 6.0


def _robust_ratio(given_costs: Floats, low: Floats, floor: float) -> float:
    """Return the ratio of costs without the most decisive window, which may be a knock."""
    others = np.arange(len(given_costs)) != int(given_costs.argmax())
    return _compare_costs(given_costs[others], low[others], floor).ratio


def _decide_agreement(costs: Costs, tied: Booleans, explained: Booleans) -> Decision:
    """Return the decision for axes that nothing contradicts."""
    remaining = np.flatnonzero(tied[0])
    is_seen = len(remaining) == tied.sum() and any(shared_rows(remaining))
    status: Status = "agrees" if tied.sum() == 1 else "partly seen" if is_seen else "cannot tell"
    where = _expand_windows(
        costs.costs[0].max(axis=0) > _TIE_RATIO * costs.costs[0, IDENTITY], explained
    )
    return Decision(status, 0, remaining, IDENTITY, where, 1.0)


def _decide_nothing(status: Status, costs: Costs, explained: Booleans | None = None) -> Decision:
    n = costs.costs.shape[2] if explained is None else len(explained)
    return Decision(status, 0, np.arange(48), IDENTITY, np.zeros(n, dtype=bool), 1.0)


def _expand_windows(where: Booleans, explained: Booleans) -> Booleans:
    expanded = np.zeros(len(explained), dtype=bool)
    expanded[explained] = where
    return expanded


def _simplest_sense(costs: Costs, unit: int, remaining: Integers) -> int:
    """Return the sense with the fewest mistakes; if there are several, the best of them."""
    means = costs.costs[unit].mean(axis=1)
    return int(min(remaining, key=lambda sense: (count_mistakes(SENSES[sense]), means[sense])))
