"""`zerorate stream` as users run it: through pipes, FIFOs, terminals and datagrams."""

import json
import os
import pty
import signal
import socket
import subprocess
import sys
import tty
import urllib.request
import zlib
from contextlib import suppress

import numpy as np
import pytest

import zerorate as zr
from support.killed import left_by_a_kill
from support.streams import Asked, lines_of, streamed
from zerorate.cli import run
from zerorate.tasks.exclusion_counts import ExclusionCounts

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="FIFOs and signals are of POSIX")

RATE = ("--rate", "100")
Z = 0.5 + 0.1 * np.random.default_rng(1).standard_normal((300, 2))
LINES = lines_of(Z)
EXPECTED = lines_of(
    zr.DriftFilter(100.0, method="auto", output="compensated", channels=2).process(Z)
)


ALL = "no header: all 2 columns are filtered as gyros"


def told_of(z, names=("column 0", "column 1"), opening=ALL, **options):
    """Return what stderr says: what is filtered, and at the end what the filter has left out."""
    filter_ = zr.DriftFilter(100.0, channels=len(names), **options)
    filter_.process(z)
    sentences = ExclusionCounts.of(filter_).sentences(names, len(z), options.get("limit"))
    return "".join(f"zerorate: {sentence}\n" for sentence in filter(None, [opening, *sentences]))


def position(checkpoint, capsys):
    assert run(["stream", "--checkpoint", str(checkpoint), "--position"]) == 0
    return int(capsys.readouterr().out)


def test_each_answer_comes_before_the_next_line_is_sent():
    with Asked(*RATE) as asked:
        assert asked.ask("wx,wy") == "wx,wy"
        assert [asked.ask(line) for line in LINES] == EXPECTED
        assert asked.end() == (0, [], told_of(Z, ("wx", "wy"), "filters wx, wy"))


def test_options_reach_the_filter():
    options = "--method kf --output-kind estimate --motion hold --with bias,at_rest --columns 1"
    code, answers, errors = streamed(LINES, *RATE, *options.split())
    alone = zr.DriftFilter(100.0, method="kf", motion="hold", output="estimate")
    trace = alone.copy().trace(Z[:, 1])
    columns = (alone.process(Z[:, 1]), trace.bias, trace.at_rest)
    opening = "filters column 1; passes on 0"
    message = told_of(Z[:, 1:], ("column 1",), opening, method="kf", motion="hold")
    assert (code, errors) == (0, message)
    found = np.array([[float(cell) for cell in answer.split(",")] for answer in answers])
    np.testing.assert_array_equal(found, np.column_stack((Z[:, 0], *columns)))


def test_a_log_is_filtered_as_it_stands_with_its_time_and_accelerometers():
    counts = np.rint(131 * Z).astype(int)
    lines = [f"{5 * i},{i % 3},{x},{y}" for i, (x, y) in enumerate(counts)]
    options = ("--device", "mpu6050", "--range", "250")
    code, answers, errors = streamed(["millis,az,gx,gy", *lines], *RATE, *options)
    limits = {"rest_limit": 10.0, "bias_limit": 20.0}
    alone = zr.DriftFilter(100.0, method="auto", output="compensated", channels=2, **limits)
    expected = lines_of(alone.process(counts / 131.0))
    before = [line.rsplit(",", 2)[0] for line in lines]
    assert (code, answers[0]) == (0, "millis,az,gx,gy")
    assert [line.rsplit(",", 2)[0] for line in answers[1:]] == before
    np.testing.assert_allclose(
        *(
            np.array([line.split(",")[-2:] for line in some], dtype=float)
            for some in (answers[1:], expected)
        ),
        rtol=1e-9,
        atol=1e-12,
    )
    message = "zerorate: filters gx, gy times 0.00763359 in deg/s; passes on millis, az\n"
    assert errors.startswith(message)


