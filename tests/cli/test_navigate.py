"""``zerorate navigate``: files, tables, and a line for every fault."""

import json
import re
import shutil
from functools import partial

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import zerorate as zr
from support.commands import check_line, names, one_line
from support.recordings import RECORDINGS, needs_recordings

DRIVE = zr.simulate_drive(50.0, 110.0, seed=2, antenna=(0.5, 0.0, -1.0))
TURN = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""From the body's axes to those of a sensor that is mounted askew."""


def imu_columns(turn=None):
    found = {"time_s": DRIVE.time}
    for name, values in (("gyro_{}_radps", DRIVE.gyro), ("accel_{}_mps2", DRIVE.accel)):
        shown = values if turn is None else values @ turn.T
        found |= {name.format(axis): shown[:, i] for i, axis in enumerate("xyz")}
    return found


def fix_columns():
    fixes = DRIVE.fixes
    ways = ("north", "east", "down")
    found = {"time_s": fixes.time}
    found |= dict(zip(("latitude_deg", "longitude_deg", "height_m"), fixes.position.T, strict=True))
    found |= {f"velocity_{w}_mps": v for w, v in zip(ways, fixes.velocity.T, strict=True)}
    return found


def write(path, columns):
    rows = np.column_stack([*columns.values()])
    np.savetxt(path, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.17g")
    return path


def write_parquet(path, columns, **meta):
    table = pa.table(columns).replace_schema_metadata(meta)
    pq.write_table(table, path)
    return path


@pytest.fixture
def cli(call):
    """Run ``zerorate navigate``; return its code, stdout and stderr."""
    return partial(call, "navigate")


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    write(folder / "imu.csv", imu_columns())
    write(folder / "gnss.csv", fix_columns())
    return folder


@pytest.fixture
def imu(tmp_path, written):
    return shutil.copy(written / "imu.csv", tmp_path / "imu.csv")


@pytest.fixture
def gnss(tmp_path, written):
    return shutil.copy(written / "gnss.csv", tmp_path / "gnss.csv")


def expected(smooth=False, recording=None, antenna=None, **options):
    """A track as of the command, by the steps of the library."""
    recording = recording or zr.read_recording(imu_columns())
    fixes = zr.read_fixes(fix_columns())
    begun = zr.navigation.find_beginning(recording, fixes, antenna=antenna, **options)
    nav = begun.filter(**options)
    track = nav.process(begun.recording, fixes, time_offset=begun.time_offset)
    return track.smooth() if smooth else track


def test_it_writes_a_log_maps_and_a_figure(cli, imu, gnss, out):
    code, text, errors = cli(imu, gnss, "-o", out)
    assert (code, errors) == (0, "")
    stem = "imu-zerorate-navigate"
    assert names(out) == [f"{stem}.{x}" for x in ("geojson", "gpx", "parquet", "png")]
    assert re.match(r"Track of imu.csv\n\nAt the end\n +σ\n  latitude, deg; north, m ", text)
    assert re.search(r"\n\nAligned at [\d.]+ s\n  roll, pitch, deg ", text)
    assert "NIS of position, mean" in text
    assert "outages" not in text
    found, track = zr.read_fixes(out / f"{stem}.parquet"), expected()
    there = track.navigating
    np.testing.assert_allclose(found.position, track.position[there], rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.velocity, track.velocity[there], rtol=0, atol=1e-12)
    line = json.loads((out / f"{stem}.geojson").read_text())["features"][0]["geometry"]
    assert len(line["coordinates"]) == there.sum()
    assert (out / f"{stem}.gpx").read_text().count("<trkpt") == there.sum()


def test_wheels_tell_their_speed_or_their_ticks(cli, gnss, out, tmp_path):
    """A tick is as long as the receiver's speed says if nothing else does."""
    columns = imu_columns()
    columns["wheel_speed_mps"] = zr.simulation.wheel_speeds(DRIVE, 50.0, scale=0.02)
    columns["ticks"] = zr.simulation.wheel_ticks(DRIVE, 0.03, scale=0.02)
    log = write(tmp_path / "wheels.csv", columns)
    for k, told in enumerate(
        (
            ("--wheel-speed", "wheel_speed_mps"),
            ("--wheel-ticks", "ticks", "--tick", "0.03"),
            ("--wheel-ticks", "ticks"),
        )
    ):
        code, text, errors = cli(log, gnss, *told, "--no-figure", "-o", out / f"{k}.csv")
        assert code == 0, errors
        note = " ".join(text.split()).partition("- the wheels roll ")[2]
        scale, sigma = (float(word) for word in note.split(" %")[0].split(" ± "))
        if k < 2:
            assert abs(scale - 2.0) < 4.0 * sigma < 4.0
        assert "% faster than measured, along an axis" in note


def test_held_stands_beside_the_filter(cli, imu, gnss, out):
    options = ("--outages", "5,10", "--smooth", "--no-figure", "-o", out / "a.csv")
    code, text, _ = cli(imu, gnss, *options)
    assert code == 0
    assert names(out) == ["a.csv", "a.geojson", "a.gpx"]
    assert "Track of imu.csv, smoothed" in text
    assert text.count("position held") == text.count("velocity held") == 2
    assert text.count("smoothed, largest inside") == 2
    found = zr.read_fixes(out / "a.csv")
    track = expected(smooth=True)
    np.testing.assert_allclose(found.position, track.position[track.navigating], atol=1e-9)


def test_options_reach_the_filter(cli, imu, gnss, out, tmp_path):
    model = zr.NoiseModel(angle_random_walk=2e-4, rate_random_walk=3e-6)
    model.to_json(tmp_path / "gyro.json")
    axes = {"axes": {"ax": None, "gx": json.loads(model.to_json())}}
    force = zr.NoiseModel(angle_random_walk=2e-3, rate_random_walk=3e-5, quantity="acceleration")
    axes["axes"]["ay"] = json.loads(force.to_json())
    (tmp_path / "models.json").write_text(json.dumps(axes))
    options = ("--vehicle", "wheeled", "--axle=-1,0,1", "--antenna", "0.5,0,-1", "--gate", "30")
    noise = ("--gyro-noise", tmp_path / "gyro.json", "--accel-noise", tmp_path / "models.json")
    table = ("--wheel-sigma", "0.2", "--covariance-step", "0.05")
    code, _, errors = cli(
        imu, gnss, *options, *noise, *table, "--adapt", "fixed", "-o", out / "a.npz", "--no-figure"
    )
    assert (code, errors) == (0, "")
    track = expected(
        vehicle="wheeled",
        axle=(-1.0, 0.0, 1.0),
        antenna=(0.5, 0.0, -1.0),
        gate=30.0,
        wheel_sigma=0.2,
        covariance_step=0.05,
        adapt="fixed",
        gyro=model,
        accel=force,
    )
    found = zr.read_fixes(out / "a.npz")
    np.testing.assert_allclose(found.position, track.position[track.navigating], atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_the_noise_is_read_from_the_file_of_kalibr(cli, imu, gnss, out, tmp_path, seed):
    """As it was written by `to_kalibr`, or by hand, under a name of the IMU."""
    sizes = np.exp(np.random.default_rng(seed).uniform(-9, -6, 4)) * (1.0, 0.01, 1.0, 0.01)
    # The file has six digits.
    white, walk, force, bias = (float(f"{size:.5e}") for size in sizes)
    gyro = zr.NoiseModel(angle_random_walk=white, rate_random_walk=walk)
    accel = zr.NoiseModel(force, rate_random_walk=bias, quantity="acceleration")
    path = tmp_path / "imu.yaml"
    text = gyro.to_kalibr(accelerometer=accel, rate=200.0)
    indented = "imu0:\n" + "".join(f"  {line}\n" for line in text.splitlines())
    path.write_text(indented if seed else text)
    noise = ("--gyro-noise", path, "--accel-noise", path, "--noise", "stated")
    code, _, errors = cli(imu, gnss, *noise, "-o", out / "a.npz", "--no-figure")
    assert (code, errors) == (0, "")
    track, found = expected(gyro=gyro, accel=accel), zr.read_fixes(out / "a.npz")
    np.testing.assert_allclose(found.position, track.position[track.navigating], rtol=0, atol=1e-9)
    path.write_text("gyroscope: 0.1\n")
    code, _, errors = cli(imu, gnss, *noise, "-o", out / "b.npz", "--no-figure")
    assert code == 1
    assert "zerorate allan --export json" in errors
    assert "Kalibr" in errors


def test_a_mounting_is_read_typed_and_left_alone(cli, gnss, out, tmp_path):
    meta = {
        "body_from_sensor": json.dumps(TURN.T.tolist()),
        "antenna_from_imu_m": "[0.5, 0, -1]",
        "imu_time_offset_s": "-0.02",
    }
    log = write_parquet(tmp_path / "imu.parquet", imu_columns(TURN), **meta)
    plain = ("--no-figure", "--force", "-o")
    code, text, _ = cli(log, gnss, *plain, out / "a.npz")
    assert code == 0
    message = (
        "mounting, antenna and time offset by the metadata of imu.parquet (antenna 0.5, 0, -1 m"
    )
    assert message in one_line(text)
    assert "time offset 0.02 s)" in one_line(text)
    typed = ",".join(str(x) for x in TURN.T.ravel())
    other = write(tmp_path / "askew.csv", imu_columns(TURN))
    (tmp_path / "mount.json").write_text(json.dumps(TURN.T.tolist()))
    beside = ("--antenna", "0.5,0,-1", "--time-offset", "0.02")
    for mount in (typed, tmp_path / "mount.json", log):
        code, text, _ = cli(other, gnss, "--mount", mount, *beside, *plain, out / "b.npz")
        assert code == 0
        one, two = (zr.read_fixes(out / name).position for name in ("a.npz", "b.npz"))
        np.testing.assert_allclose(one, two, rtol=0, atol=1e-12)
    code, text, _ = cli(log, gnss, "--mount", "none", *beside, *plain, out / "c.npz")
    assert (code, "metadata" in text) == (0, False)
    assert not np.allclose(zr.read_fixes(out / "c.npz").position, one, rtol=0, atol=1e-6)


def test_a_time_offset_is_added_to_the_fixes_everywhere(cli, imu, gnss, out, tmp_path):
    """By Python, shifted fixes, the option and metadata; for those of the sensors it is minus."""
    late = write(tmp_path / "late.csv", fix_columns() | {"time_s": DRIVE.fixes.time + 0.125})
    lever = ("--antenna", "0.5,0,-1", "--no-figure", "--force", "-o")
    files = [out / f"{name}.npz" for name in ("in time", "option", "metadata", "of the sensors")]
    assert cli(imu, gnss, *lever, files[0])[0] == 0
    assert cli(imu, late, "--time-offset", "-0.125", *lever, files[1])[0] == 0
    said = ({"time_offset_s": "-0.125"}, {"imu_time_offset_s": "0.125"})
    for file, meta in zip(files[2:], said, strict=True):
        log = write_parquet(tmp_path / f"{file.stem}.parquet", imu_columns(), **meta)
        assert zr.io.read_mounting(log).time_offset == -0.125
        assert cli(log, late, *lever, file)[0] == 0
    first, *others = (zr.read_fixes(file).position for file in files)
    for other in others:
        np.testing.assert_array_equal(other, first)

    recording = zr.read_recording(imu)
    nav = zr.NavigationFilter(zr.align(recording, latitude=48.0, heading="course"))
    shifted = nav.copy().process(recording, zr.read_fixes(late).shifted(-0.125))
    offset = nav.copy().process(recording, zr.read_fixes(late), time_offset=-0.125)
    np.testing.assert_array_equal(offset.position, shifted.position)


def test_a_clock_that_is_off_is_said(cli, imu, out, tmp_path):
    late = write(tmp_path / "late.csv", fix_columns() | {"time_s": DRIVE.fixes.time + 0.15})
    lever = ("--antenna", "0.5,0,-1", "--no-figure", "-o", out)
    code, text, _ = cli(imu, late, *lever)
    assert code == 0
    said = re.search(r"best fit of sensors and fixes: time offset, s (-0\.\d+) ", one_line(text))
    assert float(said[1]) == pytest.approx(-0.15, abs=0.1)
    _, text, _ = cli(imu, late, "--time-offset", "0", *lever, "--force")
    assert "not 0 s: --time-offset auto" in one_line(text)
    log = write_parquet(tmp_path / "wrong.parquet", imu_columns(), time_offset_s="0")
    _, text, _ = cli(log, late, *lever)
    assert "; not 0 s, as the metadata say: --time-offset 0 takes that" in one_line(text)
    assert (
        re.search(r"best fit of sensors and fixes: time offset, s (-0\.\d+) ", one_line(text))[1]
        == said[1]
    )
    minute = write(tmp_path / "minute.csv", fix_columns() | {"time_s": DRIVE.fixes.time + 60.0})
    code, text, _ = cli(imu, minute, *lever, "--force")
    assert code == 0
    assert "imu.csv: the fixes are on another clock, " in one_line(text)
    assert "they are moved by that" in one_line(text)
    code, text, errors = cli(imu, minute, "--time-offset", "1e5", *lever, "--force")
    assert code == 1
    assert "--time-offset auto moves them" in text
    check_line(errors, "imu.csv: the filter cannot start: its samples are from 0")


def test_one_file_may_hold_both(cli, out, tmp_path):
    table = imu_columns()
    fixes = fix_columns()
    every = np.searchsorted(DRIVE.time, fixes.pop("time_s"))
    for name, values in fixes.items():
        table[name] = np.full(DRIVE.time.size, np.nan)
        table[name][every] = values
    log = write_parquet(tmp_path / "both.parquet", table)
    code, text, errors = cli(log, "-o", out, "--no-figure")
    assert (code, errors) == (0, "")
    used = int(re.search(r"used +(\d+)", text)[1])
    assert used == expected().fix_count["used"]


def test_a_heading_and_a_rest_may_be_given(cli, imu, gnss, out):
    yaw = 2.0 * np.arctan2(DRIVE.truth_quaternion[0, 3], DRIVE.truth_quaternion[0, 0])
    options = (f"--heading={np.degrees(yaw):.3f}", "--rest", "1,25")
    code, text, _ = cli(imu, gnss, *options, "-o", out, "--no-figure")
    assert code == 0
    assert "heading from the course" not in text
    assert re.search(r"waiting +2\d\.\d", text)


@pytest.mark.parametrize(
    ("options", "code", "match"),
    [
        (("--outages", "10,x"), 2, "--outages takes lengths in s, such as 10,30,60, with commas"),
        (("--outages", "10,-3"), 2, "--outages takes lengths above 0 s"),
        (("--outages", "90"), 2, "there is no room for an outage of 90 s"),
        (("--vehicle", "boat"), 2, "--vehicle takes wheeled"),
        (("--tick", "0.03"), 2, "--tick needs --wheel-ticks"),
        (("--wheel-ticks", "gyro_x_radps", "--tick", "0"), 2, "--tick takes metres above 0"),
        (
            ("--wheel-ticks", "a", "--wheel-speed", "b"),
            2,
            "--wheel-speed and --wheel-ticks say the same",
        ),
        (("--axle", "1,0,0"), 2, "--axle needs --vehicle wheeled"),
        (("--vehicle", "wheeled", "--axle", "1,0"), 2, "--axle takes three numbers with commas"),
        (("--antenna", "1,0,zero"), 2, "--antenna takes three numbers with commas between"),
        (("--mount", "1,0,0,0"), 2, "--mount takes nine numbers of a rotation"),
        (("--mount", "1,0,0,0,1,0,0,0,-1"), 2, "must be a rotation"),
        (("--heading", "north"), 2, "--heading takes deg within 360, or 'course', got 'north'"),
        (("--rest", "20"), 2, "--rest takes two times"),
        (("--rest", "20,10"), 2, "--rest must end after it begins"),
        (("--rest", "1,1.5"), 2, "--rest must be at least 1 s long"),
        (("--rest", "500,520"), 1, "imu.csv: there are 0 samples from 500 to 520 s"),
        (("--gate", "-1"), 2, "--gate must be"),
        (("--adapt", "never"), 2, "--adapt takes inflate, free or fixed, got 'never'"),
        (("--time-offset", "soon"), 2, "--time-offset takes seconds, or 'auto', got 'soon'"),
        (("--gyro-noise", "none.json"), 1, "none.json: No such file"),
        (("--calibration", "none.json"), 1, "none.json: No such file"),
        (
            ("-o", "a.xlsx"),
            2,
            "-o takes a folder, or a file as parquet, csv, npz, mcap, gcsv, geojson, gpx",
        ),
    ],
)
def test_refusals(cli, imu, gnss, out, options, code, match):
    found, text, errors = cli(imu, gnss, "-o", out, *options)
    assert (found, text) == (code, "")
    check_line(errors, match)
    assert names(out) == []


def test_what_is_no_input(cli, imu, gnss, out, tmp_path):
    plain = ("-o", out, "--no-figure")
    code, _, errors = cli(imu, *plain)
    assert code == 1
    check_line(errors, "there are no fixes of a receiver; give their file after the log")
    code, _, errors = cli(imu, tmp_path / "none.nmea", *plain)
    assert code == 1
    check_line(errors, "none.nmea does not exist")
    code, _, errors = cli(gnss, imu, *plain)
    assert code == 1
    check_line(errors, "imu.csv: no column is a latitude")
    (tmp_path / "model.json").write_text("[1, 2]")
    code, _, errors = cli(imu, gnss, *plain, "--gyro-noise", tmp_path / "model.json")
    assert code == 1
    check_line(errors, "model.json is not a zerorate noise model in JSON")
    code, _, errors = cli(imu, gnss, "-o", imu)
    assert code == 2
    check_line(errors, "-o names the log itself")
    assert names(out) == []


def test_a_vehicle_that_stands_has_no_heading(cli, gnss, out, tmp_path):
    still = zr.simulate_drive(50.0, 30.0, kind="rest")
    columns = {"time_s": still.time}
    for name, values in (("gyro_{}_radps", still.gyro), ("accel_{}_mps2", still.accel)):
        columns |= {name.format(axis): values[:, i] for i, axis in enumerate("xyz")}
    log = write(tmp_path / "still.csv", columns)
    fixes = {"time_s": still.fixes.time}
    fixes |= dict(zip(("lat", "lon", "alt"), still.fixes.position.T, strict=True))
    fixes = write(tmp_path / "fixes.csv", fixes)
    code, _, errors = cli(log, fixes, "-o", out, "--no-figure", "--rest", "0,12")
    assert code == 1
    check_line(errors, "the heading is not known, and the vehicle not above 1 m/s: --heading says")


def test_nothing_is_replaced_unasked(cli, imu, gnss, out):
    assert cli(imu, gnss, "-o", out, "--no-figure")[0] == 0
    code, _, errors = cli(imu, gnss, "-o", out, "--no-figure")
    assert code == 2
    check_line(errors, "exists already; pass --force")
    assert cli(imu, gnss, "-o", out, "--no-figure", "--force")[0] == 0


@needs_recordings
def test_a_log_of_a_flight_controller_holds_both(cli, out):
    log = RECORDINGS / "px4_sample_log_small.ulg"
    options = ("--rest", "0,2", "--heading", "30", "--no-figure", "-o", out)
    code, text, errors = cli(log, *options)
    assert (code, errors) == (0, "")
    assert re.search(r"used +22\n", text)


def test_errors_against_a_reference_come_first(cli, imu, gnss, out, tmp_path):
    asked = (imu, gnss, "--no-figure", "--force", "-o", out / "a.csv", "--reference")
    truth = expected().poses()
    place = truth.position[:, (1, 0, 2)] * [1, -1, 1]
    turned = zr.record.Poses(truth.time, place, truth.quaternion)
    turned.to_tum(tmp_path / "truth.tum")
    code, text, _ = cli(*asked, tmp_path / "truth.tum", "--tum")
    assert code == 0
    lines = text.splitlines()
    assert lines[0] == "Errors against the reference"
    assert float(lines[2].split()[4]) == pytest.approx(0.0, abs=0.01)
    assert "turned by -90.00 deg about the vertical" in text
    assert len(zr.io.read_poses(out / "a.tum")) == len(truth)
    code, text, _ = cli(*asked, gnss)
    assert (code, text.splitlines()[0]) == (0, "Errors against the reference")
    assert "to fit best" not in text
    code, _, errors = cli(*asked, tmp_path / "none.tum")
    assert (code, "does not exist" in errors) == (2, True)
