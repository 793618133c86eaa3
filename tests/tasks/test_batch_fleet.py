"""What a batch says of a fleet: the noise of each log, and which logs stand out."""

import json

import numpy as np
import pyarrow.parquet as pq
import pytest

import zerorate as zr
from support.batch_work import make_logs
from zerorate.cli import run
from zerorate.tasks.batch import Settings, batch
from zerorate.tasks.batch.fleet import fleet_of
from zerorate.tasks.batch.task import COMMANDS

COMPARED = COMMANDS["allan"].quantities


def rows_of(count, seed, axes=("x", "y", "z"), unit="deg/s"):
    """Return the rows of units that differ by chance alone."""
    random = np.random.default_rng(seed)

    def row(axis):
        positive = {one.column: float(np.exp(random.normal(0.0, 0.1))) for one in COMPARED}
        return {"axis": axis, "unit": unit, **positive, "mean": float(random.normal())}

    return {f"unit{i}": [row(axis) for axis in axes] for i in range(count)}


class TestComparison:
    @pytest.mark.parametrize("count", [8, 15, 60])
    def test_units_that_are_alike_raise_an_alarm_in_one_fleet_of_ten_at_most(self, count):
        fleets = [fleet_of(rows_of(count, seed), COMPARED) for seed in range(50)]
        # The mean is 0.1: more than 11 of 50 are less likely than 1 in 100.
        assert sum(len(one.outliers) for one in fleets) <= 11

    def test_a_unit_of_three_times_the_noise_is_found(self):
        logs = rows_of(30, 1)
        logs["unit7"][1]["angle_random_walk"] *= 3.0
        logs["unit7"][1]["deviation_1s"] /= 9.0  # less than the others have is no fault
        logs["unit8"][0]["mean"] -= 12.0
        logs["unit9"][0] |= {"angle_random_walk": 9.0, "angle_random_walk_sigma": 9.0}
        logs["unit9"][2] |= {"angle_random_walk": 9.0, "moved": True}
        found = fleet_of(logs, COMPARED)
        said = [(one.log, one.axis, one.quantity, one.unit) for one in found.outliers]
        assert said == [
            ("unit8", "x", "mean", "deg/s"),
            ("unit7", "y", "angle_random_walk", "deg/s/sqrt(Hz)"),
        ]
        noise = found.outliers[1]
        assert noise.times == pytest.approx(noise.value / noise.median)
        assert found.of("unit7", "y") == ["angle_random_walk"]
        assert found.of("unit7", "x") == []

    def test_few_logs_are_not_judged(self):
        logs = rows_of(20, 1)
        logs["unit0"] += rows_of(1, 2, "w")["unit0"]
        logs["unit1"] = rows_of(1, 3, "xyz", "rad/s")["unit0"]
        logs["unit0"][0]["mean"] = 1e9
        found = fleet_of(logs, COMPARED)
        assert found.untested_axes == {("unit0", "w"), *(("unit1", axis) for axis in "xyz")}
        assert [found.of("unit0", axis) for axis in "wxy"] == [None, ["mean"], []]

    def test_equal_logs_have_no_spread_and_none_stands_out(self):
        logs = {f"unit{i}": rows_of(1, 1)["unit0"] for i in range(10)}
        assert fleet_of(logs, COMPARED).outliers == ()


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    """Nine logs, one of them with three times the noise, and a folder of their noise."""
    folder = tmp_path_factory.mktemp("fleet")
    for path in make_logs(folder / "logs", 9, 6000):
        if path.name == "run03.parquet":
            log = zr.read_log(path)
            zr.write_log(log.with_data(3.0 * log.data - 1.0), path, force=True)
    result = batch(folder / "logs", folder / "noise", command="allan", workers=1)
    return folder, result


class TestNoise:
    def test_models_are_those_of_the_command(self, fleet, tmp_path, capsys):
        folder, _ = fleet
        log = folder / "logs" / "unit0" / "run00.parquet"
        assert (
            run(["allan", str(log), "-o", f"{tmp_path}/", "--no-figure", "--export", "json"]) == 0
        )
        name = "run00-zerorate-allan-models.json"
        mirrored = folder / "noise" / "unit0" / name
        assert mirrored.read_bytes() == (tmp_path / name).read_bytes()

    def test_the_summary_has_the_noise_of_every_log(self, fleet):
        _, result = fleet
        rows = pq.read_table(result.summary).to_pylist()
        assert [row["status"] for row in rows] == ["done"] * 9
        # White noise of 0.1 deg/s at 100 Hz.
        assert rows[0]["angle_random_walk"] == pytest.approx(0.01, rel=0.1)
        assert rows[0]["deviation_1s"] == pytest.approx(0.01, rel=0.3)
        assert (rows[0]["unit"], rows[0]["n"], rows[0]["moved"]) == ("deg/s", 6000, False)
        # A minute cannot tell what 100 s bring, nor a random walk that is not there.
        assert rows[0]["deviation_100s"] is None
        assert (rows[0]["rate_random_walk"], rows[0]["rate_random_walk_identifiable"]) == (
            None,
            False,
        )
        assert rows[0]["rate_random_walk_upper"] > 0.0
        assert {row["log"]: row["outlying"] for row in rows if row["outlying"]} == {
            "unit1/run03.parquet": ["angle_random_walk", "deviation_1s"]
        }

    def test_the_terminal_tells_who_stands_out(self, fleet, capsys):
        folder, _ = fleet
        line = f"batch --command allan {folder}/logs -o {folder}/noise --workers 1"
        assert run(line.split()) == 0
        out = capsys.readouterr().out
        assert "0 logs done" in out
        assert "9 skipped" in out
        assert "  unit1/run03.parquet  gyro_x  angle_random_walk  0.03" in out

    def test_a_folder_holds_the_results_of_one_command(self, fleet):
        folder, _ = fleet
        with pytest.raises(ValueError, match="is of command 'allan': give 'replay' a folder"):
            batch(folder / "logs", folder / "noise", workers=1)

    def test_every_sensor_has_a_row_and_a_dead_axis_a_note(self, tmp_path):
        random = np.random.default_rng(1)
        columns = {"gyro_x": random.normal(size=3000), "gyro_y": np.full(3000, np.nan)}
        columns |= {"acc_x": 9.8 + random.normal(size=3000), "acc_y": np.ones(3000)}
        text = zr.Log(
            np.arange(3000) / 100.0, 100.0, np.column_stack([*columns.values()]), [*columns]
        )
        zr.write_log(text, tmp_path / "a.csv")
        settings = {"command": "allan", "unit": "deg/s,m/s^2"}
        result = batch(tmp_path / "a.csv", tmp_path / "out", **settings, workers=1)
        rows = pq.read_table(result.summary).to_pylist()
        assert [(row["axis"], row["unit"]) for row in rows] == [
            ("gyro_x", "deg/s"),
            ("acc_x", "m/s^2"),
            ("acc_y", "m/s^2"),
        ]
        assert rows[0]["angle_random_walk"] == pytest.approx(0.1, rel=0.1)
        assert rows[2]["angle_random_walk"] is None
        assert rows[0]["outlying"] is None
        assert any("gyro_y" in note for note in rows[0]["notes"])
        models = json.loads((tmp_path / "out" / "a-zerorate-allan-models.json").read_text())
        assert models["axes"]["acc_y"] is None


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "kf"}, "method has no effect on command 'allan', only on 'replay'"),
        ({"format": "csv"}, "format has no effect on command 'allan'"),
        ({"unit": "deg/s,miles"}, "unknown unit 'miles'"),
    ],
)
def test_what_the_noise_does_not_use_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        Settings(command="allan", **options)
