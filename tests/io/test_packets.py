"""Packets of devices: what their bytes say, in pieces of any size, and what is damaged is told."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.packets import mtdata2, sensor_logger, sensor_server, wit, wit_bluetooth, ximu3
from zerorate.io.packets import PACKETS, Damage
from zerorate.record.names import meaning_of

GYRO, ACCEL, MAG = (0.5, -0.25, 2.0), (0.125, 0.5, 9.75), (0.5, -1.0, 0.25)
MTI = (
    "10 20 02 A6 55 10 60 04 00 57 47 2E 20 10 10 3F 7F 7D C4 BC 10 10 7D 3B A1 57 70 BD 7E C6 56 "
    "40 20 0C BD A2 1A F8 BE 2A 8E 96 41 1D 27 A2 40 10 0C B9 4F C8 00 B9 DA 24 00 3C C9 28 80 40 "
    "30 0C 3C 02 C8 9C 3C 35 F6 C8 3C DB 0C 00 80 20 0C BB B1 7D 81 BB 96 32 00 3C 01 E8 41 80 30 "
    "10 3F 80 00 00 B6 E3 30 01 B6 C0 40 00 37 26 48 00 C0 20 0C BE 99 9C 24 3F B6 1B 56 3F 16 6A "
    "EB 30 10 04 00 01 86 DE E0 20 04 00 40 00 03"
)
"""The data of a message that an MTi-300 sent, with what Xsens' own program read in it."""


def fed(name, *pieces):
    """Return the rows of pieces, and what is told of damage."""
    decoder = PACKETS[name].decoder()
    found = [row for piece in pieces for row in decoder.feed(piece)]
    found += decoder.finish()
    rows = [tuple(row) for row in found if not isinstance(row, Damage)]
    return rows, [row.reason for row in found if isinstance(row, Damage)]


def counts(numbers, unit):
    return [round(number / unit) for number in numbers]


G, DPS = 16 / 32768, 2000 / 32768
WIT_GYRO, WIT_ACCEL = tuple(n * DPS for n in (10, -4, 3000)), tuple(n * G for n in (1, 2, 2048))
SENT = {
    "xsens": (
        [mtdata2(7, GYRO, ACCEL, MAG, fine=12), mtdata2(8, GYRO, ACCEL)],
        [(7, 1200, *GYRO, *ACCEL, *MAG), (8, "", *GYRO, *ACCEL, "", "", "")],
    ),
    "witmotion": (
        [
            wit(0x51, counts(WIT_ACCEL, G)) + wit(0x52, (10, -4, 3000)) + wit(0x53, (1, 2, 3)),
            wit(0x54, (5, 6, -7)) + wit(0x51, counts(WIT_ACCEL, G)) + wit(0x52, (10, -4, 3000)),
            wit_bluetooth(counts(WIT_ACCEL, G), (10, -4, 3000)),
        ],
        [
            (*WIT_GYRO, *WIT_ACCEL, "", "", ""),
            (*WIT_GYRO, *WIT_ACCEL, 5, 6, -7),
            (*WIT_GYRO, *WIT_ACCEL, "", "", ""),
        ],
    ),
    "xio": (
        [
            ximu3("M", 900, MAG) + ximu3("I", 1000, (*GYRO, *ACCEL)),
            b"I,2000,0.5000,-0.2500,2.0000,0.1250,0.5000,9.7500\r\n",
            ximu3("I", 0x0ADB0ADC, (*GYRO, *ACCEL)) + ximu3("T", 1, (20.0,)) + b"N,1,Button\r\n",
        ],
        [
            (1000, *GYRO, *ACCEL, *MAG),
            (2000, *GYRO, *ACCEL, "", "", ""),
            (0x0ADB0ADC, *GYRO, *ACCEL, "", "", ""),
        ],
    ),
    "phone": (
        [
            sensor_server("accelerometer", 1, ACCEL) + b"\n",
            sensor_server("light", 1, (3.0,)) + b"\n",
            sensor_server("gyroscope", 2, GYRO) + b"\n",
            sensor_logger(
                [
                    ("accelerometer", 3, (0.125, 0.5, 0.0)),
                    ("gravity", 3, (0.0, 0.0, 9.75)),
                    ("magnetometer", 3, MAG),
                    ("gyroscope", 4, GYRO),
                    ("gyroscope", 5, GYRO),
                ]
            )
            + b"\n",
        ],
        [
            (2, *GYRO, *ACCEL, "", "", ""),
            (4, *GYRO, *ACCEL, *MAG),
            (5, *GYRO, *[""] * 6),
        ],
    ),
}
DAMAGED = {
    "xsens": mtdata2(7, GYRO, ACCEL),
    "witmotion": wit(0x52, (10, -4, 3000)),
    "xio": ximu3("I", 1000, (*GYRO, *ACCEL))[4:],
    "phone": sensor_server("gyroscope", 2, GYRO)[4:] + b"\n",
}
FORMS = sorted(PACKETS)


