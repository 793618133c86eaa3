"""Accelerometers of an array as one: exact without noise, robust with a fault, and refusals."""

import json

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from zerorate.array import accelerometers
from zerorate.array.accelerometers import fuse_accelerometers
from zerorate.array.logs import ArrayLog, array_log
from zerorate.array.rotations import read_rotations
from zerorate.tasks.array import replay_array

G = 9.80665
RATE = 200.0
N = 4000
CORNERS = np.array([[x, y, z] for x in (-0.02, 0.03) for y in (-0.01, 0.02) for z in (0.0, 0.004)])
UPSIDE_DOWN = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


def rotation(seed):
    q, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    return q * np.linalg.det(q)


class Body:
    """A body at rest for 5 s and in motion for 15, with sensors at some places; in SI."""

    def __init__(self, places=CORNERS, noise=0.0, speed=6.0, seed=1):
        random = np.random.default_rng(seed)
        time = np.arange(N) / RATE
        f, phase = random.uniform(0.3, 4.0, (5, 3)), random.uniform(0.0, 7.0, (5, 3))
        angle = 2.0 * np.pi * f * time[:, np.newaxis, np.newaxis] + phase
        begins = np.clip(time - 5.0, 0.0, 1.0)[:, np.newaxis]
        on, grows = begins**2 * (3.0 - 2.0 * begins), 6.0 * begins * (1.0 - begins)
        size = speed / np.sqrt(2.5)
        self.omega = size * on * np.sin(angle).sum(axis=1)
        self.alpha = size * (
            grows * np.sin(angle).sum(axis=1) + on * (2.0 * np.pi * f * np.cos(angle)).sum(axis=1)
        )
        self.force = 5.0 * on * np.cos(angle[:, ::-1]).sum(axis=1) + [0.0, 0.0, G]
        turn, change = self.omega[:, np.newaxis], self.alpha[:, np.newaxis]
        self.places = np.asarray(places)
        self.z = self.force[:, np.newaxis] + np.cross(change, places)
        self.z += np.cross(turn, np.cross(turn, places))
        self.z += noise * random.standard_normal(self.z.shape)

    def fuse(self, z=None, omega=None, **asked):
        asked = {"positions": self.places, **asked}
        omega = self.omega if omega is None else omega
        return fuse_accelerometers(self.z if z is None else z, omega, RATE, **asked)

    def error(self, found):
        return np.abs(found.accel - self.force).max()


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


