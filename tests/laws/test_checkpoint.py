"""Bytes that are no checkpoint of such a filter are refused in one clear sentence."""

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import zerorate as zr
from support.checkpoints import (
    CHECKSUM,
    CONTENT,
    LAYOUT,
    LENGTH,
    SIGNATURE,
    TAG,
    VERSION,
    P,
    Q,
    changed,
    refuses,
    sealed,
    sealed_anew,
)
from support.checks import assert_same_bits, named
from support.classes import EXAMPLES, STREAMS, assert_same_state, example
from support.feeding import process
from support.settings import METHODS, MOTIONS, ORDERS, OUTPUTS, RATE, start_of

BY_KIND = pytest.mark.parametrize("kind", EXAMPLES)
RECORD = np.random.default_rng(8).standard_normal((150, 3))


def fed(f, width=1):
    """A filter, after some samples of so many numbers."""
    z = RECORD[:, 0] if f.channels is None else RECORD[:, : f.channels]
    process(f, z if width == 1 else np.stack([z] * width, axis=-1))
    return f


def used(kind, channels=None):
    """One of EXAMPLES, after some samples."""
    return fed(example(kind, channels), EXAMPLES[kind][0].width)


@BY_KIND
def test_the_format_is_the_one_that_these_tests_change(kind):
    b = used(kind).to_bytes()
    assert b[: len(SIGNATURE)] == SIGNATURE
    assert int.from_bytes(b[LENGTH], "little") == len(b)
    assert sealed(b[:-CHECKSUM]) == b


@BY_KIND
def test_other_versions(kind):
    f = used(kind)
    b = f.to_bytes()
    for version in (0, 1, 2, 4, 0xFFFF):
        other = changed(b, LAYOUT, version.to_bytes(2, "little"))
        refuses(f, other, f"layout version {version}, this zerorate reads version 3")
    tag = b[TAG].rstrip(b"\0").decode()
    now = int.from_bytes(b[VERSION], "little")
    for version in (0, now + 1, 0xFFFF):
        other = changed(b, VERSION, version.to_bytes(2, "little"))
        refuses(f, other, f"holds '{tag}' version {version}.*expected '{tag}' version {now}")


@BY_KIND
def test_truncated_at_every_length(kind):
    f = used(kind)
    b = f.to_bytes()
    for n in range(len(b)):
        refuses(f, b[:n], "truncated" if n >= len(SIGNATURE) else "not a zerorate checkpoint")


@BY_KIND
def test_padded(kind):
    f = used(kind)
    refuses(f, f.to_bytes() + b"\0", "padded")


@BY_KIND
def test_flipped_bits(kind):
    """All of the head, some of the rest: that a CRC-32 finds any single one is proven."""
    f = used(kind)
    b = f.to_bytes()
    for place in [*range(CONTENT), *range(CONTENT, len(b), 7), len(b) - 1]:
        for bit in range(8) if place < CONTENT else (place % 8,):
            damaged = bytearray(b)
            damaged[place] ^= 1 << bit
            refuses(f, bytes(damaged), "checkpoint")


@BY_KIND
def test_garbage(kind):
    f = used(kind)
    for b in (b"", b"\0", SIGNATURE[:3], b"garbage" * 50, b"\0" * 400):
        refuses(f, b, "not a zerorate checkpoint: they do not start with its signature")


ONE_OF_EACH = [example(next(iter(stream.examples))) for stream in STREAMS.values()]


@given(st.binary(max_size=400), st.sampled_from([b"", SIGNATURE, SIGNATURE + b"\x03\0"]))
def test_arbitrary_bytes(rest, start):
    for f in ONE_OF_EACH:
        refuses(f, start + rest, "checkpoint")


@given(st.data())
def test_arbitrary_content_under_a_right_checksum(data):
    """Refused, or a filter that works: never a panic."""
    kind = data.draw(st.sampled_from(list(EXAMPLES)))
    f = used(kind)
    b = f.to_bytes()
    body = bytearray(b[:-CHECKSUM])
    for _ in range(data.draw(st.integers(1, 8))):
        body[data.draw(st.integers(CONTENT, len(body) - 1))] = data.draw(st.integers(0, 255))
    try:
        other = type(f).from_bytes(sealed(body))
    except ValueError:
        return
    shape = (5,) if other.channels is None else (5, other.channels)
    process(other, EXAMPLES[kind][0].wide(np.zeros(shape)))
    repr(other)


