"""A checkpoint that was forged, with a right checksum, is refused in one sentence, or is a filter
like any other: it obeys the laws and never answers NaN."""

import struct
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.checkpoints import CHECKSUM, CONTENT, refuses, sealed, sealed_anew
from support.checks import assert_semidefinite_to_rounding, indefiniteness, named
from support.classes import EXAMPLES, STREAMS, example
from support.feeding import process
from support.records import hostile_records, mixed_record, moving_records, records

# Those that a bank saves, channel after channel; others are forged in tests of their own.
BANKS = [name for name in EXAMPLES if not name.startswith(("array", "linear", "navigation"))]
BY_KIND = pytest.mark.parametrize("kind", BANKS)

# Numbers that no filter computes, or none at that place.
WORDS = [
    struct.pack("<d", x)
    for x in (
        np.nan, np.inf, -np.inf, np.finfo(float).max, -1e308, 1e300, -1e300, 1e160, -1e150, 1e80,
        1e40, -1e30, 1e13, -1.0, 0.0, 5e-324, -1e-310, 1e-300, 1e-30, -1e-12,
    )
]  # fmt: skip
BYTES = [bytes([b]) for b in (0, 1, 2, 3, 0x7F, 0x80, 0xFF)]
MIXED = mixed_record()
# All that a filter treats differently, and what a sensor never gives.
AFTER = np.concatenate(
    [
        MIXED[::9],
        [1e12, -1e150, np.nan, 1e308, 5e-324, 0.0, -np.inf, 1.0],
        MIXED[1::11],
        [1e200] * 9,
    ]
)


def forged(b, place, content):
    """With other content at a place, and the checksum that belongs to it."""
    return sealed(b[:place] + content + b[place + len(content) : -CHECKSUM])


@cache
def after(width, channels):
    z = AFTER if channels is None else np.stack([AFTER] * channels, axis=1)
    z = next(one for one in STREAMS.values() if one.width == width).wide(z)
    z.flags.writeable = False
    return z


def assert_lawful(f, stream):
    """Finite answers and a sound state, on its own and after its next checkpoint."""
    z = after(stream.width, f.channels)
    answers = process(f, z)
    stream.sound(f, z, answers)


def accepted(kind, b):
    """The filter of a checkpoint, None if that is refused in one sentence."""
    stream, _ = EXAMPLES[kind]
    try:
        return stream.kind.from_bytes(b)
    except ValueError as error:
        message = str(error)
        assert "\n" not in message
        assert 20 < len(message) < 130
        return None