def test_every_form_is_tried():
    assert sorted(SENT) == FORMS


@pytest.mark.parametrize("name", FORMS)
def test_rows_hold_what_was_sent(name):
    packets, rows = SENT[name]
    assert fed(name, b"".join(packets)) == (rows, [])


@pytest.mark.parametrize("name", FORMS)
def test_columns_name_sensors_and_units(name):
    columns = PACKETS[name].columns
    _, (row, *_) = SENT[name]
    assert len(columns) == len(row)
    for kind, units in (("gyro", {"rad/s", "deg/s"}), ("accel", {"m/s^2", "g"}), ("mag", None)):
        meanings = [meaning_of(column) for column in columns if column.startswith(kind)]
        assert [meaning.kind for meaning in meanings] == [kind] * 3
        assert units is None or {meaning.unit for meaning in meanings} <= units
    assert PACKETS[name].counter in (None, *columns)


@pytest.mark.parametrize("name", FORMS)
@given(data=st.data())
def test_pieces_of_any_size_give_the_same(name, data):
    packets, rows = SENT[name]
    raw = b"".join(packets)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(raw)), max_size=12)))
    pieces = [raw[a:b] for a, b in zip([0, *cuts], [*cuts, len(raw)], strict=True)]
    assert fed(name, *pieces) == (rows, [])


@pytest.mark.parametrize("name", FORMS)
def test_one_may_join_in_the_middle_of_a_packet(name):
    packets, rows = SENT[name]
    found, told = fed(name, packets[0][3:], *packets)
    assert (found[-len(rows) :], told) == (rows, [])


@pytest.mark.parametrize("name", FORMS)
def test_a_damaged_packet_is_told_and_the_next_ones_are_read(name):
    packets, rows = SENT[name]
    bad = bytearray(DAMAGED[name])
    bad[5] ^= 0x11
    found, told = fed(name, *packets, bytes(bad), *packets)
    assert found == rows + rows
    (sentence,) = told
    assert "no packet: " in sentence


@pytest.mark.parametrize("name", FORMS)
def test_another_form_is_told(name):
    text = b"0.1 0.2 0.3 0.4 0.5 0.6\r\n" * 400
    rows, (first, *_) = fed(name, text)
    assert rows == []
    assert f"hold no packet of {name}; is the form another" in first


@pytest.mark.parametrize("name", FORMS)
@given(raw=st.binary(max_size=300))
def test_no_bytes_stop_a_decoder(name, raw):
    packets, rows = SENT[name]
    found, _ = fed(name, raw, b"\n", *packets, *packets)
    assert found[-len(rows) :] == rows


@pytest.mark.parametrize("form", [1, 2, 3])
def test_numbers_of_an_mti_may_be_fixed_point_or_double(form):
    assert fed("xsens", mtdata2(1, GYRO, ACCEL, MAG, form)) == (
        [(1, "", *GYRO, *ACCEL, *MAG)],
        [],
    )


def test_a_message_that_an_mti_sent_reads_as_by_its_maker():
    data = bytes.fromhex(MTI)
    body = bytes([0xFF, 0x36, len(data)]) + data
    rows, told = fed("xsens", b"\xfa" + body + bytes([-sum(body) % 256]))
    ((counter, stamp, *numbers),) = rows
    assert (told, counter, stamp) == ([], 42581, 571985400)
    assert numbers == pytest.approx(
        [
            *(-0.00541657, -0.00458360, 0.00792891),
            *(-0.07915300, -0.16655955, 9.82217598),
            *(-0.30001938, 1.42270923, 0.58756894),
        ],
        abs=5e-9,
    )