def test_a_log_of_ours_begins_with_a_comment_and_is_filtered(tmp_path):
    log = tmp_path / "gyro.csv"
    assert run(["simulate", "MPU-6050", "-o", str(log), "--duration", "2"]) == 0
    lines = log.read_text().splitlines()
    assert lines[0].startswith("# zerorate")
    code, answers, errors = streamed(lines, *RATE)
    assert (code, len(answers)) == (0, len(lines) - 1), errors
    assert answers[0] == lines[1]


def test_rate_and_unit_of_a_first_line_are_taken(tmp_path):
    head = "# rate: 100 Hz, unit: deg/s"
    expected = streamed(["wx,wy", *LINES], *RATE, "--unit", "deg/s")
    assert (
        streamed(
            [head, "wx,wy", *LINES],
        )
        == expected
    )
    other = streamed([head, "wx,wy", *LINES], "--unit", "rad/s")
    assert other == streamed(["wx,wy", *LINES], *RATE, "--unit", "rad/s")
    path = tmp_path / "lines.txt"
    path.write_text("\n".join([head, "wx,wy", *LINES]) + "\n")
    assert streamed([], str(path)) == expected


def test_a_calibration_is_read_from_its_file(tmp_path):
    session = zr.simulation.simulate_session(12, seed=3)
    path = tmp_path / "cal.json"
    path.write_text(session.truth.to_json())
    rows = session.recording.gyro.data[:200]
    head = ",".join(f"gyro_{a}_dps" for a in "xyz")
    code, answers, _ = streamed([head, *lines_of(rows)], *RATE, "--calibration", path)
    plain = streamed([head, *lines_of(rows)], *RATE)[1]
    assert (code, len(answers)) == (0, 201)
    assert answers != plain
    for options in (
        ("--calibration", tmp_path / "none.json"),
        ("--calibration", path, "--attitude"),
    ):
        assert streamed([head], *RATE, *options)[0] != 0


def test_what_is_garbled_before_the_first_line_is_told_and_passed_over():
    code, answers, errors = streamed(["0.5,0.2", "0.5"], *RATE, "--fields", "1")
    assert (code, len(answers)) == (0, 1), errors
    assert "line 1: it has 2 cells, expected 1; it counts as missing" in errors


def test_raw_counts_are_told_of_once():
    lines = [f"{i % 7},{i % 5}" for i in range(300)]
    code, _, errors = streamed(lines, *RATE)
    message = "column 0, column 1 are whole numbers without a unit, as raw counts are: for an "
    assert (code, errors.count(message)) == (0, 1)
    assert "--device MPU-6050 --range 250, or --scale and --unit, make deg/s of them" in errors
    assert "raw counts" not in streamed(lines, *RATE, "--scale", "1/131")[2]


def test_parameters_of_a_published_method_reach_the_filter():
    options = (
        "--method fading --output-kind estimate --order 3,0 --fading 0.9 --adapt-for always "
        "--forgetting-factor 0.999 --process-noise 0.2 --startup 0.5 --noise hadamard"
    )
    code, answers, errors = streamed(LINES, *RATE, *options.split())
    alone = zr.DriftFilter(
        100.0,
        order=(3, 0),
        method="fading",
        fading=0.9,
        adapt_for=None,
        forgetting_factor=0.999,
        process_noise=0.2,
        startup=0.5,
        noise="hadamard",
        channels=2,
        output="estimate",
    )
    assert (code, answers, errors) == (0, lines_of(alone.process(Z)), f"zerorate: {ALL}\n")


