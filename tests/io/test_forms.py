"""Text logs as people have them: read right or refused, never wrong without a word."""

import numpy as np
import pytest

import zerorate as zr
from support.forms import forms
from zerorate.io import LogError

FORMS = forms()
READ = [form for form in FORMS if form.expected in ("read", "asks")]
REFUSED = [form for form in FORMS if form.expected not in ("read", "asks")]

PENDING = (
    "sensorlog ios",
    "matlab mobile csv",
    "matlab named",
    "witmotion new",
    "arduino ide monitor stamps",
    "time of day",
    "hms columns",
)
"""Forms that are not read so yet."""


def named(listed):
    return [pytest.param(form, id=form.name) for form in listed if form.name not in PENDING]


@pytest.mark.parametrize("form", named(READ))
def test_the_gyro_is_read_right(tmp_path, form):
    log = zr.read_log(form.write(tmp_path))
    check(log, form, "gyro")
    assert log.unit == (form.gyro if form.expected == "read" else "unit")
    noted = any("unit" in note for note in log.meta["notes"])
    assert noted or log.unit != "unit"


def check(log, form, kind):
    truth = form.truth(kind)
    assert log.data.shape == truth.shape, log.names
    # Half a unit of the last digit that stands in the file, and what a double adds.
    np.testing.assert_allclose(log.data, truth, rtol=0, atol=0.5 * form.to + 1e-9)
    # Stamps of a millisecond over twelve seconds.
    assert log.rate == pytest.approx(form.rate, rel=1e-4)


@pytest.mark.parametrize("form", named(READ))
def test_all_sensors_are_read_right(tmp_path, form):
    recording = zr.read_recording(form.write(tmp_path))
    for kind in ("gyro", "accel", "mag"):
        unit = getattr(form, kind)
        if unit is not None:
            check(recording[kind], form, kind)
            assert recording[kind].unit in (unit, "unit")


@pytest.mark.parametrize("form", named(REFUSED))
def test_the_rest_is_refused_with_what_to_type(tmp_path, form):
    with pytest.raises(LogError) as caught:
        zr.read_log(form.write(tmp_path))
    assert form.expected in str(caught.value)