@BY_KIND
@pytest.mark.parametrize("content", [b"", b"\xff", b"\xff" * 10, b"\xff" * 200, b"\0\0"])
def test_other_content_under_a_right_checksum(kind, content):
    """Of another size; the last is no number of channels, and none of the filters."""
    f = used(kind)
    other = sealed_anew(f.to_bytes()[:CONTENT] + content)
    refuses(f, other, "content is not the state of this filter")


@BY_KIND
def test_another_kind(kind):
    f = used(kind)
    for other in EXAMPLES:
        stranger = used(other)
        with named(other):
            if type(f) is type(stranger):
                assert_same_state(type(f).from_bytes(stranger.to_bytes()), stranger)
                continue
            words = f"holds '{tag(stranger)}' version.*, expected '"
            refuses(f, stranger.to_bytes(), words)


def tag(f):
    return f.to_bytes()[TAG].rstrip(b"\0").decode()


@BY_KIND
def test_an_unknown_kind(kind):
    f = used(kind)
    unknown = b"drift-of-tomorrow"[:16]
    refuses(f, changed(f.to_bytes(), TAG, unknown), "holds 'drift-of-tomorro' version")


@pytest.mark.parametrize("kind", ["fading", "started", "holding", "least-squares"])
@pytest.mark.parametrize(("place", "value"), [(P, 0), (P, 4), (Q, 4), (P, 3), (Q, 0)])
def test_another_order_than_the_content_has(kind, place, value):
    f = used(kind)
    assert f.order == (2, 1)
    refuses(f, changed(f.to_bytes(), place, value), "content is not the state of this filter")


@BY_KIND
def test_what_is_not_bytes(kind):
    for b in ("text", None, 7, [1, 2]):
        with named(b), pytest.raises(TypeError, match="bytes"):
            type(example(kind)).from_bytes(b)


@BY_KIND
def test_a_refused_checkpoint_does_not_unpickle(kind):
    f = used(kind)
    damaged = pickle.dumps(f).replace(b"ZRTE", b"ZRTX")
    with pytest.raises(ValueError, match="not a zerorate checkpoint"):
        pickle.loads(damaged)


def assert_returns(f):
    """Out of its checkpoint, with its state and its settings."""
    twin = type(f).from_bytes(f.to_bytes())
    assert_same_state(twin, f)
    assert (twin.channels, repr(twin)) == (f.channels, repr(f))
    if isinstance(f, zr.DriftFilter):
        assert (twin.params, twin.status) == (f.params, f.status)
        np.testing.assert_equal(twin.start, f.start)
    return twin


@pytest.mark.parametrize("order", ORDERS, ids=str)
@pytest.mark.parametrize("channels", [None, 1, 3])
def test_every_order_returns(order, channels):
    """Of every method, started or not, and of least squares."""
    start = start_of(np.random.default_rng(7), order, channels)
    for method in METHODS:
        arguments = {"rate": RATE, "order": order, "method": method, "channels": channels}
        with named(method):
            assert_returns(fed(zr.DriftFilter(**arguments)))
            assert assert_returns(fed(zr.DriftFilter.started(start, **arguments))).start
    twin = assert_returns(fed(zr.identification.RecursiveLeastSquares(order, channels=channels)))
    assert twin.order == order


@pytest.mark.parametrize("method", [*METHODS, "auto"])
@pytest.mark.parametrize("channels", [None, 3])
def test_every_behaviour_returns(method, channels):
    for motion in MOTIONS:
        for output in OUTPUTS:
            behaviour = {"motion": motion, "output": output}
            with named(behaviour):
                f = zr.DriftFilter(rate=RATE, method=method, channels=channels, **behaviour)
                assert_returns(fed(f))


def test_what_was_learned_before_switching_on_again_returns():
    f = used("auto")
    f.power_on()
    twin = zr.DriftFilter.from_bytes(f.to_bytes())
    z = np.random.default_rng(10).standard_normal(3000)
    assert_same_bits(twin.process(z), f.process(z))
    assert_same_state(twin, f)


@BY_KIND
def test_every_pickle_protocol(kind):
    f = used(kind)
    for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
        with named(protocol):
            assert_same_state(pickle.loads(pickle.dumps(f, protocol)), f)


@BY_KIND
def test_a_checkpoint_changes_nothing(kind):
    f = used(kind)
    assert f.to_bytes() == f.to_bytes()
