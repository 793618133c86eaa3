"""``zerorate simulate`` and ``zerorate demo``: logs and truths of simulated gyros."""

import numpy as np
import pytest

import zerorate as zr
from support.commands import names
from zerorate import Calibration, read_log, read_recording
from zerorate.simulation import DEVICES, GyroErrors, simulate_session
from zerorate.tasks.simulate_motion import simulated_motion


class TestSimulate:
    @pytest.mark.parametrize("kind", ["csv", "tsv", "npz", "parquet"])
    def test_log_and_truth(self, call, out, kind):
        file = out / f"sim.{kind}"
        assert call("simulate", "mpu6050", "-o", file, "--duration", "20")[0] == 0
        log, truth = read_log(file), read_log(out / f"sim-truth.{kind}")
        assert log.names == ("gyro_x_radps", "gyro_y_radps", "gyro_z_radps")
        assert truth.names == ("drift_x_radps", "drift_y_radps", "drift_z_radps")
        assert (log.n, log.rate, log.unit) == (2000, 100.0, "rad/s")
        assert (log.data - truth.data).std() < 0.1

    def test_seed(self, call, out):
        for name, seed in (("a", 1), ("b", 1), ("c", 2)):
            options = ("--duration", "2", "--seed", seed, "--axes", "1")
            assert call("simulate", "MTi-100", "-o", out / f"{name}.npz", *options)[0] == 0
        a, b, c = (read_log(out / f"{name}.npz").data for name in "abc")
        np.testing.assert_array_equal(a, b)
        assert not np.array_equal(a, c)

    def test_list(self, call):
        code, text, _ = call("simulate", "--list")
        assert code == 0
        assert all(name in text for name in DEVICES)
        assert "data sheet" in text
        assert max(map(len, text.split("\n"))) <= 100

    @pytest.mark.parametrize(
        "arguments",
        [
            ("gizmo", "-o", "a.csv"),
            ("mpu6050", "-o", "a.xyz"),
            ("mpu6050", "-o", f"{__file__}/a.csv"),
            ("mpu6050", "-o", "a.csv", "--duration", "-1"),
            ("mpu6050", "-o", "a.csv", "--axes", "0"),
            ("mpu6050",),
        ],
    )
    def test_usage(self, call, out, monkeypatch, arguments):
        monkeypatch.chdir(out)
        code, _, errors = call("simulate", *arguments)
        assert code == 2
        assert errors.startswith("zerorate: ")
        assert names(out) == []

    def test_existing_truth_is_kept(self, call, out):
        (out / "sim-truth.csv").write_text("old")
        assert call("simulate", "mpu6050", "-o", out / "sim.csv", "--duration", "1")[0] == 2
        assert names(out) == ["sim-truth.csv"]


class TestSession:
    @pytest.mark.parametrize("kind", ["csv", "tsv", "parquet"])
    def test_log_and_truth(self, call, out, kind):
        file = out / f"session.{kind}"
        options = ("--poses", "3", "--temperature", "20,30")
        assert call("simulate", "-o", file, *options)[0] == 0
        recording = read_recording(file)
        expected = simulate_session(
            3,
            temperature=(20.0, 30.0),
            gyro=GyroErrors(temperature=np.radians(((0.2, -0.1, 0.15), (0.02, 0.01, -0.01)))),
        )
        assert set(recording) == {"gyro", "accel", "temperature"}
        for name, log in expected.recording.items():
            np.testing.assert_array_equal(recording[name].data, log.data)
            assert (recording[name].unit, recording[name].rate) == (log.unit, log.rate)
        truth = Calibration.from_json(out / "session-truth.json")
        np.testing.assert_array_equal(truth.values, expected.truth.values)
        assert (truth.accel_units, truth.gyro_units) == (("g", "g"), ("deg/s", "deg/s"))

    @pytest.mark.parametrize(
        ("options", "message"),
        [
            (("--poses", "3"), "needs a file"),
            (("--poses", "3", "-o", "a.npz"), "cannot write a log as '.npz'"),
            (("--poses", "3", "-o", "a.csv", "--axes", "2"), "--axes has no meaning with --poses"),
            (("--poses", "0", "-o", "a.csv"), "poses must be a whole number from 1"),
            (("--poses", "3", "-o", "a.csv", "--temperature", "20"), "takes two numbers"),
            (("mpu6050", "-o", "a.csv", "--temperature", "1,2"), "--temperature needs --poses"),
        ],
    )
    def test_usage(self, call, out, monkeypatch, options, message):
        monkeypatch.chdir(out)
        code, _, errors = call("simulate", *options)
        assert code == 2
        assert message in errors
        assert names(out) == []


