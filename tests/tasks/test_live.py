"""`LineStream`: what a line may hold, what it is answered, and that it can be saved anywhere."""

import json
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import zerorate as zr
from support.streams import lines_of
from zerorate.tasks.live import (
    CheckpointError,
    ColumnError,
    DriftColumn,
    LineError,
    LineStream,
    Settings,
    SettingsError,
)
from zerorate.tasks.live.backlog import BacklogFilter
from zerorate.tasks.live.sequence import SequenceCount

RATE = 100.0
Z = 0.5 + 0.1 * np.random.default_rng(1).standard_normal((400, 3))
Z[50] = np.nan
Z[60, 1] = np.nan


def stream(fields=None, **settings):
    return LineStream(Settings(RATE, **settings), fields)


def taken(some, lines):
    return [some.take(line) for line in lines]


@pytest.mark.parametrize("method", ["kf", "akf", "fading", "auto"])
@pytest.mark.parametrize("output", ["estimate", "compensated"])
@pytest.mark.parametrize("channels", [1, 3])
def test_answers_are_those_of_the_filter(method, output, channels):
    z = Z[:, :channels]
    answers = taken(stream(method=method, output=output), lines_of(z))
    alone = zr.DriftFilter(RATE, method=method, output=output, channels=channels)
    # repr gives every float back to the last bit.
    assert answers == lines_of(alone.process(z))


def test_columns_beside_the_rate():
    z = Z.copy()
    z[200:] += 20.0 * np.sin(np.arange(200) / 10.0)[:, None]
    z[150:180, 0] = z[150, 0]
    answers = taken(stream(extra=tuple(DriftColumn), limit=20.0), lines_of(z))
    alone = zr.DriftFilter(RATE, method="auto", output="compensated", limit=20.0, channels=3)
    trace = alone.copy().trace(z)
    rate = alone.process(z)
    columns = (trace.bias, trace.bias_sigma, trace.at_rest, trace.saturated, trace.stuck)
    found = np.array([[float(cell) for cell in answer.split(",")] for answer in answers])
    np.testing.assert_array_equal(found, np.hstack([rate, *columns]))
    assert {cell for answer in answers for cell in answer.split(",")[9:]} == {"0", "1"}
    assert trace.saturated.any()
    assert trace.stuck.any()


def test_it_tells_what_was_left_out_by_channel():
    z = np.vstack([Z, 0.5 + 0.1 * np.random.default_rng(2).standard_normal((2000, 3))])
    z[1000::100, 0] += 10.0
    z[1200:1300, 1] = z[1200, 1]
    z[1500:1503, 2] = -250.0
    some = stream(limit=250.0)
    assert list(some.sentences()) == []
    taken(some, ["wx,wy,wz", *lines_of(z)])
    alone = zr.DriftFilter(RATE, method="auto", limit=250.0, channels=3, output="estimate")
    alone.process(z)
    message = list(some.sentences())
    assert (
        message[0] == "saturated, at or beyond the limit of 250, so missing: wz 3 of 2400 samples"
    )
    assert f"wx {alone.outlier_count[0]}" in message[1]
    stuck = f"wy {alone.stuck_count[1]} of 2400 samples"
    assert message[2] == f"left out because the sensor was stuck at one value: {stuck}"
    assert list(LineStream.from_bytes(some.to_bytes()).sentences()) == message


def test_a_channel_without_a_name_is_called_by_its_column():
    some = stream(sequence=0, columns=(2,), limit=250.0)
    taken(some, [f"{i},9,250" for i in range(3)])
    expected = "saturated, at or beyond the limit of 250, so missing: column 2 3 of 3 samples"
    assert list(some.sentences()) == [expected]
    assert some.opening == "filters column 2; passes on 0, 1"


def test_a_saturated_sample_is_missing_while_a_gap_is_made_up_for():
    for channels in (1, 2):
        some = LineStream(Settings(8000.0, sequence=0, limit=250.0))
        taken(some, [f"{i}{',1' * channels}" for i in range(100)])
        answer = some.take(f"1000000{',250' * channels}")
        assert answer == f"1000000{',nan' * channels}"


