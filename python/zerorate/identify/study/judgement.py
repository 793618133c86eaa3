"""What the numbers of an identification mean, in sentences."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.identify.study.drift import slow_ratio
from zerorate.identify.study.fitness import on_distribution, on_fitness, on_smoothing
from zerorate.identify.study.phrases import model_name, per_cent
from zerorate.numerals import significant

if TYPE_CHECKING:
    from zerorate.identify.estimation.order import OrderSelection
    from zerorate.identify.study.result import Identification

__all__ = ["judged"]

_MATTERS: Final = 0.01
"""Predictable part of the residuals' variance from which on a model leaves something out."""

_SLOW: Final = 1.5
"""Slow variance over the model's from which on chance does not explain it: of 100 segments of a
known model it scatters by a seventh."""

_FAR: Final = 3.0
"""Standard errors between two estimates that chance does not explain."""


def judged(found: Identification) -> tuple[str, ...]:
    """Return the verdict on a record and its model, a sentence each.

    Parameters
    ----------
    found : Identification
        What was found out.

    Returns
    -------
    tuple of str
        On the record, the order, the residuals, the drift and the coefficients, in this turn.
    """
    parts = (
        on_fitness,
        on_distribution,
        on_smoothing,
        _on_order,
        _on_residuals,
        _on_drift,
        _on_coefficients,
        _on_online,
    )
    return tuple(sentence for part in parts for sentence in part(found))


def _on_order(found: Identification) -> Iterator[str]:
    orders, name = found.arma_orders, model_name(found.model.order)
    rule = orders.criterion.upper()
    clear, least = model_name(orders.clear), model_name(orders.minimum)
    if found.asked:
        yield f"{name} was asked for; the clear choice of {rule} is {clear}."
    elif orders.clear == orders.minimum:
        yield f"{rule} chooses {name}, which has the least of it."
    else:
        yield (
            f"{rule} chooses {name}: the fewest coefficients within {orders.margin:g} of the "
            f"least, which {least} has."
        )
    if not found.asked and not found.moving and _at_an_end(orders):
        yield "That is at an end of the orders that were tried: a higher one may do better."
    if sum(found.model.order) and not found.moving:
        explained = max(0.0, 1.0 - found.model.sigma2 / float(np.nanvar(found.prepared.data)))
        yield f"The model explains {per_cent(explained)} of the variance."


def _at_an_end(orders: OrderSelection) -> bool:
    """Return whether the clear choice has one of the highest orders."""
    highest = [max(order[i] for order in orders.orders) for i in (0, 1)]
    return any(0 < most == own for most, own in zip(highest, orders.clear, strict=True))


def _on_residuals(found: Identification) -> Iterator[str]:
    white, test = found.whiteness, found.whiteness.ljung_box
    if white.white:
        yield f"The residuals are white (Ljung-Box, p = {significant(test.p_value, 2)})."
        return
    rest = per_cent(white.predictable)
    if white.predictable < _MATTERS:
        yield (
            f"The residuals are not quite white (Ljung-Box); {rest} of their variance could still "
            "be predicted, which hardly matters."
        )
    else:
        yield (
            f"The residuals are not white: {rest} of their variance could still be predicted; a "
            f"higher order would pay (the AR models ask for {model_name(found.ar_orders.clear)})."
        )


def _on_drift(found: Identification) -> Iterator[str]:
    ratio = slow_ratio(found)
    if found.moving or not ratio > _SLOW:
        return
    yield (
        f"The means of segments of {significant(found.tests.segment)} s vary with "
        f"{significant(ratio, 2)} times the variance that the model gives them: a slow drift is "
        "there that it does not contain. Decimate the record to model it."
    )


def _on_coefficients(found: Identification) -> Iterator[str]:
    for note in found.model.notes:
        yield f"{note[0].upper()}{note[1:]}."


def _on_online(found: Identification) -> Iterator[str]:
    if found.online is None or found.moving:
        return
    distance = np.abs(found.online.distance)
    far = float(np.nanmax(distance)) if np.isfinite(distance).any() else 0.0
    if far <= _FAR:
        yield (
            f"Learned online, the coefficients end within {significant(max(far, 0.1), 2)} standard "
            "errors of these."
        )
    else:
        yield (
            f"Learned online, the coefficients end up to {significant(far, 2)} standard errors "
            "from these: the recursion had not settled."
        )