class TestWhatRestCanBe:
    """A sensor that turns for ten seconds, then rests for ten."""

    Z = 0.5 + 0.1 * np.random.default_rng(3).standard_normal(2000)
    Z[:1000] += 20.0 * np.sin(np.arange(1000) / 30.0)

    @pytest.mark.every(2)
    @pytest.mark.parametrize(
        ("options", "limits"),
        [
            ("--unit deg/s", {"rest_limit": 10.0, "bias_limit": 20.0}),
            ("--unit dps --rest-limit 2", {"rest_limit": 2.0, "bias_limit": 20.0}),
            ("--unit deg/s --bias-limit none", {"rest_limit": 10.0}),
            ("--rest-limit 10", {"rest_limit": 10.0}),
            ("--unit deg/s --rest-limit none --bias-limit none", {}),
            ("--unit deg/s --motion ignore", {"motion": "ignore"}),
            ("--unit g", {}),
            ("", {}),
        ],
    )
    def test_it_is_known_where_the_unit_is(self, options, limits):
        code, answers, errors = streamed(lines_of(self.Z), *RATE, *options.split())
        alone = zr.DriftFilter(100.0, method="auto", output="compensated", **limits)
        assert (code, answers) == (0, lines_of(alone.process(self.Z)))
        assert errors == told_of(self.Z[:, np.newaxis], ("column 0",), None, **limits)

    def test_another_unit_is_the_same_sensor(self):
        answers = [
            np.array(streamed(lines_of(z), *RATE, "--unit", unit)[1], dtype=float)
            for z, unit in ((self.Z, "deg/s"), (np.radians(self.Z), "rad/s"))
        ]
        np.testing.assert_allclose(np.degrees(answers[1]), answers[0], rtol=1e-9, atol=1e-12)
        # Before it rests nothing is taken off.
        np.testing.assert_array_equal(answers[0][:1000], self.Z[:1000])


def test_what_was_left_out_is_flagged_and_told():
    z = 0.5 + 0.1 * np.random.default_rng(2).standard_normal((2000, 2))
    z[500:600, 0] = z[500, 0]
    z[1000:1003, 1] = 250.0
    options = ("--limit", "250", "--with", "saturated,stuck")
    code, answers, errors = streamed(["wx,wy", *lines_of(z)], *RATE, *options)
    assert answers[0] == "wx,wy,saturated_wx,saturated_wy,stuck_wx,stuck_wy"
    flags = np.array([list(map(int, line.split(",")[2:])) for line in answers[1:]])
    trace = zr.DriftFilter(100.0, method="auto", limit=250.0, channels=2).trace(z)
    np.testing.assert_array_equal(flags, np.hstack([trace.saturated, trace.stuck]))
    assert answers[1001].split(",")[1] == "nan"
    assert (code, errors) == (0, told_of(z, ("wx", "wy"), "filters wx, wy", limit=250.0))
    assert "zerorate: saturated, at or beyond the limit of 250, so missing: wy 3 of 2000" in errors
    assert "zerorate: left out because the sensor was stuck at one value: wx 100 of 2000" in errors


def test_a_garbled_line_is_told_and_the_stream_goes_on():
    lines = [*LINES[:100], "0.1,*", *LINES[101:]]
    code, answers, errors = streamed(lines, *RATE)
    z = Z.copy()
    z[100] = np.nan
    alone = zr.DriftFilter(100.0, method="auto", output="compensated", channels=2)
    assert (code, answers) == (0, lines_of(alone.process(z)))
    assert errors.splitlines() == [
        f"zerorate: {ALL}",
        "zerorate: line 101: '*' is not a number; it counts as missing",
        *told_of(z, opening=None).splitlines(),
        "zerorate: garbled lines: 1",
    ]


def test_many_garbled_lines_are_told_ten_times():
    code, answers, errors = streamed(["1", *["x"] * 50], *RATE)
    assert (code, answers[1:]) == (0, ["nan"] * 50)
    assert len(errors.splitlines()) == 11
    assert errors.endswith("garbled lines: 50\n")


def test_a_line_without_an_end_does_not_fill_the_memory():
    code, answers, errors = streamed(["1", "1" * 3_000_000, "1"], *RATE)
    assert (code, answers) == (0, ["0.0", "nan", "0.0"])
    assert "line 2: '1111" in errors


