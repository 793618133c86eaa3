"""The tables of an identification, for text and page alike, and its plain text."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from zerorate.identification.arma_model import ArmaModel
from zerorate.identification.conclusions import model_name, per_cent
from zerorate.identification.identification import Identification
from zerorate.identification.order import CRITERIA, OrderSelection, above_least
from zerorate.identification.verdict import Verdict
from zerorate.numerals import significant, with_error
from zerorate.show.tables import Table, as_text, bulleted
from zerorate.tasks.identify import Identified
from zerorate.texts import width

Row = tuple[str, ...]

_MARKS: Final = "* the least; < the clear choice, with the fewest coefficients within {:g} of it."


def format_identified(found: Identified) -> str:
    """Return the tables of all axes of a log, and notes."""
    return "\n\n".join(filter(None, (format_identify(found.axes), bulleted(found.notes))))


def tables(found: Identification) -> tuple[Table, ...]:
    """Return the tables of one axis in the order of a report."""
    return (
        _record(found),
        _tests(found),
        _autoregressive(found.ar_orders, found.unit),
        _grid(found.arma_orders),
        _coefficients(found),
        _residuals(found),
    )


def _record(found: Identification) -> Table:
    return Table("Record", (), tuple(_facts(found)), words=2)


def _facts(found: Identification) -> Iterator[Row]:
    record, unit = found.record, found.unit
    yield "samples", f"{record.sample_count:,} at {record.rate:g} Hz, {record.duration:g} s"
    if record.missing_count:
        yield (
            "missing",
            f"{record.missing_count:,}, which leaves {record.stretch_count:,} stretches",
        )
    yield "mean", f"{significant(record.mean, 4)} {unit}"
    yield "deviation", f"{significant(record.deviation, 4)} {unit}"
    if record.step:
        yield "quantised", f"in steps of {significant(record.step)} {unit}"
    spans = [f"{span.start:.1f} to {span.end:.1f} s" for span in found.moving]
    more = f" and {len(spans) - 4} more" if len(spans) > 4 else ""
    yield "not at rest", ", ".join(spans[:4]) + more if spans else "nowhere"
    for i, change in enumerate(found.prepared.changes):
        yield "" if i else "preparation", change.what


def _tests(found: Identification) -> Table:
    head = ("test", "of", "statistic", "accepted, 5 %", "p", "result")
    means, variances, *others = found.tests.all
    named = (
        (f"{means.name} of means", means),
        (f"{variances.name} of variances", variances),
        *((test.name, test) for test in others),
        ("Ljung-Box of the residuals", found.whiteness.ljung_box),
    )
    rows = tuple(_tested(name, test) for name, test in named)
    note = "; ".join(f"{name}: {test.note}" for name, test in named if test.note)
    return Table("Tests", head, rows, words=2, note=note, spare=(3, 2, 4))


def _tested(name: str, test: Verdict) -> Row:
    return (
        name,
        test.hypothesis,
        significant(test.statistic, 4),
        _range(test),
        _probability(test),
        "not rejected" if test.accepted else "rejected",
    )


def _range(test: Verdict) -> str:
    low, high = (significant(bound, 4) for bound in (test.lower, test.upper))
    if np.isinf(test.lower):
        return f"up to {high}"
    return f"from {low}" if np.isinf(test.upper) else f"{low} to {high}"


def _probability(test: Verdict) -> str:
    p = test.p_value
    if np.isnan(p):
        return "-"
    return "< 1e-6" if p < 1e-6 else f"{test.p_bound} {significant(p, 2)}".strip()


def _autoregressive(orders: OrderSelection, unit: str) -> Table:
    shown = {name: above_least(orders, name) for name in CRITERIA}
    rows = [
        (
            str(order[0]),
            significant(float(np.sqrt(orders.sigma2[i])), 6),
            *(_above(shown[name][i]) for name in CRITERIA),
            _mark(orders, order),
        )
        for i, order in enumerate(orders.orders)
    ]
    head = ("p", f"innovation [{unit}]", *(name.upper() for name in CRITERIA), "")
    title = f"Orders of AR models: criteria above their least, chosen by {orders.criterion.upper()}"
    return Table(title, head, tuple(rows), note=_MARKS.format(orders.margin))


def _grid(orders: OrderSelection) -> Table:
    above = dict(zip(orders.orders, above_least(orders, orders.criterion), strict=True))
    most_p, most_q = (max(axis) for axis in zip(*orders.orders, strict=True))
    rows = [
        (str(p), *(f"{_above(above[p, q])} {_mark(orders, (p, q)):2}" for q in range(most_q + 1)))
        for p in range(most_p + 1)
    ]
    head = ("p", *(f"q = {q}   " for q in range(most_q + 1)))
    title = f"Orders of ARMA models: {orders.criterion.upper()} above its least"
    return Table(title, head, tuple(rows), note=_MARKS.format(orders.margin))


def _above(score: float) -> str:
    return f"{score:.1f}" if score < 9999.5 else f"{score:.3g}".replace("e+0", "e")


def _mark(orders: OrderSelection, order: tuple[int, int]) -> str:
    return "*" * (order == orders.minimum) + "<" * (order == orders.clear)


_ONLINE: Final = (
    "online: learned in one pass, as the filters of Fu & Han do; apart [s.e.]: how far from "
    "the model, in standard errors of the model: large where one pass has not settled"
)


def _coefficients(found: Identification) -> Table:
    ar, model = found.ar, found.model
    p, q = max(ar.order[0], model.order[0]), model.order[1]
    columns = [_column(one, p, q, found.unit) for one in (ar, model)]
    columns += _online(found, p, q) if found.online is not None else []
    names = [*(f"φ{i + 1}" for i in range(p)), *(f"θ{j + 1}" for j in range(q)), "constant"]
    labels = [*names, "innovation", "condition"]
    head = (
        "",
        f"{model_name(ar.order)}, {ar.method}",
        f"{model_name(model.order)}, {model.method}",
        *(("online", "apart [s.e.]") if found.online is not None else ()),
    )
    note = _ONLINE if found.online is not None else ""
    return Table("Coefficients", head, tuple(zip(labels, *columns, strict=True)), note=note)


def _column(model: ArmaModel, p: int, q: int, unit: str) -> list[str]:
    """Return a model's cells, blank where a larger one has more coefficients."""
    errors = model.standard_errors
    split = model.order[0]
    phi = [with_error(v, e) for v, e in zip(model.phi, errors[:split], strict=True)]
    theta = [with_error(v, e) for v, e in zip(model.theta, errors[split:-1], strict=True)]
    return [
        *_padded(phi, p),
        *_padded(theta, q),
        f"{with_error(model.constant, errors[-1])} {unit}",
        f"{significant(float(np.sqrt(model.sigma2)), 5)} {unit}",
        significant(model.condition, 3),
    ]


