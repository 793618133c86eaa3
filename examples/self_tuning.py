"""Self-tuning filter on recordings: duration of the start, behaviour in motion; with figures.

python examples/self_tuning.py [FOLDER] [--seconds S]

The column vqf needs ``pip install vqf``. Without it the column is left out.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

import zerorate as zr
from recordings import (
    BROAD,
    BROAD_RATE,
    Recording,
    at_rest,
    check_folder,
    parser,
    sensors_alone,
)
from tables import table
from zerorate._native import exponential_mean
from zerorate.show import save_figure
from zerorate.show.scales import MAX_COLUMNS, column_quantiles, split_into_parts
from zerorate.show.stack import (
    Stack,
    draw_band,
    draw_with_sigma,
    find_spans,
    shade,
    share_time_axis,
    write_head,
    write_names,
)
from zerorate.show.style import AXIS_COLOURS, BLACK, BLUE, FONT_PT, new_figure, style_panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = npt.NDArray[np.float64]

FIGURES = Path(__file__).parents[1] / "docs" / "figures"
RATE = 100.0
LIMITS = {"rest_limit": 10.0, "bias_limit": 20.0}
"""Limits of rest and bias, deg/s, as the commands set them for a known unit."""
FIRST_REST = 300
"""Sample from which a bias is drawn; before it the bias is unknown."""
WHITE, WALK = 0.01, 3e-4  # deg/s/sqrt(Hz), deg/s/sqrt(s)
AFTER = np.array([0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 90.0, 120.0, 180.0])
HORIZON = 10.0
SHORT = (60.0, 120.0, 180.0, 300.0)
MOST_PIECES = 40
GAINS = np.logspace(-5.0, -1.0, 25)
NEAR = 0.05
"""Bias accuracy that a start must reach, deg/s."""


@dataclass(frozen=True)
class Starts:
    """Results of a filter that is started at many moments of a record, after some time."""

    coasting: Floats
    """RMS angle after coasting for `HORIZON`, deg, shape (AFTER,)."""
    settled: Floats
    """Time of each start to within `NEAR` of the best estimate of the whole record, s."""


def main() -> None:
    """Print the tables and draw the figures."""
    options = parser(__doc__)
    arguments = options.parse_args()
    check_folder(arguments.folder)
    learning()
    for recording in sensors_alone(arguments.folder, arguments.seconds):
        starting(recording)
        pieces(recording)
    pieces(at_rest(arguments.folder, arguments.seconds)[2])
    orientation(arguments.folder / BROAD)


def learner(rate: float, channels: int | None = None, **limits: float) -> zr.DriftFilter:
    """Return a self-tuning filter whose output is the bias."""
    return zr.DriftFilter(rate, method="auto", output="estimate", channels=channels, **limits)


def learning() -> None:
    """Draw the filter's results for a simulated gyro with a known drift."""
    model = zr.NoiseModel(angle_random_walk=WHITE, rate_random_walk=WALK)
    z, truth = zr.simulate(model, RATE, 1800.0, 4)
    trace = learner(RATE, **LIMITS).trace(z)
    some = slice(FIRST_REST, None, 50)
    t = np.arange(z.size)[some] / RATE
    figure = new_figure(180.0, 70.0)
    left = figure.add_axes((0.07, 0.16, 0.5, 0.75))
    above, below = (figure.add_axes((0.68, y, 0.3, 0.31)) for y in (0.6, 0.16))
    _drift(left, t, truth[some], trace.bias[some], trace.bias_sigma[some])
    density = np.sqrt(trace.measurement_noise[some] / RATE)
    strength = np.sqrt(trace.process_noise[some, 0, 0] * RATE)
    _learned(above, t, density, WHITE, "white noise N\n[deg/s/√Hz]")
    _learned(below, t, strength, WALK, "bias drift K\n[deg/s/√s]")
    above.set_title("the noise as learned")
    above.set_ylim(0.0, 1.6 * WHITE)
    below.set_yscale("log")
    below.set_xlabel("time [s]")
    style_panels([left, above, below])
    below.set_ylim(5e-5, 2e-2)
    below.set_yticks((1e-4, 1e-3, 1e-2))
    save_figure(figure, FIGURES / "auto_learns.png")