class TestWithoutNoise:
    """The rate's derivative is wrong by (2 pi f / rate)^2 / 6 at a frequency f, 0.26 % at 4 Hz.

    The accelerometers know the angular acceleration exactly, so that less is left.
    """

    DERIVATIVE = 2.7e-3

    def test_the_force_is_that_at_the_origin(self):
        body = Body()
        found = body.fuse()
        felt = np.cross(body.alpha, CORNERS.mean(axis=0))
        assert body.error(found) < self.DERIVATIVE * np.abs(felt).max()
        assert not found.excluded.any()
        assert (found.weights > 0.0).all()

    def test_the_angular_acceleration(self):
        body = Body()
        found = body.fuse()
        by_rate = np.gradient(body.omega, 1.0 / RATE, axis=0)
        wrong = rms(found.angular_acceleration - body.alpha)
        assert rms(by_rate - body.alpha) < self.DERIVATIVE * rms(body.alpha)
        assert wrong < 0.5 * rms(by_rate - body.alpha)

    def test_at_a_constant_rate_it_is_exact(self):
        omega = np.tile([1.0, -2.0, 3.0], (N, 1))
        turn = omega[:, np.newaxis]
        z = np.array([0.1, 0.2, G]) + np.cross(turn, np.cross(turn, CORNERS))
        found = fuse_accelerometers(z, omega, RATE, positions=CORNERS)
        np.testing.assert_allclose(found.accel, np.tile([0.1, 0.2, G], (N, 1)), rtol=0, atol=1e-12)
        np.testing.assert_allclose(found.angular_acceleration, 0.0, atol=1e-9)
        np.testing.assert_allclose(found.residual, 0.0, atol=1e-12)

    def test_places_that_are_even_around_the_origin_need_no_lever_arms(self):
        body = Body(places=CORNERS - CORNERS.mean(axis=0))
        np.testing.assert_allclose(body.fuse(weights="mean").accel, body.force, atol=1e-12)
        plain = body.fuse(weights="mean", positions=None)
        np.testing.assert_allclose(plain.accel, body.force, atol=1e-12)
        assert plain.angular_acceleration is None

    def test_lever_arms_matter_where_a_sensor_is_missing(self):
        body = Body(places=CORNERS - CORNERS.mean(axis=0))
        z = body.z.copy()
        z[:, 3] = np.nan
        without, found = body.fuse(z, positions=None), body.fuse(z)
        assert rms(found.accel - body.force) < self.DERIVATIVE * rms(without.accel - body.force)
        assert (found.weights[:, 3] == 0.0).all()
        assert np.isnan(found.residual[3])

    def test_without_a_rate_the_sensors_tell_how_the_force_changes_with_the_place(self):
        """Of seven sensors of eight, and from places that fill a room."""
        body = Body(places=np.delete(5.0 * (CORNERS - CORNERS.mean(axis=0)), 3, axis=0), speed=20.0)
        omega = body.omega.copy()
        lost = np.linalg.norm(omega, axis=1) > 20.0
        omega[lost] = np.nan
        found, plain = body.fuse(omega=omega), body.fuse(positions=None)
        assert lost.sum() > 500
        assert rms((found.accel - body.force)[lost]) < 0.2 * rms((plain.accel - body.force)[lost])
        assert np.isnan(found.angular_acceleration[lost]).all()
        assert np.isfinite(found.accel).all()

    def test_one_sensor_is_brought_to_the_origin_by_the_rate(self):
        body = Body(places=CORNERS[:1])
        left = rms(body.fuse().accel - body.force)
        assert left < self.DERIVATIVE * rms(body.z[:, 0] - body.force)


class TestNoise:
    def test_it_falls_by_the_root_of_the_number(self):
        body = Body(noise=0.03)
        rest = slice(0, 900)
        centred = Body(places=CORNERS - CORNERS.mean(axis=0), noise=0.03)
        sigma = (centred.fuse().accel - centred.force)[rest].std()
        # 2700 numbers know it to 1.4 %.
        assert sigma == pytest.approx(0.03 / np.sqrt(8.0), rel=0.05)
        # The origin is 8 mm from the mean place: turning costs nothing, for the rate tells of none.
        assert (body.fuse().accel - body.force)[rest].std() == pytest.approx(sigma, rel=0.1)

    def test_in_motion_as_well(self):
        body = Body(places=CORNERS - CORNERS.mean(axis=0), noise=0.03)
        left = (body.fuse(weights="mean").accel - body.force)[1200:]
        assert rms(left) == pytest.approx(0.03 / np.sqrt(8.0), rel=0.05)

    def test_weights_by_noise(self):
        body = Body(noise=0.02)
        z = body.z.copy()
        z[:, 5] += 0.2 * np.random.default_rng(2).standard_normal((N, 3))
        white, auto = (body.fuse(z, weights=kind).weights for kind in ("white", "auto"))
        # A tenth of the noise, a hundredth of the weight.
        assert white[0, 5] / white[0, 0] == pytest.approx(0.01, rel=0.2)
        # One per cent of gravity beside it: (0.02^2 + 0.098^2) / (0.2^2 + 0.098^2).
        assert auto[0, 5] / auto[0, 0] == pytest.approx(0.2, rel=0.1)
        # In motion they are more alike, and they sum to one.
        assert auto[2000, 5] > auto[0, 5]
        np.testing.assert_allclose(auto.sum(axis=1), 1.0)

    def test_given_weights(self):
        body = Body(noise=0.02)
        given = np.array([1.0, 1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0])
        found = body.fuse(weights=given)
        np.testing.assert_allclose(found.weights, np.tile(given / 4.0, (N, 1)))


