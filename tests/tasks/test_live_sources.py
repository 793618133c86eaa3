"""Live devices: each kind of source opened, its bytes read, its packets answered."""

import json
import os
import pty
import socket
import threading
import tty
import urllib.request

import bleak
import numpy as np
import pytest
from websockets.sync.server import serve

import zerorate as zr
from support.packets import mtdata2, sensor_logger, sensor_server, wit
from zerorate.cli import run
from zerorate.io.packets import PACKETS
from zerorate.tasks.interrupts import Interrupts
from zerorate.tasks.live import LineStream, Settings
from zerorate.tasks.live.serving import Server, packets_of
from zerorate.tasks.live.sources import SOURCES, AddressError, live_source

RATE = 100.0
GYRO = np.float32(0.02 + 0.01 * np.random.default_rng(3).standard_normal((200, 3)))
ACCEL = np.float32([0.0, 0.0, 9.81])
MESSAGES = [mtdata2(n, gyro, ACCEL) for n, gyro in enumerate(GYRO)]


def line_of(counter, gyro):
    return ",".join(map(str, [counter, "", *gyro.tolist(), *ACCEL.tolist(), "", "", ""]))


def answered(raw, *options, code=0, capsys=None):
    """Return answers and what is told of bytes in a file."""
    assert run(["stream", "--rate", "100", *options, str(raw)]) == code
    said = capsys.readouterr()
    return said.out.splitlines(), said.err


@pytest.fixture
def recorded(tmp_path):
    """Return a function that writes bytes to a file."""

    def write(*pieces):
        path = tmp_path / "recorded.bin"
        path.write_bytes(b"".join(pieces))
        return path

    return write


def test_packets_are_answered_as_their_lines_would_be(recorded, tmp_path, capsys):
    answers, _ = answered(recorded(*MESSAGES), "--form", "xsens", capsys=capsys)
    lines = tmp_path / "lines.csv"
    columns = ",".join(PACKETS["xsens"].columns)
    lines.write_text("\n".join([columns, *map(line_of, range(200), GYRO)]) + "\n")
    options = ("--sequence", "packet_counter", "--sequence-bits", "16")
    assert answers == answered(lines, *options, capsys=capsys)[0]
    assert len(answers) == 201


def test_the_counter_of_packets_tells_what_was_lost(recorded, capsys):
    answers, message = answered(
        recorded(*MESSAGES[:50], *MESSAGES[53:]), "--form", "xsens", capsys=capsys
    )
    assert len(answers) == 198
    assert "200 samples, 3 of them lost" in message


def test_a_damaged_packet_is_a_missing_sample(recorded, capsys):
    packets = [wit(0x51, (0, 0, 2048)) + wit(0x52, (10, n, 3)) for n in range(40)]
    bad = bytearray(packets[20])
    bad[15] ^= 1
    raw = recorded(*packets[:20], bad, *packets[21:])
    answers, message = answered(raw, "--form", "witmotion", capsys=capsys)
    assert len(answers) == 41
    assert answers[21].split(",")[:3] == ["nan"] * 3
    assert "after 20 samples 11 bytes are no packet" in message
    assert "garbled lines: 1" in message


def test_packets_give_orientations(recorded, capsys):
    answers, _ = answered(recorded(*MESSAGES), "--form", "xsens", "--attitude", capsys=capsys)
    names, *rows = answers
    quaternions = np.array([row.split(",")[-4:] for row in rows], dtype=float)
    alone = zr.Attitude(RATE, gyro_unit="rad/s", accel_unit="m/s^2")
    expected = [alone.update(gyro, ACCEL, [np.nan] * 3) for gyro in np.float64(GYRO)]
    assert names.endswith("quat_w,quat_x,quat_y,quat_z")
    np.testing.assert_array_equal(quaternions, expected)


def test_bytes_of_another_form_are_told(recorded, capsys):
    answers, message = answered(recorded(b"0.1,0.2,0.3\n" * 500), "--form", "xsens", capsys=capsys)
    assert len(answers) > 0
    assert "hold no packet of xsens; is the form another, or the speed of the line?" in message


