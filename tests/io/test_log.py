"""The class Log."""

from dataclasses import replace

import numpy as np
import pytest

from support.logs import make_log
from zerorate.record import Log, LogError
from zerorate.record.log import drop_empty_channels
from zerorate.record.span import Span


def test_log_properties():
    log = make_log([[1, 2], [np.nan, 3], [4, np.nan], [5, 6]], rate=2.0)
    assert (log.n, log.channels, log.duration, log.missing_count) == (4, 2, 2.0, 2)
    assert log.data.flags.c_contiguous
    assert log.data.dtype == np.float64


def test_with_data_keeps_everything_else():
    log = make_log([1.0, 2.0], sensor="X")
    other = log.with_data([3, 4])
    assert other.data.tolist() == [[3.0], [4.0]]
    assert (other.names, other.unit, other.meta) == (log.names, log.unit, log.meta)
    with pytest.raises(LogError, match=r"shape \(2, 1\), got \(3, 1\)"):
        log.with_data([1, 2, 3])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"names": ["a"]}, "one entry a channel: 2, got 1"),
        ({"names": ["a", "a"]}, "repeated: a"),
        ({"names": ["a", ""]}, "printable text, got ''"),
        ({"time": [0.0, 1.0]}, r"shape \(3,\)"),
        ({"time": [0.0, 1.0, 5.0]}, "uniform at 1 Hz"),
        ({"time": [0.0, np.nan, 2.0]}, "finite"),
        ({"data": np.zeros((0, 2))}, "at least one sample"),
        ({"data": np.zeros((3, 2, 1))}, r"\(3, 2, 1\)"),
        ({"unit": ""}, "unit"),
        ({"rate": -1.0}, "positive finite"),
    ],
)
def test_log_refuses_what_does_not_agree(change, message):
    good = {"time": np.arange(3.0), "rate": 1.0, "data": np.zeros((3, 2)), "names": ["a", "b"]}
    with pytest.raises(ValueError, match=message):
        Log(**good | change)


def test_channels_may_differ_in_unit():
    data = np.ones((2, 3))
    mixed = make_log(data, unit=("deg", "deg", "m"))
    assert (mixed.unit, mixed.units) == ("deg, deg, m", ("deg", "deg", "m"))
    assert mixed.with_data(2 * data).units == mixed.units
    alike = make_log(data, unit=["m"] * 3)
    assert (alike.unit, alike.units) == ("m", ("m", "m", "m"))
    assert "deg, deg, m: gyro_0" in repr(mixed)


@pytest.mark.parametrize("unit", [("deg", "m"), ("deg", "", "m"), ("deg", 1, "m"), 3, None, " "])
def test_a_unit_is_one_or_one_a_channel(unit):
    with pytest.raises(LogError, match="unit must be a non-empty string"):
        make_log(np.ones((2, 3)), unit=unit)


class TestExtra:
    """Columns next to the channels."""

    log = Log(
        np.arange(5) / 10,
        10.0,
        np.ones((5, 2)),
        ("gyro_x", "gyro_y"),
        stamps=np.array([0.0, 0.1, 0.21, 0.3, 0.4]),
        extra={
            "at_rest": np.arange(5) > 2,
            "sigma": np.ma.array(np.arange(5.0), mask=[1, *[0] * 4]),
        },
    )

    def test_they_are_no_channels(self):
        assert self.log.channels == 2
        assert self.log.extra["at_rest"].dtype == np.bool_
        np.testing.assert_array_equal(self.log.extra["sigma"], [np.nan, 1, 2, 3, 4])

    def test_a_part_has_theirs(self):
        part = self.log.part(slice(2, 4))
        assert part.extra["at_rest"].tolist() == [False, True]
        assert part.sampled.tolist() == [0.21, 0.3]
        cut = Span(0.2, 0.4).of([self.log])[0]
        assert cut.extra["sigma"].tolist() == [2, 3]

    def test_they_stay_with_other_data_and_without_empty_channels(self):
        data = np.column_stack([np.ones(5), np.full(5, np.nan)])
        kept = drop_empty_channels(self.log.with_data(data))
        assert kept.names == ("gyro_x",)
        assert kept.extra == self.log.extra

    @pytest.mark.parametrize(
        ("extra", "message"),
        [
            ({"temp": np.zeros(4)}, r"extra column 'temp' must have shape \(5,\), got \(4,\)"),
            ({"gyro_x": np.zeros(5)}, "extra column 'gyro_x' has the name of a channel"),
            ({"a\n": np.zeros(5)}, "an extra column's name must be printable text"),
            ({"temp": list("abcde")}, "extra column 'temp' must hold real numbers"),
        ],
    )
    def test_refusals(self, extra, message):
        with pytest.raises(LogError, match=message):
            replace(self.log, extra=extra)
