"""A forged checkpoint with a right checksum is refused in one sentence, or is a lawful filter."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import zerorate as zr
from support.checkpoints import (
    CHECKSUM,
    CONTENT,
    SIGNATURE,
    VERSION,
    changed,
    refuses,
    sealed,
    sealed_anew,
)
from support.checks import assert_covariance, named
from support.linear import measurements, model

NUMBERS = [
    np.nan, np.inf, -np.inf, 1.7e308, -1e308, 1e300, 1e160, -1e150, 1e80, 1e61, 1e31, -1e30,
    1e13, -1.0, 0.0, 5e-324, -1e-310, 1e-300, -1e-12,
]  # fmt: skip
WORDS = [struct.pack("<d", x) for x in NUMBERS] + [bytes([b]) for b in (0, 1, 2, 9, 0x7F, 0xFF)]
AFTER = np.array([0.0, 1.0, -1e150, np.nan, 1e308, 5e-324, 1e12, -np.inf, 1.0, -1.0])


def accepted(b):
    """The filter of a checkpoint, None if that is refused in one sentence."""
    try:
        return zr.LinearKalman.from_bytes(b)
    except ValueError as error:
        message = str(error)
        assert "\n" not in message
        assert 20 < len(message) < 130
        return None


def assert_lawful(kf):
    count = kf.channels or 1
    shape = (len(AFTER), *([count] if kf.channels else []), len(kf.H))
    run = kf.process(np.broadcast_to(AFTER.reshape(-1, *[1] * (len(shape) - 1)), shape))
    assert np.isfinite(run.state).all()
    assert np.isfinite(run.log_likelihood).all()
    assert not np.isinf(run.innovation).any()
    assert not np.isinf(run.nis).any()
    assert_covariance(run.covariance)
    assert zr.LinearKalman.from_bytes(kf.to_bytes()).to_bytes() == kf.to_bytes()


@pytest.mark.every(6)
@pytest.mark.parametrize("channels", [None, 2])
@pytest.mark.parametrize("size", [(1, 1), (3, 2), (2, 3)])
@pytest.mark.parametrize("count", [0, 1, 30])
def test_every_number_at_every_place(size, channels, count):
    kf = zr.LinearKalman(**model(*size, p=1), channels=channels)
    z = measurements(count, *([channels] if channels else []), size[1])
    kf.process(z)
    b = kf.to_bytes()
    taken = 0
    for place in range(CONTENT, len(b) - CHECKSUM):
        for word in WORDS:
            body = b[:place] + word + b[place + len(word) : -CHECKSUM]
            other = accepted(sealed(body[: len(b) - CHECKSUM]))
            if other is not None:
                taken += 1
                with named(place, word):
                    assert_lawful(other)
    assert taken


def test_damaged_bytes_are_refused():
    kf = zr.LinearKalman(**model(2, 1))
    b = kf.to_bytes()
    refuses(kf, b"", "not a zerorate checkpoint")
    refuses(kf, SIGNATURE, "truncated or padded")
    refuses(kf, b[:-1], "truncated or padded")
    refuses(kf, b[:60] + bytes([b[60] ^ 1]) + b[61:], "its checksum does not match")
    refuses(kf, sealed_anew(b[: len(b) // 2]), "not the state of this filter")
    refuses(kf, sealed_anew(b[:-CHECKSUM] + b"\0"), "not the state of this filter")
    refuses(kf, changed(b, VERSION, b"\x63\0"), "'linear-kalman' version 99")
    refuses(kf, zr.RestDetector(100.0).to_bytes(), "expected 'linear-kalman' version 1")


@given(
    st.integers(2, 6), st.floats(-16.0, -9.5), st.lists(st.floats(-6.0, 6.0), min_size=6),
    st.sampled_from([-1.0, 1.0]),
)  # fmt: skip
def test_what_a_constructor_takes_its_checkpoint_takes(n, power, sizes, sign):
    """At either side of the bound of what a person computed, after no step and after some."""
    scale = np.exp(sizes[:n])
    correlation = np.eye(n)
    correlation[0, 1] = correlation[1, 0] = sign * (1.0 + 10.0**power)
    P = correlation * np.outer(scale, scale)
    made = dict(F=np.eye(n), H=np.eye(n), Q=np.zeros((n, n)), R=np.eye(n), P0=P)
    if power > -9.999:
        with pytest.raises(ValueError, match="P0 must be positive semidefinite"):
            zr.LinearKalman(**made)
        return
    if power > -10.001:  # the rounding of the bound itself
        return
    f = zr.LinearKalman(**made)
    for z in np.linspace(-1.0, 1.0, 4):
        twin = zr.LinearKalman.from_bytes(f.to_bytes())
        assert twin.to_bytes() == f.to_bytes()
        assert_covariance(f.covariance)
        for one in (f, twin):
            one.predict()
            one.update(np.full(n, z))
        assert twin.to_bytes() == f.to_bytes()
