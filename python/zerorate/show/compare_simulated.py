"""The regret of methods on simulated gyros as tables of text."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.numerals import significant
from zerorate.show.compare_tables import format_compare, marked, on_looking_ahead
from zerorate.show.tables import Table, as_text
from zerorate.tasks.compare.simulated import Regret
from zerorate.tasks.compare.task import Compared

_MEANING: Final = (
    "Regret: RMSE to the true drift over that of the Kalman filter that knows the model, whose own "
    "RMSE is the column optimum. 1 is perfect."
)
_TRANSIENT: Final = "Only the optimum knows its time constant; not in mean and worst."
_HONEST: Final = "Share of errors within one sigma of the method: 0.683 if it is honest."


def format_compared(found: Compared, per_axis: bool = False) -> str:
    """Return the tables of recordings, then those of simulated gyros."""
    parts = [format_compare(found.comparisons, per_axis)] if found.comparisons else []
    return "\n\n".join((*parts, *map(format_regret, found.simulated)))


def format_regret(found: Regret) -> str:
    """Return tables with a row for each model and a column for each method.

    Parameters
    ----------
    found : Regret
        What to show.

    Returns
    -------
    str
        Lines without an end: regret with its mean and worst, models whose drift dies away apart,
        and the coverage of methods that give a sigma.

    Examples
    --------
    >>> from zerorate.tasks.compare.simulated import run
    >>> from zerorate.simulation.models import MODELS
    >>> found = run(["mean"], models=MODELS[:1], seeds=1, duration=9.0, score_from=8.0)
    >>> format_regret(found).splitlines()[1].split()
    ['model', 'optimum', '(deg/s)', 'mean']
    """
    return "\n\n".join(as_text(table) for table in _tables(found))


def _tables(found: Regret) -> Iterator[Table]:
    head = ("model", "optimum (deg/s)", *map(marked, found.methods, found.causal))
    lasting = found.lasting
    faults = "" if found.contamination is None else f", {found.contamination}"
    summary = (_row("mean", "", found.mean), _row("worst", "", found.worst))
    if lasting.any():
        causal = dict(zip(found.methods, found.causal.tolist(), strict=True))
        note = " ".join((_MEANING, *(f"{text}." for text in on_looking_ahead(causal))))
        yield Table(f"regret{faults}", head, (*_rows(found, lasting), *summary), note=note)
    if not lasting.all():
        yield Table(
            f"regret, transient{faults}", head, tuple(_rows(found, ~lasting)), note=_TRANSIENT
        )
    given = np.flatnonzero(~np.isnan(found.coverage).all(axis=0))
    if given.size:
        names = ("model", *(found.methods[i] for i in given))
        yield Table(f"coverage{faults}", names, tuple(_covered(found, given)), note=_HONEST)


def _rows(found: Regret, chosen: npt.NDArray[np.bool_]) -> Iterator[tuple[str, ...]]:
    for i in np.flatnonzero(chosen):
        yield _row(found.models[i].name, f"{found.optimum[i]:.5f}", found.regret[i])


def _covered(found: Regret, given: npt.NDArray[np.intp]) -> Iterator[tuple[str, ...]]:
    for model, shares in zip(found.models, found.coverage[:, given], strict=True):
        cells = ("-" if np.isnan(share) else f"{share:.2f}" for share in shares)
        yield (model.name, *cells)


def _row(
    name: str, optimum: str, values: Sequence[float] | npt.NDArray[np.float64]
) -> tuple[str, ...]:
    return (name, optimum, *(significant(float(value)) for value in values))
