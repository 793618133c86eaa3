"""What comes out of broken sensors, buses and memories, drawn from a generator."""

import binascii

import numpy as np

# Ends of ranges, "no value" of sensors and protocols, and numbers that square to none.
# fmt: off
EDGES = np.array([
    0.0, -0.0, 5e-324, 1e-310, 1e-150, 1e-9, 1.0, 9999.0, 32767.0, 2.0**31, 1e15, 3.4028235e38,
    1e75, 1e150, 1e300, np.finfo(float).max, np.nan, np.inf,
])
# fmt: on
WORDS = [
    np.float64(edge).tobytes() for edge in [*EDGES, *-EDGES, 1e-12, 1e12, 0.5, 2.0, 1e30, -1e-3]
] + [np.uint8(byte).tobytes() for byte in (0, 1, 2, 3, 0x7F, 0x80, 0xFF)]


def samples(rng, most=3000):
    """A record of stretches: calm, loud, equal, missing, spikes, steps, ramps, growth, anything."""
    longest = most // 4 + 2
    parts = [stretch(rng, int(rng.integers(1, longest))) for _ in range(rng.integers(1, 8))]
    return np.concatenate(parts)[:most]


def stretch(rng, n):
    size = 10.0 ** rng.choice([0.0, 0.0, 0.0, rng.uniform(-12, 12), rng.uniform(-300, 300)])
    with np.errstate(all="ignore"):
        match rng.integers(9):
            case 0 | 1:
                return size * (rng.normal() + rng.standard_normal(n))
            case 2:
                return np.full(n, size * rng.normal())
            case 3:
                return np.full(n, rng.choice([np.nan, np.inf, -np.inf]))
            case 4:
                z = size * rng.standard_normal(n)
                z[rng.random(n) < rng.uniform(0.0, 0.4)] = rng.choice(EDGES)
                return z
            case 5:
                return size * np.round(rng.uniform(0.05, 3.0) * rng.standard_normal(n))
            case 6:
                return size * np.arange(n) * rng.normal()
            case 7:
                return (
                    size
                    * rng.choice([-1.0, 1.0], n) ** rng.integers(2)
                    * (rng.uniform(0.5, 2.0) ** np.arange(n))
                )
            case _:
                return rng.choice([-1.0, 1.0], n) * 10.0 ** rng.uniform(-320, 308, n)


def pieces(rng, z):
    """The record in up to twelve parts, some of them empty."""
    return np.split(z, np.sort(rng.integers(0, len(z) + 1, rng.integers(12))))


def forged(rng, saved):
    """A checkpoint with one to three places of its content overwritten and a checksum that fits."""
    header, checksum = 30, 4
    body = bytearray(saved[:-checksum])
    for _ in range(rng.integers(1, 4)):
        place, word = int(rng.integers(header, len(body))), WORDS[rng.integers(len(WORDS))]
        body[place : place + len(word)] = word[: len(body) - place]
    return bytes(body) + binascii.crc32(body).to_bytes(4, "little")
