"""``zerorate allan``: tables, curves, configurations, and for every fault one line and a code."""

import csv
import json
import shutil
from functools import partial

import numpy as np
import pytest
import yaml

import zerorate as zr
from support.commands import check_line, names, one_line
from support.logs import write_table
from zerorate import Log, NoiseModel, write_log
from zerorate.io.reading import read_sensors
from zerorate.noise.characterise import characterise_log
from zerorate.noise.kinds import KINDS
from zerorate.numerals import format_significant, format_with_error
from zerorate.show import WIDTH
from zerorate.tasks.characterise import Characterised, export_texts

RATE = 100.0
STEM = "run-zerorate-allan"


def signal(n=20_000, axes=3, scale=1.0):
    model = NoiseModel(angle_random_walk=1e-4, bias_instability=2e-5)
    return scale * zr.simulate(model, RATE, n / RATE, seed=1, axes=axes)[0]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    z, a = signal(), signal(scale=10.0)
    columns = {f"gyro_{x}_radps": z[:, i] for i, x in enumerate("xyz")}
    columns |= {f"accel_{x}_mps2": a[:, i] for i, x in enumerate("xyz")}
    return write_table(tmp_path_factory.mktemp("logs") / "run.csv", columns)


@pytest.fixture
def log(tmp_path, written):
    return shutil.copy(written, tmp_path / "run.csv")


@pytest.fixture
def cli(call):
    """Run ``zerorate allan``; return its code, stdout and stderr."""
    return partial(call, "allan")


class TestTable:
    def test_gyros_and_accelerometers_are_found(self, cli, log, out):
        code, text, errors = cli(log, "-o", out)
        assert (code, errors) == (0, "")
        assert names(out) == [f"{STEM}.csv", f"{STEM}.png"]
        assert "gyro: overlapping Allan deviation of 200 s at 100 Hz, 14 averaging times" in text
        for word in ("accelerometer:", "velocity random walk", "worst axis", "by the spectrum"):
            assert word in text
        assert f"wrote {out / STEM}.png" in text
        assert max(map(len, text.replace(str(out), "").split("\n"))) <= WIDTH

    def test_the_values_are_those_of_the_library(self, cli, log, out):
        _, text, _ = cli(log, "-o", out, "--no-figure", "--columns", "gyro_x_radps")
        model = zr.allan(zr.read_log(log, columns=["gyro_x_radps"])).fit()
        found = model.in_units("deg/sqrt(h)")
        row = next(line for line in text.split("\n") if line.startswith("angle random walk"))
        assert row.split("deg/sqrt(h)")[1].strip() == format_with_error(found.value, found.sigma)
        assert f"< {format_significant(model.in_units('arcsec').upper_bound)}" in text
        assert "worst axis" not in text

    def test_without_a_second_opinion(self, cli, log, out):
        _, text, _ = cli(log, "-o", out, "--no-figure", "--no-second-opinion")
        assert "by the spectrum" not in text

    def test_a_markov_term_has_its_rows(self, cli, log, out):
        options = ("--no-figure", "--markov", 1, "--columns", "gyro_x_radps,accel_x_mps2")
        code, text, _ = cli(log, "-o", out, *options)
        assert code == 0
        assert text.count("Markov noise") == text.count("correlation time") == 2

    def test_many_axes_are_wrapped(self, cli, tmp_path, out):
        z = signal(2000, 8)
        data = {f"unit{i}_gyro_x_radps": z[:, i] for i in range(8)}
        _, text, _ = cli(write_table(tmp_path / "run.csv", data), "-o", out)
        assert all(name in text for name in data)
        assert max(map(len, text.replace(str(out), "").split("\n"))) <= WIDTH

    @pytest.mark.parametrize("kind", KINDS)
    def test_every_kind(self, cli, tmp_path, out, kind):
        drawn = () if kind in ("oadev", "theo1") else ("--no-figure",)
        path = write_table(tmp_path / "run.csv", {"gyro_x_radps": signal(2000)[:, 0]})
        code, text, errors = cli(path, "-o", out, "--kind", kind, *drawn)
        assert (code, errors) == (0, "")
        assert KINDS[kind].title in text
        assert ("no model to fit" in one_line(text)) == (kind in ("theo1", "pdev"))

    def test_an_unknown_unit_is_that_of_the_samples(self, cli, tmp_path, out):
        np.save(tmp_path / "run.npy", signal(2200, 2))
        given = (tmp_path / "run.npy", "--rate", RATE, "-o", out, "--no-figure")
        code, text, _ = cli(*given, "--export", "json")
        assert code == 0
        assert "deviation unit" in one_line(text)
        assert "white noise unit/sqrt(Hz)" in one_line(text)
        assert '"unit" is the unknown unit of the samples; exports to estimators need it.' in text
        assert sum("unit" in note for note in text.split("\n- ")[1:]) == 1
        code, text, errors = cli(*given, "--force", "--export", "kalibr")
        assert (code, text) == (2, "")
        assert errors.startswith("zerorate: --export kalibr needs the unit of the samples, which")

    def test_units_of_both_kinds(self, cli, tmp_path, out):
        z = signal(2000, 2)
        path = write_table(tmp_path / "run.csv", {"wx": z[:, 0], "ax": z[:, 1]})
        code, text, _ = cli(path, "-o", out, "--unit", "deg/s,g", "--no-figure")
        assert code == 0
        assert "gyro:" in text
        assert "accelerometer:" in text


