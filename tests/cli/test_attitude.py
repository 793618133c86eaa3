"""``zerorate attitude`` and ``zerorate stream --attitude``: files, and a line for every fault."""

import re
from functools import partial

import numpy as np
import pytest

import zerorate as zr
from support.commands import check_line, names, one_line
from support.logs import write_table
from support.streams import streamed
from zerorate.cli import run
from zerorate.geometry import rotations

MOTION = zr.simulate_motion("hand", duration=8.0, seed=3, magnet=[[5.0, 7.0]])
SENSORS = {"gyro_{}_radps": MOTION.gyro, "accel_{}_mps2": MOTION.accel, "mag_{}_ut": MOTION.mag}


def columns(sensors=SENSORS, reference=True):
    found = {"time_s": MOTION.time}
    for name, values in sensors.items():
        found |= {name.format(axis): values[:, i] for i, axis in enumerate("xyz")}
    if reference:
        found |= {f"ref_quat_{axis}": MOTION.quaternion[:, i] for i, axis in enumerate("wxyz")}
    return found


@pytest.fixture
def cli(call):
    """Run ``zerorate attitude``; return its code, stdout and stderr."""
    return partial(call, "attitude")


@pytest.fixture
def log(tmp_path):
    return write_table(tmp_path / "hand.csv", columns())


def test_it_writes_a_log_and_a_figure(cli, log, out):
    code, text, errors = cli(log, "-o", out)
    assert (code, errors) == (0, "")
    assert names(out) == ["hand-zerorate-attitude.parquet", "hand-zerorate-attitude.png"]
    assert "Attitude of hand.csv: nine axes, auto, to east, north, up" in text
    assert "Errors against the reference, deg" in text
    found = zr.read_log(out / "hand-zerorate-attitude.parquet")
    expected = zr.estimate_attitude(zr.read_recording(log)).quaternion
    np.testing.assert_array_equal(found.data, expected)


@pytest.mark.parametrize("suffix", ["csv", "npz"])
def test_options_reach_the_filter(cli, log, out, suffix):
    options = ("--frame", "ned", "--offline", "--no-mag", "--no-figure")
    code, text, _ = cli(log, "-o", out / f"a.{suffix}", *options, "--reference-frame", "enu")
    assert code == 0
    assert names(out) == [f"a.{suffix}"]
    assert "six axes, auto, offline, to north, east, down" in text
    expected = zr.estimate_attitude(
        zr.read_recording(log), frame="ned", offline=True, mag=False
    ).quaternion
    np.testing.assert_array_equal(zr.read_log(out / f"a.{suffix}").data, expected)


def test_constants_of_a_method_reach_the_filter(cli, log, out):
    typed = ("--method", "mahony", "--kp", "2", "--ki", "0.1", "--no-figure")
    assert cli(log, "-o", out / "a.npz", *typed)[0] == 0
    known = {"method": "mahony", "kp": 2.0, "ki": 0.1}
    expected = zr.estimate_attitude(zr.read_recording(log), **known).quaternion
    np.testing.assert_array_equal(zr.read_log(out / "a.npz").data, expected)


def test_a_hard_iron_is_learned(cli, tmp_path, out):
    motion = zr.simulate_motion("hand", duration=30.0, seed=3)
    found = {"time_s": motion.time}
    mag = motion.mag + np.array([20.0, -12.0, 9.0])
    for name, values in zip(SENSORS, (motion.gyro, motion.accel, mag), strict=True):
        found |= {name.format(axis): values[:, i] for i, axis in enumerate("xyz")}
    log = write_table(tmp_path / "iron.csv", found)
    typed = ("-o", out / "a.npz", "--learn-magnetometer", "--no-figure")
    assert cli(log, *typed)[0] == 0
    recording = zr.read_recording(log)
    written = zr.read_log(out / "a.npz").data
    expected = zr.estimate_attitude(recording, learn_magnetometer=True).quaternion
    np.testing.assert_array_equal(written, expected)
    assert np.any(written != zr.estimate_attitude(recording).quaternion)
    code, _, errors = cli(log, *typed, "--no-mag", "--force")
    assert (code, "no effect with --no-mag" in one_line(errors)) == (2, True)


def test_a_reference_of_another_frame_is_suspected(cli, log, out):
    _, text, _ = cli(log, "-o", out, "--frame", "ned", "--no-figure")
    assert "the reference has other earth axes" in one_line(text)


def test_a_reference_may_be_chosen(cli, out, tmp_path):
    table = {k.replace("ref_quat_", "mocap"): v for k, v in columns().items()}
    log = write_table(tmp_path / "run.csv", table)
    chosen = ("--reference", "mocapw,mocapx,mocapy,mocapz")
    code, text, _ = cli(log, "-o", out, "--no-figure", *chosen)
    assert (code, "Errors against" in text) == (0, True)


