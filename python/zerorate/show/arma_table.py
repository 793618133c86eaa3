"""Coefficients of an ARMA model as plain text."""

from collections.abc import Iterator

from zerorate.identification.arma_model import ArmaModel
from zerorate.show.tables import wrap_prose

Row = tuple[str, str, str]


def format_arma_model(model: ArmaModel) -> str:
    """Return aligned lines with coefficient, value ± error, and t, followed by the notes."""
    rows = list(_rows(model))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    return "\n".join([_format_head(model), *lines, *map(_format_note, model.notes)])


def _format_note(note: str) -> str:
    return wrap_prose(f"note: {note}", hang="  ")


def _format_head(model: ArmaModel) -> str:
    samples = f", {model.n} innovations" if model.n else ""
    return f"{arma_name(model)}{samples}"


def arma_name(model: ArmaModel) -> str:
    """Return the order of a model, and its origin."""
    p, q = model.order
    return f"ARMA({p}, {q}) {'as' if model.method == 'given' else 'by'} {model.method}"


def _rows(model: ArmaModel) -> Iterator[Row]:
    p, q = model.order
    names = [f"phi_{i}" for i in range(1, p + 1)] + [f"theta_{j}" for j in range(1, q + 1)]
    names += ["constant"] if model.has_constant else []
    values = [*model.phi.tolist(), *model.theta.tolist(), model.constant]
    # Without a constant, skip the last value and its error.
    for name, value, error in zip(names, values, model.standard_errors.tolist(), strict=False):
        yield _row(name, value, error)
    yield "sigma^2", f"{model.sigma2:.6g}", ""


def _row(name: str, value: float, error: float) -> Row:
    if not error > 0.0:
        return name, f"{value:.6g}", ""
    return name, f"{value:.6g} ± {error:.2g}", f"t = {value / error:.3g}"