class TestNotes:
    def test_a_constant_axis_is_told(self, cli, tmp_path, out):
        data = {"gyro_x_dps": np.full(1000, 2.0), "gyro_y_dps": signal(1000)[:, 0]}
        code, text, _ = cli(write_table(tmp_path / "run.csv", data), "-o", out)
        assert code == 0
        assert "gyro_x_dps: all samples are equal" in text

    def test_only_constants(self, cli, tmp_path, out):
        path = write_table(tmp_path / "run.csv", {"gyro_x_dps": np.ones(1000)})
        code, text, _ = cli(path, "-o", out)
        assert code == 0
        assert "nothing to fit" in text
        assert names(out) == [f"{STEM}.csv", f"{STEM}.png"]

    def test_gaps_and_rounded_taus_are_told(self, cli, tmp_path, out):
        z = signal()[:, 0]
        z[500:520] = np.nan
        path = write_table(tmp_path / "run.csv", {"gyro_x_radps": z})
        options = ("--taus", "0.01,0.02,0.044,0.1,0.2,0.4", "--bridge", 30, "--no-figure")
        _, text, _ = cli(path, "-o", out, *options)
        assert "20 of 20000 samples are missing; gaps of up to 30 are bridged" in one_line(text)
        assert "0.044 s to 0.04 s" in one_line(text)

    def test_a_record_too_short_for_a_fit_gives_deviations(self, cli, tmp_path, out):
        path = write_table(tmp_path / "run.csv", {"gyro_x_radps": signal(25)[:, 0]})
        code, text, _ = cli(path, "-o", out)
        assert code == 0
        assert "a fit needs" in text


