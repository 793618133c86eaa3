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
    "actigraph",
    "android long rows",
    "arduino ide monitor stamps",
    "arduino plotter labels",
    "arduino plotter tabs",
    "ardupilot mavlogdump",
    "ardupilot missionplanner log",
    "axivity",
    "betaflight unfilt",
    "decimal comma in commas",
    "degpmin",
    "delsys",
    "euroc",
    "excel serial days",
    "excel serial days date",
    "gsdc device imu",
    "gx in g",
    "gyro norm",
    "header again",
    "hms columns",
    "matlab mobile csv",
    "matlab named",
    "mavlink raw mrads",
    "metawear",
    "movella dot",
    "movella dot plain",
    "mrads",
    "ms 5hz",
    "rpm",
    "sensor logger cal",
    "sensor logger combined",
    "sensor logger gyroscope",
    "sensor logger uncal",
    "sensor logger unnamed",
    "sensorlog ios",
    "shimmer consensys",
    "shimmer raw and cal",
    "st mdps",
    "time 1hz s unnamed",
    "time 5hz ms unnamed",
    "time of day",
    "ulog2csv sensor combined",
    "ulog2csv sensor gyro",
    "ulog2csv vehicle imu",
    "units second row",
    "utf16 excel",
    "vectornav",
    "witmotion new",
    "xsens mtmanager",
    "yaw pitch roll rate",
    "zyx order",
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