def test_a_header_is_answered_by_names_whenever_it_comes():
    some = stream(extra=(DriftColumn.bias,))
    assert some.take("wx, wy") == "wx,wy,bias_wx,bias_wy"
    some.take("1,2")
    assert some.take("wx,wy") == "wx,wy,bias_wx,bias_wy"
    assert some.samples == 1


IMU = "timestamp,ax,ay,az,gx,gy,gz"


def test_what_is_no_gyro_passes_through_in_its_place():
    some = stream(extra=(DriftColumn.at_rest,))
    assert some.take(IMU) == f"{IMU},at_rest_gx,at_rest_gy,at_rest_gz"
    alone = zr.DriftFilter(RATE, method="auto", output="compensated", channels=3)
    for i, (row, gyros) in enumerate(zip(lines_of(Z), alone.process(Z), strict=True)):
        before = f"2024-05-01T12:00:00.{i:03d}Z,0.10,-0,ok"
        answer = some.take(f"{before},{row}")
        assert answer.startswith(f"{before},{lines_of(gyros[None])[0]},")
    filters = "filters gx, gy, gz, given motion by ax, ay, az"
    assert some.opening == f"{filters}; passes on timestamp, ax, ay, az"
    assert some.no_answer == ",".join(["nan"] * 10)
    again = LineStream.from_bytes(some.to_bytes(), some.settings)
    with pytest.raises(LineError, match="characters that cannot be printed"):
        again.take(f"\x1b[2J,8,7,6,{lines_of(Z)[0]}")
    some.take(f"9,8,7,6,{','.join(['nan'] * 3)}")
    assert again.take(f"9,8,7,6,{lines_of(Z)[0]}") == some.take(f"9,8,7,6,{lines_of(Z)[0]}")


def test_a_time_without_a_header_is_known_where_it_is_a_date():
    some = stream(method="kf", output="estimate")
    assert some.take("2024-05-01T12:00:00Z,1.5,2") == "2024-05-01T12:00:00Z,1.5,2.0"


def test_the_header_tells_the_unit_and_so_what_rest_can_be():
    turning = np.array([[0.0], [100.0]]).repeat(1500)
    limits = {"rest_limit": 10.0, "bias_limit": 20.0}
    alone = zr.DriftFilter(RATE, method="auto", output="compensated", **limits)
    expected = lines_of(alone.process(turning))
    named, given = stream(), stream(unit="dps")
    named.take("gyro_z_dps")
    assert named.opening == "filters gyro_z_dps in deg/s"
    assert taken(named, lines_of(turning)) == taken(given, lines_of(turning)) == expected
    none = LineStream(Settings(RATE, unit="deg/s", rest_limit=None, bias_limit=None))
    none.take("1.0")
    with pytest.raises(SettingsError, match="bias_limit=none, now it is 20"):
        LineStream.from_bytes(none.to_bytes(), Settings(RATE, unit="deg/s", bias_limit=20.0))


def test_raw_counts_are_scaled():
    counts = np.rint(131 * Z)
    some = stream(data_scale=1 / 131, unit="deg/s")
    some.take("gx,gy,gz")
    limits = {"rest_limit": 10.0, "bias_limit": 20.0}
    alone = zr.DriftFilter(RATE, method="auto", output="compensated", channels=3, **limits)
    assert taken(some, lines_of(counts)) == lines_of(alone.process(counts * (1 / 131)))
    assert some.opening == "filters gx, gy, gz times 0.00763359 in deg/s"


@pytest.mark.parametrize("line", ["1.5,2", " 1.5 , 2 ", "1.5 2", "\t1.5\t 2\r\n", "1.5e0,+2."])
def test_ways_to_write_a_line(line):
    some = stream(method="kf", output="estimate")
    assert some.take(line) == "1.5,2.0"


@pytest.mark.parametrize("cell", ["", "nan", "NaN", "NA", "null", "inf"])
def test_ways_to_miss_a_sample(cell):
    some = stream()
    some.take("1,2")
    assert some.take(f"{cell},2").split(",")[0] == "nan"


def test_an_empty_line_is_a_missing_sample_of_one_channel():
    some = stream(method="kf", output="estimate")
    assert taken(some, ["0.5", ""]) == ["0.5", "0.5"]
    assert some.samples == 2