def _drift(axes: "Axes", t: Floats, truth: Floats, bias: Floats, sigma: Floats) -> None:
    band = {"color": BLUE, "alpha": 0.25, "lw": 0, "label": "bias of auto ± 2σ"}
    axes.fill_between(t, bias - 2 * sigma, bias + 2 * sigma, **band)
    axes.plot(t, truth, color=BLACK, lw=0.6, label="true bias")
    axes.plot(t, bias, color=BLUE, lw=0.9, label="bias of auto")
    spread = 6.0 * float(np.std(truth))
    axes.set_ylim(float(truth.mean()) - spread, float(truth.mean()) + spread)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("rate [deg/s]")
    axes.set_title("the bias, found under white noise of 0.1 deg/s (not shown)")
    axes.legend(fontsize=FONT_PT, frameon=False, loc="lower right")


def _learned(axes: "Axes", t: Floats, found: Floats, true: float, label: str) -> None:
    axes.plot(t, found, color=BLUE, lw=0.9, label="learned")
    axes.axhline(true, color=BLACK, lw=0.6, ls="--", label="true")
    axes.set_ylabel(label)
    axes.legend(fontsize=FONT_PT - 0.5, frameon=False, loc="upper right", ncols=2)


def starting(recording: Recording) -> None:
    """Print the time after which a new filter is as good as a filter that ran for long."""
    rows = []
    for i, axis in enumerate(recording.axes):
        z = recording.z[:, i]
        running = learner(recording.rate)
        estimate = running.process(z)
        cold = starts(z, recording.rate, learner(recording.rate), estimate)
        running.power_on()
        known = starts(z, recording.rate, running, estimate)
        best = _best(z, estimate, recording.rate)
        for name, found in (("cold", cold), ("power_on", known)):
            enough = AFTER[found.coasting <= 1.1 * best]
            first = f"{enough[0]:g}" if enough.size else f"over {AFTER[-1]:g}"
            ratios = (f"{c / best:.2f}" for c in found.coasting[[2, 4, 7, 9]])
            rows.append((axis, name, f"{np.median(found.settled):.2f}", first, *ratios))
    head = ("axis", "start", "to 0.05 deg/s, s", "to 1.1, s", "2 s", "10 s", "60 s", "120 s")
    title = f"{recording.name}: coasting error after a start over that of a filter long running"
    print(table(title, head, rows, markdown=True))


def starts(z: Floats, rate: float, ready: zr.DriftFilter, estimate: Floats) -> Starts:
    """Start a copy of a filter at every hundredth of a record."""
    length, coast = round(AFTER[-1] * rate), round(HORIZON * rate)
    begins = np.linspace(0, z.size - length - coast - 1, 60).astype(int)
    ends = np.round(AFTER * rate).astype(int)
    square, settled = np.zeros(AFTER.size), []
    for begin in begins:
        bias = ready.copy().process(z[begin : begin + length])
        for j, end in enumerate(ends):
            ahead = z[begin + end : begin + end + coast] - bias[end - 1]
            square[j] += (ahead.sum() / rate) ** 2
        error = bias - estimate[begin + length]
        settled.append(zr.metrics.settling_time(error, 0.0, NEAR, rate))
    return Starts(np.sqrt(square / begins.size), np.array(settled))