class TestFiles:
    def test_csv(self, cli, log, out):
        cli(log, "-o", out, "--no-figure")
        with (out / f"{STEM}.csv").open() as file:
            rows = list(csv.DictReader(file))
        curve = zr.allan(zr.read_log(log), confidence=0.683)
        assert [row["axis"] for row in rows[:: curve.taus.size]][:3] == list(curve.names)
        for name in ("deviation", "lower", "upper", "edf", "exponent", "term_count"):
            found = [float(row[name]) for row in rows[: curve.taus.size]]
            np.testing.assert_array_equal(found, getattr(curve, name)[:, 0])
        assert rows[0]["unit"] == "rad/s"
        assert rows[-1]["unit"] == "m/s^2"

    def test_json_without_nan(self, cli, tmp_path, out):
        z = signal(2000)[:, 0]
        z[::50] = np.nan
        path = write_table(tmp_path / "run.csv", {"gyro_x_radps": z})
        assert cli(path, "-o", out, "--format", "json", "--no-figure")[0] == 0
        text = (out / f"{STEM}.json").read_text()
        (axis,) = json.loads(text, parse_constant=pytest.fail)["axes"]
        assert axis["deviation"][-1] is None
        assert len(axis["tau_s"]) == len(axis["term_count"])

    def test_npz(self, cli, log, out):
        assert cli(log, "-o", out, "--format", "npz", "--no-figure")[0] == 0
        with np.load(out / f"{STEM}.npz") as found:
            curve = zr.allan(zr.read_log(log))
            np.testing.assert_array_equal(found["deviation"][:, :3], curve.deviation)
            np.testing.assert_array_equal(found["tau_s"], curve.taus)
            assert list(found["axis"][:3]) == list(curve.names)

    def test_what_is_doubted_is_not_exported_unless_accepted(self, cli, tmp_path, out):
        z = signal(3000)
        z[1500:1700] += 0.5
        table = {f"gyro_{x}_radps": z[:, i] for i, x in enumerate("xyz")}
        path = write_table(tmp_path / "run.csv", table)
        asked = (path, "-o", out, "--no-figure", "--export", "kalibr,px4,json")
        code, text, errors = cli(*asked)
        assert (code, names(out)) == (1, [f"{STEM}.csv"])
        assert text.startswith("gyro: overlapping Allan deviation")
        check_line(errors, f"{path}: no export to kalibr, px4, json: gyro_x_radps: looks as if it")
        assert "record the sensor at rest" in errors
        assert "--doubtful writes the numbers with this warning" in errors
        assert cli(*asked, "--force", "--doubtful")[::2] == (0, "")
        assert "# WARNING: gyro_x_radps: looks" in (out / f"{STEM}-kalibr.yaml").read_text()
        assert "looks as if it moved" in (out / f"{STEM}-models.json").read_text()

    def test_without_a_gyro_there_is_no_export(self, cli, tmp_path, out):
        path = write_table(tmp_path / "run.csv", {"accel_x_g": signal(2200)[:, 0]})
        code, _, errors = cli(path, "-o", out, "--no-figure", "--export", "kalibr")
        assert (code, names(out)) == (1, [f"{STEM}.csv"])
        check_line(errors, f"{path}: no export to kalibr: it needs a model of a gyro")

    def test_exports_hold_the_worst_axis_of_each_kind(self, cli, log, out):
        options = ("--no-figure", "--export", "kalibr,vins,orbslam3,px4", "--doubtful")
        code, text, _ = cli(log, "-o", out, *options)
        assert code == 0
        gyros, accelerometers = read_sensors(log)
        worst = [zr.noise.worst_axis(zr.allan(one).fit()) for one in (gyros, accelerometers)]
        found = yaml.safe_load((out / f"{STEM}-kalibr.yaml").read_text())
        # Kalibr's file has six digits.
        expected = pytest.approx(worst[0].angle_random_walk.value, rel=1e-5)
        assert found["gyroscope_noise_density"] == expected
        expected = pytest.approx(worst[1].rate_random_walk.conservative, rel=1e-5)
        assert found["accelerometer_random_walk"] == expected
        assert found["update_rate"] == RATE
        assert found["rostopic"] == "/imu0"
        for name in ("vins.yaml", "orbslam3.yaml", "px4.params"):
            assert f"wrote {out / STEM}-{name}" in text

    def test_exports_are_inflated_and_per_sample_where_asked(self, cli, log, out):
        options = ("-o", out, "--no-figure", "--columns", "gyro_x_radps", "--export", "vins,ros")
        files = [out / f"{STEM}-{name}.yaml" for name in ("vins", "ros")]
        values = []
        for more in ((), ("--inflate", 3, "--force"), ("--per-sample", "--force")):
            assert cli(log, *options, *more)[0] == 0
            vins, ros = (yaml.safe_load(path.read_text()) for path in files)
            values.append((vins["gyr_n"], ros["angular_velocity_covariance"][0]))
        (n, variance), (inflated, ninefold), (sample, same) = values
        # Six digits are written.
        expected = (3.0 * n, 9.0 * variance, 10.0 * n, variance)
        assert (inflated, ninefold, sample, same) == pytest.approx(expected, rel=1e-5)
        assert variance == pytest.approx(sample**2, rel=1e-5)

    def test_kalibr_takes_the_topic_of_a_ros_recording(self):
        time, z = np.arange(200) / RATE, signal(200, 1)
        for sensor, topic in (("/imu/data", "/imu/data"), ("ADIS", "/imu0")):
            named = Log(time, RATE, z, ["gx"], "rad/s", {"sensor": sensor})
            found = characterise_log(named, second_opinion=False)
            texts, _ = export_texts(Characterised((found,)), "kalibr", doubtful=True)
            assert yaml.safe_load(texts["kalibr"])["rostopic"] == topic

    def test_models_of_every_axis(self, cli, log, out):
        cli(log, "-o", out, "--no-figure", "--export", "json")
        axes = json.loads((out / f"{STEM}-models.json").read_text())["axes"]
        assert len(axes) == 6
        read = NoiseModel.from_json(json.dumps(axes["gyro_y_radps"]))
        assert read.angle_random_walk == zr.allan(zr.read_log(log)).fit()[1].angle_random_walk

    @pytest.mark.every(3)
    @pytest.mark.parametrize("figure", ["svg", "pdf"])
    def test_figure_formats(self, cli, log, out, figure):
        assert cli(log, "-o", out, "--figure-format", figure)[0] == 0
        assert (out / f"{STEM}.{figure}").stat().st_size < 500_000

    def test_all_or_none(self, cli, log, out):
        (out / f"{STEM}-vins.yaml").write_text("old")
        code, _, errors = cli(log, "-o", out, "--export", "kalibr,vins")
        assert code == 2
        assert "pass --force" in errors
        assert names(out) == [f"{STEM}-vins.yaml"]
        assert cli(log, "-o", out, "--export", "kalibr,vins", "--force")[0] == 0
        assert len(names(out)) == 4

    def test_a_full_disk_leaves_nothing(self, cli, log, out, monkeypatch):
        def fail(*_):
            raise OSError(28, "No space left on device")

        monkeypatch.setattr("zerorate.tasks.characterise.write_curves", fail)
        code, _, errors = cli(log, "-o", out, "--export", "json")
        assert (code, names(out)) == (1, [])
        assert errors == f"zerorate: {out}: No space left on device\n"


