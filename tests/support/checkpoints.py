"""The bytes of a checkpoint, for tests that change them."""

import zlib

import pytest

# The layout of a checkpoint: signature, version of the layout, tag and version of the type, orders,
# length, content, checksum.
SIGNATURE = b"ZRTE"
LAYOUT = slice(4, 6)
TAG = slice(6, 22)
VERSION = slice(22, 24)
P, Q = 24, 25
LENGTH = slice(26, 30)
CONTENT = 30
CHECKSUM = 4


def sealed(body):
    """With the checksum that belongs to it."""
    return bytes(body) + zlib.crc32(body).to_bytes(CHECKSUM, "little")


def changed(b, place, value):
    """With other bytes at ``place`` and a checksum that fits."""
    body = bytearray(b[:-CHECKSUM])
    body[place] = value
    return sealed(body)


def sealed_anew(body):
    """With the length and the checksum that belong to it."""
    body = bytearray(body)
    body[LENGTH] = (len(body) + CHECKSUM).to_bytes(4, "little")
    return sealed(body)


def refuses(f, b, words):
    """Whether these bytes are refused in one sentence with these words."""
    with pytest.raises(ValueError, match=words) as error:
        type(f).from_bytes(b)
    message = str(error.value)
    assert "\n" not in message
    assert 20 < len(message) < 130
    assert not message.endswith(".")
