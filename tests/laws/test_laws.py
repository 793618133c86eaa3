"""The laws of all that streams: each for every class of support/classes.py, setting and record."""

import copy
import pickle
import subprocess
import sys
from functools import partial
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.checks import named
from support.classes import (
    EXAMPLES,
    STREAMS,
    assert_same_answers,
    assert_same_state,
    example,
    in_unit,
    state,
)
from support.feeding import arguments_of, called, flat, joined, one_by_one, process
from support.records import hostile_records, mixed_record
from support.settings import METHODS, MOTIONS, ORDERS, OUTPUTS, RATE

BY_STREAM = pytest.mark.parametrize("stream", STREAMS.values(), ids=STREAMS)
SIDE_BY_SIDE = {name: stream for name, stream in STREAMS.items() if stream.side_by_side}
COPIES = {
    "bytes": lambda f: type(f).from_bytes(f.to_bytes()),
    "pickle": lambda f: pickle.loads(pickle.dumps(f)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "method": lambda f: f.copy(),
}


def assert_batch_is_sample_by_sample(make, z):
    batch, stream = make(), make()
    assert_same_answers(one_by_one(stream, z), process(batch, z))
    assert_same_state(stream, batch)


@pytest.mark.parametrize("stream", [stream for stream in STREAMS.values() if stream.told])
@given(data=st.data())
def test_the_text_of_an_object_makes_it_anew(stream, data):
    """A call that Python can read; what a filter was started with is too long to be shown."""
    f = stream.make(data.draw(stream.settings(data.draw(st.sampled_from(stream.channels)))))
    text = repr(f).replace("started(...", "started(f.start")
    assert eval(text, {"f": f, f.__class__.__name__: type(f)}).to_bytes() == f.to_bytes()


@pytest.mark.parametrize("name", EXAMPLES)
def test_batch_is_sample_by_sample(name):
    """Every example of every class, alone and as three channels."""
    z = EXAMPLES[name][0].wide(mixed_record())
    assert_batch_is_sample_by_sample(partial(example, name), z)
    if not EXAMPLES[name][0].side_by_side:
        return
    rows = np.stack([z, z[::-1], np.roll(z, 50, axis=0)], axis=1)
    assert_batch_is_sample_by_sample(partial(example, name, 3), rows)


@pytest.mark.parametrize("order", ORDERS, ids=str)
def test_batch_is_sample_by_sample_for_every_order(order):
    """Of a DriftFilter with every method, motion and output, and of least squares."""
    z, stream, model = mixed_record(), STREAMS["published"], STREAMS["least-squares"]
    for conduct in product(METHODS, MOTIONS, OUTPUTS):
        arguments = dict(zip(("method", "motion", "output"), conduct, strict=True))
        arguments |= {"rate": RATE, "order": order}
        with named(arguments):
            assert_batch_is_sample_by_sample(partial(stream.make, arguments), z)
    assert_batch_is_sample_by_sample(partial(model.make, {"order": order}), z)


@BY_STREAM
@given(data=st.data())
def test_pieces_are_the_whole(stream, data):
    """Two pieces, cut anywhere, and sample by sample."""
    arguments, z = data.draw(stream.settings(None)), data.draw(stream.records())
    cut = data.draw(st.integers(0, len(z)))
    whole, parts, single = (stream.make(arguments) for _ in range(3))
    expected = process(whole, z)
    assert_same_answers(joined([process(parts, z[:cut]), process(parts, z[cut:])]), expected)
    # No sample, no answer: of which type cannot be seen.
    if len(z):
        assert_same_answers(one_by_one(single, z), expected)
    assert_same_state(parts, whole)
    assert_same_state(single, whole)


@BY_STREAM
@given(data=st.data())
def test_a_copy_goes_on_equal(stream, data):
    """Copied in every way, after any sample, with and without channels; the copy is independent."""
    channels = data.draw(st.sampled_from(stream.channels))
    arguments, z = data.draw(stream.settings(channels)), data.draw(stream.records())
    z = z if channels is None else np.stack([z, z[::-1]], axis=1)
    cut = data.draw(st.integers(0, len(z)))
    f = stream.make(arguments)
    process(f, z[:cut])
    before, twins = f.to_bytes(), {way: make(f) for way, make in COPIES.items()}
    answers = {}
    for way, twin in twins.items():
        with named(way):
            assert_same_state(twin, f)
            assert repr(twin) == repr(f)
            answers[way] = process(twin, z[cut:])
            assert f.to_bytes() == before
    expected = process(f, z[cut:])
    for way, twin in twins.items():
        with named(way):
            assert_same_answers(answers[way], expected)
            assert_same_state(twin, f)


@BY_STREAM
@given(data=st.data())
def test_reset_is_a_new_one(stream, data):
    arguments, z = data.draw(stream.settings(None)), data.draw(stream.records())
    f = stream.make(arguments)
    process(f, z)
    twin, before = f.copy(), f.to_bytes()
    twin.reset()
    assert f.to_bytes() == before
    assert_same_state(twin, stream.make(arguments))


CONTINUE = """
import pickle
import sys

with open(sys.argv[1], "rb") as file:
    cases = pickle.load(file)
told = []
for kind, saved, method, rest in cases:
    f = kind.from_bytes(saved)
    answers = getattr(f, method)(*rest)
    # What the smoother of a navigation needs belongs to this process.
    told.append((answers[:1] if method == "process_arrays" else answers, f.to_bytes()))
with open(sys.argv[1], "wb") as file:
    pickle.dump(told, file)
"""


def test_another_process_goes_on_equal(tmp_path):
    """Every example of every class, with and without channels, after several samples each."""
    mixed = mixed_record()
    cuts = [0, 1, 2, 99, 100, 101, 333, len(mixed)]
    tried = [
        (name, c, cut)
        for name, (stream, _) in EXAMPLES.items()
        for c in stream.channels
        for cut in cuts
    ]
    cases, filters = [], []
    for name, channels, cut in tried:
        z = mixed if channels is None else np.stack([mixed, mixed[::-1]], axis=1)
        f, record = example(name, channels), EXAMPLES[name][0].wide(z)
        process(f, record[:cut])
        filters.append((f, record[cut:]))
        rest = arguments_of(f, record[cut:])
        cases.append((type(f), f.to_bytes(), called(f), rest))
    file = tmp_path / "cases"
    file.write_bytes(pickle.dumps(cases))
    subprocess.run([sys.executable, "-c", CONTINUE, file], check=True)
    told = pickle.loads(file.read_bytes())
    for what, (f, rest), (answers, saved) in zip(tried, filters, told, strict=True):
        with named(*what):
            assert_same_answers(flat(answers), process(f, rest))
            assert saved == f.to_bytes()


@BY_STREAM
@given(data=st.data())
def test_a_power_of_two_scales_without_rounding(stream, data):
    arguments, z = data.draw(stream.settings(None)), data.draw(stream.ordinary())
    a = 2.0 ** data.draw(st.integers(-stream.powers, stream.powers))
    plain, scaled = stream.make(arguments), stream.make(stream.in_unit(arguments, a))
    expected, got = process(plain, z), process(scaled, stream.times(z, a))
    if expected is not None:
        expected = in_unit(expected, stream.answer, a)
    assert_same_answers(got, expected)
    known = state(plain)
    for name, value in state(scaled).items():
        with named(name):
            assert_same_answers(value, in_unit(known[name], stream.properties[name], a))


@pytest.mark.parametrize("stream", SIDE_BY_SIDE.values(), ids=SIDE_BY_SIDE)
@given(data=st.data())
def test_channels_do_not_mix(stream, data):
    """Any number of them on any number of threads, and row by row, is each alone."""
    channels, threads = data.draw(st.integers(1, 5)), data.draw(st.integers(1, 8))
    arguments = data.draw(stream.settings(channels))
    columns = [data.draw(stream.records()) for _ in range(channels)]
    rows = min(map(len, columns))
    z = np.stack([column[:rows] for column in columns], axis=1)
    together, by_row = stream.make(arguments), stream.make(arguments)
    got = process(together, z, threads=threads)
    if rows:
        assert_same_answers(one_by_one(by_row, z), got)
        assert_same_state(by_row, together)
    known = state(together)
    for channel in range(channels):
        alone = stream.make(stream.one_of(arguments, channel))
        answers = process(alone, z[:, channel].copy())
        assert_same_answers(None if got is None else got[:, channel].copy(), answers)
        for name, value in state(alone).items():
            whole = known[name]
            if whole.ndim > value.ndim:
                whole = np.take(whole, channel, stream.channel_axis)
            with named(name, channel):
                assert_same_answers(whole, value.astype(whole.dtype))


@pytest.mark.every(3)
@pytest.mark.parametrize("name", [name for name in EXAMPLES if EXAMPLES[name][0].side_by_side])
def test_threads_do_not_matter_in_long_batches(name):
    """More rows than the threads work on before they meet."""
    z = EXAMPLES[name][0].wide(np.random.default_rng(6).standard_normal((70_000, 4)))
    single = example(name, 4)
    expected = process(single, z, threads=1)
    for threads in (3, 64, None):
        f = example(name, 4)
        with named(threads):
            assert_same_answers(process(f, z, threads=threads), expected)
            assert_same_state(f, single)


@BY_STREAM
@given(data=st.data())
def test_every_kind_of_missing_is_the_same(stream, data):
    arguments, z = data.draw(stream.settings(None)), data.draw(stream.records())
    kind = data.draw(st.sampled_from([np.inf, -np.inf]))
    plain, other = stream.make(arguments), stream.make(arguments)
    expected = process(plain, np.where(np.isfinite(z), z, np.nan))
    assert_same_answers(process(other, np.where(np.isfinite(z), z, kind)), expected)
    assert_same_state(other, plain)


@BY_STREAM
@given(data=st.data())
def test_nothing_finite_breaks_it(stream, data):
    """Hostile records, one after the other."""
    f = stream.make(data.draw(stream.settings(None)))
    hostile = hostile_records().map(stream.wide)
    for z in data.draw(st.lists(st.one_of(stream.records(), hostile), max_size=3)):
        stream.sound(f, z, process(f, z))