def test_units_are_given_and_asked_for(cli, tmp_path, out):
    sensors = {"g{}": np.degrees(MOTION.gyro), "a{}": MOTION.accel / 9.80665}
    log = write_table(tmp_path / "run.csv", columns(sensors, reference=False))
    code, text, errors = cli(log, "-o", out, "--no-figure")
    assert (code, text) == (1, "")
    check_line(errors, "gx, gy, gz: an attitude needs a gyro of a known unit, got 'unit'; give")
    assert "--unit" in errors
    code, _, errors = cli(log, "-o", out, "--no-figure", "--unit", "deg/s")
    assert code == 1
    check_line(errors, "ax, ay, az: an attitude needs an accelerometer of a known unit")
    assert cli(log, "-o", out, "--no-figure", "--unit", "deg/s,g")[0] == 0
    found = zr.read_log(out / "run-zerorate-attitude.parquet").data
    expected = zr.Attitude(100.0, mag=False).process(MOTION.gyro, MOTION.accel)
    # Degrees and g are rounded on their way.
    np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize(
    ("options", "code", "match"),
    [
        (("--frame", "up"), 2, "--frame takes enu, ned or nwu, got 'up'"),
        (("--method", "kf"), 2, "--method takes auto, complementary"),
        (("--method", "ekf", "--offline"), 2, "smooth is for method 'auto'"),
        (("--accel", "accel_2"), 1, "hand.csv: an attitude needs an accelerometer; there is no"),
        (("--reference", "a,b,c,d"), 2, "there is no column 'a'"),
        (("--columns", "gyro_x_radps"), 1, "an attitude needs a gyro of three axes, got 1"),
        (("-o", "a.json"), 2, "-o takes a folder, or a file as parquet, csv, npz"),
        (("--calibration", "none.json"), 1, "none.json: No such file"),
    ],
)
def test_refusals(cli, log, out, options, code, match):
    found, text, errors = cli(log, "-o", out, *options)
    assert (found, text) == (code, "")
    check_line(errors, match)
    assert names(out) == []


def test_nothing_is_replaced_unasked(cli, log, out):
    assert cli(log, "-o", out, "--no-figure")[0] == 0
    code, _, errors = cli(log, "-o", out, "--no-figure")
    assert code == 2
    check_line(errors, "exists already; pass --force")
    assert cli(log, "-o", out, "--no-figure", "--force")[0] == 0


HEADER = ",".join(columns(reference=False))
LINES = [
    ",".join(map(repr, row))
    for row in np.column_stack([*columns(reference=False).values()]).tolist()
]


def answered(values):
    """Return the quaternions in answers, after the time that passed through."""
    return np.array([[float(cell) for cell in line.split(",")][1:5] for line in values])


class TestStream:
    LIVE = ("--attitude", "--rate", "100", "--time", "time_s")

    def test_a_line_in_an_orientation_out(self):
        code, answers, errors = streamed([HEADER, *LINES], *self.LIVE, "--with", "disturbed")
        assert code == 0
        assert answers[0] == "time_s,quat_w,quat_x,quat_y,quat_z,disturbed"
        filter_ = zr.Attitude(100.0)
        own = filter_.trace(MOTION.gyro, MOTION.accel, MOTION.mag)
        np.testing.assert_array_equal(answered(answers[1:]), own["quaternion"])
        assert [int(line[-1]) for line in answers[1:]] == own["disturbed"].tolist()
        assert "magnetometer mag_x_ut, mag_y_ut, mag_z_ut; passes on time_s" in errors

    def test_what_was_lost_takes_its_time(self):
        lost = [300, 301, 500]
        kept = np.delete(np.arange(800), lost)
        _, answers, _ = streamed([HEADER, *(LINES[i] for i in kept)], *self.LIVE)
        sensors = [values.copy() for values in (MOTION.gyro, MOTION.accel, MOTION.mag)]
        for values in sensors:
            values[lost] = np.nan
        expected = zr.Attitude(100.0).process(*sensors)[kept]
        np.testing.assert_array_equal(answered(answers[1:]), expected)

    def test_a_checkpoint_changes_nothing(self, tmp_path):
        options = (*self.LIVE, "--checkpoint", tmp_path / "state")
        first = streamed([HEADER, *LINES[:300]], *options)
        second = streamed(LINES[300:], *options)
        whole = streamed([HEADER, *LINES], *self.LIVE)
        assert first[1] + second[1] == whole[1]
        assert streamed([], "--attitude", "--checkpoint", tmp_path / "state", "--position")[1] == [
            "800"
        ]
        code, _, errors = streamed(LINES, *options, "--frame", "ned")
        assert code == 2
        check_line(errors, "it was made with --frame enu, now it is ned; --force starts again")
        code, _, errors = streamed(LINES, "--rate", "100", "--checkpoint", tmp_path / "state")
        assert code == 2
        check_line(errors, "it is of the engine 'attitude', not of 'drift'; --force starts again")

    @pytest.mark.parametrize(
        ("options", "match"),
        [
            (("--attitude", "--method", "kf"), "--method has no effect with --attitude"),
            (("--frame", "ned"), "--frame needs --attitude"),
            (("--attitude", "--with", "saturated"), "--with takes some of euler"),
            (("--attitude", "--columns", "1,2,3"), "--columns takes six columns, or nine"),
            (("--attitude", "--unit", "deg/s,rad/s"), "--unit takes one unit of each kind"),
        ],
    )
    def test_refusals(self, call, options, match):
        code, _, errors = call("stream", "--rate", "100", *options)
        assert code == 2
        check_line(errors, match)


