"""The task `estimate_attitude`: what it takes, and recordings that are not what they seem."""

from dataclasses import replace

import numpy as np
import pytest
from rosbags import rosbag1
from rosbags.typesys import Stores, get_typestore

import zerorate as zr
from support.bags import EPOCH, imu_message
from support.commands import one_line
from zerorate.findings.attitude import up_direction
from zerorate.record import LogError

MOTION = zr.simulate_motion("hand", duration=25.0, seed=4)
RECORDING = MOTION.recording()
G = 9.80665


def table(gyro, accel, **more):
    rows = {"time_s": np.arange(len(gyro)) / 100.0}
    for name, values in {"gyro": gyro, "accel": accel, **more}.items():
        rows |= {f"{name}_{x}": values[:, i] for i, x in enumerate("xyz")}
    return rows


def still(bias, n=3000):
    """A sensor on a table whose gyro has a bias, deg/s."""
    rng = np.random.default_rng(1)
    gyro = np.asarray(bias) + 0.1 * rng.normal(size=(n, 3))
    return table(gyro, [0.0, 0.0, 1.0] + 0.003 * rng.normal(size=(n, 3)))


def test_path_frame_and_recording_give_the_same(tmp_path):
    whole = zr.estimate_attitude(RECORDING, mag=False)
    rows = table(MOTION.gyro, MOTION.accel)
    unit = "rad/s,m/s^2"
    found = zr.estimate_attitude(rows, unit=unit)
    np.testing.assert_array_equal(found.quaternion, whole.quaternion)
    np.savetxt(tmp_path / "a.csv", np.column_stack([*rows.values()]), "%.17g", ",",
               header=",".join(rows), comments="")  # fmt: skip
    read = zr.estimate_attitude(tmp_path / "a.csv", unit=unit)
    np.testing.assert_array_equal(read.quaternion, whole.quaternion)


def test_reference_by_columns_poses_and_file(tmp_path):
    poses = zr.record.Poses(MOTION.time, np.zeros((len(MOTION.time), 3)), MOTION.quaternion)
    poses.to_tum(tmp_path / "truth.tum")
    later = replace(poses, time=poses.time - 3.0)
    known = zr.estimate_attitude(RECORDING, reference=poses)
    assert known.compared_heading == "aligned"
    for reference, offset in ((tmp_path / "truth.tum", 0.0), (later, 3.0)):
        found = zr.estimate_attitude(RECORDING, reference=reference, reference_offset=offset)
        assert found.errors().total == pytest.approx(known.errors().total, rel=1e-6)
    rows = table(MOTION.gyro, MOTION.accel)
    rows |= {f"m{x}": MOTION.quaternion[:, i] for i, x in enumerate("wxyz")}
    for columns in ("mw,mx,my,mz", ["mw", "mx", "my", "mz"]):
        found = zr.estimate_attitude(rows, unit="rad/s,m/s^2", reference=columns)
        np.testing.assert_array_equal(found.reference, MOTION.quaternion)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"at": (95.0, 11.0)}, "at= takes deg, latitude within 90 first, got '95,11'"),
        ({"at": (48.0, 11.0), "declination": 0.1}, "at= determines the declination: give it, or"),
        ({"at": (48.0, 11.0), "mag": False}, "at= has no effect with mag=False"),
        ({"learn_magnetometer": True, "mag": False}, "learn_magnetometer= has no effect with"),
        ({"magnetometer": "a.json", "mag": False}, "magnetometer= has no effect with mag=False"),
        ({"reference": "no.tum"}, "reference= names no.tum, which does not exist"),
        ({"reference": "a,b,c,d", "reference_offset": 1.0}, "reference_offset= acts on a file"),
        ({"reference": "a,b,c,d"}, "reference= applies to data that are read"),
        ({"reference_heading": "north"}, "reference_heading must be one of absolute, relative"),
        ({"kp": 2.0}, "kp has no effect on method 'auto', only on 'mahony'"),
        ({"unit": "deg/s"}, "unit= applies to data that are read: a Recording is used unchanged"),
    ],
)
def test_refusals(options, match):
    with pytest.raises(ValueError, match=match):
        zr.estimate_attitude(RECORDING, **options)


