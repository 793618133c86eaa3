"""Every way that a log can take through a filter: functions of a log and a method to answers.

A log is an array (n, k) with NaN for missing samples, and so are its answers.
"""

import copy
import pickle

import numpy as np

import zerorate as zr
from support.streams import lines_of, streamed_apart
from zerorate.tasks.live import LineStream, Settings

RATE = 100.0
N = 2200
CHANNELS = 9
SILENT = 1
MOTION = slice(600, 800)
MIDDLE = 700

# As wherever the unit is known to be deg/s.
LIMITS = {"rest_limit": 10.0, "bias_limit": 20.0}
METHODS = {
    "kf": {"method": "kf", "output": "estimate"},
    "akf": {"method": "akf"},
    "fading": {"method": "fading", "output": "estimate"},
    # What nothing else is asked for.
    "auto": LIMITS,
    "holding": {"method": "fading", "motion": "hold"},
}


def log():
    """Nine channels that rest, turn and rest, each with gaps of its own; one never answers."""
    rng = np.random.default_rng(5)
    z = np.linspace(-2.0, 2.0, CHANNELS) + 0.1 * rng.standard_normal((N, CHANNELS))
    z[MOTION] += 30.0 * np.sin(np.arange(200) / 9.0)[:, None]
    z[rng.random(z.shape) < 0.01] = np.nan
    for channel in range(CHANNELS):
        begin = 60 + 197 * channel
        z[begin : begin + 10 * channel, channel] = np.nan
    z[:, SILENT] = np.nan
    return z


def make(method, channels=CHANNELS):
    return zr.DriftFilter(RATE, channels=channels, **METHODS[method])


def alone(z, method):
    """Each channel by itself, one float at a time: what all others are compared to."""
    filters = [make(method, None) for _ in z.T]
    return np.array(
        [[f.update(x) for f, x in zip(filters, row, strict=True)] for row in z.tolist()]
    )


def row_by_row(z, method):
    f = make(method)
    return np.array([f.update(row) for row in z])


def row_by_row_of_lists(z, method):
    f = make(method)
    return np.array([f.update(row) for row in z.tolist()])


def whole(z, method):
    return make(method).process(z)


def in_pieces(z, method):
    f = make(method)
    cuts = np.sort(np.random.default_rng(6).integers(0, N, 20))
    return np.concatenate([f.process(piece) for piece in np.split(z, cuts)])


def side_by_side(width):
    """So many channels in a filter, the rest in further ones."""

    def road(z, method):
        groups = [z[:, first : first + width] for first in range(0, CHANNELS, width)]
        return np.hstack([make(method, g.shape[1]).process(g) for g in groups])

    return road


def on_threads(count):
    return lambda z, method: make(method).process(z, threads=count)


def into_itself(z, method):
    out = z.copy()
    return make(method).process(out, out=out)


def into_every_second_column(z, method):
    out = np.zeros((N, 2 * CHANNELS))[:, ::2]
    return make(method).process(z, out=out)


def of_every_second_row(z, method):
    spread = np.repeat(z, 2, axis=0)[::2]
    assert not spread.flags.c_contiguous
    return make(method).process(spread)


def traced(z, method):
    trace = make(method).trace(z)
    return trace.estimate if "output" in METHODS[method] else z - trace.bias


def handed_on(go_on):
    """Something else goes on in the middle of the motion."""

    def road(z, method):
        first = make(method)
        begin = first.process(z[:MIDDLE])
        return np.concatenate([begin, go_on(first, z[MIDDLE:])])

    return road


def process(f, z):
    """Go on in another process, which can import this module."""
    return f.process(z)


def by_lines(z, method):
    stream = LineStream(Settings(RATE, **METHODS[method]))
    return numbers(map(stream.take, lines_of(z)))


def by_lines_of_two_streams(z, method):
    first, lines = LineStream(Settings(RATE, **METHODS[method])), lines_of(z)
    begin = [first.take(line) for line in lines[:MIDDLE]]
    second = LineStream.from_bytes(first.to_bytes())
    return numbers([*begin, *map(second.take, lines[MIDDLE:])])


def by_pipes(z, method, checkpoint):
    """Two processes in turn, the second from the checkpoint of the first."""
    begin = options(method)
    answers = []
    for lines in (lines_of(z[:MIDDLE]), lines_of(z[MIDDLE:])):
        code, more, errors = streamed_apart(
            lines, *begin, "--rate", RATE, "--checkpoint", checkpoint
        )
        told = errors.splitlines()
        assert (code, told[0]) == (
            0,
            f"zerorate: no header: all {CHANNELS} columns are filtered as gyros",
        )
        # The first samples of a motion are outliers in their tick.
        assert all(line.startswith("zerorate: left out as outliers: ") for line in told[1:]), errors
        answers += more
    return numbers(answers)


def options(method):
    """The method on the command line."""
    asked = METHODS[method]
    names = {"output": "output-kind"}
    words = [(names.get(name, name).replace("_", "-"), str(asked[name])) for name in asked]
    return [word for name, value in words for word in (f"--{name}", value)]


def numbers(answers):
    return np.array([[float(cell) for cell in answer.split(",")] for answer in answers])


IN_PYTHON = {
    "row by row": row_by_row,
    "row by row of lists": row_by_row_of_lists,
    "whole": whole,
    "in pieces": in_pieces,
    **{f"{width} side by side": side_by_side(width) for width in (1, 2, 3, 5, 8, 9)},
    **{f"{count} threads": on_threads(count) for count in (1, 2, 3, 7)},
    "into itself": into_itself,
    "into every second column": into_every_second_column,
    "of every second row": of_every_second_row,
    "traced": traced,
    "copied": handed_on(lambda f, z: f.copy().process(z)),
    "copied deeply": handed_on(lambda f, z: copy.deepcopy(f).process(z)),
    "pickled": handed_on(lambda f, z: pickle.loads(pickle.dumps(f)).process(z)),
    "as bytes": handed_on(lambda f, z: zr.DriftFilter.from_bytes(f.to_bytes()).process(z)),
    "by lines": by_lines,
    "by lines of two streams": by_lines_of_two_streams,
}