def test_comments_are_no_samples():
    some = stream()
    assert taken(some, ["# boot", "1", "#"]) == [None, "0.0", None]
    assert some.samples == 1


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("1,x", "'x' is not a number"),
        ("1,1_0", "'1_0' is not a number"),
        ("1,\x1b[2J", r"'\\x1b\[2J' is not a number"),
        ("1,2,3", "it has 3 cells, expected 2"),
        ("", "it has 1 cells, expected 2"),
    ],
)
def test_a_garbled_line_is_a_missing_sample(line, message):
    some, other = stream(), stream()
    taken(some, ["1,2", "2,1"])
    with pytest.raises(LineError, match=message):
        some.take(line)
    assert some.no_answer == "nan,nan"
    taken(other, ["1,2", "2,1", "nan,nan"])
    assert some.to_bytes() == other.to_bytes()


@pytest.mark.parametrize(
    ("settings", "line", "message"),
    [
        ({}, "", "it is empty, expected names or numbers"),
        ({}, "1,x", "names and numbers"),
        ({}, "a,b", "no column looks like a gyro; choose with columns= from: a, b"),
        ({}, "wx_dps,wy_radps", "differ in unit"),
        ({"unit": "rad/s"}, "wx_dps", "'rad/s' was given, but column 'wx_dps' is in deg/s"),
        ({"columns": (0,)}, IMU, "names 'timestamp', which holds the time.*are gx, gy, gz"),
        ({"columns": ("millis",)}, "millis,a", "names 'millis', which holds the time"),
        ({"columns": (1, 1)}, "1,2", "names a column twice"),
        ({"columns": (0,), "sequence": 0}, "1,2", "names the column of the sequence number"),
        ({"columns": ("wx",)}, "a,b", "no column 'wx', expected one of a, b"),
        ({"columns": ("wx",)}, "1,2", "no column 'wx', the line names none"),
        ({"columns": (2,)}, "1,2", "no column 2, the line has 2"),
        ({"sequence": 0}, "1", "only the sequence number"),
    ],
)
def test_a_first_line_that_is_refused(settings, line, message):
    some = stream(**settings)
    with pytest.raises(LineError, match=message):
        some.take(line)
    assert not some.open


def test_fields_let_the_first_line_be_cut():
    some = stream(fields=2)
    with pytest.raises(LineError, match="1 cells, expected 2"):
        some.take("3")
    assert some.take("1,2") == "0.0,0.0"


def test_other_columns_end_the_stream():
    some = stream()
    taken(some, ["wx,wy", "1,2"])
    with pytest.raises(ColumnError, match="names the columns wy,wx, before they were wx,wy"):
        some.take("wy,wx")


@pytest.mark.parametrize("line", ["ERROR", "0.1wx,wy", "0.1,wy", "wx", "no,sensor"])
def test_garbled_words_do_not_end_the_stream(line):
    some = stream()
    taken(some, ["wx,wy", "1,2"])
    with pytest.raises(LineError) as message:
        some.take(line)
    assert message.type is LineError
    assert some.samples == 2


def test_a_name_may_be_empty():
    some = stream(columns=(1,))
    assert taken(some, [",wx", "0,1.0", ",wx"]) == [",wx", "0,0.0", ",wx"]


def test_columns_by_name_and_position():
    header, line = "n,time,wx,wy", "7,0.01,3,4"
    by_name = stream(method="kf", output="estimate", columns=("wy", "wx"), sequence="n")
    assert taken(by_name, [header, line]) == [header, "7,0.01,3.0,4.0"]
    by_position = stream(method="kf", output="estimate", columns=(3, 2), sequence=0)
    assert by_position.take(line) == "7,0.01,3.0,4.0"


def test_lost_samples_are_missing_ones():
    gaps = [*range(100), *range(107, 300), *range(301, 400)]
    numbered = [f"{i},{line}" for i, line in enumerate(lines_of(Z))]
    some = stream(sequence=0)
    answers = taken(some, [numbered[i] for i in gaps])
    z = Z.copy()
    z[[i for i in range(400) if i not in gaps]] = np.nan
    alone = zr.DriftFilter(RATE, method="auto", output="compensated", channels=3)
    expected = lines_of(alone.process(z)[gaps])
    assert answers == [f"{i},{line}" for i, line in zip(gaps, expected, strict=True)]
    assert (some.sequence.lost_count, some.samples, some.position) == (8, 400, 400)


