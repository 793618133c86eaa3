"""What records are told that are too little, wrong, or damaged: never that they are good."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import zerorate as zr
from support.calibrated import calibration, deviations, session, sigmas, with_data
from zerorate.record.clock import ClockReport

DEG = np.pi / 180.0


def lost(found):
    """Names of the 18 parameters that are not identifiable."""
    known = found.identifiable[:24]
    return {name for name, there in zip(found.parameters, known, strict=False) if not there}


def test_arrays_of_two_lengths_are_refused():
    one = session(6).recording
    with pytest.raises(ValueError, match="gyro and accel must have as many samples, got"):
        zr.calibration.calibrate(gyro=one.gyro.data[:-50], accel=one.accel.data, rate=100.0)


class TestTooLittle:
    @pytest.mark.parametrize("poses", [1, 3, 5, 6])
    def test_few_poses_are_an_error_that_says_what_there_is(self, poses):
        one = zr.simulation.simulate_session(poses, seed=5)
        with pytest.raises(zr.calibration.CalibrationError) as refusal:
            zr.calibration.calibrate(one.recording)
        text, turns = str(refusal.value), f"{poses - 1} turn" + "s" * (poses != 2)
        assert text.startswith(f"{poses} rest")
        assert f"{turns} can be used, and a calibration needs 4 and 6" in text
        assert "the longest still stretch is" in text
        assert "a variance below 5 times that of the quietest" in text
        bias = one.truth.gyro.bias
        told = text.partition("the gyro's bias is ")[2].partition(" deg/s")[0].split(", ")
        # Gravity adds up to some 0.1 deg/s to it.
        np.testing.assert_allclose([float(b) for b in told], bias, atol=0.2)

    def test_what_they_tell_all_the_same_is_never_valid(self):
        with pytest.raises(
            zr.calibration.CalibrationError, match="of 18 parameters are not"
        ) as refusal:
            zr.calibration.calibrate(session(5).recording)
        found = refusal.value.calibration
        assert not found.valid
        assert len(lost(found)) > 9
        # Where nothing is known the value stays where it was.
        names = list(found.parameters)
        stays = np.array([found.values[names.index(name)] for name in lost(found)])
        # The inverse of M, of which the other elements are not those of before.
        assert np.minimum(np.abs(stays), np.abs(stays - 1.0)).max() < 1e-3
        with pytest.raises(zr.calibration.CalibrationError) as refusal:
            zr.calibration.calibrate(session(1).recording)
        assert refusal.value.calibration is None

    def test_nine_poses_have_honest_errors_and_are_told_to_be_few(self):
        found = calibration(9)
        assert np.abs(deviations(found, session(9).truth)).max() < 4.0
        assert not found.held_out
        assert "rest in 12 poses or more, each of another direction" in found.advice
        assert np.median(sigmas(found)[12:21] / sigmas(calibration(20))[12:21]) > 2.0

    def test_turns_about_the_vertical_alone(self):
        found = zr.calibration.calibrate(
            zr.simulation.simulate_session(12, seed=5, axis=(0, 0, 1)).recording
        )
        assert not found.valid
        assert any(
            "about which gravity gives no information" in problem for problem in found.problems
        )
        assert "all poses lie within 0 deg" in found.problems
        assert {f"gyro.matrix.{axes}" for axes in ("xx", "yy", "zz")} <= lost(found)
        assert "hold -z up for five seconds" in found.advice
        assert "turn by about 90 degrees about x, with x level, between rests" in found.advice

    def test_poses_within_sixty_degrees(self):
        tilts = [(30, 0), (-30, 10), (0, 20), (10, -30), (20, 0), (-30, 20), (0, -20), (20, 10)]
        one = zr.simulation.simulate_session(
            turns=np.array([(x, y, 0) for x, y in tilts]) * DEG, seed=5
        )
        found = zr.calibration.calibrate(one.recording)
        assert not found.valid
        assert any(problem.startswith("all poses lie within 4") for problem in found.problems)
        assert "hold -z up for five seconds" in found.advice

    def test_turns_about_one_axis_leave_the_others(self):
        one = zr.simulation.simulate_session(turns=np.tile([100 * DEG, 0, 0], (8, 1)), seed=5)
        found = zr.calibration.calibrate(one.recording)
        assert not found.valid
        assert {"gyro.matrix.yy", "gyro.matrix.zz", "accel.matrix.xx"} <= lost(found)
        assert "gyro.matrix.xx" not in lost(found)
        assert "hold +x up for five seconds" in found.advice
        assert not any("about x, with x" in advice for advice in found.advice)

    def test_poses_that_are_asked_for_make_it_valid(self):
        """The advice, followed: from turns about one axis to all."""
        turns = [(100, 0, 0)] * 8 + [(0, 90, 0), (0, 90, 0), (0, 0, 90), (0, 0, 90), (0, 90, 0)]
        one = zr.simulation.simulate_session(turns=np.array(turns) * DEG, seed=5)
        found = zr.calibration.calibrate(one.recording)
        assert found.valid, found.problems
        assert not any(advice.startswith(("hold", "turn by")) for advice in found.advice)


class TestMotion:
    def test_one_rest_with_motion_is_named_and_does_little_harm(self):
        one, known = session(), calibration()
        gyro, accel = (log.data.copy() for log in one.recording.values())
        first, last = one.rests[7]
        # It creeps by 3 deg about x.
        tilt = np.linspace(0.0, 3.0 * DEG, last - first)
        gyro[first:last, 0] += 3.0 / (last - first) * 100.0
        y, z = accel[first:last, 1].copy(), accel[first:last, 2].copy()
        accel[first:last, 1] = y * np.cos(tilt) + z * np.sin(tilt)
        accel[first:last, 2] = z * np.cos(tilt) - y * np.sin(tilt)
        found = zr.calibration.calibrate(with_data(one.recording, gyro, accel))
        assert found.rests[7].reason.startswith("moving")
        assert "put the sensor down for rests: it moved in some of them" in found.advice
        assert np.abs(deviations(found, one.truth)).max() < 4.0
        assert known.advice == ()

    def test_a_hand_that_trembles_gives_larger_errors(self):
        one = zr.simulation.simulate_session(20, seed=5, tremor=3.0 * DEG)
        found = zr.calibration.calibrate(one.recording)
        assert np.abs(deviations(found, one.truth)).max() < 4.0
        assert found.carry_error > 3.0 * calibration().carry_error
        assert np.median(sigmas(found)[12:21] / sigmas(calibration())[12:21]) > 2.0

    def test_a_steady_turn_is_no_rest(self):
        one = session()
        gyro = one.recording.gyro.data.copy()
        first, last = one.rests[4]
        gyro[first:last, 2] += 20.0
        found = zr.calibration.calibrate(with_data(one.recording, gyro))
        assert [rest.used for rest in found.rests].count(False) == 1
        assert found.rests[4].reason == "turning: 20 deg/s more than at other rests"
        # The turn past it contains its motion; both of its own are gone.
        assert len(found.turns) == 18
        assert found.turns[3].reason.startswith("outlier: ")
        assert found.valid
        assert np.abs(deviations(found, one.truth)).max() < 4.0

    def test_nothing_rests(self):
        rng = np.random.default_rng(2)
        gyro = np.cumsum(rng.standard_normal((6000, 3)), axis=0)
        accel = 0.2 * rng.standard_normal((6000, 3)) + [0, 0, 1]
        message = (
            r"1 of 3 rests and 0 turns .*: hold it still for .*; left out: 2 rests \(turning\)"
        )
        with pytest.raises(zr.calibration.CalibrationError, match=message):
            zr.calibration.calibrate(_recording(gyro, accel))


def _recording(gyro, accel, rate=100.0):
    time = np.arange(len(gyro)) / rate
    return zr.Recording(
        {
            "gyro": zr.Log(time, rate, gyro, ["gyro_x", "gyro_y", "gyro_z"], "deg/s"),
            "accel": zr.Log(time, rate, accel, ["acc_x", "acc_y", "acc_z"], "g"),
        }
    )


class TestSaturation:
    def test_turns_at_the_end_of_the_range_are_left_out(self):
        one = zr.simulation.simulate_session(
            20, seed=5, gyro=zr.simulation.GyroErrors(range=100 * DEG)
        )
        found = zr.calibration.calibrate(one.recording)
        dropped = [turn for turn in found.turns if not turn.used]
        assert 0 < len(dropped) < 13
        for turn in dropped:
            assert turn.reason.startswith("saturated: ")
            assert np.isnan(turn.residual)
        assert "rotate more slowly: the gyro reached its range" in found.advice
        assert found.valid
        assert np.abs(deviations(found, one.truth)).max() < 4.0

    def test_the_end_of_the_range_may_be_given(self):
        known = calibration()
        found = zr.calibration.calibrate(session().recording, saturation=120.0)
        peak = [
            np.abs(session().recording.gyro.data[turn.first : turn.last]).max()
            for turn in known.turns
        ]
        assert [turn.used for turn in found.turns] == [size < 120.0 for size in peak]

    def test_one_axis_that_clips_softly_is_never_valid(self):
        gyro = session().recording.gyro.data.copy()
        gyro[:, 1] = gyro[:, 1].clip(-50.0, 50.0)
        gyro += 0.01 * np.random.default_rng(0).standard_normal(gyro.shape)
        found = zr.calibration.calibrate(with_data(session().recording, gyro))
        assert not found.valid
        assert {f"gyro.matrix.y{axis}" for axis in "xyz"} <= lost(found)
        assert np.abs(deviations(found, session().truth)).max() < 4.0

    def test_an_accelerometer_that_clips_is_never_valid(self):
        accel = session().recording.accel.data.copy()
        accel[:, 2] = accel[:, 2].clip(-0.8, 0.8)
        try:
            found = zr.calibration.calibrate(with_data(session().recording, accel=accel))
        except zr.calibration.CalibrationError as refusal:
            found = refusal.calibration
        assert not found.valid

    def test_a_slow_sensor_leaves_too_few_turns(self):
        one = zr.simulation.simulate_session(
            20, seed=5, gyro=zr.simulation.GyroErrors(range=40 * DEG)
        )
        message = r"4 and 6: rotate more slowly, or set a larger range .*: 1\d turns \(saturated\)"
        with pytest.raises(zr.calibration.CalibrationError, match=message) as refusal:
            zr.calibration.calibrate(one.recording)
        assert str(refusal.value).count("saturated") == 1


class TestGaps:
    @pytest.mark.parametrize(("lost", "advised"), [([3], False), ([3, 8], True)])
    def test_a_turn_with_a_lost_sample_is_left_out(self, lost, advised):
        gyro = session().recording.gyro.data.copy()
        gyro[session().turns[lost].mean(axis=1).astype(int)] = np.nan
        found = zr.calibration.calibrate(with_data(session().recording, gyro))
        assert [place for place, turn in enumerate(found.turns) if not turn.used] == lost
        assert found.turns[3].reason == "gap: 1 of 262 samples of the gyro are missing"
        advice = "record without gaps: rotations with missing samples were left out"
        assert (advice in found.advice) == advised
        assert np.abs(deviations(found, session().truth)).max() < 4.0

    def test_a_gap_in_a_rest_splits_it(self):
        gyro = session().recording.gyro.data.copy()
        first = session().rests[3, 0]
        gyro[first + 250 : first + 350] = np.nan
        found = zr.calibration.calibrate(with_data(session().recording, gyro))
        assert len(found.rests) == 21
        assert [turn.reason[:3] for turn in found.turns if not turn.used] == ["gap"]

    def test_an_accelerometer_may_lose_samples(self):
        accel = session().recording.accel.data.copy()
        accel[np.random.default_rng(1).random(len(accel)) < 0.02] = np.nan
        found = zr.calibration.calibrate(with_data(session().recording, accel=accel))
        assert found.valid
        assert all(turn.used for turn in found.turns)
        assert np.abs(deviations(found, session().truth)).max() < 4.0

    def test_a_jittering_clock_is_noted(self):
        recording = session().recording
        late = dataclasses.replace(
            recording.gyro, meta={"clock": ClockReport(100.0, jitter_rms=1e-3, jitter_max=5e-3)}
        )
        found = zr.calibration.calibrate(zr.Recording({"gyro": late, "accel": recording.accel}))
        assert any("stamps of the gyro jitter by 10 % of a period" in x for x in found.notes)
        assert not any("jitter" in note for note in calibration().notes)


class TestAxes:
    @pytest.mark.parametrize(
        ("signs", "order", "hand", "told"),
        [
            ((1, 1, -1), (0, 1, 2), "left-handed; one sign is wrong", "(x, y, -z)"),
            ((-1, -1, -1), (0, 1, 2), "left-handed; one sign is wrong", "(-x, -y, -z)"),
            ((1, 1, 1), (1, 0, 2), "or two axes are exchanged", "(y, x, z)"),
            ((1, 1, 1), (1, 2, 0), "not those of the accelerometer", "(z, x, y)"),
        ],
    )
    def test_a_gyro_of_other_axes_is_told_which(self, signs, order, hand, told):
        gyro = session().recording.gyro.data[:, order] * signs
        found = zr.calibration.calibrate(with_data(session().recording, gyro))
        assert not found.valid
        assert hand in found.problems[0]
        assert f"if {told} is read as its (x, y, z)" in found.problems[0]
        # The fit itself is of the axes that follow gravity.
        assert found.carry_error == pytest.approx(calibration().carry_error, rel=1e-3)

    def test_one_wrong_sign_of_the_accelerometer(self):
        accel = session().recording.accel.data * [-1, 1, 1]
        found = zr.calibration.calibrate(with_data(session().recording, accel=accel))
        assert not found.valid
        assert "the gyro's axes are not those of the accelerometer" in found.problems[0]

    def test_the_axes_told_make_it_valid(self):
        gyro = session().recording.gyro.data[:, [1, 2, 0]]
        message = zr.calibration.calibrate(with_data(session().recording, gyro)).problems[0]
        named = message.partition("if (")[2].partition(")")[0].split(", ")
        again = gyro[:, ["xyz".index(name) for name in named]]
        found = zr.calibration.calibrate(with_data(session().recording, again))
        assert found.valid
        np.testing.assert_array_equal(found.values, calibration().values)

    def test_left_handed_axes_of_unknown_unit(self):
        recording = session().recording
        found = zr.calibration.calibrate(
            gyro=recording.gyro.data * [1, 1, -1], accel=recording.accel.data, rate=100.0
        )
        assert found.problems == ("the gyro's axes are left-handed; one sign is wrong",)

    def test_a_dead_axis(self):
        recording = session().recording
        with pytest.raises(zr.calibration.CalibrationError):
            zr.calibration.calibrate(with_data(recording, recording.gyro.data * [1, 0, 1]))
        try:
            found = zr.calibration.calibrate(
                with_data(recording, accel=recording.accel.data * [1, 0, 1])
            )
        except zr.LogError:
            return
        assert not found.valid


class TestUnits:
    @pytest.mark.parametrize(
        ("factor", "unit", "message"),
        [
            (1.0, "m/s^2", r"shows 0.999 m/s\^2 at rest, which is not gravity, .*; it fits 'g'"),
            (9.80665, "g", r"shows 9.796 g at rest, .*; it fits 'm/s\^2'"),
            (1000.0, "g", "it fits 'mg'"),
            (16384.0, "g", "if these are raw counts, read them without a unit"),
        ],
    )
    def test_an_accelerometer_that_does_not_show_gravity(self, factor, unit, message):
        recording = session().recording
        with pytest.raises(zr.LogError, match=message):
            zr.calibration.calibrate(
                with_data(recording, accel=recording.accel.data * factor, accel_unit=unit)
            )

    def test_a_wrong_unit_explains_a_lack_of_rests(self):
        """Counts taken for deg/s are steady turns, but the accelerometer's unit is the fault."""
        recording = session().recording
        both = (65.5 * recording.gyro.data, 8192.0 * recording.accel.data)
        with pytest.raises(zr.LogError, match="which is not gravity, 1 g; if these are raw"):
            zr.calibration.calibrate(with_data(recording, both[0], accel=both[1]))

    def test_columns_without_names_cannot_be_told_apart(self):
        log = zr.Log(np.arange(50) / 50.0, 50.0, np.zeros((50, 7)), list("0123456"), "unit")
        with pytest.raises(zr.LogError, match="gyro of 7 columns; a first line of names such as"):
            zr.calibration.calibrate(zr.Recording({"gyro": log}))

    @pytest.mark.parametrize(
        ("factor", "unit", "told"), [(1.0, "rad/s", "deg/s"), (DEG, "deg/s", "rad/s")]
    )
    def test_a_gyro_that_does_not_follow_gravity(self, factor, unit, told):
        recording = session().recording
        with pytest.raises(zr.LogError, match=f"not follow gravity in {unit}.* does in '{told}'"):
            zr.calibration.calibrate(
                with_data(recording, recording.gyro.data * factor, gyro_unit=unit)
            )

    def test_units_of_another_kind(self):
        recording = session().recording
        with pytest.raises(zr.LogError, match="the gyro has the unit g, which is of acceleration"):
            zr.calibration.calibrate(with_data(recording, gyro_unit="g"))

    def test_unknown_units_need_poses_and_turns(self):
        few = session(8).recording
        with pytest.raises(zr.LogError, match=r"unit of the accel is not known.* 9 poses, got 8"):
            zr.calibration.calibrate(with_data(few, accel_unit="unit"))
        flat = zr.simulation.simulate_session(12, seed=5, axis=(0, 0, 1)).recording
        with pytest.raises(zr.LogError, match="the poses are too close to find it"):
            zr.calibration.calibrate(with_data(flat, accel_unit="unit"))
        with pytest.raises(zr.LogError, match=r"rotations are about too few axes|one axis"):
            zr.calibration.calibrate(with_data(flat, gyro_unit="unit"))