def served(address, form, count):
    """Return the first answers to what a source sends."""
    answers = []
    stream = LineStream(Settings(RATE))
    form = PACKETS[form]

    class Answers:
        def write(self, raw):
            answers.append(raw.decode().strip())

        def flush(self):
            if len(answers) > count:
                raise EOFError

    with live_source(address, form) as file, pytest.raises(EOFError):
        Server(stream, None, lambda _: None).serve(packets_of(file, form, Answers(), Interrupts()))
    return answers


def expected(form, cells):
    stream = LineStream(Settings(RATE))
    lines = [",".join(PACKETS[form].columns), *(",".join(map(str, row)) for row in cells)]
    return [stream.take(line) for line in lines]


ROWS = [(n, "", *GYRO[n].tolist(), *ACCEL.tolist(), "", "", "") for n in range(20)]
EVENTS = [sensor_server("gyroscope", n, GYRO[n].tolist()) for n in range(20)]
PHONE_ROWS = [(n, *GYRO[n].tolist(), *[""] * 6) for n in range(20)]


def test_a_serial_line():
    leader, follower = pty.openpty()
    tty.setraw(leader)
    stop = threading.Event()

    def send():
        # What comes before it is opened is thrown away, and one may be cut in two by that.
        for message in MESSAGES:
            if stop.wait(0.005):
                break
            os.write(leader, message)

    thread = threading.Thread(target=send)
    thread.start()
    try:
        found = served(f"serial:{os.ttyname(follower)}@115200", "xsens", 20)
    finally:
        stop.set()
        thread.join()
        os.close(leader)
        os.close(follower)
    names, *rows = found
    first = int(rows[0].split(",")[0])
    cells = [
        (first + n, "", *gyro.tolist(), *ACCEL.tolist(), "", "", "")
        for n, gyro in enumerate(GYRO[first : first + len(rows)])
    ]
    assert [names, *rows] == expected("xsens", cells)


def test_a_server_that_sends():
    with socket.create_server(("127.0.0.1", 0)) as server:

        def send():
            port, _ = server.accept()
            with port:
                for message in MESSAGES[:20]:
                    port.sendall(message)

        thread = threading.Thread(target=send)
        thread.start()
        found = served(f"tcp:127.0.0.1:{server.getsockname()[1]}", "xsens", 20)
        thread.join()
    assert found[-21:] == expected("xsens", ROWS)


def free_port(kind):
    with socket.socket(socket.AF_INET, kind) as port:
        port.bind(("127.0.0.1", 0))
        return port.getsockname()[1]


def again(send, stop):
    """Call a function with each number until it works, from another thread."""

    def work():
        for n in range(20):
            while not stop.wait(0.01):
                try:
                    send(n)
                    break
                except OSError:
                    continue

    thread = threading.Thread(target=work)
    thread.start()
    return thread


def test_datagrams():
    number = free_port(socket.SOCK_DGRAM)
    stop = threading.Event()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        # A port that nobody has bound refuses only once connected.
        port.connect(("127.0.0.1", number))

        def send(n):
            port.send(b"")
            port.send(EVENTS[n])

        thread = again(send, stop)
        try:
            found = served(f"udp:127.0.0.1:{number}", "phone", 10)
        finally:
            stop.set()
            thread.join()
    rows = [row for row in found if row[:1].isdecimal()]
    assert len(rows) >= 10
    assert {row.split(",")[0] for row in rows} <= {str(n) for n in range(20)}


def test_what_is_pushed():
    number = free_port(socket.SOCK_STREAM)
    stop = threading.Event()
    body = sensor_logger([("gyroscope", n, GYRO[n].tolist()) for n in range(20)])

    def send(n):
        if n == 0:
            urllib.request.urlopen(f"http://127.0.0.1:{number}/data", body, timeout=5).close()

    thread = again(send, stop)
    try:
        found = served(f"http:127.0.0.1:{number}", "phone", 20)
    finally:
        stop.set()
        thread.join()
    assert found[-21:] == expected("phone", PHONE_ROWS)