USAGE = {
    "kind": (("--kind", "pink"), "unknown kind 'pink'; known: adev, oadev"),
    "unit": (("--unit", "furlong"), "unknown unit 'furlong'"),
    "two units of one kind": (("--unit", "deg/s,rad/s"), "one unit of each kind"),
    "format": (("--format", "xls"), "got 'xls'"),
    "export": (("--export", "kalibr,okvis"), "--export takes some of kalibr, vins"),
    "inflate": (("--inflate", "0", "--export", "vins"), "--inflate must be a positive number"),
    "inflate nothing": (("--inflate", "2", "--export", "json"), "--inflate acts on exports to"),
    "per sample": (("--per-sample", "--export", "ros"), "--per-sample acts on --export vins"),
    "taus": (("--taus", "soon"), "--taus takes octave, decade, all, or seconds"),
    "negative tau": (("--taus", "-1"), "taus must be positive"),
    "tau beyond": (("--taus", "1e6"), "is beyond this record"),
    "bridge": (("--bridge", "-1"), "bridge"),
    "confidence": (("--confidence", "2"), "confidence"),
    "markov": (("--markov", "-1"), "--markov must not be negative"),
    "rate": (("--rate", "-5"), "rate"),
    "columns": (("--columns", "gyro_q"), "there is no column 'gyro_q'"),
    "folder": (("-o", f"{__file__}/out"), "is not a folder"),
}

DATA = {
    "too short": ({"gyro_x_dps": np.ones(12)}, (), "needs at least 20 samples, the log has 12"),
    "no sample": (
        {"gyro_x_dps": np.full(100, np.nan)},
        (),
        "column 'gyro_x_dps' holds no sample: choose others with --columns",
    ),
    "no sensor": ({"temp": np.ones(100)}, (), "looks like a gyro or an accelerometer"),
    "mixed units": (
        {"gyro_x_dps": np.ones(100), "gyro_y_radps": np.ones(100)},
        (),
        "the columns differ in unit ('gyro_x_dps' in deg/s, 'gyro_y_radps' in rad/s)",
    ),
    "other rate": ({"gyro_x_dps": np.ones(100)}, ("--rate", 5), "stated as 5 Hz"),
    "unit of none": ({"gyro_x_dps": np.ones(100)}, ("--unit", "g"), "no column holds an accel"),
    "other unit": ({"gyro_x_dps": np.ones(100)}, ("--unit", "rad/s"), "is in deg/s"),
}