class TestReference:
    """A camera that sees the same orientations with a north of its own."""

    def given(self, folder, turn=1.0):
        recording = MOTION.recording()
        (truth,) = recording.of_kind("reference")
        half = np.array([np.cos(turn / 2.0), 0.0, 0.0, -np.sin(turn / 2.0)])
        seen = rotations.product(half, truth.data[::4])
        poses = zr.record.Poses(truth.time[::4], np.zeros((len(seen), 3)), seen)
        poses.to_tum(folder / "truth.tum", force=True)
        columns = {
            name: log.data[:, i]
            for kind in ("gyro", "accel", "mag")
            for log in [recording[kind]]
            for i, name in enumerate(log.names)
        }
        return write_table(folder / "seen.csv", columns), folder / "truth.tum"

    def test_headings_are_aligned_and_that_is_said(self, call, tmp_path, out):
        log, truth = self.given(tmp_path)
        asked = ("attitude", log, "-o", out, "--no-figure", "--force", "--reference", truth)
        code, text, errors = call(*asked, "--tum")
        assert (code, errors) == (0, "")
        assert text.split("\n\n")[1].startswith("Errors against the reference, deg")
        angle = float(re.search(r"rotated back by ([\d.]+) deg about z", text)[1])
        assert angle == pytest.approx(np.degrees(1.0), abs=15.0)
        poses = zr.io.read_poses(out / "seen-zerorate-attitude.tum")
        assert len(poses) > 700
        absolute = call(*asked, "--reference-heading", "absolute")[1]
        row = next(line for line in absolute.splitlines() if line.startswith("  all "))
        assert float(row.split()[2]) > 40.0

    def test_what_cannot_be_compared_is_told(self, call, tmp_path, out):
        log, truth = self.given(tmp_path)
        asked = ("attitude", log, "-o", out, "--no-figure", "--force", "--reference")
        code, _, errors = call(*asked, truth, "--reference-offset", "1000")
        assert (code, "so both" in errors or "both must be on one clock" in errors) == (1, True)
        assert "--reference-offset S" in errors
        code, _, errors = call(*asked, tmp_path / "no.tum")
        assert (code, "no.tum, which does not exist" in errors) == (2, True)
        code, _, errors = call(*asked, "a,b,c,d", "--reference-offset", "1")
        assert (code, "acts on a file" in errors) == (2, True)


def test_a_place_gives_true_north(tmp_path, capsys):
    motion = zr.simulate_motion("hand", 100.0, 20.0, seed=2)
    path = tmp_path / "nine.csv"
    kinds = {"gyro_{}_radps": motion.gyro, "accel_{}_mps2": motion.accel, "mag_{}_ut": motion.mag}
    columns = {"time_s": motion.time} | {
        name.format(axis): values[:, i]
        for name, values in kinds.items()
        for i, axis in enumerate("xyz")
    }
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, "%.9g", ",", header=",".join(columns), comments="")
    options = ["attitude", str(path), "--no-figure", "--format", "csv"]
    assert run([*options, "-o", str(tmp_path / "there.csv"), "--at", "48.1,11.6"]) == 0
    message = one_line(capsys.readouterr().out)
    assert "deg east of true north, by the World Magnetic Model" in message
    east = float(message.split("lies ")[1].split(" deg")[0])
    assert 3.0 < east < 6.0
    assert run([*options, "-o", str(tmp_path / "typed.csv"), "--declination", f"{east}"]) == 0
    there, typed = (
        np.loadtxt(tmp_path / f"{name}.csv", delimiter=",", skiprows=2)[:, 1:5]
        for name in ("there", "typed")
    )
    np.testing.assert_allclose(there, typed, atol=1e-3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--at", "95,11"], "--at takes deg, latitude within 90 first, got '95,11'"),
        (["--at", "48,11", "--declination", "4"], "--at determines the declination: give it, or"),
        (["--at", "48,11", "--no-mag"], "--at has no effect with --no-mag"),
    ],
)
def test_a_place_that_tells_nothing_is_refused(tmp_path, capsys, options, message):
    path = tmp_path / "a.csv"
    path.write_text("t\n1\n")
    assert run(["attitude", str(path), *options]) == 2
    assert message in capsys.readouterr().err