class TestInvariance:
    @pytest.mark.parametrize("accel_unit", ["g", "mg"])
    def test_units(self, accel_unit):
        body = Body(noise=0.02)
        plain = body.fuse()
        degrees = np.degrees(body.omega)
        units = {"gyro_unit": "deg/s", "accel_unit": accel_unit}
        other = body.fuse(zr.units.convert(body.z, "m/s^2", accel_unit), degrees, **units)
        for name in ("accel", "residual"):
            back = zr.units.convert(getattr(other, name), accel_unit, "m/s^2")
            np.testing.assert_allclose(back, getattr(plain, name), rtol=1e-9, atol=1e-9)
        turns = np.radians(other.angular_acceleration)
        np.testing.assert_allclose(turns, plain.angular_acceleration, rtol=1e-9, atol=1e-6)
        assert (plain.unit, other.unit) == ("m/s^2", accel_unit)

    def test_the_order_of_the_sensors(self):
        body = Body(noise=0.02)
        order = np.random.default_rng(3).permutation(8)
        plain = body.fuse()
        found = body.fuse(body.z[:, order], positions=CORNERS[order])
        np.testing.assert_allclose(found.accel, plain.accel, rtol=0, atol=1e-9)
        np.testing.assert_allclose(found.weights, plain.weights[:, order], rtol=1e-9)

    def test_turned_axes_of_the_body(self):
        body, turn = Body(noise=0.02), rotation(4)
        plain = body.fuse()
        found = body.fuse(body.z @ turn.T, body.omega @ turn.T, positions=CORNERS @ turn.T)
        np.testing.assert_allclose(found.accel, plain.accel @ turn.T, rtol=0, atol=1e-8)

    def test_turned_sensors(self):
        body = Body(noise=0.02)
        matrices = np.stack([rotation(10 + k) for k in range(8)])
        z = np.einsum("kji,nkj->nki", matrices, body.z)
        found, plain = body.fuse(z, rotations=matrices), body.fuse()
        np.testing.assert_allclose(found.accel, plain.accel, rtol=0, atol=1e-9)

    @pytest.mark.parametrize("positions", [None, CORNERS])
    def test_parts_in_which_it_is_computed(self, positions, monkeypatch):
        body = Body(noise=0.02)
        z = body.z.copy()
        z[1300:1700, 4] += 6.0
        z[2100:2200, 1] = np.nan
        whole = body.fuse(z, positions=positions)
        monkeypatch.setattr(accelerometers, "_CHUNK_ROWS", 1)
        parts = body.fuse(z, positions=positions)
        for name in ("accel", "weights", "excluded", "angular_acceleration"):
            np.testing.assert_array_equal(getattr(parts, name), getattr(whole, name))
        np.testing.assert_allclose(parts.residual, whole.residual, rtol=1e-12)

    def test_one_sensor_without_positions_is_itself(self):
        body = Body(places=CORNERS[:1], noise=0.02)
        found = body.fuse(positions=None)
        np.testing.assert_allclose(found.accel, body.z[:, 0], rtol=1e-15)