class TestAxes:
    def test_one_without_samples_is_left_out_and_named(self, cli, tmp_path, out):
        table = {"gyro_x_dps": signal(1000)[:, 0], "gyro_y_dps": np.full(1000, np.nan)}
        table |= {"accel_x_g": np.full(1000, np.nan)}
        code, text, errors = cli(write_table(tmp_path / "run.csv", table), "-o", out)
        assert (code, errors) == (0, "")
        assert "- column 'gyro_y_dps' is all missing" in text
        assert "gyro_x_dps" in text.split("\n\n")[1]
        assert "accelerometer" not in text

    def test_a_constant_one_is_named(self, cli, tmp_path, out):
        table = {"gyro_x_dps": signal(1000)[:, 0], "gyro_y_dps": np.full(1000, 0.25)}
        code, text, errors = cli(write_table(tmp_path / "run.csv", table), "-o", out)
        assert (code, errors) == (0, "")
        assert "- gyro_y_dps: all samples are equal" in text


class TestFaults:
    @pytest.mark.parametrize("name", USAGE)
    def test_usage(self, cli, log, out, name):
        options, match = USAGE[name]
        code, text, errors = cli(log, "-o", out, *options)
        assert (code, text, names(out)) == (2, "", [])
        assert errors.startswith("zerorate: ")
        assert errors.count("\n") == 1
        assert match in errors

    @pytest.mark.parametrize("name", DATA)
    def test_data(self, cli, tmp_path, out, name):
        columns, options, match = DATA[name]
        code, text, errors = cli(write_table(tmp_path / "run.csv", columns), "-o", out, *options)
        assert (code, text, names(out)) == (1, "", [])
        assert errors.count("\n") == 1
        assert match in errors

    def test_a_column_that_is_no_sensor(self, cli, tmp_path, out):
        path = write_table(tmp_path / "run.csv", {"mag_x_ut": np.ones(100)})
        code, _, errors = cli(path, "-o", out, "--columns", "mag_x_ut")
        assert code == 1
        assert "is in uT, expected an angular rate or an acceleration" in errors

    def test_an_interrupt_ends_the_analysis(self, cli, log, out, monkeypatch):
        def interrupted(*_):
            raise KeyboardInterrupt

        monkeypatch.setattr("concurrent.futures.Future.result", interrupted)
        code, text, errors = cli(log, "-o", out, "--no-figure")
        assert (code, text, errors) == (130, "", "zerorate: interrupted\n")
        assert names(out) == []


def test_a_note_says_that_the_sensor_moved(cli, tmp_path, out):
    z = signal()[:, 0]
    z[12_000:12_300] += 0.5
    _, text, _ = cli(write_table(tmp_path / "run.csv", {"gyro_x_radps": z}), "-o", out)
    assert "gyro_x_radps: looks as if it moved (at 12" in text
    assert "the numbers describe the motion, not the sensor" in one_line(text)


class TestCharacterise:
    def test_progress_is_told_for_every_axis(self):
        log = Log(np.arange(2000) / RATE, RATE, signal(2000), ["x", "y", "z"], "rad/s")
        told = []
        characterise_log(log, progress=lambda *step: told.append(step))
        assert told[0] == ("deviations", 0.0)
        assert told[-1] == ("models", 2 / 3)

    def test_a_log_written_by_the_package_is_read(self, tmp_path):
        log = Log(np.arange(50) / RATE, RATE, signal(50, 1), ["accel_x"], "m/s^2")
        write_log(log, tmp_path / "a.npz")
        (found,) = read_sensors(tmp_path / "a.npz")
        assert (found.names, found.unit) == (("accel_x",), "m/s^2")


def test_several_logs_are_drawn_over_each_other(call, tmp_path, out):
    z = signal(3000)
    names_ = [f"gyro_{x}_radps" for x in "xyz"]
    paths = [
        write_table(tmp_path / f"{name}.csv", dict(zip(names_, scale * z.T, strict=True)))
        for name, scale in (("a", 1.0), ("b", 2.0))
    ]
    code, text, errors = call("allan", *paths, "-o", out, "--deviation", "adev")
    assert (code, errors) == (0, "")
    assert names(out) == [
        "a-zerorate-allan.csv",
        "allan-zerorate-overlay.png",
        "b-zerorate-allan.csv",
    ]
    lines = text.splitlines()
    assert lines[0] == "Gyros"
    assert [line.split()[0] for line in lines[2:8:3]] == ["a.csv", "b.csv"]
    assert "adev" in (out / "a-zerorate-allan.csv").read_text()
    code, _, errors = call("allan", *paths, "-o", out / "x.csv")
    assert (code, "takes a folder for several logs" in errors) == (2, True)