def test_a_websocket():
    def send(port):
        for event in EVENTS:
            port.send(event.decode())

    with serve(send, "127.0.0.1", 0) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        number = server.socket.getsockname()[1]
        try:
            found = served(f"ws://127.0.0.1:{number}/sensors/connect?types=[]", "phone", 20)
        finally:
            server.shutdown()
            thread.join()
    assert found[-21:] == expected("phone", PHONE_ROWS)


def test_a_bluetooth_device(monkeypatch):
    """A device of the library's own kind, which notifies what a WitMotion would."""
    packets = [wit(0x51, (0, 0, 2048)) + wit(0x52, (10, n, 3)) for n in range(20)]

    class Client:
        def __init__(self, device, disconnected_callback, timeout):
            self.device, self.gone = device, disconnected_callback

        async def __aenter__(self):
            assert self.device == "D9:41:48:15:5E:FB"
            return self

        async def __aexit__(self, *_):
            return None

        async def start_notify(self, characteristic, take):
            assert characteristic == PACKETS["witmotion"].notify
            for packet in packets:
                take(0, bytearray(packet))
            self.gone(self)

    monkeypatch.setattr(bleak, "BleakClient", Client)
    with live_source("ble:D9:41:48:15:5E:FB", PACKETS["witmotion"]) as file:
        assert file.read() == b"".join(packets)


def test_a_bluetooth_device_that_is_not_there_is_told(monkeypatch):

    def client(*_, **__):
        raise RuntimeError("no adapter")

    monkeypatch.setattr(bleak, "BleakClient", client)
    with (
        live_source("ble:D9:41", PACKETS["witmotion"]) as file,
        pytest.raises(OSError, match="ble:D9:41: no adapter"),
    ):
        file.read()


@pytest.mark.parametrize(
    "address",
    [
        *("", "serial", "serial:", "usb:1", "tcp:5000", "udp:host:port"),
        *("serial:/dev/null@fast", "http:127.0.0.1:99999", "ble:D9:41"),
    ],
)
def test_what_is_no_address_is_refused(address):
    with pytest.raises(AddressError, match="takes "), live_source(address, None):
        pass


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--from", "usb:1"], "--from takes one of serial:DEVICE@BAUD, "),
        (["--form", "vesc"], "--form takes one of phone, witmotion, xio, xsens, got 'vesc'"),
        (["--form", "xio", "--udp", "127.0.0.1:0"], "--udp takes lines only; --from udp:"),
        (["--from", "tcp:a:1", "--udp", "127.0.0.1:0"], "give only one of SOURCE, --from"),
        (["--form", "xio", "--fields", "3"], "--fields has no effect with --form"),
    ],
)
def test_what_does_not_go_together_is_refused(options, sentence, capsys):
    assert run(["stream", "--rate", "100", *options]) == 2
    assert sentence in capsys.readouterr().err


def test_a_device_that_is_not_there_is_a_fault(capsys):
    assert run(["stream", "--rate", "100", "--from", "serial:/dev/nothing"]) == 1
    assert "serial:/dev/nothing cannot be read: " in capsys.readouterr().err


@pytest.mark.parametrize(
    ("address", "module"),
    [("serial:/dev/null", "serial"), ("ws://a/", "websockets"), ("ble:D9:41", "bleak")],
)
def test_a_package_that_is_missing_is_named(monkeypatch, capsys, address, module):
    monkeypatch.setattr("zerorate.tasks.live.sources.find_spec", lambda name: None)
    assert run(["stream", "--rate", "100", "--form", "witmotion", "--from", address]) == 2
    assert f"needs {module}: run pip install '.[live]'" in capsys.readouterr().err


def test_every_kind_of_source_is_told(capsys):
    assert run(["stream", "--help"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert all(name in said for name in SOURCES)


def test_forms_are_listed(capsys):
    assert run(["formats"]) == 0
    said = capsys.readouterr().out
    assert all(f"\n  {name} " in said for name in PACKETS)


def test_json_of_a_phone_may_hold_several_events():
    raw = json.dumps([json.loads(event) for event in EVENTS]).encode() + b"\n"
    rows = list(PACKETS["phone"].decoder().feed(raw))
    assert [tuple(row) for row in rows] == PHONE_ROWS