def work_of(monkeypatch):
    """Count what a filter is given at once."""
    given, process = [], BacklogFilter._predict
    monkeypatch.setattr(
        BacklogFilter,
        "_predict",
        lambda self, n: (given.append(min(n, self.pending_count)), process(self, n)),
    )
    return given


@pytest.mark.every(3)
@pytest.mark.parametrize("output", ["estimate", "compensated"])
@pytest.mark.parametrize("channels", [1, 3])
def test_a_long_gap_stops_no_answer(monkeypatch, output, channels):
    rate, lost, given = 8000.0, 1_000_000, work_of(monkeypatch)
    settings = Settings(rate, method="kf", output=output, sequence=0, extra=(DriftColumn.bias,))
    z = 0.5 + 0.1 * np.random.default_rng(2).standard_normal((30_000, channels))
    numbers = np.arange(len(z)) + lost * (np.arange(len(z)) >= 10_000)
    lines = [f"{n},{line}" for n, line in zip(numbers, lines_of(z), strict=True)]
    some = LineStream(settings)
    found = np.array([list(map(float, some.take(line).split(",")[1:])) for line in lines])
    # A piece that leaves most of the time between two samples to what comes.
    assert max(given) <= (1 << 22) / (rate * channels)
    behind = np.flatnonzero(np.array(given) > 0)
    caught_up = 10_000 + len(behind)
    assert 10_000 < caught_up < 25_000
    bias = found[10_000 : caught_up - 1, channels:]
    held = bias if output == "estimate" else z[10_000 : caught_up - 1] - bias
    np.testing.assert_array_equal(found[10_000 : caught_up - 1, :channels], held)
    # The state is that of a filter which was given all of it as missing.
    alone = settings.filter(channels)
    flat = z[:, 0] if channels == 1 else z
    alone.process(flat[:10_000])
    gap = (lost + caught_up - 1 - 10_000, *flat.shape[1:])
    alone.process(np.full(gap, np.nan))
    alone.process(flat[caught_up - 1 :])
    state, filter_ = opened(some.to_bytes())
    assert filter_ == alone.to_bytes()
    assert (state["samples"], state["owed"], some.sequence.lost_count) == (len(z) + lost, 0, lost)


def test_saved_within_a_long_gap_it_goes_on(monkeypatch):
    some = LineStream(Settings(8000.0, sequence=0))
    lines = [f"{n + 500_000 * (n > 99)},{n % 7}" for n in range(5000)]
    expected = taken(some, lines)
    first = LineStream(some.settings)
    taken(first, lines[:150])
    second = LineStream.from_bytes(first.to_bytes())
    assert opened(first.to_bytes())[0]["owed"] > 0
    assert taken(second, lines[150:]) == expected[150:]
    assert second.to_bytes() == some.to_bytes()


def test_a_late_sample_is_answered_but_not_taken():
    some = stream(sequence=0)
    taken(some, ["10,1", "12,2"])
    before = some.samples
    assert some.take("11,3") == "11,nan"
    assert some.take("12,2") == "12,nan"
    assert (some.samples, some.sequence.late_count) == (before, 2)


@pytest.mark.parametrize("number", ["", "x", "1.5", "-", "+-11", "1_1", "1" * 5000])
def test_a_number_that_cannot_be_read_is_found_as_a_gap(number):
    some = stream(sequence=0)
    some.take("10,1")
    with pytest.raises(LineError, match="sequence number"):
        some.take(f"{number},2")
    assert some.no_answer == "nan,nan"
    some.take("12,2")
    assert (some.sequence.lost_count, some.samples) == (1, 3)


@pytest.mark.parametrize("jump", [-101, -65535, 360_001, 2**40])
def test_a_jump_is_a_new_beginning(jump):
    count = SequenceCount(RATE)
    count.step(0)
    assert count.step(jump) == 0
    assert (count.lost_count, count.late_count, count.restart_count) == (0, 0, 1)
    assert count.step(jump + 1) == 0


@pytest.mark.parametrize("missing", [1, 99, 359_999])
def test_an_hour_may_be_lost(missing):
    count = SequenceCount(RATE, last=5)
    assert count.step(6 + missing) == missing
    assert count.restart_count == 0


