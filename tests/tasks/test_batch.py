"""A batch: its files, what it skips, and what it says of logs that fail."""

import json
import os
import shutil

import numpy as np
import pyarrow.parquet as pq
import pytest

import zerorate as zr
from support.bags import write_recording
from support.batch_work import Here, make_logs
from support.calibrations import calibration, recorded, write_imu
from support.logs import write_table
from zerorate.cli import run
from zerorate.io import read_log
from zerorate.tasks.batch import Settings


@pytest.fixture(autouse=True)
def here(monkeypatch):
    """Without processes, which tests of engines start."""
    monkeypatch.setattr("zerorate.tasks.batch.run.Processes", Here)


@pytest.fixture
def logs(tmp_path):
    return make_logs(tmp_path / "logs", 3)


@pytest.fixture
def batch(tmp_path):
    """Run a batch of all logs with one worker."""

    def call(**options):
        pattern = str(tmp_path / "logs" / "**" / "*.*")
        return zr.batch(pattern, tmp_path / "out", workers=1, **options)

    return call


def statuses(result):
    return [one.status for one in result.outcomes]


def test_each_log_is_what_a_replay_writes(logs, batch, tmp_path):
    result = batch()
    assert statuses(result) == ["done"] * 3
    for log in logs:
        alone = tmp_path / "alone"
        alone.mkdir(exist_ok=True)
        assert run(["replay", str(log), "-o", str(alone), "--no-figure"]) == 0
        name = f"{log.stem}-zerorate.parquet"
        mirrored = tmp_path / "out" / log.parent.name / name
        assert mirrored.read_bytes() == (alone / name).read_bytes()


def test_a_calibration_is_applied_first(tmp_path):
    made, other = calibration(), calibration(2)
    made.to_json(tmp_path / "cal.json")
    log = write_imu(tmp_path / "run.csv", recorded(made)[0])
    alone = ["--calibration", str(tmp_path / "cal.json"), "-o", str(tmp_path), "--no-figure"]
    assert run(["replay", str(log), *alone]) == 0
    out = tmp_path / "out"
    for one, status in [(made, "done"), (made, "skipped"), (other, "done")]:
        result = zr.batch(log, out, calibration=one, unit="deg/s,g", workers=1)
        assert statuses(result) == [status]
        same = (out / "run-zerorate.parquet").read_bytes() == (
            tmp_path / "run-zerorate.parquet"
        ).read_bytes()
        assert same == (one is made)
    with pytest.raises(ValueError, match="calibration has no effect on command 'allan'"):
        Settings(command="allan", calibration=made)


def test_settings_reach_the_filter(logs, batch, tmp_path, capsys):
    batch(method="kf", motion="hold", output="compensated", order=(1, 1), format="csv")
    options = "--method kf --motion hold --output-kind compensated --order 1,1 --format csv"
    assert run(["replay", str(logs[0]), "-o", str(tmp_path), "--no-figure", *options.split()]) == 0
    name = f"{logs[0].stem}-zerorate.csv"
    mirrored = tmp_path / "out" / logs[0].parent.name / name
    assert mirrored.read_bytes() == (tmp_path / name).read_bytes()


def test_only_what_has_changed_is_done_again(logs, batch, tmp_path):
    batch()
    assert statuses(batch()) == ["skipped"] * 3
    os.utime(logs[0], ns=(1, 1))
    shutil.rmtree(tmp_path / "out" / "unit1")
    assert statuses(batch()) == ["done", "skipped", "done"]
    (tmp_path / "out" / "unit0" / f"{logs[1].stem}-zerorate.parquet").write_bytes(b"torn")
    assert statuses(batch(motion="ignore")) == ["done"] * 3
    assert statuses(batch(motion="ignore", force=True)) == ["done"] * 3


