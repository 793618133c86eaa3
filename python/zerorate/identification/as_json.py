"""Identifications as JSON."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

from zerorate._native import __version__
from zerorate.identification.conclusions import is_fit
from zerorate.identification.order import CRITERIA
from zerorate.record.saved import as_json as strict
from zerorate.record.saved import fields_of, plain

if TYPE_CHECKING:
    from collections.abc import Sequence

    from zerorate.identification.arma_model import ArmaModel
    from zerorate.identification.identification import Identification, Online
    from zerorate.identification.order import OrderSelection

SCHEMA: Final = "zerorate-identify/1"
"""The form of the document; the number rises when a reader has to change."""


def as_json(found: Sequence[Identification], source: str, notes: Sequence[str] = ()) -> str:
    """Return the identifications of one log as strict JSON.

    Parameters
    ----------
    found : sequence of Identification
        One an axis, of different names.
    source : str
        Name of the log.
    notes : sequence of str
        Sentences on the log, and on axes that were left out.
    """
    content = {
        "schema": SCHEMA,
        "zerorate": __version__,
        "source": source,
        "notes": list(notes),
        "axes": {one.name: as_dict(one) for one in found},
    }
    return strict(content, indent=1)


def as_dict(found: Identification) -> dict[str, Any]:
    """Return all numbers of one axis; what is not finite is None.

    ``models`` are as `ArmaModel.from_json` reads them, after `json.dumps`.
    """
    content = {
        "unit": found.unit,
        "record": {**fields_of(found.record), "duration": found.record.duration},
        "moving": [[span.start, span.end] for span in found.moving],
        "changes": [
            {"what": change.what, "count": change.count} for change in found.prepared.changes
        ],
        "modelled_rate": found.rate,
        "tests": [fields_of(test) for test in (*found.tests.all, found.whiteness.ljung_box)],
        "slow": {
            "part": found.tests.slow,
            "segment": found.tests.segment,
            "over_model": found.slow_ratio,
        },
        "correlogram": fields_of(found.correlogram),
        "orders": {"ar": _orders(found.ar_orders), "arma": _orders(found.arma_orders)},
        "residuals": {
            "white": found.whiteness.white,
            "outside_count": found.whiteness.outside_count,
            "predictable": found.whiteness.predictable,
            "correlogram": fields_of(found.whiteness.correlogram),
        },
        "online": None if found.online is None else _online(found.online),
        "fit": is_fit(found),
        "verdict": list(found.verdict),
    }
    models = {"ar": _model(found.ar), "arma": _model(found.model)}
    return {**plain(content), "models": models}


def _orders(orders: OrderSelection) -> dict[str, Any]:
    scores: dict[str, Any] = {name: getattr(orders, name) for name in CRITERIA}
    choice = {"minimum": orders.minimum, "clear": orders.clear}
    return {**fields_of(orders), **scores, **choice}


def _model(model: ArmaModel) -> Any:  # noqa: ANN401
    return json.loads(model.to_json())


def _online(online: Online) -> dict[str, Any]:
    return {"coefficients": online.last, "distance": online.distance}
