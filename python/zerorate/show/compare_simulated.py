"""Regret of methods on simulated gyros, as text tables."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.numerals import format_significant
from zerorate.show.compare_tables import explain_acausal, format_compare, mark_method
from zerorate.show.tables import Table, as_text
from zerorate.tasks.compare.simulated import Regret
from zerorate.tasks.compare.task import Compared

_MEANING_NOTE: Final = (
    "Regret: RMSE to the true drift, divided by that of the Kalman filter with the true model "
    "(column 'optimum'). 1 is perfect."
)
_TRANSIENT_NOTE: Final = "Only the optimum has the drift's time constant; not in mean and worst."
_COVERAGE_NOTE: Final = (
    "Share of times at which the mean drift over the next 10 s is within the method's one sigma: "
    "0.683 if sigma is right."
)


def format_compared(result: Compared, per_axis: bool = False) -> str:
    """Return the tables of recordings, then the tables of simulated gyros."""
    parts = [format_compare(result.comparisons, per_axis)] if result.comparisons else []
    return "\n\n".join((*parts, *map(format_regret, result.simulated)))


def format_regret(regret: Regret) -> str:
    """Return tables with a row for each model and a column for each method.

    Parameters
    ----------
    regret : Regret
        Result to show.

    Returns
    -------
    str
        Lines without a final line end. They show the regret with its mean and maximum. For methods
        with a standard deviation they show the coverage. Models with a decaying drift are listed
        separately.

    Examples
    --------
    >>> from zerorate.tasks.compare.simulated import run
    >>> from zerorate.simulation.models import MODELS
    >>> found = run(["mean"], models=MODELS[:1], seeds=1, duration=9.0, score_from=8.0)
    >>> format_regret(found).splitlines()[1].split()
    ['model', 'optimum', '(deg/s)', 'mean']
    """
    return "\n\n".join(as_text(table) for table in _make_tables(regret))


def _make_tables(regret: Regret) -> Iterator[Table]:
    head = ("model", "optimum (deg/s)", *map(mark_method, regret.methods, regret.causal))
    lasting = regret.lasting_mask
    faults = "" if regret.contamination is None else f", {regret.contamination}"
    summary = (_make_row("mean", "", regret.mean), _make_row("worst", "", regret.worst))
    if lasting.any():
        causal = dict(zip(regret.methods, regret.causal.tolist(), strict=True))
        note = " ".join((_MEANING_NOTE, *(f"{text}." for text in explain_acausal(causal))))
        yield Table(f"regret{faults}", head, (*_make_rows(regret, lasting), *summary), note=note)
    if not lasting.all():
        yield Table(
            f"regret, transient{faults}",
            head,
            tuple(_make_rows(regret, ~lasting)),
            note=_TRANSIENT_NOTE,
        )
    columns = np.flatnonzero(~np.isnan(regret.coverage).all(axis=0))
    if columns.size:
        names = ("model", *(regret.methods[i] for i in columns))
        yield Table(
            f"coverage{faults}",
            names,
            tuple(_make_coverage_rows(regret, columns)),
            note=_COVERAGE_NOTE,
        )


def _make_rows(regret: Regret, mask: npt.NDArray[np.bool_]) -> Iterator[tuple[str, ...]]:
    for i in np.flatnonzero(mask):
        yield _make_row(regret.models[i].name, f"{regret.optimum[i]:.5f}", regret.regret[i])


def _make_coverage_rows(regret: Regret, columns: npt.NDArray[np.intp]) -> Iterator[tuple[str, ...]]:
    for model, shares in zip(regret.models, regret.coverage[:, columns], strict=True):
        cells = ("-" if np.isnan(share) else f"{share:.2f}" for share in shares)
        yield (model.name, *cells)


def _make_row(
    name: str, optimum: str, values: Sequence[float] | npt.NDArray[np.float64]
) -> tuple[str, ...]:
    return (name, optimum, *(format_significant(float(value)) for value in values))
