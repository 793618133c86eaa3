"""Tables 4 and 5 of Fu & Han (2019), and the same measures for other recordings.

Any strong low-pass filter reduces the deviation at rest. The tables therefore add the error of
coasting with the estimate and, in motion, the delay.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

import zerorate as zr
from recordings import Floats, Recording, Turning, at_rest, check_folder, parser, turning
from tables import table
from zerorate import metrics

Method = Literal["kf", "akf", "fading"]

METHODS: tuple[Method, ...] = ("kf", "akf", "fading")
HORIZONS = (10.0, 60.0)
GAINS = np.logspace(-5.0, 0.0, 21)
WINDOWS, DEGREE = (5, 7, 9), 4

PUBLISHED_AT_REST = (
    ("MTi-100", "-0.353", "0.078", "0.037", "0.019", "0.009"),
    ("3DM-GX4-25", "0.071", "0.197", "0.195", "0.099", "0.013"),
)
PUBLISHED_SWING = (
    ("MTi-100", "4.844", "0.377", "0.333", "0.315", "0.275"),
    ("3DM-GX4-25", "5.092", "0.323", "0.321", "0.317", "0.269"),
)
PUBLISHED_HEAD = ("sensor", "mean", "raw", "KF", "AKF", "theirs")


def moving_average(z: Floats, gain: float) -> Floats:
    """Return the exponential moving average, which starts as the plain mean."""
    n = min(math.ceil(1.0 / gain), len(z))
    count = np.maximum(np.isfinite(z[:n]).cumsum(axis=0), 1)
    begin = np.nancumsum(z[:n], axis=0) / count
    rest = metrics.equal_delay_lowpass(np.concatenate((begin[-1:], z[n:])), 1.0, 1.0 / gain - 1.0)
    return np.concatenate((begin[:-1], rest))


def best_average(z: Floats, rate: float) -> tuple[Floats, Floats, Floats]:
    """Return the best average of each axis, its gain, and its coasting error at 10 s."""
    averages = [moving_average(z, gain) for gain in GAINS]
    errors = np.array([metrics.coasting_error(z, x, rate, HORIZONS[0]) for x in averages])
    best = errors.argmin(axis=0)
    chosen = np.stack([averages[i][:, axis] for axis, i in enumerate(best)], axis=1)
    return chosen, GAINS[best], errors.min(axis=0)


def filtered(z: Floats, rate: float, method: Method) -> Floats:
    """Return the output of a published method with its default settings, for several axes."""
    return np.asarray(published(rate, method, z.shape[1]).process(z, threads=z.shape[1]))


def published(rate: float, method: Method, axes: int, process_noise: float = 0.1) -> zr.DriftFilter:
    """Return the filter of the paper, with the smoothed rate as its output."""
    return zr.DriftFilter(
        rate,
        method=method,
        order=(2, 1),
        process_noise=process_noise,
        output="estimate",
        channels=axes,
    )


RANKING_HEAD = ("recording", "axes", "fading least", "akf below kf", "both", "fading of raw")


def ranking_rows(recordings: Sequence[Recording]) -> list[Sequence[str]]:
    """Return the number of axes of each recording with deviations in the published order."""
    rows: list[Sequence[str]] = []
    axes: list[Floats] = []
    for recording in recordings:
        z, rate = recording.z, recording.rate
        kept = np.array(
            [np.atleast_1d(metrics.reduction(z, filtered(z, rate, m))) for m in METHODS]
        )
        axes.append(kept)
        rows.append((recording.name, *_ranking(kept)))
    return [*rows, ("all", *_ranking(np.concatenate(axes, axis=1)))]


def _ranking(kept: Floats) -> Sequence[str]:
    kf, akf, fading = kept
    least, below = fading < np.minimum(kf, akf), akf < kf
    counts = (fading.size, least.sum(), below.sum(), (least & below).sum())
    return (*(f"{count}" for count in counts), f"{fading.min():.2f} to {fading.max():.2f}")


NOISE_HEAD = ("recording", "axis", "R kf / R akf", "kf of raw", "akf of raw")


def noise_rows(recording: Recording) -> list[Sequence[str]]:
    """Return each axis' noise of the start-up over the noise of the record, and the effect."""
    z, methods = recording.z, METHODS[:2]
    banks = [published(recording.rate, m, z.shape[1]) for m in methods]
    kept = [np.atleast_1d(metrics.reduction(z, bank.process(z))) for bank in banks]
    ratio = banks[0].measurement_noise / banks[1].measurement_noise
    return [
        (recording.name, axis, f"{ratio[i]:.2f}", *(f"{values[i]:.3f}" for values in kept))
        for i, axis in enumerate(recording.axes)
    ]


def rest_rows(recording: Recording) -> list[Sequence[str]]:
    """Return a row for each axis and filter; raw is first, the best average is last."""
    z, rate = recording.z, recording.rate
    average, gains, _ = best_average(z, rate)
    estimates = {"raw": z}
    estimates.update((m, filtered(z, rate, m)) for m in METHODS)
    estimates["average"] = average
    columns = [_rest_columns(z, x, rate) for x in estimates.values()]
    rows: list[Sequence[str]] = []
    for axis, label in enumerate(recording.axes):
        names = [*list(estimates)[:-1], f"best average, gain {gains[axis]:.1e}"]
        for name, values in zip(names, columns, strict=True):
            rows.append((label, name, *(column[axis] for column in values)))
    return rows


REST_HEAD = ("axis", "filter", "mean", "deviation", "of raw", "coasting 10 s", "coasting 60 s")