def test_lost_samples_are_counted():
    lines = [f"{i} {i % 7}" for i in [*range(10), *range(13, 20), 15]]
    code, answers, errors = streamed(lines, *RATE, "--sequence", "0")
    assert (code, len(answers), answers[-1]) == (0, 18, "15,nan")
    assert errors == (
        "zerorate: filters column 1; passes on 0\n"
        "zerorate: 20 samples, 3 of them lost; 1 came late or twice; the numbers restarted 0 "
        "times\n"
    )


def test_a_counter_of_a_byte_wraps_many_times():
    lines = [f"{i % 256} {i % 7 / 8}" for i in range(3000) if i != 700]
    code, answers, errors = streamed(lines, "--rate", "1000", "--sequence", "0")
    assert (code, sum("nan" in answer for answer in answers)) == (0, 0)
    assert errors == (
        "zerorate: filters column 1; passes on 0\n"
        "zerorate: 3000 samples, 1 of them lost; 0 came late or twice; the numbers restarted 0 "
        "times; they wrap after 255\n"
    )


def test_a_new_beginning_is_told_at_once():
    with Asked("--rate", "1000", "--sequence", "0") as asked:
        for i in [*range(100), *range(31)]:
            asked.ask(f"{i},0.5")
        assert asked.ask("31,0.5") == "31,0.0"
        assert "filters" in asked.process.stderr.readline()
        message = asked.process.stderr.readline()
        assert message == "zerorate: line 132: the sequence numbers restart, here with 31\n"
        code, _, errors = asked.end()
    assert code == 0
    assert "31 came late or twice; the numbers restarted 1 times" in errors


def test_many_new_beginnings_are_told_ten_times():
    lines = [f"{10**7 * i},0.5" for i in range(200)]
    code, _, errors = streamed(lines, *RATE, "--sequence", "0")
    assert (code, errors.count("restart, here with")) == (0, 10)


class TestClosedDescriptors:
    """What a shell closes by ``2>&-`` must not be what another file is opened as."""

    @staticmethod
    def closed(descriptors, *options):
        command = [sys.executable, "-m", "zerorate", "stream", *map(str, options)]
        shell = ["sh", "-c", f'exec "$@" {descriptors}', "sh", *command]
        return subprocess.run(shell, input="1\nx\n2\n", capture_output=True, text=True)

    def test_warnings_do_not_enter_the_answers(self, tmp_path):
        plain = self.closed("", *RATE)
        done = self.closed("2>&-", *RATE)
        assert (done.returncode, done.stdout) == (0, plain.stdout)

    def test_warnings_do_not_enter_a_file(self, tmp_path):
        source, state = tmp_path / "source", tmp_path / "state"
        source.write_text("1\nx\n2\n")
        options = (*RATE, source, "--checkpoint", state, "--every", "0.01")
        done = self.closed("0<&- 2>&-", *options)
        assert (done.returncode, done.stdout.count("\n")) == (0, 3)
        assert run(["stream", "--checkpoint", str(state), "--position"]) == 0

    def test_answers_that_go_nowhere_are_a_fault(self):
        done = self.closed(">&-", *RATE)
        assert (done.returncode, done.stdout) == (1, "")
        assert "could not be read or answered: " in done.stderr
        assert len(done.stderr.splitlines()) == 1

    def test_a_broken_stderr_does_not_end_the_stream(self):
        done = self.closed("2>/dev/full", *RATE)
        assert (done.returncode, done.stdout.count("\n")) == (0, 3)


class TestEnds:
    def test_nobody_reads_the_answers(self):
        with Asked(*RATE) as asked:
            asked.ask(LINES[0])
            asked.process.stdout.close()
            asked.send(LINES[1])
            # As the shell shows a process that SIGPIPE ended.
            assert asked.process.wait() == 141
            assert asked.process.stderr.read() == f"zerorate: {ALL}\n"

    @pytest.mark.parametrize(
        ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
    )
    def test_a_signal_saves_all_that_was_answered(self, tmp_path, capsys, number, code):
        checkpoint = tmp_path / "state"
        with Asked(*RATE, "--checkpoint", checkpoint, "--every", "1000") as asked:
            answers = [asked.ask(line) for line in LINES[:57]]
            asked.process.send_signal(number)
            assert asked.process.wait() == code
            expected = "zerorate: interrupted\n" if number == signal.SIGINT else ""
            assert asked.process.stderr.read() == f"zerorate: {ALL}\n{expected}"
        assert position(checkpoint, capsys) == 57
        code, rest, _ = streamed(LINES[57:], *RATE, "--checkpoint", checkpoint)
        assert (code, answers + rest) == (0, EXPECTED)