def _best(z: Floats, estimate: Floats, rate: float) -> float:
    late = slice(min(z.size // 3, round(AFTER[-1] * rate)), None)
    return float(zr.metrics.coasting_error(z[late], estimate[late], rate, HORIZON))


def pieces(recording: Recording) -> None:
    """Print the results on short records: pieces of a long record, each filtered separately."""
    rows = []
    for seconds in SHORT:
        n = round(seconds * recording.rate)
        for i, axis in enumerate(recording.axes):
            z = recording.z[:, i]
            starts = range(0, min(len(z) - n + 1, MOST_PIECES * n), n)
            found = np.mean([_piece(z[k : k + n], recording.rate) for k in starts], axis=0)
            auto, mean, best = found[0], found[1], found[2:].min()
            ratios = (f"{np.sqrt(auto / mean):.3f}", f"{np.sqrt(auto / best):.3f}")
            rows.append((axis, f"{seconds:g}", f"{len(starts)}", *ratios))
    title = f"{recording.name}, short pieces: coasting error over 10 s from a third of the piece on"
    head = ("axis", "length, s", "pieces", "over mean so far", "over best average")
    print(table(title, head, rows, markdown=True))


def _piece(z: Floats, rate: float) -> Floats:
    """Return squared coasting errors: auto, mean to date, and moving averages of many gains."""
    estimates = [learner(rate).process(z), zr.metrics.running_mean(z)]
    estimates += [exponential_mean(z, gain) for gain in GAINS]
    late = slice(len(z) // 3, None)
    errors = (zr.metrics.coasting_error(z[late], x[late], rate, HORIZON) for x in estimates)
    return np.array([float(error) ** 2 for error in errors])


def orientation(path: Path) -> None:
    """Print and draw a hand-moved gyro next to an optical reference."""
    log = zr.read_log(path, rate=BROAD_RATE)
    columns = zr.read_log(path, rate=BROAD_RATE, columns=[f"ref_quat_{a}" for a in "wxyz"])
    trace = learner(BROAD_RATE, channels=3).trace(log.data)
    biases = {
        "raw": np.zeros(3),
        "mean of the first 10 s": log.data[: round(10 * BROAD_RATE)].mean(axis=0),
        "auto": trace.bias,
        **_vqf(path, log),
    }
    horizons = (1.0, 10.0, 60.0)
    rows = []
    for name, bias in biases.items():
        error = zr.metrics.orientation_error_growth(
            log.data - bias, columns.data, BROAD_RATE, horizons
        )
        rows.append((name, *(f"{np.degrees(e):.3g}" for e in np.atleast_1d(error))))
    title = "myon aktos-t, moved by hand: growth of the orientation error, deg"
    print(table(title, ("filter", *(f"{h:g} s" for h in horizons)), rows, markdown=True))
    motion_figure(log)


def _vqf(path: Path, log: zr.Log) -> dict[str, Floats]:
    try:
        from vqf import VQF
    except ImportError:
        return {}
    force = zr.read_log(path, rate=BROAD_RATE, columns=[f"accel_{a}_mps2" for a in "xyz"])
    out = VQF(1.0 / BROAD_RATE).updateBatch(
        np.ascontiguousarray(log.data), np.ascontiguousarray(force.data)
    )
    return {"vqf, with accelerometer": out["bias"]}


def _means(t: Floats, z: Floats, rate: float) -> Floats:
    """Return times and values of the means of whole seconds."""
    length = round(rate)
    whole = z.size // length * length
    return np.stack([x[:whole].reshape(-1, length).mean(axis=1) for x in (t, z)])


def motion_figure(log: zr.Log) -> None:
    """Draw one axis, its bias, and the detected motion."""
    z = np.degrees(log.data[:, 2])
    trace = learner(log.rate, **LIMITS).trace(z)
    t = np.arange(z.size) / log.rate
    few = split_into_parts(z.size, MAX_COLUMNS)
    few = few[t[few] > FIRST_REST / RATE]
    bias, sigma = trace.bias[few], trace.bias_sigma[few]
    caption = (
        "Grey: the filter sees motion, and holds the bias. Above: the middle 90 % of the samples."
    )
    answer = "It is learned at rest and held in motion; what is not known of it grows."
    stack = Stack("Does a moving gyro's bias stay known?", answer, caption, [22.0, 26.0])
    above, below = stack.add(), stack.add()
    drawn = column_quantiles(z)
    draw_band(above, drawn.middle / log.rate, drawn, AXIS_COLOURS[0], "")
    write_head(above, "rate about z [deg/s]")
    draw_with_sigma(below, t[few], bias, sigma, AXIS_COLOURS[1], "bias ± 2σ")
    dots = {"color": BLACK, "ls": "", "marker": "o", "ms": 1.3, "mew": 0.0}
    below.plot(*_means(t, z, log.rate), label="means of 1 s, raw", **dots)
    middle, reach = float(np.median(bias)), 5.0 * float(sigma.max())
    below.set_ylim(middle - reach, middle + reach)
    write_head(below, "the same, magnified [deg/s]")
    write_names(below)
    for axes in (above, below):
        begins, ends = find_spans(~trace.at_rest)
        shade(axes, begins / log.rate, ends / log.rate)
    share_time_axis(stack.panels, 0.0, float(t[-1]), "s")
    save_figure(stack.finish("BROAD, trial 5", log.rate, log.duration), FIGURES / "auto_motion.png")


if __name__ == "__main__":
    main()