@pytest.mark.every(8)
@BY_KIND
@pytest.mark.parametrize("n", [0, 40, 1000])
@pytest.mark.parametrize("part", range(3))
def test_every_number_at_every_place(kind, n, part):
    """A third of the places in a case."""
    f, (stream, _) = example(kind), EXAMPLES[kind]
    process(f, stream.wide(MIXED[:n]))
    b = f.to_bytes()
    # Places of a ring of phases are alike: a few of them are enough.
    stride = max((len(b) - CONTENT) // 150, 1)
    for place in range(CONTENT + part * stride, len(b) - CHECKSUM, 3 * stride):
        for content in WORDS if place + 8 <= len(b) - CHECKSUM else BYTES:
            other = accepted(kind, forged(b, place, content))
            if other is not None:
                with named(place, content):
                    assert_lawful(other, stream)


@pytest.mark.every(3)
@BY_KIND
@given(st.data())
def test_several_numbers_at_once(kind, data):
    stream, _ = EXAMPLES[kind]
    channels = data.draw(st.sampled_from([None, 2]))
    f = example(kind, channels)
    z = data.draw(hostile_records())
    process(f, stream.wide(z if channels is None else np.stack([z] * channels, axis=1)))
    b = f.to_bytes()
    for _ in range(data.draw(st.integers(1, 3))):
        place = data.draw(st.integers(CONTENT, len(b) - CHECKSUM - 8))
        b = forged(b, place, data.draw(st.sampled_from(WORDS + BYTES)))
    other = accepted(kind, b)
    if other is not None:
        assert_lawful(other, stream)


@pytest.mark.parametrize("name", STREAMS)
@given(st.data())
def test_what_was_saved_is_never_refused(name, data):
    """Whatever the samples, the settings and the moment."""
    stream = STREAMS[name]
    channels = data.draw(st.sampled_from(stream.channels))
    f = stream.make(data.draw(stream.settings(channels)))
    z = data.draw(st.one_of(records(), hostile_records(), moving_records()))
    for first in range(0, len(z) + 1, 37):
        part = z[first : first + 37]
        process(f, stream.wide(part if channels is None else np.stack([part, part[::-1]], axis=1)))
        b = f.to_bytes()
        assert stream.kind.from_bytes(b).to_bytes() == b


@BY_KIND
def test_numbers_of_channels(kind):
    """More and fewer than there are filters, and more than any memory holds."""
    f = example(kind, 2)
    b = f.to_bytes()
    # An option, two channels, two filters: one byte each.
    assert b[CONTENT : CONTENT + 3] == b"\x01\x02\x02"
    four, huge = b"\xff\xff\xff\xff\x0f", b"\xff" * 8 + b"\x7f"
    counts = [b"\x00\x02", b"\x01\x01\x02", b"\x01\x03\x02", b"\x01\x02\x01", b"\x01\x00\x00"]
    counts += [b"\x01" + huge + huge, b"\x01\x02" + huge, b"\x01" + four + four]
    for count in counts:
        other = b[:CONTENT] + count + b[CONTENT + 3 : -CHECKSUM]
        refuses(f, sealed_anew(other), "content is not the state of this filter")


@BY_KIND
def test_channels_that_differ_in_their_parameters_or_counts(kind):
    one, other = example(kind), example(kind)
    if isinstance(one, STREAMS["allan-noise"].kind):
        other = type(one)(fading=0.5)
    elif isinstance(one, STREAMS["corrector-3"].kind):
        stream, arguments = EXAMPLES[kind]
        other = stream.make({**arguments, "gyro_bias": np.ones(3)})
    else:
        process(other, EXAMPLES[kind][0].wide(MIXED[:3]))
    if isinstance(one, STREAMS["rest-detector"].kind):
        other = type(one)(rate=17.0)
    contents = [f.to_bytes()[CONTENT + 2 : -CHECKSUM] for f in (one, other)]
    both = one.to_bytes()[:CONTENT] + b"\x01\x02\x02" + b"".join(contents)
    refuses(one, sealed_anew(both), "content is not the state of this filter")


@given(st.integers(0, 2**32), st.floats(0.2, 0.8), st.sampled_from([-1.0, 1.0]))
def test_a_process_noise_at_either_side_of_the_bound(seed, share, sign):
    """One bound for what a step leaves, what a checkpoint takes, and what these tests ask."""
    f = EXAMPLES["fading"][0].make({**EXAMPLES["fading"][1], "channels": None, "scale": 1.0})
    process(f, np.random.default_rng(seed).standard_normal(500))
    noise = f.process_noise
    b, sizes = f.to_bytes(), np.sqrt(np.diag(noise))
    place = b.index(struct.pack("<d", noise[0, 1]))
    bound = indefiniteness(len(noise))
    for miss, taken in ((share * bound, True), ((2.0 + share) * bound, False)):
        covariance = struct.pack("<d", sign * sizes[0] * sizes[1] * (1.0 + miss))
        other = forged(b, place, covariance)
        # Whatever the third component is correlated with, the first two are too much.
        for i in range(2, len(noise)):
            for j in range(i):
                other = forged(other, b.index(struct.pack("<d", noise[j, i])), bytes(8))
        restored = accepted("fading", other)
        assert (restored is not None) is taken, miss
        if restored is not None:
            process(restored, np.random.default_rng(seed + 1).standard_normal(300))
            assert_semidefinite_to_rounding(restored.process_noise)
            assert_semidefinite_to_rounding(restored.covariance)