class TestArguments:
    def test_a_sensor_that_is_not_there(self):
        recording = session().recording
        with pytest.raises(zr.LogError, match="needs a gyro and an accel; the recording has: gyro"):
            zr.calibration.calibrate(zr.Recording({"gyro": recording.gyro}))
        with pytest.raises(zr.LogError, match="there is no 'accel_3'; the recording has"):
            zr.calibration.calibrate(recording, accel="accel_3")
        with pytest.raises(zr.LogError, match="there is no accel: give a recording, or accel="):
            zr.calibration.calibrate(gyro=recording.gyro)

    @pytest.mark.parametrize(
        ("arguments", "error", "message"),
        [
            ({"gravity": 1.0}, ValueError, r"from 9.7 to 9.9 m/s\^2, got 1"),
            ({"frame": "y"}, ValueError, "frame must be 'x', 'z' or 'symmetric', got 'y'"),
            ({"prior": "none"}, ValueError, "prior must be 'datasheet' or 'wide', got 'none'"),
            ({"g_sensitivity": "no"}, ValueError, "must be 'auto', True or False, got 'no'"),
            ({"saturation": -1.0}, ValueError, "saturation must be positive"),
            ({"gyro": np.zeros((5, 3))}, ValueError, "gyro= is an array, which needs rate="),
            (
                {"gyro": np.zeros((5, 2)), "rate": 100.0},
                ValueError,
                r"shape \(n, 3\), got \(5, 2\)",
            ),
            ({"rests": [(0.0, 5.0), (4.0, 9.0)]}, ValueError, "rests must not overlap"),
            ({"rests": [(900.0, 905.0)]}, ValueError, "a sensor has no samples"),
        ],
    )
    def test_what_is_not_as_described(self, arguments, error, message):
        with pytest.raises(error, match=message):
            zr.calibration.calibrate(session().recording, **arguments)

    def test_no_recording(self):
        with pytest.raises(TypeError, match=r"must be a Recording .* got ndarray"):
            zr.calibration.calibrate(np.zeros((100, 3)))


