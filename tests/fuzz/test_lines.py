"""Any lines into a stream: an answer for each, or one sentence; and it can be saved between any."""

import pytest

from support.wild import EDGES
from zerorate.tasks.live import ColumnError, LineError, LineStream, Settings

CELLS = ["", "nan", "-", "1_0", "x", "1e999", "0x1", "\u0663", "\x00", '"', "1,2,3", "#", "9" * 400]
CELLS += map(str, EDGES)
# Most numbers follow the one before; some are lost, repeated or late.
STEPS = [*[1] * 40, 0, 2, -3, 40]
SETTINGS = [
    Settings(rate=100.0),
    Settings(rate=255.0, sequence="seq", method="kf"),
    Settings(rate=8000.0, sequence="seq", method="auto", output="compensated"),
]


def line(rng, number):
    """Return a line of two cells, most of them good."""
    good = [str(number % 256), repr(float(rng.normal()))]
    if rng.random() < 0.1:
        good[rng.integers(2)] = str(rng.choice(CELLS))
    return ",".join(good[: 1 + (rng.random() < 0.98)])


def taken(stream, text):
    """Return the answer to a line, or what it is refused with."""
    try:
        return stream.take(text)
    except (LineError, ColumnError) as error:
        return f"refused: {error}"


@pytest.mark.parametrize("settings", SETTINGS, ids=["plain", "short counter", "fast"])
def test_any_lines(search, settings):
    def case(rng):
        stream = LineStream(settings)
        taken(stream, "seq,wz")
        twin = LineStream.from_bytes(stream.to_bytes())
        number = int(rng.integers(300))
        for _ in range(int(rng.integers(1, 400))):
            number += int(rng.choice(STEPS))
            text = line(rng, number)
            answer = taken(stream, text)
            assert answer is None or answer.isprintable()
            assert taken(twin, text) == answer
            if rng.random() < 0.02:
                twin = LineStream.from_bytes(twin.to_bytes())
        assert stream.samples == twin.samples

    search(case, 25)
