"""Lines of names and numbers: a live stream reads them as the reader of logs does."""

import numpy as np
import pytest

from support.kinds import texts
from zerorate.tasks.live import AttitudeSettings, LineStream

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
