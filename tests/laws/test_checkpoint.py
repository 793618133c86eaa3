"""Bytes that are no checkpoint of such a filter are refused in one clear sentence."""

import pickle
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import zerorate as zr
from support.strategies import (
    METHODS,
    MOTIONS,
    ORDERS,
    OUTPUTS,
    RATE,
    assert_same_bits,
    assert_same_state,
    drift,
    random_start,
)

VERSION = slice(4, 6)
KIND, P, Q, RESERVED = 6, 7, 8, 9
LENGTH = slice(10, 14)


def start_of(order, channels):
    rng = np.random.default_rng(7)
    known = [random_start(rng, order) for _ in range(channels or 1)]
    if channels is None:
        return known[0]
    return {name: np.stack([start[name] for start in known]) for name in known[0]}


FILTERS = {
    "drift": lambda **more: zr.DriftFilter(rate=RATE, **more),
    "started": lambda order=(2, 1), channels=None, **more: drift(
        {
            "rate": RATE,
            "order": order,
            "channels": channels,
            "start": start_of(order, channels),
            **more,
        }
    ),
    "auto": lambda **more: zr.DriftFilter(rate=RATE, method="auto", **more),
    "holding": lambda **more: zr.DriftFilter(rate=RATE, motion="hold", **more),
    "compensating": lambda **more: zr.DriftFilter(rate=RATE, output="compensated", **more),
    "least-squares": zr.RecursiveLeastSquares,
    "allan-noise": zr.AllanNoise,
    "rest-detector": lambda **more: zr.RestDetector(rate=RATE, **more),
    "streaming-allan": lambda **more: zr.StreamingAllan(rate=RATE, octaves=2, **more),
}
BY_KIND = pytest.mark.parametrize("kind", FILTERS)


def used(kind, **arguments):
    """A filter that has seen some samples."""
    f = FILTERS[kind](**arguments)
    shape = (150,) if f.channels is None else (150, f.channels)
    f.process(np.random.default_rng(8).standard_normal(shape))
    return f


def sealed(body):
    """With the checksum that belongs to it."""
    return bytes(body) + zlib.crc32(body).to_bytes(4, "little")


def changed(b, place, value):
    """With other bytes at ``place`` and a checksum that fits."""
    body = bytearray(b[:-4])
    body[place] = value
    return sealed(body)


def refuses(f, b, words):
    with pytest.raises(ValueError, match=words) as error:
        type(f).from_bytes(b)
    message = str(error.value)
    assert "\n" not in message
    assert 20 < len(message) < 120
    assert not message.endswith(".")


@BY_KIND
def test_the_format_is_the_one_that_these_tests_change(kind):
    b = used(kind).to_bytes()
    assert b[:4] == b"ZRTE"
    assert int.from_bytes(b[LENGTH], "little") == len(b)
    assert sealed(b[:-4]) == b


@BY_KIND
@pytest.mark.parametrize("version", [0, 1, 3, 0xFFFF])
def test_other_versions(kind, version):
    f = used(kind)
    b = changed(f.to_bytes(), VERSION, version.to_bytes(2, "little"))
    refuses(f, b, f"format version {version}, this zerorate reads version 2")


@BY_KIND
def test_truncated_at_every_length(kind):
    f = used(kind)
    b = f.to_bytes()
    for n in range(len(b)):
        refuses(f, b[:n], "truncated" if n >= 4 else "not a zerorate checkpoint")


@BY_KIND
def test_padded(kind):
    f = used(kind)
    refuses(f, f.to_bytes() + b"\0", "padded")


@BY_KIND
def test_every_flipped_bit(kind):
    f = used(kind)
    b = f.to_bytes()
    for place in range(len(b)):
        for bit in range(8):
            damaged = bytearray(b)
            damaged[place] ^= 1 << bit
            refuses(f, bytes(damaged), "checkpoint")


@BY_KIND
@pytest.mark.parametrize("b", [b"", b"\0", b"ZRTE"[:3], b"garbage" * 50, b"\0" * 400])
def test_garbage(kind, b):
    refuses(used(kind), b, "not a zerorate checkpoint: they do not start with its signature")


@given(st.binary(max_size=400), st.sampled_from([b"", b"ZRTE", b"ZRTE\x02\0"]))
def test_arbitrary_bytes(rest, start):
    for kind in FILTERS:
        refuses(FILTERS[kind](), start + rest, "checkpoint")


@given(st.data())
def test_arbitrary_content_under_a_right_checksum(data):
    """Refused, or a filter that works: never a panic."""
    f = used(data.draw(st.sampled_from(list(FILTERS))))
    b = f.to_bytes()
    body = bytearray(b[:-4])
    for _ in range(data.draw(st.integers(1, 8))):
        body[data.draw(st.integers(14, len(body) - 1))] = data.draw(st.integers(0, 255))
    try:
        other = type(f).from_bytes(sealed(body))
    except ValueError:
        return
    shape = (5,) if other.channels is None else (5, other.channels)
    other.process(np.zeros(shape))
    repr(other)