class TestSources:
    def test_a_fifo(self, tmp_path):
        fifo = tmp_path / "imu"
        os.mkfifo(fifo)
        with Asked(*RATE, fifo, stdin=subprocess.DEVNULL) as asked:
            with fifo.open("w", buffering=1) as source:
                for line, expected in zip(LINES, EXPECTED, strict=True):
                    source.write(f"{line}\n")
                    assert asked.process.stdout.readline() == f"{expected}\n"
            assert asked.end() == (0, [], told_of(Z))

    def test_a_terminal_as_serial_devices_are(self):
        device, theirs = os.openpty()
        # As `stty raw` does: else the device's CR LF would be two line ends.
        tty.setraw(theirs)
        with Asked(*RATE, os.ttyname(theirs), stdin=subprocess.DEVNULL) as asked:
            for line, expected in zip(LINES[:50], EXPECTED, strict=False):
                os.write(device, f"{line}\r\n".encode())
                assert asked.process.stdout.readline() == f"{expected}\n"
            asked.process.send_signal(signal.SIGINT)
            assert asked.process.wait() == 130
        os.close(device)
        os.close(theirs)

    def test_a_source_that_is_not_there(self, capsys, tmp_path):
        assert run(["stream", *RATE, str(tmp_path / "none")]) == 1
        assert "No such file" in capsys.readouterr().err


class TestDatagrams:
    def test_each_is_answered_to_its_sender(self):
        with Asked(*RATE, "--udp", "127.0.0.1:0", stdin=subprocess.DEVNULL) as asked:
            message = asked.process.stderr.readline()
            assert message.startswith("zerorate: listening on 127.0.0.1:")
            place = ("127.0.0.1", int(message.rsplit(":", 1)[1]))
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as source:
                # Generous: it only keeps a lost datagram from hanging the test.
                source.settimeout(60.0)
                for line, expected in zip(LINES, EXPECTED, strict=True):
                    source.sendto(line.encode(), place)
                    assert source.recv(1 << 16).decode() == expected
            asked.process.send_signal(signal.SIGINT)
            assert asked.process.wait() == 130

    @pytest.mark.parametrize(
        ("address", "message"),
        [
            ("5005", "takes HOST:PORT"),
            ("127.0.0.1:x", "takes HOST:PORT"),
            ("127.0.0.1:70000", "takes HOST:PORT"),
            ("0.0.0.0:0", "of this machine alone"),
            ("no host:5005", "--udp cannot use no host:5005: "),
        ],
    )
    def test_addresses_that_are_refused(self, capsys, address, message):
        assert run(["stream", *RATE, "--udp", address]) == 2
        assert message in capsys.readouterr().err