class TestMissing:
    @pytest.mark.parametrize("gone", [np.nan, np.inf, -np.inf, 1e150])
    def test_what_is_no_sample(self, gone):
        body = Body(noise=0.02)
        z = body.z.copy()
        z[100:3000, 2, 1] = gone
        found = body.fuse(z)
        z[100:3000, 2] = np.nan
        np.testing.assert_array_equal(found.accel, body.fuse(z).accel)
        assert (found.weights[100:3000, 2] == 0.0).all()
        assert not found.excluded.any()

    def test_at_the_end_of_the_range(self):
        body = Body(noise=0.02)
        z, gone = body.z.copy(), body.z.copy()
        gone[1500:1600, 0] = np.nan
        most = 2.0 * np.abs(body.z).max()
        z[1500:1600, 0, 0] = most
        np.testing.assert_array_equal(body.fuse(z, limit=most).accel, body.fuse(gone).accel)

    @pytest.mark.parametrize("positions", [None, CORNERS])
    def test_nobody_is_left(self, positions):
        body = Body(noise=0.02)
        z = body.z.copy()
        z[700:800] = np.nan
        found = body.fuse(z, positions=positions)
        lost = np.isnan(found.accel).all(axis=1)
        np.testing.assert_array_equal(np.flatnonzero(lost), np.arange(700, 800))
        assert np.isnan(body.fuse(np.full_like(z, np.nan), positions=positions).accel).all()

    @pytest.mark.parametrize("size", [0.0, 1e-308, 1e150, -1e300])
    @pytest.mark.parametrize("positions", [None, CORNERS])
    def test_hostile_numbers(self, size, positions):
        z, omega = np.full((300, 8, 3), size), np.full((300, 3), size)
        z[::2] *= -1.0
        z[150:] = Body().z[150:300]
        found = fuse_accelerometers(z, omega, RATE, positions=positions)
        usual = abs(size) < 1.0
        assert np.isfinite(found.accel[0 if usual else 150 :]).all()
        assert np.isfinite(found.weights).all()

    @pytest.mark.parametrize("n", [1, 2, 3])
    def test_a_few_samples(self, n):
        body = Body()
        found = fuse_accelerometers(body.z[:n], body.omega[:n], RATE, positions=CORNERS)
        np.testing.assert_allclose(found.accel, body.force[:n], atol=1e-9)

    def test_every_sensor_at_one_place(self):
        body = Body(places=np.tile([0.1, 0.0, 0.0], (4, 1)))
        assert rms(body.fuse().accel - body.force) < 0.05 * rms(body.z[:, 0] - body.force)


def faulty(kind, x, random):
    """Put a fault into the samples (n, 3) of a sensor, in place."""
    if kind == "offset":
        x += [4.0, 0.0, 0.0]
    elif kind == "sign":
        x[:, 2] *= -1.0
    elif kind == "swap":
        x[:] = x[:, [2, 1, 0]]
    elif kind == "scale":
        x *= 1.5
    elif kind == "full":
        x[:] = 156.0
    elif kind == "spikes":
        hit = random.random(len(x)) < 0.02
        x[hit] += 50.0
    return x


class TestFaults:
    KINDS = ("offset", "sign", "swap", "scale", "full", "spikes")

    @pytest.mark.parametrize("kind", KINDS)
    def test_a_wrong_sensor_is_left_out(self, kind):
        body = Body(noise=0.02)
        z = body.z.copy()
        faulty(kind, z[400:, 6], np.random.default_rng(5))
        found = body.fuse(z)
        assert not np.delete(found.excluded, 6, axis=1).any()
        wrong = np.abs(z[:, 6] - body.z[:, 6]).max(axis=1) > 10.0
        plain = rms(z.mean(axis=1) - body.z.mean(axis=1))
        # What seven give differs by noise and by a hundredth of the lever arms.
        assert rms(found.accel - body.fuse().accel) < 0.1 * plain
        if kind != "spikes":
            assert found.excluded[400:, 6].mean() > 0.95
        else:
            assert found.excluded[wrong, 6].mean() > 0.95

    def test_it_is_back_after_ten_seconds(self):
        body = Body(noise=0.02)
        z = body.z.copy()
        z[400:600, 6] += 5.0
        out = np.flatnonzero(body.fuse(z).excluded[:, 6])
        assert out[0] == 400
        # Ten seconds after the last tick of 50 samples that was wrong.
        assert 600 + 9.5 * RATE < out[-1] <= 600 + 10.5 * RATE

    def test_of_two_nobody_knows_which_is_wrong(self):
        body = Body(places=CORNERS[:2], noise=0.02)
        z = body.z.copy()
        z[:, 1] += 5.0
        assert not body.fuse(z).excluded.any()

    @pytest.mark.parametrize("keep", [[0, 1, 7], [0, 1, 2], [0, 3, 5, 6], [*range(8)]])
    @pytest.mark.parametrize("known", [True, False])
    def test_nobody_is_left_out_in_motion(self, keep, known):
        """With errors of cheap sensors, at 20 rad/s and wherever they are."""
        body = Body(places=CORNERS[keep], noise=0.03, speed=20.0)
        random = np.random.default_rng(6)
        z = body.z * (1.0 + 0.02 * random.standard_normal((len(keep), 3)))
        z += 0.3 * random.standard_normal((len(keep), 3))
        assert not body.fuse(z, positions=CORNERS[keep] if known else None).excluded.any()