@pytest.mark.parametrize("size", [0, 1, 10, 200])
@BY_KIND
def test_content_of_another_size_under_a_right_checksum(kind, size):
    f = used(kind)
    body = bytearray(f.to_bytes()[:14] + b"\xff" * size)
    body[LENGTH] = (len(body) + 4).to_bytes(4, "little")
    refuses(f, sealed(body), "content is not the state of this filter")


@BY_KIND
def test_content_without_a_filter_under_a_right_checksum(kind):
    f = used(kind)
    # No number of channels, and none of the filters.
    body = bytearray(f.to_bytes()[:14] + b"\0\0")
    body[LENGTH] = (len(body) + 4).to_bytes(4, "little")
    refuses(f, sealed(body), "content is not the state of this filter")


@BY_KIND
@pytest.mark.parametrize("other", FILTERS)
def test_another_kind(kind, other):
    f, stranger = used(kind), used(other)
    if type(f) is type(stranger):
        assert_same_state(type(f).from_bytes(stranger.to_bytes()), stranger)
        return
    found, expected = type(stranger).__name__, type(f).__name__
    refuses(f, stranger.to_bytes(), f"holds an? {found}.*expected an? {expected}")


@BY_KIND
def test_an_unknown_kind(kind):
    f = used(kind)
    refuses(f, changed(f.to_bytes(), KIND, 77), "content is not the state of this filter")


@pytest.mark.parametrize("kind", ["drift", "started", "holding", "least-squares"])
@pytest.mark.parametrize(("place", "value"), [(P, 0), (P, 4), (Q, 4), (P, 3), (Q, 0)])
def test_another_order_than_the_content_has(kind, place, value):
    f = used(kind, order=(2, 1))
    refuses(f, changed(f.to_bytes(), place, value), "content is not the state of this filter")


@BY_KIND
@pytest.mark.parametrize("b", ["text", None, 7, [1, 2]])
def test_what_is_not_bytes(kind, b):
    with pytest.raises(TypeError, match="bytes"):
        type(used(kind)).from_bytes(b)


@BY_KIND
def test_a_refused_checkpoint_does_not_unpickle(kind):
    f = used(kind)
    damaged = pickle.dumps(f).replace(b"ZRTE", b"ZRTX")
    with pytest.raises(ValueError, match="not a zerorate checkpoint"):
        pickle.loads(damaged)


@pytest.mark.parametrize("order", ORDERS, ids=str)
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("channels", [None, 1, 3])
def test_every_order_and_method_returns(order, method, channels):
    f = used("drift", order=order, method=method, channels=channels)
    twin = zr.DriftFilter.from_bytes(f.to_bytes())
    assert_same_state(twin, f)
    assert twin.params == f.params
    assert repr(twin) == repr(f)


@pytest.mark.parametrize("order", ORDERS, ids=str)
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("channels", [None, 1, 3])
def test_every_started_filter_returns_with_its_start(order, method, channels):
    f = used("started", order=order, method=method, channels=channels)
    twin = zr.DriftFilter.from_bytes(f.to_bytes())
    assert_same_state(twin, f)
    assert twin.params == f.params
    for name, value in f.start.items():
        np.testing.assert_array_equal(twin.start[name], value)


@pytest.mark.parametrize("method", [*METHODS, "auto"])
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("output", OUTPUTS)
@pytest.mark.parametrize("channels", [None, 3])
def test_every_conduct_returns(method, motion, output, channels):
    f = used("drift", method=method, motion=motion, output=output, channels=channels)
    twin = zr.DriftFilter.from_bytes(f.to_bytes())
    assert_same_state(twin, f)
    assert twin.params == f.params
    assert (twin.status, repr(twin)) == (f.status, repr(f))


def test_what_was_learned_before_switching_on_again_returns():
    f = used("auto")
    f.power_on()
    twin = zr.DriftFilter.from_bytes(f.to_bytes())
    z = np.random.default_rng(10).standard_normal(3000)
    assert_same_bits(twin.process(z), f.process(z))
    assert_same_state(twin, f)


@pytest.mark.parametrize("order", ORDERS, ids=str)
@pytest.mark.parametrize("channels", [None, 1, 3])
def test_least_squares_of_every_order_returns(order, channels):
    f = used("least-squares", order=order, channels=channels)
    twin = zr.RecursiveLeastSquares.from_bytes(f.to_bytes())
    assert_same_state(twin, f)
    assert (twin.order, twin.channels, repr(twin)) == (order, channels, repr(f))


@BY_KIND
@pytest.mark.parametrize("seen", [0, 1, 2, 99, 100, 101])
def test_around_the_end_of_the_start_up(kind, seen):
    z = np.random.default_rng(9).standard_normal(300)
    f = FILTERS[kind]()
    f.process(z[:seen])
    twin = type(f).from_bytes(f.to_bytes())
    assert_same_state(twin, f)
    assert_same_bits(twin.process(z[seen:]), f.process(z[seen:]))
    assert_same_state(twin, f)


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
@BY_KIND
def test_every_pickle_protocol(kind, protocol):
    f = used(kind)
    assert_same_state(pickle.loads(pickle.dumps(f, protocol)), f)


@BY_KIND
def test_a_checkpoint_changes_nothing(kind):
    f = used(kind)
    assert f.to_bytes() == f.to_bytes()