def test_a_heading_to_compare_needs_a_reference():
    bare = zr.Recording({k: v for k, v in RECORDING.items() if k != "reference"})
    with pytest.raises(ValueError, match="reference_heading= needs a reference"):
        zr.estimate_attitude(bare, reference_heading="relative")
    with pytest.raises(TypeError, match="there is no argument 'kq'"):
        zr.estimate_attitude(RECORDING, kq=2.0)


class TestGravity:
    """A phone's linear acceleration, with and without gravity next to it."""

    def parts(self):
        """Return specific force, and what of it is gravity's: up at rest."""
        felt = G * up_direction(MOTION.quaternion)
        return MOTION.accel - felt, felt

    def test_it_is_missed(self):
        rows = table(MOTION.gyro, self.parts()[0])
        with pytest.raises(LogError, match="gravity is absent, as in a phone's linear"):
            zr.estimate_attitude(rows, unit="rad/s,m/s^2")

    @pytest.mark.parametrize(("unit", "sign"), [("m/s^2", 1.0), ("g", -1.0)])
    def test_it_is_added(self, unit, sign):
        """Android's points up, in m/s^2, Apple's down, in g: both show the same attitude."""
        size = sign / (G if unit == "g" else 1.0)
        free, felt = (size * part for part in self.parts())
        found = zr.estimate_attitude(table(MOTION.gyro, free, gravity=felt), unit=f"rad/s,{unit}")
        whole = zr.estimate_attitude(RECORDING, mag=False)
        np.testing.assert_allclose(found.quaternion, whole.quaternion, atol=1e-9)
        assert found.alarms == ()
        assert "gravity_x, gravity_y, gravity_z is added" in " ".join(found.notes)


class TestSteadyRate:
    """A gyro with a bias beyond what the filter takes for one, at rest."""

    @pytest.mark.parametrize("bias", [15.0, 20.0, 25.0])
    def test_what_is_seen_is_said(self, bias):
        found = zr.estimate_attitude(still([bias, -1.0, 0.7 * bias]), unit="deg/s,g")
        (alarm,) = found.alarms
        assert "deg/s throughout, while the accelerometer shows no motion: a bias" in alarm
        assert "bias_limit=math.radians(" in alarm

    def test_a_limit_that_is_stated_is_enough(self):
        limit = np.radians(40.0)
        source = still([25.0, -1.0, 17.5])
        found = zr.estimate_attitude(source, unit="deg/s,g", bias_limit=limit)
        assert found.alarms == ()
        assert found.at_rest.mean() > 0.95
        np.testing.assert_allclose(np.degrees(found.bias[-1]), [25.0, -1.0, 17.5], atol=0.1)
        low = zr.estimate_attitude(source, unit="deg/s,g", bias_limit=np.radians(20.0))
        assert len(low.alarms) == 1


def split_bag(path):
    """Write gyro and accelerometer in topics of their own, zeros in the other half of each."""
    store = get_typestore(Stores.ROS1_NOETIC)
    rng = np.random.default_rng(1)
    events = [(EPOCH + i * 5_000_000, "gyro") for i in range(3000)]
    events += [(EPOCH + i * 16_000_000 + 1_234_567, "accel") for i in range(937)]
    with rosbag1.Writer(path) as writer:
        topics = {
            name: writer.add_connection(
                f"/camera/{name}/sample", "sensor_msgs/msg/Imu", typestore=store
            )
            for name in ("accel", "gyro")
        }
        for stamp, name in sorted(events):
            row = np.zeros(6)
            if name == "gyro":
                row[:3] = [0.0, 0.0, np.radians(15.0)] + 0.002 * rng.normal(size=3)
            else:
                row[3:] = [0.0, 0.0, G] + 0.02 * rng.normal(size=3)
            message = imu_message(store, stamp, row, "0")
            raw = store.serialize_ros1(message, "sensor_msgs/msg/Imu")
            writer.write(topics[name], stamp, raw)
    return path


def test_a_half_of_a_message_that_is_zero_is_absent(call, tmp_path):
    path = split_bag(tmp_path / "camera.bag")
    found = zr.estimate_attitude(path)
    assert found.rate == pytest.approx(200.0, rel=1e-3)
    turned = np.unwrap(found.euler[:, 2])
    assert np.degrees(turned[-1] - turned[400]) == pytest.approx(15.0 * 13.0, rel=0.02)
    absent = [note for note in found.notes if "constant zero" in note]
    assert len(absent) == 2
    text = one_line(call("attitude", path, "--no-figure", "-o", tmp_path)[1])
    assert all(one_line(note) in text for note in absent)