class TestRefusals:
    @pytest.mark.parametrize(
        ("changed", "message"),
        [
            ({"z": np.zeros((9, 3))}, r"accel must have shape \(n, sensors, 3\), got \(9, 3\)"),
            ({"omega": np.zeros((N, 2))}, r"rate_fused must have shape \(4000, 3\), as accel has"),
            ({"positions": np.zeros((2, 3))}, r"positions must have shape \(8, 3\), in m"),
            ({"positions": np.full((8, 3), np.nan)}, "positions must be finite"),
            ({"rotations": np.zeros((8, 3))}, r"rotations must have shape \(8, 3, 3\)"),
            ({"rotations": np.stack([np.eye(3)] * 7 + [-np.eye(3)])}, "sensor 8 is no rotation"),
            ({"weights": "best"}, "weights must be auto, mean, white or numbers, got 'best'"),
            ({"weights": [1.0] * 7 + [-1.0]}, "weights must be 8 numbers, none negative"),
            ({"weights": [0.0] * 8}, "weights must not all be zero"),
            ({"limit": 0.0}, "limit must be positive, got 0"),
            ({"scale_error": 2.0}, "scale_error must be from 0 to 1, got 2"),
            ({"gyro_unit": "g"}, "gyro_unit must be a unit of rate, got 'g'"),
            ({"accel_unit": "deg/s"}, "accel_unit must be a unit of acceleration"),
        ],
    )
    def test_what_is_wrong_is_said(self, changed, message):
        with pytest.raises(ValueError, match=message):
            Body().fuse(**changed)


def columns(kinds=("gyro_{}_dps", "accel_{}_g"), devices=("imu1", "imu2", "imu3"), n=N):
    """Return columns of a body that turns; accelerometers of the devices lie side by side."""
    places = CORNERS[: len(devices)]
    body, random = Body(places=places, noise=0.01), np.random.default_rng(7)
    found = {"time_s": np.arange(n) / RATE}
    rates = np.degrees(body.omega[:, np.newaxis]) + 0.05 * random.standard_normal((N, 3, 3))
    for k, device in enumerate(devices):
        for kind, data in zip(kinds, (rates[:, k], body.z[:, k] / G), strict=True):
            for i, axis in enumerate("xyz"):
                found[f"{device}_{kind.format(axis)}"] = data[:n, i]
    return found


