"""Tables of an identification, for text and page, and their plain text."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from zerorate.identification.arma_model import ArmaModel
from zerorate.identification.conclusions import format_percent, model_name
from zerorate.identification.identification import Identification
from zerorate.identification.order import CRITERIA, OrderSelection, scores_above_minimum
from zerorate.identification.verdict import Verdict
from zerorate.numerals import format_significant, format_with_error
from zerorate.show.tables import Table, as_text, bullet_list
from zerorate.tasks.identify import Identified
from zerorate.texts import width

Row = tuple[str, ...]

_MARKS_NOTE: Final = (
    "*: minimum; <: clear choice, the fewest coefficients within {:g} of the minimum."
)


def format_identified(result: Identified) -> str:
    """Return the tables of all axes of a log, with notes."""
    return "\n\n".join(filter(None, (format_identify(result.axes), bullet_list(result.notes))))


def identification_tables(identification: Identification) -> tuple[Table, ...]:
    """Return the tables of one axis in the order of the report."""
    return (
        _make_record_table(identification),
        _make_tests_table(identification),
        _make_ar_table(identification.ar_orders, identification.unit),
        _make_arma_table(identification.arma_orders),
        _make_coefficients_table(identification),
        _make_residuals_table(identification),
    )


def _make_record_table(identification: Identification) -> Table:
    return Table("Record", (), tuple(_list_facts(identification)), words=2)


def _list_facts(identification: Identification) -> Iterator[Row]:
    record, unit = identification.record, identification.unit
    yield "samples", f"{record.sample_count:,} at {record.rate:g} Hz, {record.duration:g} s"
    if record.missing_count:
        yield (
            "missing",
            f"{record.missing_count:,}, which leaves {record.stretch_count:,} stretches",
        )
    yield "mean", f"{format_significant(record.mean, 4)} {unit}"
    yield "deviation", f"{format_significant(record.deviation, 4)} {unit}"
    if record.step:
        yield "quantised", f"in steps of {format_significant(record.step)} {unit}"
    spans = [f"{span.start:.1f} to {span.end:.1f} s" for span in identification.moving]
    more = f" and {len(spans) - 4} more" if len(spans) > 4 else ""
    yield "not at rest", ", ".join(spans[:4]) + more if spans else "nowhere"
    for i, change in enumerate(identification.prepared.changes):
        yield "" if i else "preparation", change.what


def _make_tests_table(identification: Identification) -> Table:
    head = ("test", "of", "statistic", "accepted, 5 %", "p", "result")
    means, variances, *others = identification.tests.all
    named = (
        (f"{means.name} of means", means),
        (f"{variances.name} of variances", variances),
        *((test.name, test) for test in others),
        ("Ljung-Box of the residuals", identification.whiteness.ljung_box),
    )
    rows = tuple(_make_test_row(name, test) for name, test in named)
    note = "; ".join(f"{name}: {test.note}" for name, test in named if test.note)
    return Table("Tests", head, rows, words=2, note=note, spare=(3, 2, 4))


def _make_test_row(name: str, test: Verdict) -> Row:
    return (
        name,
        test.hypothesis,
        format_significant(test.statistic, 4),
        _format_range(test),
        _format_probability(test),
        "not rejected" if test.accepted else "rejected",
    )


def _format_range(test: Verdict) -> str:
    low, high = (format_significant(bound, 4) for bound in (test.lower, test.upper))
    if np.isinf(test.lower):
        return f"up to {high}"
    return f"from {low}" if np.isinf(test.upper) else f"{low} to {high}"


def _format_probability(test: Verdict) -> str:
    p = test.p_value
    if np.isnan(p):
        return "-"
    return "< 1e-6" if p < 1e-6 else f"{test.p_bound} {format_significant(p, 2)}".strip()


def _make_ar_table(orders: OrderSelection, unit: str) -> Table:
    shown = {name: scores_above_minimum(orders, name) for name in CRITERIA}
    rows = [
        (
            str(order[0]),
            format_significant(float(np.sqrt(orders.sigma2[i])), 6),
            *(_format_above(shown[name][i]) for name in CRITERIA),
            _order_mark(orders, order),
        )
        for i, order in enumerate(orders.orders)
    ]
    head = ("p", f"innovation [{unit}]", *(name.upper() for name in CRITERIA), "")
    title = f"Orders of AR models: criteria above their least, chosen by {orders.criterion.upper()}"
    return Table(title, head, tuple(rows), note=_MARKS_NOTE.format(orders.margin))


def _make_arma_table(orders: OrderSelection) -> Table:
    above = dict(zip(orders.orders, scores_above_minimum(orders, orders.criterion), strict=True))
    most_p, most_q = (max(axis) for axis in zip(*orders.orders, strict=True))
    rows = [
        (
            str(p),
            *(
                f"{_format_above(above[p, q])} {_order_mark(orders, (p, q)):2}"
                for q in range(most_q + 1)
            ),
        )
        for p in range(most_p + 1)
    ]
    head = ("p", *(f"q = {q}   " for q in range(most_q + 1)))
    title = f"Orders of ARMA models: {orders.criterion.upper()} above its least"
    return Table(title, head, tuple(rows), note=_MARKS_NOTE.format(orders.margin))


def _format_above(score: float) -> str:
    return f"{score:.1f}" if score < 9999.5 else f"{score:.3g}".replace("e+0", "e")


def _order_mark(orders: OrderSelection, order: tuple[int, int]) -> str:
    return "*" * (order == orders.minimum) + "<" * (order == orders.clear)


_ONLINE_NOTE: Final = (
    "online: learned in one pass, as in the filters of Fu & Han; apart [s.e.]: distance from the "
    "model in its standard errors, large if one pass has not converged"
)


def _make_coefficients_table(identification: Identification) -> Table:
    ar, model = identification.ar, identification.model
    p, q = max(ar.order[0], model.order[0]), model.order[1]
    columns = [_make_column(fitted, p, q, identification.unit) for fitted in (ar, model)]
    columns += (
        _make_online_columns(identification, p, q) if identification.online is not None else []
    )
    names = [*(f"φ{i + 1}" for i in range(p)), *(f"θ{j + 1}" for j in range(q)), "constant"]
    labels = [*names, "innovation", "condition"]
    head = (
        "",
        f"{model_name(ar.order)}, {ar.method}",
        f"{model_name(model.order)}, {model.method}",
        *(("online", "apart [s.e.]") if identification.online is not None else ()),
    )
    note = _ONLINE_NOTE if identification.online is not None else ""
    return Table("Coefficients", head, tuple(zip(labels, *columns, strict=True)), note=note)


def _make_column(model: ArmaModel, p: int, q: int, unit: str) -> list[str]:
    """Return a model's cells; they are blank for coefficients that only larger models have."""
    errors = model.standard_errors
    split = model.order[0]
    phi = [format_with_error(v, e) for v, e in zip(model.phi, errors[:split], strict=True)]
    theta = [format_with_error(v, e) for v, e in zip(model.theta, errors[split:-1], strict=True)]
    return [
        *_pad_cells(phi, p),
        *_pad_cells(theta, q),
        f"{format_with_error(model.constant, errors[-1])} {unit}",
        f"{format_significant(float(np.sqrt(model.sigma2)), 5)} {unit}",
        format_significant(model.condition, 3),
    ]