def test_failed_logs_do_not_stop_the_others(logs, batch, tmp_path):
    whole = logs[0].read_bytes()
    logs[0].write_bytes(whole[: len(whole) // 2])
    (logs[1].parent / "words.csv").write_text("time_s,gyro_x\n0.0,one\n0.1,two\n")
    (logs[1].parent / "notes.txt").write_text("")
    result = batch()
    assert result.counts == {"done": 2, "failed": 3}
    errors = {one.name: one.error for one in result.failed}
    assert "truncated, damaged" in errors[f"unit0/{logs[0].name}"]
    assert all(len(error.splitlines()) == 1 for error in errors.values())
    logs[0].write_bytes(whole)
    assert batch().counts == {"done": 1, "skipped": 2, "failed": 2}


def test_summary_has_a_row_for_each_log_and_axis(tmp_path, batch):
    make_logs(tmp_path / "logs", 2, axes=3)
    (tmp_path / "logs" / "bad.csv").write_text("")
    first = pq.read_table(batch().summary).to_pylist()
    again = pq.read_table(batch().summary).to_pylist()
    assert [(row["log"], row["axis"], row["status"]) for row in first] == [
        ("bad.csv", None, "failed"),
        *(("unit0/run00.parquet", f"gyro_{axis}", "done") for axis in "xyz"),
        *(("unit1/run01.parquet", f"gyro_{axis}", "done") for axis in "xyz"),
    ]
    for one, other in zip(first[1:], again[1:], strict=True):
        assert one | {"status": "skipped"} == other
        # It takes a second and a half to see that a sensor rests.
        assert (one["n"], one["rate"], one["time_at_rest"]) == (2000, 100.0, 17.76)
        # The signal is 0.5 with noise of 0.1: five standard errors of the filter's own.
        assert abs(one["bias"] - 0.5) < 5 * one["bias_sigma"]
        # White noise of 0.1 at 100 Hz is 0.01 a root hertz; 2000 samples tell it to a few percent.
        assert one["angle_random_walk"] == pytest.approx(0.01, rel=0.2)


def test_notes_reach_the_record_the_summary_and_the_terminal(tmp_path, batch, capsys):
    logs = tmp_path / "logs"
    logs.mkdir()
    rows = np.delete(np.arange(2000), np.s_[500:510])
    noise = np.random.default_rng(1).standard_normal(2000)
    for name in ("a", "b"):
        rows_of = [f"{i / 100:.2f},{noise[i]}\n" for i in rows]
        (logs / f"{name}.csv").write_text("time_s,gyro_x\n" + "".join(rows_of))
    (logs / "c.csv").write_text("time,gyro_x_dps\n" + "".join(f"{10 * i},1\n" for i in range(2000)))
    (logs / "d.csv").write_text("gyro_x_dps\n1\n2\n")
    gap = "clock at 100 Hz with 10 missing samples in 1 gap (longest 0.11 s)"
    unit = "the unit of gyro_x is not known; give unit="
    ms = "time column 'time' read as ms, by its step: 100 Hz"
    equal = "gyro_x_dps: all samples are equal, so no noise, model or gain was learned"
    for _ in range(2):
        # A log that an earlier run has finished keeps its notes.
        table = pq.read_table(batch(method="kf").summary).to_pylist()
        assert [row["notes"] for row in table] == [[gap, unit], [gap, unit], [ms, equal], []]
    line = f"zerorate batch {logs}/*.csv -o {tmp_path / 'out'} --method kf --workers 1"
    assert run(line.split()[1:]) == 1
    out = capsys.readouterr().out
    assert f"note: a.csv and 1 other: {gap}" in out
    assert f"note: c.csv: {ms}" in out
    # What a user can do about it is an option there.
    assert "the unit of gyro_x is not known; give --unit" in out
    assert "no timestamps for the sampling rate; give --rate in Hz" in out


def test_samples_that_were_left_out_are_counted(tmp_path, batch):
    logs = tmp_path / "logs"
    logs.mkdir()
    z = 0.5 + 0.1 * np.random.default_rng(1).standard_normal((3000, 2))
    z[1000::100, 0] += 10.0
    z[2000:2400, 1] = z[2000, 1]
    z[1500:1510, 1] = 250.0
    write_table(logs / "a.csv", {"gyro_x_dps": z[:, 0], "gyro_y_dps": z[:, 1]})
    first, second = pq.read_table(batch(limit=250.0).summary).to_pylist()
    alone = zr.DriftFilter(
        100.0, limit=250.0, rest_limit=10.0, bias_limit=20.0, channels=2, output="estimate"
    )
    alone.process(z)
    names = ("saturated_count", "outlier_count", "stuck_count")
    counts = (alone.saturated_count, alone.outlier_count, alone.stuck_count)
    for name, count in zip(names, counts, strict=True):
        assert [first[name], second[name]] == count.tolist()
    assert (second["saturated_count"], second["missing_count"]) == (10, 10)
    record = json.loads((tmp_path / "out" / "a-zerorate.json").read_text())
    assert [row["stuck_count"] for row in record["rows"]] == [0, 400]


def test_a_topic_chooses_among_those_of_a_bag(tmp_path):
    bag = write_recording(tmp_path / "logs", "folder", ["/front", "/rear"], 200)
    first = zr.batch(tmp_path / "logs", tmp_path / "out", workers=1)
    assert "choose with topic= from: /front, /rear" in first.failed[0].error
    settings = {"topic": "/rear"}
    second = zr.batch(tmp_path / "logs", tmp_path / "out", **settings, workers=1)
    assert [(one.name, one.status) for one in second.outcomes] == [(bag.name, "done")]
    with (bag / "metadata.yaml").open("a") as file:
        file.write("\n")
    third = zr.batch(tmp_path / "logs", tmp_path / "out", **settings, workers=1)
    assert statuses(third) == ["done"]


def test_it_filters_as_the_command_does(tmp_path, batch, capsys):
    """The limits of what rest can be are those of `replay`, in a unit of their own."""
    logs = tmp_path / "logs"
    logs.mkdir()
    z = 0.5 + 0.1 * np.random.default_rng(1).standard_normal((4000, 1))
    z[:1500] += 60.0
    write_table(logs / "a.csv", {"gyro_x_radps": np.radians(z[:, 0])})
    batch()
    assert run(["replay", str(logs / "a.csv"), "-o", str(tmp_path / "alone"), "--no-figure"]) == 0
    name = "a-zerorate.parquet"
    assert (tmp_path / "out" / name).read_bytes() == (tmp_path / "alone" / name).read_bytes()
    filtered = read_log(tmp_path / "out" / name, columns="bias_gyro_x_radps")
    assert (filtered.data[:1500] == 0.0).all()


def test_outputs_are_no_inputs(logs, tmp_path):
    pattern = str(tmp_path / "**" / "*.parquet")
    first = zr.batch(pattern, tmp_path / "out", workers=1)
    again = zr.batch(pattern, tmp_path / "out", workers=1)
    assert (len(first.outcomes), statuses(again)) == (3, ["skipped"] * 3)


def test_a_removed_output_is_a_failed_log(logs, batch, tmp_path):
    def remove_first(through, all_of_them):
        if through == 1:
            os.rename(tmp_path / "out", tmp_path / "gone")

    # How many were written before the folder went depends on the moment; none may be lost unseen.
    result = batch(progress=remove_first)
    assert result.counts["failed"] >= 1
    assert result.failed[0].error
    for one in result.outcomes:
        name = one.name.replace(".parquet", "-zerorate.parquet")
        assert (tmp_path / "out" / name).exists() == (one.status == "done")
    assert batch().counts["failed"] == 0


def test_records_are_json_beside_the_logs(logs, batch, tmp_path):
    batch()
    record = json.loads((tmp_path / "out" / "unit0" / "run00-zerorate.json").read_text())
    assert record["output_bytes"] == os.path.getsize(
        tmp_path / "out" / "unit0" / "run00-zerorate.parquet"
    )
    assert read_log(tmp_path / "out" / "unit0" / "run00-zerorate.parquet").n == 2000
    assert [row["axis"] for row in record["rows"]] == ["gyro_x"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"method": "best"},
            "method must be 'kf', 'akf', 'fading', 'robust' or 'auto', got 'best'",
        ),
        ({"unit": "miles"}, "unknown unit 'miles'"),
        ({"unit": "deg/s,g"}, "unknown unit 'deg/s,g'"),
        (
            {"command": "identify"},
            "command must be 'replay' or 'allan' or 'report' or 'check'",
        ),
        ({"rate": -1.0}, "rate"),
        ({"format": "xls"}, "format must be one of"),
        ({"rest_limit": -1.0}, "rest_limit must be a positive number"),
        ({"rest_limit": 10.0, "method": "kf"}, "rest_limit has no effect on method 'kf'"),
        ({"rest_limit": 10.0, "motion": "ignore"}, "no effect on motion 'ignore', only on 'hold'"),
        ({"fading": 0.9}, "fading has no effect on method 'auto', only on 'fading'"),
        ({"method": "fading", "fading": 2.0}, "fading must be above 0 and at most 1"),
    ],
)
def test_settings_are_checked_before_any_log(change, message):
    with pytest.raises(ValueError, match=message):
        Settings(**change)


