"""Offline identifications of Bao & Yuan and of Fu & Han (2019), on recordings at rest.

The papers report orders and coefficients. The tables here add the errors of the coefficients, the
effect of smoothing, and the remaining structure of the residuals.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

import zerorate as zr
from recordings import Floats, Recording, at_rest, check_folder, parser, sensors_alone
from tables import table
from zerorate import identification

SAMPLES, SEGMENTS = 15_000, 100
WIDTH = 5
HIGHEST = 20
LEARNED_AFTER = 120.0

Row = tuple[str, ...]

STATIONARY_HEAD = ("recording", "axis", "λ of means", "λ of variances")


def stationary_rows(recording: Recording) -> list[Row]:
    """Return the results of the reverse arrangements test on the first samples of each axis."""
    rows = []
    for axis, z in axes(recording, SAMPLES):
        arrangements = identification.reverse_arrangements
        tests = [arrangements(z, SEGMENTS, of=of) for of in ("mean", "variance")]
        rows.append((recording.name, axis, *(f"{test.z_score:.2f}" for test in tests)))
    return rows


SMOOTHED_HEAD = ("recording", "axis", "φ1 as it is", "φ1 smoothed", "FPE least", "FPE clear")


def smoothed_rows(recording: Recording) -> list[Row]:
    """Return AR(1) before and after a moving average, and the order by the final error."""
    rows = []
    for axis, z in axes(recording, SAMPLES):
        smooth = identification.moving_average(z, WIDTH)
        models = [identification.fit_ar(record, 1) for record in (z, smooth)]
        orders = identification.select_order(z, kind="ar", criterion="fpe", max_order=HIGHEST)
        cells = (with_error(model.phi[0], model.standard_errors[0], 4) for model in models)
        rows.append((recording.name, axis, *cells, f"{orders.minimum[0]}", f"{orders.clear[0]}"))
    return rows


ORDERS_HEAD = ("recording", "axis", "least", "clear", "AR", "predictable", "slow over model")


def order_rows(recording: Recording) -> list[Row]:
    """Return the orders that AIC selects, and the effect of the clear order."""
    rows = []
    for axis, z in axes(recording):
        found = identification.identify(z, recording.rate, max_order=HIGHEST)
        orders = (found.arma_orders.minimum, found.arma_orders.clear)
        left = f"{100.0 * found.whiteness.predictable:.2f} %"
        names = (*(order(chosen) for chosen in orders), f"{found.ar_orders.clear[0]}")
        rows.append((recording.name, axis, *names, left, f"{found.slow_ratio:.1f}"))
    return rows


MODEL_HEAD = ("recording", "axis", "φ1", "φ2", "θ1", "condition")


def model_rows(recording: Recording) -> list[Row]:
    """Return Fu and Han's ARMA(2, 1) for each axis, with errors."""
    rows = []
    for axis, z in axes(recording):
        model = identification.fit_arma(z, 2, 1)
        values = (*model.phi, *model.theta)
        cells = (with_error(v, s, 4) for v, s in zip(values, model.standard_errors, strict=False))
        rows.append((recording.name, axis, *cells, f"{model.condition:.1e}"))
    return rows


ONLINE_HEAD = ("recording", "axis", "order", "offline", "online, 120 s", "online, whole")


def online_rows(recording: Recording) -> list[Row]:
    """Return offline and online coefficients after two minutes and after the whole record."""
    rows = []
    for axis, z in axes(recording):
        for p, q in ((2, 0), (2, 1)):
            model = identification.fit_arma(z, p, q)
            early = round(LEARNED_AFTER * recording.rate)
            online = zr.identification.RecursiveLeastSquares(order=(p, q))
            online.process(z[:early])
            after = listed(online.coefficients[:-1])
            online.process(z[early:])
            offline = listed((*model.phi, *model.theta))
            whole = listed(online.coefficients[:-1])
            rows.append((recording.name, axis, order((p, q)), offline, after, whole))
    return rows


def axes(recording: Recording, n: int | None = None) -> list[tuple[str, Floats]]:
    """Return the first samples of each axis, with its name."""
    columns = np.ascontiguousarray(recording.z[:n].T)
    return list(zip(recording.axes, columns, strict=True))


def order(found: tuple[int, int]) -> str:
    """Return orders as text."""
    return f"({found[0]}, {found[1]})"


def with_error(value: float, sigma: float, digits: int) -> str:
    """Return a number and its standard error."""
    return f"{value:.{digits}f} ± {sigma:.{digits}f}"


def listed(values: Sequence[float] | Floats) -> str:
    """Return coefficients as text."""
    return ", ".join(f"{value:.3f}" for value in values)


def print_tables(folder: Path, seconds: float, markdown: bool) -> None:
    """Print each table for the recordings that are long enough."""
    recordings = [r for r in at_rest(folder, seconds) if len(r.z) >= SAMPLES]
    alone = sensors_alone(folder, seconds)
    for title, head, rows, measured in (
        ("Reverse arrangements", STATIONARY_HEAD, stationary_rows, recordings),
        ("AR(1) as it is, and smoothed over 5", SMOOTHED_HEAD, smoothed_rows, recordings),
        ("Orders by AIC, whole records", ORDERS_HEAD, order_rows, recordings),
        ("ARMA(2, 1), whole records", MODEL_HEAD, model_rows, recordings),
        ("Offline and online", ONLINE_HEAD, online_rows, alone),
    ):
        found = [row for recording in measured for row in rows(recording)]
        print(table(title, head, found, markdown))


def main() -> None:
    """Run from the command line."""
    options = parser(__doc__)
    options.add_argument("--markdown", action="store_true", help="print tables in Markdown")
    given = options.parse_args()
    check_folder(given.folder)
    print_tables(given.folder, given.seconds, given.markdown)


if __name__ == "__main__":
    main()