class TestMotion:
    @pytest.mark.parametrize("kind", ["csv", "parquet"])
    def test_a_motion_is_read_back_as_it_is_simulated(self, call, out, kind):
        for motion, seconds in (("hand", 12.0), ("drive", 40.0), ("walk", 15.0)):
            file = out / f"{motion}.{kind}"
            options = ("--duration", seconds, "--seed", "3")
            assert call("simulate", motion, "-o", file, *options)[0] == 0
            recording, fixes = simulated_motion(motion, 100.0, seconds, 3)
            found = read_recording(file)
            assert set(found.names) == set(recording.names)
            for name, log in recording.items():
                np.testing.assert_array_equal(found[name].data, log.data)
                assert (found[name].unit, found[name].rate) == (log.unit, log.rate)
        told = zr.read_fixes(out / "drive-fixes.csv")
        assert fixes is None
        fixes = simulated_motion("drive", 100.0, 40.0, 3)[1]
        # Twelve digits of a degree are a tenth of a millimetre.
        np.testing.assert_allclose(told.position, fixes.position, rtol=1e-11)
        np.testing.assert_allclose(told.time, fixes.time, rtol=1e-11)

    def test_a_hand_has_its_iron_and_its_magnet(self, call, out):
        iron = ("--iron", "12,-9,20", "--magnet", "8,9")
        for name, options in (("plain", ()), ("iron", iron)):
            file = out / f"{name}.csv"
            assert call("simulate", "hand", "-o", file, "--duration", "10", *options)[0] == 0
        plain, disturbed = (read_recording(out / f"{name}.csv").mag for name in ("plain", "iron"))
        difference = disturbed.data - plain.data
        np.testing.assert_allclose(difference[:800], [[12.0, -9.0, 20.0]] * 800, atol=1e-9)
        assert np.abs(difference[810:890] - [12.0, -9.0, 20.0]).max() > 1.0

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            (("hand",), "simulate hand needs a file"),
            (("drive", "-o", "a.npz"), "cannot write a log as '.npz'"),
            (("walk", "-o", "a.csv", "--axes", "2"), "--axes has no meaning with walk"),
            (("walk", "-o", "a.csv", "--iron", "1,2,3"), "acts on the motion 'hand' only"),
            (("hand", "-o", "a.csv", "--iron", "1,2"), "takes numbers such as 12,-9,20"),
            (("mpu6050", "-o", "a.csv", "--magnet", "1,2"), "--magnet needs the motion hand"),
        ],
    )
    def test_usage(self, call, out, monkeypatch, arguments, message):
        monkeypatch.chdir(out)
        code, _, errors = call("simulate", *arguments)
        assert (code, names(out)) == (2, [])
        assert message in errors


class TestDemo:
    def test_it_compares_with_the_truth(self, call, out):
        code, text, errors = call("demo", "-o", out, "--duration", "20")
        assert (code, errors) == (0, "")
        assert "true error" in text
        first, _, second = text.partition("Bias as each method estimates it")
        assert "Bias at the end, by auto" in first
        assert "error at the end" in first
        assert "true error" not in first
        assert "true error" in second
        assert names(out) == ["demo-zerorate.parquet", "demo-zerorate.png"]
        assert call("demo", "-o", out, "--duration", "20")[0] == 2
        assert call("demo", "-o", out, "--duration", "20", "--force")[0] == 0

    def test_its_folders_are_made(self, call, out):
        new = out / "new" / "deep"
        assert call("demo", "-o", new, "--duration", "5", "--device", "mti-100")[0] == 0
        assert names(new) == ["demo-zerorate.parquet", "demo-zerorate.png"]

    def test_unknown_device(self, call, out):
        code, _, errors = call("demo", "-o", out, "--device", "gizmo")
        assert code == 2
        assert "unknown device 'gizmo'" in errors