class TestCommandLine:
    def call(self, capsys, *arguments):
        code = run(["batch", *map(str, arguments)])
        return code, *capsys.readouterr()

    def test_it_tells_what_became_of_the_logs(self, logs, tmp_path, capsys):
        logs[0].write_bytes(b"PAR1")
        pattern = tmp_path / "logs" / "**" / "*.parquet"
        code, text, errors = self.call(capsys, pattern, "-o", tmp_path / "out", "--workers", 1)
        assert (code, errors) == (1, "zerorate: 1 of 3 logs failed\n")
        assert "2 logs done in" in text
        assert f"failed: unit0/{logs[0].name}:" in text
        assert f"wrote {tmp_path / 'out' / 'summary.parquet'}" in text

    @pytest.mark.parametrize(
        ("options", "code", "message"),
        [
            (["--workers", "0"], 2, "workers must be at least 1"),
            (["--workers", "1", "--local-cluster", "1"], 2, "exclude each other"),
            (["--unit", "miles"], 2, "unknown unit 'miles'"),
            (["--columns", ","], 2, "--columns takes names"),
            (["--order", "1,1"], 2, "--order has no effect on method 'auto', only on 'kf'"),
            (["--command", "allan", "--method", "kf"], 2, "--method has no effect with --command"),
            (["--command", "allan", "--format", "csv"], 2, "--format has no effect with --command"),
        ],
    )
    def test_faults_of_usage(self, logs, tmp_path, capsys, options, code, message):
        got, _, errors = self.call(capsys, logs[0], "-o", tmp_path / "out", *options)
        assert got == code
        assert message in errors
        assert not (tmp_path / "out").exists()

    def test_no_log_is_a_fault_of_the_data(self, tmp_path, capsys):
        code, _, errors = self.call(capsys, tmp_path / "*.csv", "-o", tmp_path / "out")
        assert code == 1
        assert "no file matches" in errors

    def test_two_logs_of_one_output(self, tmp_path, capsys):
        for name in ("a.csv", "a.txt"):
            (tmp_path / name).write_text("time_s,gyro_x\n0.0,1.0\n0.1,2.0\n")
        code, _, errors = self.call(capsys, tmp_path / "a.*", "-o", tmp_path / "out")
        assert code == 2
        assert "'a.csv' and 'a.txt' would both become a-zerorate.parquet" in errors