HARMS = {
    "zero": lambda x, a: x * (np.arange(3) != a % 3),
    "scaled": lambda x, a: x * 10.0 ** (a - 10),
    "spikes": lambda x, a: np.where(np.arange(len(x))[:, None] % (200 + a) == 3, 1e12, x),
    "lost": lambda x, a: np.where(np.arange(len(x))[:, None] % (97 + a) == 3, np.nan, x),
    "gap": lambda x, a: np.where(abs(np.arange(len(x))[:, None] - 60 * a) < 99, np.nan, x),
    "coarse": lambda x, a: np.round(x, a % 3),
    "clipped": lambda x, a: x.clip(-0.1 * a - 0.1, 0.2),
    "reversed": lambda x, a: x[::-1],
    "shifted": lambda x, a: x + 1e6 * (np.arange(3) == a % 3),
    "constant": lambda x, a: np.tile(x[:1], (len(x), 1)),
}


@cache
def short_session():
    return zr.simulation.simulate_session(10, seed=10, rest=2.5, turn=1.0, rate=50.0)


UNITS = st.sampled_from([("deg/s", "g"), ("rad/s", "m/s^2"), ("unit", "unit")])
SPOILT = st.tuples(st.sampled_from(sorted(HARMS)), st.integers(0, 20))


@settings(max_examples=25)
@given(gyro=st.lists(SPOILT, max_size=2), accel=st.lists(SPOILT, max_size=2), units=UNITS)
def test_no_record_breaks_it(gyro, accel, units):
    """It is calibrated, in numbers that are finite, or refused in a sentence."""
    recording = short_session().recording
    data = [recording.gyro.data, recording.accel.data]
    for place, harms in enumerate((gyro, accel)):
        for name, amount in harms:
            data[place] = HARMS[name](data[place], amount)
    try:
        found = zr.calibration.calibrate(with_data(recording, *data, *units))
    except zr.LogError:
        return
    assert np.isfinite(found.values).all()
    assert (np.diagonal(found.covariance) >= 0.0).all()
    assert np.isfinite(found.covariance).all()
    assert str(found)