@given(st.data())
def test_saved_anywhere_it_goes_on_to_the_last_bit(data):
    channels = data.draw(st.sampled_from([1, 3]))
    sequence = data.draw(st.sampled_from([None, 0]))
    settings = Settings(RATE, extra=(DriftColumn.bias_sigma,), sequence=sequence)
    lines = lines_of(Z[:, :channels])
    if sequence is not None:
        lines = [f"{3 * i},{line}" for i, line in enumerate(lines)]
    cut = data.draw(st.integers(1, len(lines)))
    whole, first = LineStream(settings), LineStream(settings)
    expected = taken(whole, lines)
    answers = taken(first, lines[:cut])
    second = LineStream.from_bytes(first.to_bytes(), settings)
    assert second.position == first.position
    assert answers + taken(second, lines[cut:]) == expected
    assert second.to_bytes() == whole.to_bytes()


def test_a_header_is_known_after_a_restart():
    first = stream()
    taken(first, ["wx,wy", "1,2"])
    second = LineStream.from_bytes(first.to_bytes())
    assert second.settings == first.settings
    assert second.take("wx,wy") == "wx,wy"


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"rate": 200.0}, "rate=100, now it is 200"),
        ({"method": "kf"}, "method=auto, now it is kf"),
        ({"motion": "ignore"}, "motion=hold, now it is ignore"),
        ({"output": "estimate"}, "output=compensated, now it is estimate"),
        ({"limit": 250.0}, "limit=none, now it is 250"),
        ({"rest_limit": 10.0}, "rest_limit=none, now it is 10"),
        ({"bias_limit": 20.0}, "bias_limit=none, now it is 20"),
        ({"method": "kf", "outliers": "reject"}, "outliers=keep, now it is reject"),
        ({"extra": (DriftColumn.bias,)}, "extra=none, now it is bias"),
        ({"columns": (0,)}, "columns=none, now it is 0"),
        ({"unit": "dps"}, "unit=none, now it is deg/s"),
        ({"data_scale": 0.5}, "data_scale=none, now it is 0.5"),
        ({"sequence": 0}, "sequence=none, now it is 0"),
        ({"method": "kf", "order": (3, 1)}, "order=2,1, now it is 3,1"),
        ({"method": "kf", "adapt_for": 60.0}, "adapt_for=120, now it is 60"),
        ({"method": "kf", "adapt_for": None}, "adapt_for=120, now it is none"),
    ],
)
def test_other_settings_are_refused(changed, message):
    some = stream() if len(changed) == 1 else stream(method="kf")
    some.take("1,2")
    with pytest.raises(SettingsError, match=message):
        LineStream.from_bytes(some.to_bytes(), Settings(**{"rate": RATE, **changed}))


def test_what_the_default_of_motion_is_may_be_said():
    some = stream()
    some.take("1,2")
    assert LineStream.from_bytes(some.to_bytes(), Settings(RATE, motion="hold")).samples == 1


def test_every_cut_and_every_flipped_byte_is_refused():
    some = stream(method="kf")
    taken(some, ["1", "2"])
    raw = some.to_bytes()
    for i in range(len(raw)):
        flipped = bytes([*raw[:i], raw[i] ^ 0x10, *raw[i + 1 :]])
        for damaged in (raw[:i], flipped):
            with pytest.raises(CheckpointError, match=r"truncated|not a checkpoint"):
                LineStream.from_bytes(damaged)


def sealed(state, filter_):
    """Return a checkpoint of any JSON and any filter, with a right checksum."""
    text = json.dumps(state).encode()
    body = b"ZRLINES2" + len(text).to_bytes(4, "little") + text + filter_
    return body + zlib.crc32(body).to_bytes(4, "little")


def opened(raw):
    """Return the JSON and the filter of a checkpoint."""
    end = 12 + int.from_bytes(raw[8:12], "little")
    return json.loads(raw[12:end]), raw[end:-4]


@pytest.fixture(scope="module")
def numbered():
    some = stream(sequence=0, sequence_bits=8, extra=(DriftColumn.bias,))
    taken(some, ["n,wx,wy", "254,1,2", "255,1,3", "0,2,1", "3,2,1"])
    return opened(some.to_bytes())