def _rest_columns(z: Floats, x: Floats, rate: float) -> list[list[str]]:
    """Return mean, deviation, its ratio to raw, and the coasting errors, for every axis."""
    coasting = [
        np.atleast_1d(metrics.coasting_error(z, x, rate, horizon))
        if round(horizon * rate) < len(z)
        else np.full(z.shape[1], np.nan)
        for horizon in HORIZONS
    ]
    ratio = np.atleast_1d(metrics.reduction(z, x))
    mean, deviation = np.nanmean(x, axis=0), np.nanstd(x, axis=0)
    digits = (3, 3, 2, 3, 3)
    return [
        [_number(value, n) for value in values]
        for values, n in zip((mean, deviation, ratio, *coasting), digits, strict=True)
    ]


def reference_rate(recording: Turning, window: int) -> Floats:
    """Return the shaft's rate in deg/s, from a polynomial through the angles around each sample.

    Seven samples and a fourth-degree polynomial keep the 13 Hz vibration of the stepper motor. A
    wider window would count this motion as noise of the gyro.
    """
    half = window // 2
    powers = np.vander(np.arange(-half, half + 1), DEGREE + 1, increasing=True)
    slope = np.linalg.pinv(powers)[1]
    rate = np.full(len(recording.angle), np.nan)
    rate[half:-half] = np.correlate(recording.angle, slope, "valid") * recording.rate
    return rate


def scaled(reference: Floats, recording: Turning) -> tuple[Floats, float]:
    """Return the reference in the gyro's scale, and this scale.

    The scale is a least-squares fit of the gyro to the rate and a constant. The rate is delayed
    like the gyro, because a lag would reduce the scale.
    """
    lag = float(metrics.delay(-reference, recording.z, recording.rate))
    late = _advanced(reference, -lag * recording.rate)
    there = np.isfinite(late) & np.isfinite(recording.z)
    design = np.column_stack((late[there], np.ones(there.sum())))
    scale = float(np.linalg.lstsq(design, recording.z[there], rcond=None)[0][0])
    return scale * reference, scale


def _advanced(x: Floats, samples: float) -> Floats:
    """Return x earlier by a number of samples (also fractional), with NaN beyond its ends."""
    k, there = np.arange(len(x)), np.isfinite(x)
    moved: Floats = np.interp(k + samples, k[there], x[there], left=np.nan, right=np.nan)
    return moved


def turning_rows(recording: Turning, window: int) -> tuple[list[Sequence[str]], float]:
    """Return a row for each filter, first raw, and the scale of the gyro."""
    reference, scale = scaled(reference_rate(recording, window), recording)
    z, rate = recording.z, recording.rate
    own = float(metrics.delay(reference, z, rate))
    estimates = {"raw": z}
    estimates.update((m, filtered(z[:, np.newaxis], rate, m)[:, 0]) for m in METHODS)
    rows: list[Sequence[str]] = []
    for name, x in estimates.items():
        late = float(metrics.delay(reference, x, rate))
        residual = x - reference
        rival = metrics.equal_delay_lowpass(z, rate, max(late - own, 0.0))
        values = (
            float(np.nanmean(x)),
            float(np.nanstd(residual)),
            1e3 * late,
            *_errors(reference, x, rate),
            *_errors(reference, rival, rate),
        )
        digits = (3, 2, 1, 2, 2, 2, 2)
        rows.append((name, *(_number(v, n) for v, n in zip(values, digits, strict=True))))
    return rows, scale


def _errors(reference: Floats, x: Floats, rate: float) -> tuple[float, float]:
    """Return the RMSE relative to the reference, with and without the delay."""
    late = float(metrics.delay(reference, x, rate))
    in_time = _advanced(x, late * rate)
    return float(metrics.rmse(reference, x)), float(metrics.rmse(reference, in_time))


TURNING_HEAD = (
    "filter",
    "mean",
    "residual deviation",
    "delay ms",
    "RMSE",
    "delay removed",
    "low-pass RMSE",
    "low-pass, delay removed",
)


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "–"


def print_tables(folder: Path, seconds: float, window: int, markdown: bool) -> None:
    """Print the published values, then the values of the recordings."""
    recordings = at_rest(folder, seconds)
    ranking = ranking_rows(recordings)
    print(
        table("Published ranking at rest, axes on which it holds", RANKING_HEAD, ranking, markdown)
    )
    print(table("Published, at rest, deg/s", PUBLISHED_HEAD, PUBLISHED_AT_REST, markdown))
    for recording in recordings:
        length = len(recording.z) / recording.rate
        title = f"{recording.name}, at rest, {round(length, 1):g} s, deg/s and deg"
        print(table(title, REST_HEAD, rest_rows(recording), markdown))
    noise = [row for recording in recordings for row in noise_rows(recording)]
    print(table("Measurement noise R: first second / whole record", NOISE_HEAD, noise, markdown))
    print(table("Published, 5 deg/s swing, deg/s", PUBLISHED_HEAD, PUBLISHED_SWING, markdown))
    shaft = turning(folder, seconds)
    rows, scale = turning_rows(shaft, window)
    title = f"{shaft.name}, turning at 50 deg/s, gyro = {scale:.3f} × encoder, deg/s"
    print(table(title, TURNING_HEAD, rows, markdown))


def main() -> None:
    """Run from the command line."""
    options = parser(__doc__)
    options.add_argument("--markdown", action="store_true", help="print tables in Markdown")
    options.add_argument(
        "--window",
        type=int,
        choices=WINDOWS,
        default=7,
        help="samples of the encoder from which the reference rate is made (default: 7)",
    )
    given = options.parse_args()
    check_folder(given.folder)
    print_tables(given.folder, given.seconds, given.window, given.markdown)


if __name__ == "__main__":
    main()