class TestLogs:
    def test_they_go_with_the_gyros_of_their_names(self):
        table = columns()
        log = array_log(zr.read_recording(table))
        assert (log.accel.shape, log.accel_unit) == ((N, 3, 3), "g")
        np.testing.assert_array_equal(log.accel[:, 1, 2], table["imu2_accel_z_g"])

    def test_a_device_without_one(self):
        table = {k: v for k, v in columns().items() if not k.startswith("imu2_accel")}
        log = array_log(zr.read_recording(table))
        assert np.isnan(log.accel[:, 1]).all()
        np.testing.assert_array_equal(log.accel[:, 2, 0], table["imu3_accel_x_g"])

    def test_names_that_are_alike_are_told_apart_by_those_of_the_logs(self):
        time, random = np.arange(50) / RATE, np.random.default_rng(8)
        logs = {}
        for number in ("", "_1"):
            for kind, unit in (("gyro", "deg/s"), ("accel", "m/s^2")):
                names = [f"{kind}_{axis}" for axis in "xyz"]
                data = random.standard_normal((50, 3))
                logs[kind + number] = zr.Log(time, RATE, data, names, unit)
        log = array_log(zr.Recording(logs))
        np.testing.assert_array_equal(log.accel[:, 1], logs["accel_1"].data)

    def test_none(self):
        table = {k: v for k, v in columns().items() if "accel" not in k}
        assert array_log(zr.read_recording(table)).accel is None

    @pytest.mark.parametrize(
        ("other", "told"),
        [
            ({"unit": "unit"}, "the unit of b_ax, b_ay, b_az is not known"),
            ({"unit": "g"}, "they differ in unit"),
            ({"n": 40}, "b_ax, b_ay, b_az is not on the clock of the gyros"),
            ({"axes": "xy"}, "b_ax, b_ay has not three axes"),
        ],
    )
    def test_what_does_not_fit_is_left_out_and_said(self, other, told):
        def made(kind, label, n=50, unit="m/s^2", axes="xyz"):
            names = [f"{label}_{kind}{axis}" for axis in axes]
            return zr.Log(np.arange(n) / RATE, RATE, np.ones((n, len(axes))), names, unit)

        logs = {"gyro": made("g", "a", unit="deg/s"), "gyro_1": made("g", "b", unit="deg/s")}
        logs |= {"accel": made("a", "a"), "accel_1": made("a", "b", **other)}
        log = array_log(zr.Recording(logs))
        assert log.accel is None
        assert log.meta["notes"] == (f"the accelerometers are left out: {told}",)

    def test_a_shape_that_does_not_fit(self):
        with pytest.raises(zr.LogError, match=r"accel must have shape \(9, 2, 3\), got \(9, 3\)"):
            ArrayLog(
                np.arange(9) / RATE, RATE, np.zeros((9, 2, 3)), ("a", "b"), accel=np.zeros((9, 3))
            )


class TestPositions:
    TEXT = json.dumps(
        {
            "format": "zerorate rotations",
            "version": 1,
            "rotations": {"a": [1, 0, 0, 0], "b": UPSIDE_DOWN.tolist()},
            "positions": {"a": [0.01, 0.0, 0.1], "b": [-0.01, 0.0, 0.0]},
        }
    )

    def test_they_are_kept_to_the_last_bit(self):
        read = read_rotations(self.TEXT)
        np.testing.assert_array_equal(read.positions, [[0.01, 0.0, 0.1], [-0.01, 0.0, 0.0]])
        again = read_rotations(read.to_json())
        np.testing.assert_array_equal(again.positions, read.positions)

    def test_without_any(self):
        text = json.dumps({k: v for k, v in json.loads(self.TEXT).items() if k != "positions"})
        found = read_rotations(text)
        assert found.positions is None
        assert "positions" not in found.to_json()

    @pytest.mark.parametrize(
        ("listed", "message"),
        [
            ({"a": [0, 0, 0]}, "there is no position of b"),
            ({"a": [0, 0, 0], "b": [0, 0]}, "'position of b' must hold finite numbers"),
            ([1, 2], "'positions' must be an object"),
        ],
    )
    def test_what_is_wrong_is_said(self, listed, message):
        text = json.dumps({**json.loads(self.TEXT), "positions": listed})
        with pytest.raises(ValueError, match=message):
            read_rotations(text)