def test_a_message_of_an_mti_may_be_long():
    filler = struct.pack(">HB", 0x2010, 240) + bytes(240)
    items = mtdata2(3, GYRO, ACCEL)[4:-1] + filler
    body = b"\xff\x36\xff" + struct.pack(">H", len(items)) + items
    rows, told = fed("xsens", b"\xfa" + body + bytes([-sum(body) % 256]))
    assert (rows, told) == ([(3, "", *GYRO, *ACCEL, "", "", "")], [])


def test_items_that_are_longer_than_their_message_are_told():
    items = struct.pack(">HB", 0x8020, 200) + bytes(12)
    body = b"\xff\x36" + bytes([len(items)]) + items
    bad = b"\xfa" + body + bytes([-sum(body) % 256])
    rows, told = fed("xsens", bad, mtdata2(1, GYRO, ACCEL))
    assert len(rows) == 1
    assert told == ["a message's items are not as long as they say"]


def test_acceleration_without_gravity_is_not_taken_for_a_force():
    rows, told = fed(
        "phone", sensor_logger([("accelerometer", 1, ACCEL), ("gyroscope", 2, GYRO)]) + b"\n"
    )
    assert (rows, told) == ([(2, *GYRO, *[""] * 6)], [])


@pytest.mark.parametrize("name", FORMS)
@given(data=st.data())
def test_damaged_bytes_give_the_same_however_they_are_cut(name, data):
    packets, _ = SENT[name]
    raw = bytearray(b"".join(data.draw(st.lists(st.sampled_from(packets), max_size=30))))
    for _ in range(data.draw(st.integers(0, 6)) if raw else 0):
        at = data.draw(st.integers(0, len(raw) - 1))
        match data.draw(st.sampled_from(["change", "lose", "insert", "foreign"])):
            case "change":
                raw[at] ^= data.draw(st.integers(1, 255))
            case "lose":
                del raw[at : at + data.draw(st.integers(1, 25))]
            case "insert":
                raw[at:at] = data.draw(st.binary(max_size=30))
            case "foreign":
                raw[at:at] = data.draw(st.sampled_from([b"\0", b"\x55", b"1"])) * 5000
        if not raw:
            break
    size = data.draw(st.sampled_from([1, 2, 3, 7, 11, 16, 20, 64, 1 << 20]))
    other = data.draw(st.sampled_from([1, 5, 20, 1000, 1 << 20]))

    def by(step):
        return fed(name, *(bytes(raw[i : i + step]) for i in range(0, len(raw), step)))

    assert by(size) == by(other)


@given(
    digits=st.integers(1, 6000),
    key=st.sampled_from(["timestamp", "values", "both"]),
    sign=st.sampled_from(["", "-"]),
)
def test_numbers_of_any_length_are_damage_and_no_fault(digits, key, sign):
    long = sign + "9" * digits
    stamp = long if key != "values" else "5"
    value = long if key != "timestamp" else "0.5"
    event = f'{{"type":"gyroscope","timestamp":{stamp},"values":[{value},0,1]}}\n'.encode()
    rows, told = fed("phone", *SENT["phone"][0], event, *SENT["phone"][0])
    known = len(SENT["phone"][1])
    assert len(rows) + len(told) == 2 * known + 1
    assert all(abs(row[0]) < 1 << 63 for row in rows)


@pytest.mark.parametrize("name", FORMS)
def test_an_end_within_a_packet_is_told(name):
    packets, rows = SENT[name]
    for cut in range(1, len(packets[-1])):
        found, told = fed(name, *packets, packets[-1][:cut])
        assert found[: len(rows)] == rows
        assert len(told) == 1 or len(found) > len(rows), (cut, told)


def test_a_message_without_an_end_costs_no_more_than_its_bytes():
    decoder = PACKETS["phone"].decoder()
    buffer = decoder._buffer
    piece = b"[" * 16
    for n in range(1 << 14):
        assert not list(decoder.feed(piece))
        assert buffer._searched == 16 * (n + 1)
