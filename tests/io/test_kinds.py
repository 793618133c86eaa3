"""Kinds of text logs: each is read right, or refused with a remedy that works when it is typed."""

import numpy as np
import pytest

import zerorate as zr
from support.kinds import KINDS
from zerorate.record import LogError


def check(kind, folder, **options):
    recording = zr.read_recording(kind.write(folder), **options)
    for name in ("gyro", "accel"):
        truth = getattr(kind, name)
        if truth is None:
            continue
        log = recording[name]
        assert log.data.shape == truth.shape, (kind.name, name, log)
        np.testing.assert_allclose(log.data, truth, rtol=1e-5, atol=kind.to, err_msg=kind.name)
        assert log.rate == pytest.approx(kind.rate, rel=2e-3), kind.name
    notes = [str(n) for log in recording.values() for n in log.meta["notes"]]
    notes += map(str, recording.notes)
    for said in kind.said:
        assert any(said in note for note in notes), (kind.name, said, notes)


@pytest.mark.parametrize("name", KINDS)
def test_kinds_are_read_right_or_refused_with_a_remedy(tmp_path, name):
    for kind in KINDS[name]():
        options = dict(kind.options)
        if kind.refused is not None:
            with pytest.raises(LogError) as caught:
                check(kind, tmp_path, **options)
            assert kind.refused in str(caught.value), kind.name
            assert all(f"{argument}=" in str(caught.value) for argument in kind.remedy), kind.name
        check(kind, tmp_path, **options, **kind.remedy)