class TestRefused:
    @pytest.mark.parametrize(
        ("options", "message"),
        [
            ([], "--rate is required"),
            ([*RATE, "imu", "--udp", "127.0.0.1:0"], "give only one of SOURCE, --from and --udp"),
            (
                [*RATE, "--with", "gain"],
                "--with takes some of bias, bias_sigma, at_rest, saturated",
            ),
            ([*RATE, "--unit", "miles"], "unknown unit 'miles'"),
            ([*RATE, "--rest-limit", "-1"], "--rest-limit must be a positive number, got -1"),
            ([*RATE, "--rest-limit", "soon"], "--rest-limit takes a number or 'none', got 'soon'"),
            ([*RATE, "--bias-limit", "0"], "--bias-limit must be a positive number, got 0"),
            ([*RATE, "--limit", "abc"], "--limit takes a number"),
            ([*RATE, "--limit", "nan"], "--limit must be a positive number, got NaN"),
            (
                [*RATE, "--method", "kf", "--rest-limit", "3"],
                "--rest-limit has no effect on method 'kf', only on 'auto'",
            ),
            (
                [*RATE, "--motion", "ignore", "--rest-limit", "3"],
                "--rest-limit has no effect on motion 'ignore', only on 'hold'",
            ),
            ([*RATE, "--outliers", "reject"], "--outliers has no effect on method 'auto', only on"),
            ([*RATE, "--sequence", "0,1"], "--sequence takes one column"),
            ([*RATE, "--sequence-bits", "8"], "--sequence-bits needs --sequence"),
            (
                [*RATE, "--sequence", "0", "--sequence-bits", "65"],
                "--sequence-bits must be less than or equal to 64",
            ),
            ([*RATE, "--checkpoint", "state", "--every", "0"], "--every takes a positive"),
            ([*RATE, "--checkpoint", f"{__file__}/state"], "is not a folder"),
            ([*RATE, "--range", "250"], "--range needs --device"),
            ([*RATE, "--device", "BMI160", "--range", "300"], "--range is 300 deg/s, but the gyro"),
            ([*RATE, "--scale", "131,"], "--scale takes a number such as"),
            (["--rate", "-1"], "a positive number of samples a second"),
            (["--position"], "--position needs --checkpoint"),
            ([*RATE, "--order", "1,1"], "--order has no effect on method 'auto', only on"),
            ([*RATE, "--adapt-for", "1"], "--adapt-for has no effect on method 'auto', only on"),
            (
                [*RATE, "--method", "akf", "--fading", "0.9"],
                "--fading has no effect on method 'akf', only on 'fading'",
            ),
            ([*RATE, "--method", "kf", "--order", "2"], "--order takes two numbers"),
            ([*RATE, "--method", "kf", "--order", "9,1"], "order must be (p, q)"),
        ],
    )
    def test_usage(self, capsys, tmp_path, monkeypatch, options, message):
        monkeypatch.chdir(tmp_path)
        assert run(["stream", *options]) == 2
        errors = capsys.readouterr().err
        assert message in errors
        assert len(errors.splitlines()) == 1

    @pytest.mark.parametrize("name", ["stdin", "stdout"])
    def test_a_closed_pipe(self, capsys, monkeypatch, name):
        monkeypatch.setattr(sys, name, None)
        assert run(["stream", *RATE, os.devnull] if name == "stdout" else ["stream", *RATE]) == 1
        assert capsys.readouterr().err == f"zerorate: {name} is closed\n"

    def test_a_first_line_that_holds_no_sample(self):
        code, answers, errors = streamed(["0.1,abc"], *RATE)
        message = "zerorate: line 1: it has both names and numbers, expected either\n"
        assert (code, answers, errors) == (1, [], message)


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A checkpoint after a hundred samples."""
    path = tmp_path_factory.mktemp("saved") / "state"
    assert streamed(LINES[:100], *RATE, "--checkpoint", path)[0] == 0
    return path.read_bytes()


def sealed(state, whole):
    """Return a checkpoint of other JSON, with a right checksum."""
    filter_ = whole[12 + int.from_bytes(whole[8:12], "little") : -4]
    body = whole[:8] + len(state).to_bytes(4, "little") + state + filter_
    return body + zlib.crc32(body).to_bytes(4, "little")


class TestCheckpoints:
    @pytest.fixture
    def checkpoint(self, saved, tmp_path):
        path = tmp_path / "state"
        path.write_bytes(saved)
        return path

    def test_there_is_none_at_the_first_start(self, tmp_path, capsys):
        assert position(tmp_path / "state", capsys) == 0

    def test_no_sample_leaves_none(self, tmp_path):
        assert streamed([], *RATE, "--checkpoint", tmp_path / "state") == (0, [], "")
        assert list(tmp_path.iterdir()) == []

    def test_the_next_start_goes_on(self, checkpoint, capsys):
        assert position(checkpoint, capsys) == 100
        assert streamed(LINES[100:], *RATE, "--checkpoint", checkpoint)[1] == EXPECTED[100:]
        assert position(checkpoint, capsys) == 300

    @pytest.mark.parametrize(
        ("options", "message"),
        [
            (["--rate", "200"], "made with --rate 100, now it is 200"),
            ([*RATE, "--output-kind", "estimate"], "made with --output-kind compensated, now"),
            ([*RATE, "--with", "bias"], "made with --with none, now it is bias"),
            ([*RATE, "--startup", "2"], "made with --startup 1, now it is 2"),
            ([*RATE, "--limit", "9"], "made with --limit none, now it is 9"),
            ([*RATE, "--unit", "deg/s"], "made with --unit none, now it is deg/s"),
            ([*RATE, "--scale", "1/2"], "made with --scale none, now it is 0.5"),
            ([*RATE, "--noise-scale", "2"], "made with --noise-scale none, now it is 2"),
            ([*RATE, "--fields", "3"], "made with --fields 2, now it is 3"),
        ],
    )
    def test_other_options_are_refused(self, checkpoint, options, message, capsys):
        before = checkpoint.read_bytes()
        assert run(["stream", *options, "--checkpoint", str(checkpoint)]) == 2
        errors = capsys.readouterr().err
        assert message in errors
        assert len(errors.splitlines()) == 1
        assert checkpoint.read_bytes() == before

    @pytest.mark.every(2)
    @pytest.mark.parametrize("torn", ["short", "empty", "flipped", "foreign", "forged"])
    def test_a_torn_one_is_refused_and_kept_unless_forced(self, checkpoint, torn):
        whole = checkpoint.read_bytes()
        flipped = bytes([*whole[:50], whole[50] ^ 1, *whole[51:]])
        damaged = {
            "short": whole[:-9],
            "empty": b"",
            "flipped": flipped,
            "foreign": b"t,x\n1,2\n",
            "forged": sealed(b"[{}]", whole),
        }
        checkpoint.write_bytes(damaged[torn])
        code, answers, errors = streamed(LINES, *RATE, "--checkpoint", checkpoint)
        assert (code, answers, len(errors.splitlines())) == (1, [], 1)
        assert "--force starts again" in errors
        assert checkpoint.read_bytes() == damaged[torn]
        forced = streamed(LINES[:100], *RATE, "--checkpoint", checkpoint, "--force")
        assert forced == (0, EXPECTED[:100], told_of(Z[:100]))
        assert checkpoint.read_bytes() == whole

    def test_what_a_kill_left_is_removed_at_the_next_start(self, checkpoint):
        others = [".state.backup", ".zerorate", ".state"]
        for name in others:
            (checkpoint.parent / name).write_bytes(b"half")
        left_by_a_kill(checkpoint)
        assert streamed(LINES[100:], *RATE, "--checkpoint", checkpoint)[0] == 0
        names = sorted(path.name for path in checkpoint.parent.iterdir())
        assert names == sorted([*others, "state"])

    def test_force_goes_on_with_a_whole_one(self, checkpoint):
        forced = streamed(LINES[100:], *RATE, "--checkpoint", checkpoint, "--force")
        assert forced == (0, EXPECTED[100:], told_of(Z))

    def test_a_folder_that_vanishes_does_not_end_the_stream(self, tmp_path):
        folder = tmp_path / "folder"
        folder.mkdir()
        options = ("--checkpoint", folder / "state", "--every", "0.1")
        with Asked(*RATE, *options) as asked:
            asked.ask(LINES[0])
            folder.rmdir()
            answers = [asked.ask(line) for line in LINES[1:]]
            code, _, errors = asked.end()
        assert (code, answers) == (1, EXPECTED[1:])
        message = errors.replace(told_of(Z, opening=None), "").splitlines()[1:]
        assert [line.split(":")[1] for line in message] == [" the checkpoint cannot be written"] * 2


def test_a_page_shows_what_is_streamed():
    with Asked(*RATE, "--serve", "0") as asked:
        address = asked.process.stderr.readline()
        assert address.startswith("zerorate: watch at http://127.0.0.1:")
        for line in ("wx,wy", *LINES[:3]):
            asked.ask(line)
        with urllib.request.urlopen(f"{address.split()[-1]}events", timeout=60) as events:
            view = json.loads(events.readline().removeprefix(b"data: "))
            assert view["names"] == ["wx", "wy"]
            code, _, errors = asked.end()
            assert events.read().endswith(b"event: end\ndata: \n\n")
        assert (code, errors) == (0, "zerorate: filters wx, wy\n")


def test_a_port_that_is_taken_is_told(capsys):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        assert run(["stream", *RATE, "--serve", port]) == 2
    assert f"--serve cannot use port {port}: Address already in use" in capsys.readouterr().err


def test_a_terminal_shows_what_is_streamed(tmp_path, capfd):
    assert run(["stream", *RATE, "--show"]) == 2
    assert "--show needs a terminal on stderr" in capfd.readouterr().err

    source = tmp_path / "lines"
    source.write_text("\n".join(["wx,wy", *LINES]), encoding="utf-8")
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "zerorate", "stream", str(source), *RATE, "--show"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=theirs) as process:
        os.close(theirs)
        shown = b""
        with suppress(OSError):  # how a terminal ends
            while more := os.read(ours, 1 << 16):
                shown += more
        answers = process.stdout.read().decode().splitlines()
    os.close(ours)
    assert answers == ["wx,wy", *EXPECTED]
    assert process.returncode == 0
    assert "3.0 s" in shown.decode()
    assert "filters wx, wy" in shown.decode()


def test_answers_are_not_printed_over_what_is_shown(tmp_path):
    source = tmp_path / "lines"
    source.write_text("\n".join(["wx,wy", *LINES]), encoding="utf-8")
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "zerorate", "stream", str(source), *RATE, "--show"]
    with subprocess.Popen(command, stdout=theirs, stderr=theirs) as process:
        os.close(theirs)
        shown = b""
        with suppress(OSError):
            while more := os.read(ours, 1 << 16):
                shown += more
    os.close(ours)
    assert process.returncode == 0
    assert EXPECTED[-1] not in shown.decode()


STAMPS = 10_000 * (np.arange(300) // 5 * 5 + 4)


def test_stamps_of_blocks_with_a_loss_are_those_of_a_replay():
    kept = np.delete(np.arange(300), np.arange(200, 210))
    lines = [f"{STAMPS[i]},{LINES[i]}" for i in kept]
    options = ("--time", "0", "--time-unit", "us")
    code, answers, errors = streamed(lines, *RATE, *options)
    filter_, z = zr.DriftFilter(100.0, channels=2), Z.copy()
    z[200:210] = np.nan
    expected = lines_of(filter_.process(z)[kept])
    assert code == 0
    assert [line.split(",", 1)[1] for line in answers[-50:]] == expected[-50:]
    assert "clock: 232 equal stamps; samples are taken a period apart" in errors
    assert "clock: 1 gap; 10 samples taken as missing" in errors


def test_a_unit_of_time_needs_its_column():
    code, _, errors = streamed(LINES, *RATE, "--time-unit", "us")
    assert code == 2
    assert "--time-unit needs --time, the column of the timestamps" in errors


def test_a_limit_holds_for_attitudes():
    rows = np.tile([0.0, 0.0, 1.0, 0.0, 0.0, 1.0], (100, 1))
    rows[50:52, 2] = 600.0
    units = ("--attitude", "--unit", "deg/s,g")
    for limit, left_out in ((), False), (("--limit", "500"), True):
        code, _, errors = streamed(lines_of(rows), *RATE, *units, *limit)
        assert code == 0
        message = "rates left out as impossible: 2 beyond the gyro's range of 500 deg/s"
        assert (message in errors) == left_out