class TestReplay:
    def test_it_is_what_the_function_gives(self):
        log = array_log(zr.read_recording(columns()))
        result = replay_array(log, positions=CORNERS[:3])
        units = {"gyro_unit": "deg/s", "accel_unit": "g"}
        alone = fuse_accelerometers(log.accel, result.rate, RATE, positions=CORNERS[:3], **units)
        np.testing.assert_array_equal(result.accel.accel, alone.accel)
        at = result.accel_allan.second
        # Five seconds at rest know the Allan deviation at 1 s to some tens of per cent.
        assert result.accel_allan.gains()[1][-1, at] == pytest.approx(np.sqrt(3.0), rel=0.5)

    def test_the_written_log_has_an_accelerometer(self, tmp_path):
        log = array_log(zr.read_recording(columns()))
        result = replay_array(log)
        zr.write_log(result.to_log(), tmp_path / "fused.csv")
        again = zr.read_recording(tmp_path / "fused.csv")
        assert again.names == ("gyro", "accel")
        assert again.accel.unit == "g"
        np.testing.assert_array_equal(again.accel.data, result.accel.accel)

    def test_without_accelerometers_there_is_none(self):
        log = array_log(zr.read_recording({k: v for k, v in columns().items() if "acc" not in k}))
        result = replay_array(log)
        assert result.accel is None
        assert not any("accel" in name for name in result.to_log().extra)

    def test_positions_need_a_known_unit(self):
        log = array_log(zr.read_recording(columns()))
        bare = ArrayLog(
            log.time, RATE, log.data, log.labels, accel=log.accel, accel_unit=log.accel_unit
        )
        with pytest.raises(ValueError, match="positions need rates of a known unit, got 'unit'"):
            replay_array(bare, positions=CORNERS[:3])
        assert replay_array(bare).accel is not None


SIDE = 9.45e-3
BOARD = np.array(
    [
        (x, y, z)
        for x, y in ((-SIDE, SIDE), (-SIDE, -SIDE), (SIDE, SIDE), (SIDE, -SIDE))
        for z in (1e-3, -1e-3)
    ]
)


@pytest.fixture(scope="module")
def board():
    found = zr.read_recording(RECORDINGS / "mimu4444_array8_62hz_exp1.parquet")
    log = array_log(found)
    matrices = np.stack([np.eye(3), UPSIDE_DOWN] * 4)
    # 32767 / 16.4 deg/s is the end of the range.
    return log, replay_array(log, rotations=matrices, positions=BOARD, limit=1997.9)


@needs_recordings
class TestBoardOfEight:
    """Eight IMUs on a board, in twenty poses and in turns by hand that saturate the gyros."""

    @staticmethod
    def fuse(board, accel=None, positions=BOARD):
        log, result = board
        return fuse_accelerometers(
            log.accel if accel is None else accel, result.rate, log.rate,
            rotations=result.rotations, positions=positions, gyro_unit="deg/s",
            accel_unit="g",
        )  # fmt: skip

    def test_nobody_is_left_out(self, board):
        _, result = board
        assert not result.accel.excluded.any()
        assert np.isfinite(result.accel.accel).all()

    def test_the_noise_at_rest(self, board):
        _, result = board
        mean, one = (g[-1, result.accel_allan.second] for g in result.accel_allan.gains())
        # The sensors are alike: the plain mean is as good, and both have sqrt(8) less than one.
        assert 0.98 < mean < 1.03
        assert one == pytest.approx(np.sqrt(8.0), rel=0.05)

    def test_lever_arms_explain_most_of_what_the_sensors_differ_by(self, board):
        _, result = board
        with_them, without = result.accel.residual, self.fuse(board, positions=None).residual
        assert rms(with_them) < 0.25 * rms(without)

    def test_lever_arms_matter_where_a_sensor_is_missing(self, board):
        log, result = board
        accel = log.accel.copy()
        accel[:, 3] = np.nan
        moving = ~result.at_rest.all(axis=1)
        whole = result.accel.accel
        with_them, without = (
            rms((self.fuse(board, accel, positions).accel - whole)[moving])
            for positions in (BOARD, None)
        )
        assert with_them < 0.35 * without