@pytest.mark.parametrize("state", [None, 1, [], {}, "x", {"settings": {}}, {"settings": []}])
def test_foreign_json_under_a_right_checksum_is_refused(numbered, state):
    with pytest.raises(CheckpointError, match="no state of a stream"):
        LineStream.from_bytes(sealed(state, numbered[1]))


JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-(10**30), 10**30) | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=5,
)


@given(st.data())
def test_what_is_read_from_forged_json_is_a_stream_that_works(numbered, data):
    state = json.loads(json.dumps(numbered[0]))
    for _ in range(data.draw(st.integers(1, 2))):
        place = state
        while isinstance(place, dict | list) and place:
            keys = list(place) if isinstance(place, dict) else range(len(place))
            key = data.draw(st.sampled_from(keys))
            if not isinstance(place[key], dict | list) or data.draw(st.booleans()):
                place[key] = data.draw(JSON)
                break
            place = place[key]
    try:
        some = LineStream.from_bytes(sealed(state, numbered[1]))
    except CheckpointError:
        return
    width = len(some.take("n,wx,wy").split(","))
    assert [len(some.take(f"{n},1,2").split(",")) for n in range(60)] == [width] * 60
    assert LineStream.from_bytes(some.to_bytes()).to_bytes() == some.to_bytes()


@pytest.mark.parametrize(
    ("part", "forged"),
    [
        ("samples", 7),
        ("samples", True),
        ("lines", -1),
        ("owed", 1),
        ("layout", [3, [1, 3], 0, None, None]),
        ("layout", [3, [1], 0, None, None]),
        ("layout", [3, [1, 1], 0, None, None]),
        ("layout", [3, [1, 2], None, None, None]),
        ("layout", [3, [1, 2], 0, ["n", "wx"], None]),
        ("layout", [3, [1, 2], 0, None, "deg/s"]),
        ("sequence", [0, 0, 0, 0, [5, 5], True, 0, 0]),
        ("sequence", [0, 0, 0, 0, [0, 99], True, 0, 0]),
        ("sequence", [0, 0, 0, 0, [0, 255], False, 0, 0]),
        ("sequence", [0.5, 0, 0, 0, [0, 255], True, 0, 0]),
    ],
)
def test_parts_that_do_not_belong_together_are_refused(numbered, part, forged):
    state, filter_ = numbered
    assert LineStream.from_bytes(sealed(state, filter_)).samples == 6
    with pytest.raises(CheckpointError, match="no state of a stream"):
        LineStream.from_bytes(sealed({**state, part: forged}, filter_))


def test_another_width_is_refused():
    some = stream(sequence=0)
    some.take("1,2")
    with pytest.raises(SettingsError, match="sequence_bits=none, now it is 8"):
        LineStream.from_bytes(some.to_bytes(), Settings(RATE, sequence=0, sequence_bits=8))


def test_other_fields_are_refused():
    some = stream()
    some.take("1,2")
    assert LineStream.from_bytes(some.to_bytes(), some.settings, 2).samples == 1
    with pytest.raises(SettingsError, match="fields=2, now it is 3"):
        LineStream.from_bytes(some.to_bytes(), some.settings, 3)


def test_a_damaged_filter_under_a_right_checksum_is_refused():
    some = stream(method="kf")
    some.take("1")
    body = bytearray(some.to_bytes()[:-4])
    body[-1] ^= 1
    with pytest.raises(CheckpointError, match="checksum"):
        LineStream.from_bytes(bytes(body) + zlib.crc32(body).to_bytes(4, "little"))


def test_the_state_is_readable_text():
    some = stream()
    some.take("1,2")
    assert opened(some.to_bytes())[0]["samples"] == 1


@pytest.mark.parametrize("bad", [{"rate": -1.0}, {"method": "x"}, {"motion": "x"}])
def test_settings_that_no_filter_takes(bad):
    with pytest.raises(ValueError, match="must be"):
        Settings(**{"rate": RATE, **bad})


def test_settings_that_the_method_does_not_use():
    with pytest.raises(ValueError, match="fading has no effect on method 'auto', only on 'fading'"):
        Settings(RATE, fading=0.97)


def test_it_is_a_public_module():
    assert zr.tasks.live.LineStream is LineStream