def _online(found: Identification, p: int, q: int) -> list[list[str]]:
    assert found.online is not None
    last, split = found.online.last, found.model.order[0]
    values = [f"{value:.4f}" for value in last[:-1]]
    apart = [f"{value:+.2f}" if np.isfinite(value) else "-" for value in found.online.distance]
    constant = f"{significant(last[-1], 4)} {found.unit}"
    return [
        [*_padded(values[:split], p), *_padded(values[split:], q), constant, "", ""],
        [*_padded(apart[:split], p), *_padded(apart[split:], q), "", "", ""],
    ]


def _padded(cells: list[str], count: int) -> list[str]:
    return cells + [""] * (count - len(cells))


def _residuals(found: Identification) -> Table:
    white, lags = found.whiteness, found.whiteness.correlogram.lags.size
    slow = found.slow_ratio
    rows = (
        (
            "lags beyond the 5 % bounds",
            f"{white.outside_count} of {lags}, {0.05 * lags:g} expected",
        ),
        ("variance still predictable", per_cent(white.predictable)),
        ("white", "yes" if white.white else "no"),
        ("slow variance over the model's", "-" if np.isnan(slow) else significant(slow, 2)),
    )
    return Table(f"Residuals of {model_name(found.model.order)}", (), rows, words=2)


def format_identify(found: Sequence[Identification]) -> str:
    """Return the tables and the verdict of every axis, at most `WIDTH` columns wide."""
    return "\n\n\n".join("\n\n".join(_parts(one)) for one in found)


def format_identification(found: Identification) -> str:
    """Return the tables and the verdict of one axis."""
    return format_identify([found])


def _parts(found: Identification) -> Iterator[str]:
    title = f"{found.name} [{found.unit}]"[: width()]
    yield f"{title}\n{'=' * len(title)}"
    yield f"Verdict\n{bulleted(found.verdict)}"
    yield from map(as_text, tables(found))
