"""Identifications as JSON."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

from zerorate._native import __version__
from zerorate.identification.conclusions import is_fit
from zerorate.identification.order import CRITERIA
from zerorate.record.saved import as_json as strict
from zerorate.record.saved import fields_of, to_jsonable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from zerorate.identification.arma_model import ArmaModel
    from zerorate.identification.identification import Identification, OnlineFit
    from zerorate.identification.order import OrderSelection

SCHEMA: Final = "zerorate-identify/1"
"""Version of the document; it increases with every change that affects readers."""


def as_json(
    identifications: Sequence[Identification], source: str, notes: Sequence[str] = ()
) -> str:
    """Return the identifications of one log as strict JSON.

    Parameters
    ----------
    identifications : sequence of Identification
        Identifications, one for each axis, with different names.
    source : str
        Name of the log.
    notes : sequence of str
        Sentences on the log and on excluded axes.
    """
    content = {
        "schema": SCHEMA,
        "zerorate": __version__,
        "source": source,
        "notes": list(notes),
        "axes": {axis.name: as_dict(axis) for axis in identifications},
    }
    return strict(content, indent=1)


def as_dict(result: Identification) -> dict[str, Any]:
    """Return all numbers of one axis, with None in place of numbers that are not finite.

    ``models`` can be read by `ArmaModel.from_json` after `json.dumps`.
    """
    content = {
        "unit": result.unit,
        "record": {**fields_of(result.record), "duration": result.record.duration},
        "moving": [[span.start, span.end] for span in result.moving],
        "changes": [
            {"what": change.what, "count": change.count} for change in result.prepared.changes
        ],
        "modelled_rate": result.rate,
        "tests": [fields_of(test) for test in (*result.tests.all, result.whiteness.ljung_box)],
        "slow": {
            "part": result.tests.slow,
            "segment": result.tests.segment,
            "over_model": result.slow_ratio,
        },
        "correlogram": fields_of(result.correlogram),
        "orders": {"ar": _orders_dict(result.ar_orders), "arma": _orders_dict(result.arma_orders)},
        "residuals": {
            "white": result.whiteness.white,
            "outside_count": result.whiteness.outside_count,
            "predictable": result.whiteness.predictable,
            "correlogram": fields_of(result.whiteness.correlogram),
        },
        "online": None if result.online is None else _online_dict(result.online),
        "fit": is_fit(result),
        "verdict": list(result.verdict),
    }
    models = {"ar": _model_dict(result.ar), "arma": _model_dict(result.model)}
    return {**to_jsonable(content), "models": models}


def _orders_dict(orders: OrderSelection) -> dict[str, Any]:
    scores: dict[str, Any] = {name: getattr(orders, name) for name in CRITERIA}
    choice = {"minimum": orders.minimum, "clear": orders.clear}
    return {**fields_of(orders), **scores, **choice}


def _model_dict(model: ArmaModel) -> Any:  # noqa: ANN401
    return json.loads(model.to_json())


def _online_dict(online: OnlineFit) -> dict[str, Any]:
    return {"coefficients": online.last, "distance": online.distance}