def _make_online_columns(identification: Identification, p: int, q: int) -> list[list[str]]:
    assert identification.online is not None
    last, split = identification.online.last, identification.model.order[0]
    values = [f"{value:.4f}" for value in last[:-1]]
    distances = [
        f"{value:+.2f}" if np.isfinite(value) else "-" for value in identification.online.distance
    ]
    constant = f"{format_significant(last[-1], 4)} {identification.unit}"
    return [
        [*_pad_cells(values[:split], p), *_pad_cells(values[split:], q), constant, "", ""],
        [*_pad_cells(distances[:split], p), *_pad_cells(distances[split:], q), "", "", ""],
    ]


def _pad_cells(cells: list[str], count: int) -> list[str]:
    return cells + [""] * (count - len(cells))


def _make_residuals_table(identification: Identification) -> Table:
    white, lags = identification.whiteness, identification.whiteness.correlogram.lags.size
    slow = identification.slow_ratio
    rows = (
        (
            "lags beyond the 5 % bounds",
            f"{white.outside_count} of {lags}, {0.05 * lags:g} expected",
        ),
        ("variance still predictable", format_percent(white.predictable)),
        ("white", "yes" if white.white else "no"),
        ("slow variance over the model's", "-" if np.isnan(slow) else format_significant(slow, 2)),
    )
    return Table(f"Residuals of {model_name(identification.model.order)}", (), rows, words=2)


def format_identify(identifications: Sequence[Identification]) -> str:
    """Return the tables and the verdict of every axis, at most `WIDTH` characters wide."""
    return "\n\n\n".join(
        "\n\n".join(_format_parts(identification)) for identification in identifications
    )


def format_identification(identification: Identification) -> str:
    """Return the tables and the verdict of one axis."""
    return format_identify([identification])


def _format_parts(identification: Identification) -> Iterator[str]:
    title = f"{identification.name} [{identification.unit}]"[: width()]
    yield f"{title}\n{'=' * len(title)}"
    yield f"Verdict\n{bullet_list(identification.verdict)}"
    yield from map(as_text, identification_tables(identification))
