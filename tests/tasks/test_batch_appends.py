"""Further logs join the summary of a batch; one log alone gives its rows; checks of many logs."""

import json

import pyarrow.parquet as pq
import pytest

import zerorate as zr
from support.batch_work import Here, make_logs
from support.calibrations import write_imu
from zerorate.cli import run
from zerorate.tasks.batch import process_log
from zerorate.tasks.batch.task import COMMANDS


@pytest.fixture(autouse=True)
def here(monkeypatch):
    """Without processes, which tests of engines start."""
    monkeypatch.setattr("zerorate.tasks.batch.run.Processes", Here)


def rows(result):
    return pq.read_table(result.summary).drop_columns(["status", "seconds"]).to_pylist()


def pattern(tmp_path, unit):
    return str(tmp_path / "logs" / "**" / f"*{unit}.parquet")


def test_further_logs_join_the_summary(tmp_path):
    make_logs(tmp_path / "logs", 4)
    first = [
        str(tmp_path / "logs" / "*" / "run00.parquet"),
        str(tmp_path / "logs" / "*" / "run01*"),
    ]
    later = [
        str(tmp_path / "logs" / "*" / "run02.parquet"),
        str(tmp_path / "logs" / "*" / "run03*"),
    ]
    (tmp_path / "logs" / "unit0" / "run01.csv").write_text("no log")
    whole = zr.batch([*first, *later], tmp_path / "whole", workers=1)
    zr.batch(first, tmp_path / "out", workers=1)
    result = zr.batch(later, tmp_path / "out", workers=1)
    assert result.counts == {"done": 2}
    assert not result.failed
    assert rows(result) == rows(whole)
    assert "the summary has 3 logs of earlier runs, too" in " ".join(str(result).split())
    assert len(result.to_pandas()) == 5


def test_a_removed_output_leaves_the_summary(tmp_path):
    make_logs(tmp_path / "logs", 2)
    zr.batch(pattern(tmp_path, "00"), tmp_path / "out", workers=1)
    next((tmp_path / "out").rglob("*00-zerorate.parquet")).unlink()
    result = zr.batch(pattern(tmp_path, "01"), tmp_path / "out", workers=1)
    assert {row["log"] for row in rows(result)} == {"unit1/run01.parquet"}


def test_other_settings_replace_the_summary(tmp_path):
    make_logs(tmp_path / "logs", 2)
    zr.batch(pattern(tmp_path, "00"), tmp_path / "out", workers=1)
    result = zr.batch(pattern(tmp_path, "01"), tmp_path / "out", workers=1, motion="hold")
    assert {row["log"] for row in rows(result)} == {"unit1/run01.parquet"}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_log_alone_gives_its_rows_of_the_summary(tmp_path, command):
    recording = zr.simulate_motion("hand", duration=30.0).recording()
    gyro, accel = recording.gyro.to_pandas(), recording.accel.to_pandas()
    gyro.merge(accel).to_parquet(log := tmp_path / "hand.parquet")
    result = zr.batch(log, tmp_path / "out", command=command, workers=1)
    expected = pq.read_table(result.summary).to_pylist()
    alone = process_log(log, command, folder=tmp_path / "alone")
    for row, other in zip(alone, expected, strict=True):
        assert row["status"] == "done"
        assert row | {"log": "", "seconds": 0.0} == {
            name: value
            for name, value in (other | {"log": "", "seconds": 0.0}).items()
            if name in row
        }
    kept = {path.name for path in (tmp_path / "alone").iterdir()}
    assert {path.name for path in (tmp_path / "out").iterdir()} - kept <= {
        "summary.parquet",
        "overview.html",
    }
    assert process_log(log, command)[0].keys() == alone[0].keys()


def test_checks_of_many_logs(tmp_path, capsys):
    for seed in range(2):
        recording = zr.simulate_motion("hand", duration=60.0, seed=seed).recording()
        if seed:
            wrong = recording.gyro.data * [1, -1, 1]
            gyro = zr.Log(**{**vars(recording.gyro), "data": wrong})
            recording = zr.Recording({**recording, "gyro": gyro})
        (tmp_path / "logs").mkdir(exist_ok=True)
        write_imu(tmp_path / "logs" / f"{seed}.csv", recording)
    words = ["batch", "--command", "check", str(tmp_path / "logs"), "-o", str(tmp_path / "out")]
    assert run(words) == 0
    table = pq.read_table(tmp_path / "out" / "summary.parquet").to_pylist()
    alarms = {row["log"]: row["alarm"] for row in table if row["axis"] == "gyro"}
    assert alarms == {"0.csv": False, "1.csv": True}
    (text,) = [row["text"] for row in table if row["alarm"]]
    assert text in " ".join(capsys.readouterr().out.split())
    written = json.loads((tmp_path / "out" / "1-zerorate-check-findings.json").read_text())
    alone = zr.check(tmp_path / "logs" / "1.csv").to_json()
    assert written == json.loads(alone)
