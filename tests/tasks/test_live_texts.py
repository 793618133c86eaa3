"""Lines of names and numbers: a live stream reads them as the reader of logs does."""

import numpy as np
import pytest

from support.kinds import consoles, documents, texts
from zerorate.tasks.live import AttitudeSettings, LineStream, Settings

KINDS = [kind for kind in texts() if kind.name not in ("JSON of sensors", "0 t ACC: x=")]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_a_stream_answers_as_to_a_table(kind):
    units = {"gyro_unit": "deg/s", "accel_unit": "g"}
    if kind.name == "rostopic echo":
        units = {"gyro_unit": "rad/s", "accel_unit": "m/s^2"}
    answers = [LineStream(AttitudeSettings(100.0, **units)) for _ in range(2)]
    as_text = [answers[0].take(line) for line in kind.text.splitlines()]
    got = [line.split(",") for line in as_text if line is not None]
    answers[1].take("gx,gy,gz,ax,ay,az")
    rows = np.column_stack([kind.gyro, kind.accel])
    table = [answers[1].take(",".join(map(repr, row.tolist()))) for row in rows]
    assert len(got) in (len(table), len(table) - 1)
    want = np.array([line.split(",")[-4:] for line in table], float)[: len(got)]
    np.testing.assert_allclose(np.array([row[-4:] for row in got], float), want, atol=1e-5)


OF_SEVERAL = [
    *(kind for kind in texts() if kind.name in ("JSON of sensors", "0 t ACC: x=")),
    *(kind for kind in consoles() if kind.name in ("a line each", "units behind")),
    *(kind for kind in consoles() if kind.name.startswith("before ")),
    *(kind for kind in documents() if kind.name.startswith("InfluxDB")),
]


@pytest.mark.parametrize("kind", OF_SEVERAL, ids=lambda kind: kind.name)
def test_lines_of_other_sensors_are_no_samples(kind):
    unit = None if kind.name == "units behind" else "deg/s"
    streams = [LineStream(Settings(100.0, unit=unit or "rad/s")) for _ in range(2)]
    answers = [streams[0].take(line) for line in kind.text.splitlines()]
    got = [line.split(",") for line in answers if line is not None]
    streams[1].take("gx,gy,gz")
    want = [streams[1].take(",".join(map(repr, row.tolist()))) for row in kind.gyro]
    assert len(got) == len(want)
    at = min(streams[0]._engine.layout.channels)
    rows = [row[at : at + 3] for row in got]
    np.testing.assert_allclose(
        np.array(rows, float), np.array([line.split(",") for line in want], float), atol=1e-5
    )
