"""How live sources end: torn, closed, at a limit, by a signal; and who may send to a listener."""

import asyncio
import contextlib
import http.client
import os
import pty
import random
import resource
import signal
import socket
import subprocess
import sys
import threading
import time
import tty

import bleak
import pytest
from websockets.sync.server import serve

from support.inside import called
from zerorate.cli import run
from zerorate.show.live_page import LivePage
from zerorate.tasks.live import LineStream, Settings, listeners, sources
from zerorate.tasks.live.listeners import CUT, Access, ByteQueue, DatagramPort
from zerorate.tasks.live.serving import Saver
from zerorate.tasks.live.sources import Ending, live_source

RATE = ("--rate", "100")
LINES = [f"{n / 8},{-n / 4},103" for n in range(1, 40)]


@contextlib.contextmanager
def sending(send):
    """Serve one connection of TCP, and give its address."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def work():
            with contextlib.suppress(OSError):
                port, _ = server.accept()
                with port:
                    send(port)

        thread = threading.Thread(target=work, daemon=True)
        thread.start()
        yield f"127.0.0.1:{server.getsockname()[1]}"
        thread.join(5)


def streamed(address, capsys, *options):
    code = run(["stream", *RATE, "--from", address, *options])
    said = capsys.readouterr()
    return code, said.out.splitlines(), said.err


@pytest.mark.parametrize("seed", range(8))
def test_a_line_that_the_end_cuts_is_missing(seed, capsys):
    text = "\n".join(LINES) + "\n"
    cut = random.Random(seed).randrange(len(text) - 60, len(text) + 1)
    whole = text[:cut].count("\n")
    torn = not text[:cut].endswith("\n")
    with sending(lambda port: port.sendall(text[:cut].encode())) as address:
        code, answers, message = streamed(f"tcp:{address}", capsys)
    assert len(answers) == whole + torn
    assert code == torn
    assert ("within a line" in message) == torn
    assert "closed by the server" in message
    if torn:
        assert answers[-1] == "nan,nan,nan"
        assert "garbled lines: 1" in message


def test_a_connection_that_is_reset_is_torn(capsys):
    def send(port):
        port.sendall(b"1,2,3\n4,5,10")
        time.sleep(0.3)
        port.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")

    with sending(send) as address:
        code, answers, message = streamed(f"tcp:{address}", capsys)
    assert code == 1
    assert answers[-1] == "nan,nan,nan"
    assert "torn: Connection reset by peer, within a line" in message


@pytest.mark.parametrize("kind", ["closed", "torn", "large"])
def test_the_end_of_a_websocket_is_told(kind, capsys, monkeypatch):
    monkeypatch.setattr(sources, "_MAX_PUSH_BYTES", 1000)

    def send(port):
        port.send("0.1,0.2,0.3")
        if kind == "torn":
            port.socket.shutdown(socket.SHUT_RDWR)
        if kind == "large":
            port.send("1" * 2000)
            time.sleep(0.5)

    with serve(send, "127.0.0.1", 0) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        number = server.socket.getsockname()[1]
        code, answers, message = streamed(f"ws://127.0.0.1:{number}/", capsys)
        server.shutdown()
        thread.join()
    assert len(answers) == 1
    assert code == (kind != "closed")
    said = {"closed": "closed by the server", "torn": "torn: ", "large": "limit: a message has"}
    assert said[kind] in message


def pushed(number, body, *, length=None, host=None, **headers):
    """Return the status of a push, which may say another length than it has."""
    with socket.create_connection(("127.0.0.1", number), 5) as port:
        lines = {
            "Host": host or f"127.0.0.1:{number}",
            "Content-Length": len(body) if length is None else length,
            **headers,
        }
        head = "".join(f"{name.replace('_', '-')}: {value}\r\n" for name, value in lines.items())
        port.sendall(f"POST /data HTTP/1.1\r\n{head}\r\n".encode() + body)
        port.shutdown(socket.SHUT_WR)
        return int(port.recv(1 << 16).split()[1])


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as port:
        return port.getsockname()[1]


@pytest.fixture
def listening():
    number, ending = free_port(), Ending()
    with live_source(f"http:127.0.0.1:{number}", None, Access(), ending) as file:
        yield number, file, ending


@pytest.mark.parametrize("seed", range(5))
def test_a_push_that_is_cut_is_missing(listening, seed):
    number, file, ending = listening
    body = "\n".join(LINES[:5]).encode()
    cut = random.Random(seed).randrange(1, len(body))
    assert pushed(number, body[:cut], length=len(body)) == 400
    assert pushed(number, b"7,8,9") == 200
    whole = body[:cut].split(b"\n")
    found = [file.readline() for _ in range(len(whole) + 1)]
    assert found == [*(line + b"\n" for line in whole[:-1]), whole[-1] + b"...\n", b"7,8,9\n"]
    assert f"the first: a push had {cut} of its {len(body)} bytes" in "".join(ending.sentences())


@pytest.mark.parametrize(
    "length", ["", "-1", "x", "9" * 5000, "1e3", "٣", "9" * 12, "0x10", "5000000"]
)
def test_lengths_that_are_none_are_refused(listening, length):
    number, file, _ = listening
    assert pushed(number, b"1,2,3", length=length) == 413
    assert pushed(number, b"1,2,3") == 200
    assert file.readline() == b"1,2,3\n"


FOREIGN = [
    {"host": "evil.example"}, {"host": "evil.example:{}"}, {"host": "127.0.0.1:1"}, {"host": ":{}"},
    {"host": "127.0.0.1.evil.example:{}"}, {"host": "192.168.1.5:{}"}, {"Origin": "null"},
    {"Origin": "http://evil.example"}, {"Origin": "https://127.0.0.1:{}"},
    {"Origin": "http://127.0.0.1:{}.evil.example"}, {"Origin": "http://localhost:1"},
]  # fmt: skip


@pytest.mark.parametrize("headers", FOREIGN, ids=str)
def test_pages_of_other_sites_feed_nobody_and_read_nothing(listening, headers):
    number, _, _ = listening
    own = {name: text.format(number) for name, text in headers.items()}
    assert pushed(number, b"1,2,3", **own, Content_Type="text/plain") == 403
    with LivePage(0) as page:
        place = page.address.removeprefix("http://").rstrip("/")
        port = place.rpartition(":")[2]
        own = {name.capitalize(): text.format(port) for name, text in headers.items()}
        connection = http.client.HTTPConnection(place, timeout=20)
        connection.request("GET", "/", headers=own)
        assert connection.getresponse().status == 403
        connection.close()


def test_own_names_and_pages_are_answered(listening):
    number, _, _ = listening
    for host in ("127.0.0.1", "localhost", "LocalHost"):
        own = f"{host}:{number}"
        assert pushed(number, b"1,2,3", host=own, Origin=f"http://{own}") == 200


@pytest.mark.parametrize(
    ("allow", "peer", "admitted"),
    [
        (None, "127.0.0.1", True), (None, "::1", True), (None, "192.168.1.9", False),
        (None, "::ffff:127.0.0.1", True), ("192.168.1.9", "192.168.1.9", True),
        ("192.168.1.9", "192.168.1.8", False), ("192.168.1.0/24", "192.168.1.8", True),
        ("192.168.1.7/24", "192.168.1.8", True), ("10.0.0.1, fe80::/10", "fe80::1%eth0", True),
        ("any", "8.8.8.8", True), ("any", "2001:db8::1", True), ("my.name", "8.8.8.8", False),
        ("192.168.1.0/24", "::ffff:192.168.1.3", True),
    ],
)  # fmt: skip
def test_those_who_may_send(allow, peer, admitted):
    assert Access.of(allow).admits_peer(peer) is admitted


@pytest.mark.parametrize("kind", ["http", "udp"])
@pytest.mark.parametrize("host", ["0.0.0.0", "[::]"])
def test_an_address_that_others_reach_needs_a_word(kind, host, capsys):
    assert run(["stream", *RATE, "--from", f"{kind}:{host}:0"]) == 2
    message = capsys.readouterr().err
    assert "listens at an address of this machine alone" in message
    assert "--allow ADDRESS" in message
    with live_source(f"{kind}:0.0.0.0:0", None, Access.of("192.168.1.0/24")):
        pass


@pytest.mark.parametrize(
    "address",
    [
        "tcp:a..b:5", "tcp:" + "a" * 70 + ".b:5", "tcp:127.0.0.1:" + "9" * 5000, "tcp:x:٣",
        "udp:a..b:5", "http:a..b:5", "http:127.0.0.1:" + "9" * 5000, "ws://a..b:5/",
        "ws://127.0.0.1:99999/", "ws://[::1/", "serial:/dev/null@" + "9" * 5000, "ws:", "ws:x",
        "serial:/dev/null@١", "tcp:\x00:5",
    ],
)  # fmt: skip
def test_addresses_of_any_kind_are_a_sentence(address, capsys):
    assert run(["stream", *RATE, "--from", address]) in (1, 2)
    message = capsys.readouterr().err
    assert message.startswith("zerorate: ")
    assert "ZERORATE_TRACEBACK" not in message


def test_the_queue_is_bounded_by_bytes():
    pieces = ByteQueue(1000)
    taken = [pieces.put(b"x" * size) for size in (600, 300, 200, 100, 1)]
    assert taken == [True, True, False, True, False]
    assert pieces.dropped_count == 2
    assert len(pieces.get()) == 1000
    assert pieces.put(b"y")
    pieces.end()
    assert (pieces.get(), pieces.get()) == (b"y", b"")


def test_pushes_that_find_no_room_are_refused_and_told(monkeypatch):
    monkeypatch.setattr(sources, "ByteQueue", lambda: ByteQueue(100))
    number, ending = free_port(), Ending()
    with live_source(f"http:127.0.0.1:{number}", None, Access(), ending):
        codes = [pushed(number, b"1" * 59) for _ in range(4)]
    assert codes == [200, 503, 503, 503]
    assert list(ending.sentences()) == [
        "3 pushes were dropped: the filter is slower than the source"
    ]


@pytest.mark.parametrize("seed", range(6))
def test_datagrams_that_find_no_room_are_dropped_and_told(monkeypatch, seed):
    rng = random.Random(seed)
    sent, limit = [b"%d\n" % n * rng.randrange(1, 9) for n in range(60)], rng.randrange(1, 400)
    queue, number, ending = ByteQueue(limit), free_port(), Ending()
    monkeypatch.setattr(sources, "ByteQueue", lambda: queue)
    with (
        live_source(f"udp:127.0.0.1:{number}", None, Access(), ending) as source,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        kept, size = [], 0
        for datagram in sent:
            before = queue.dropped_count, len(queue._pieces)
            sender.sendto(datagram, ("127.0.0.1", number))
            while (queue.dropped_count, len(queue._pieces)) == before:
                time.sleep(1e-4)
            if size + len(datagram) <= limit:
                kept.append(datagram)
                size += len(datagram)
        whole = b"".join(kept)
        assert source.read(len(whole)) == whole
    dropped = len(sent) - len(kept)
    message = f"{dropped} datagrams were dropped: the filter is slower than the source"
    assert list(ending.sentences()) == [message]


@pytest.mark.skipif(sys.platform != "linux", reason="others do not count them")
@pytest.mark.parametrize("seed", range(4))
def test_datagrams_that_the_system_drops_are_counted(seed):
    rng = random.Random(seed)
    with (
        sources.bound_socket("127.0.0.1", 0, Access()) as port,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        port.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, rng.randrange(1 << 13, 1 << 17))
        port.settimeout(0.2)
        received, sent, found = DatagramPort(port, Access()), 0, 0
        for _ in range(3):
            for _ in range(rng.randrange(500, 1000)):
                sender.sendto(bytes(rng.randrange(1000, 1400)), port.getsockname())
                sent += 1
            with contextlib.suppress(TimeoutError):
                while received.receive(1 << 16):
                    found += 1
        sender.sendto(b"last", port.getsockname())
        assert received.receive(1 << 16)[0] == b"last"
        assert received.dropped_count == sent - found > 0
        (message,) = received.sentences()
        assert message.startswith(f"{sent - found} datagrams were dropped by the system")


@pytest.mark.skipif(sys.platform != "linux", reason="others do not say so")
def test_a_datagram_that_is_cut_is_marked():
    with (
        sources.bound_socket("127.0.0.1", 0, Access()) as port,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        received = DatagramPort(port, Access())
        for size in (99, 100, 101, 5000):
            sender.sendto(b"1" * size, port.getsockname())
            raw = received.receive(100)[0]
            assert raw == b"1" * size if size <= 100 else raw.endswith(CUT)


@pytest.mark.parametrize("what", ["page", "pushes"])
def test_idle_connections_make_room(what, listening):
    with LivePage(0) as page, contextlib.ExitStack() as idle:
        number = listening[0] if what == "pushes" else int(page.address[17:].rstrip("/"))
        for _ in range(3 * listeners._MAX_CONNECTIONS):
            port = socket.create_connection(("127.0.0.1", number), 5)
            idle.callback(port.close)
        if what == "pushes":
            assert pushed(number, b"1,2,3") == 200
        else:
            connection = http.client.HTTPConnection("127.0.0.1", number, timeout=20)
            idle.callback(connection.close)
            connection.request("GET", "/")
            assert connection.getresponse().status == 200
        assert len(page._server._open) <= listeners._MAX_CONNECTIONS


@contextlib.contextmanager
def fast_websocket():
    def send(port):
        with contextlib.suppress(Exception):
            while True:
                port.send("0.1,0.2,0.3\n" * 2000)

    with serve(send, "127.0.0.1", 0) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        yield ["--from", f"ws://127.0.0.1:{server.socket.getsockname()[1]}/"]
        server.shutdown()


@contextlib.contextmanager
def terminal():
    leader, follower = pty.openpty()
    tty.setraw(leader)
    yield ["--from", f"serial:{os.ttyname(follower)}@115200"]
    os.close(leader)
    os.close(follower)


@contextlib.contextmanager
def idle_server():
    with sending(lambda _: time.sleep(20)) as address:
        yield ["--from", f"tcp:{address}"]


@contextlib.contextmanager
def options(*words):
    yield [*words]


SOURCES = {
    "stdin": lambda: options(),
    "udp": lambda: options("--from", f"udp:127.0.0.1:{free_port()}"),
    "answered": lambda: options("--udp", "127.0.0.1:0"),
    "http": lambda: options("--from", f"http:127.0.0.1:{free_port()}"),
    "page": lambda: options("--serve", "0"),
    "serial": terminal,
    "tcp": idle_server,
    "a server that does not answer": lambda: options("--from", "tcp:10.255.255.1:9"),
    "fast websocket": fast_websocket,
}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("kind", SOURCES)
def test_a_signal_ends_every_source_at_once(kind, number):
    with SOURCES[kind]() as words:
        command = [sys.executable, "-m", "zerorate", "stream", *RATE, *words]
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        )
        time.sleep(2.5)
        begin = time.monotonic()
        process.send_signal(number)
        process.stdin.flush()
        code = process.wait(20)
        took = time.monotonic() - begin
        process.stdin.close()
        process.stderr.close()
    assert code in (128 + number, -number, 1)
    assert took < 1.0 + 2.0 * (os.getloadavg()[0] > 4), (kind, took)


@pytest.mark.parametrize("cut", range(7))
def test_a_last_number_that_stdin_cuts_is_missing(cut):
    text = "".join(f"{n / 7:.4f},{n / 3:.4f}\n" for n in range(20, 40))
    given = text[: len(text) - 1 - cut]
    code, answers, message = called("stream", *RATE, given=given)
    assert code == 0
    assert len(answers.splitlines()) == 20
    whole = cut == 0
    assert (answers.splitlines()[-1] != "nan,nan") == whole
    assert ("garbled lines: 1" in message) != whole


@pytest.mark.parametrize("waits", ["to connect", "for notices", "to leave"])
def test_a_bluetooth_device_holds_nobody_up(waits, monkeypatch):
    class Client:
        def __init__(self, *_, **__):
            pass

        async def __aenter__(self):
            if waits == "to connect":
                await asyncio.sleep(20)
            return self

        async def __aexit__(self, *_):
            if waits == "to leave":
                await asyncio.sleep(20)

        async def start_notify(self, _, take):
            take(0, bytearray(b"1"))

    monkeypatch.setattr(bleak, "BleakClient", Client)
    with live_source("ble:D9:41/0000ffe4", None) as file:
        if waits != "to connect":
            assert file.read(1) == b"1"
        begin = time.monotonic()
    assert time.monotonic() - begin < 1.0


@pytest.mark.skipif(sys.platform == "win32", reason="descriptors are counted by POSIX")
def test_a_checkpoint_is_written_where_no_descriptor_is_left(tmp_path):
    stream = LineStream(Settings(100.0))
    stream.take("0.1,0.2,0.3")
    told = []
    saver = Saver(tmp_path / "state", 1, told.append)
    saver.finish(stream)
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    taken = []
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(300, before[0]), before[1]))
    try:
        with contextlib.suppress(OSError):
            while True:
                taken.append(os.open(os.devnull, os.O_RDONLY))
        stream.take("0.4,0.5,0.6")
        saver.finish(stream)
    finally:
        for descriptor in taken:
            os.close(descriptor)
        resource.setrlimit(resource.RLIMIT_NOFILE, before)
    assert told == []
    assert LineStream.from_bytes((tmp_path / "state").read_bytes()).samples == 2
