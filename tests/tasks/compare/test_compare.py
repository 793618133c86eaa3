"""Comparisons: how recordings are read and matched, and what is measured of each kind."""

import math

import numpy as np
import pytest

import zerorate as zr
from support.compared import (
    BIAS,
    RATE,
    gyros,
    motion,
    noise,
    oriented,
    resting,
    turning,
    write_table,
)
from support.recordings import RECORDINGS, needs_recordings
from zerorate.record import LogError
from zerorate.show.compare_tables import format_compare
from zerorate.show.tables import WIDTH
from zerorate.simulation import Contamination
from zerorate.tasks.compare import METHODS, Trial, compare_methods, read_trial
from zerorate.tasks.compare.methods import WHOLE_RECORD_METHODS, run_on_axis
from zerorate.tasks.compare.rest import scoring_start
from zerorate.tasks.compare.slope import slope
from zerorate.tasks.compare.turning import fit_reference

BROAD = "broad_05_undisturbed_slow_rotation_with_breaks_B.parquet"
ENCODER = "mpu6050_encoder_yaw_slow_100hz.parquet"


def by_method(comparison):
    return {row.method: row.values for row in comparison.rows}


def no_gain():
    raise AssertionError("this method needs no average")


class TestReading:
    def test_a_log_alone_is_at_rest(self, tmp_path):
        recording = read_trial(resting(tmp_path / "a.csv"))
        assert recording.kind == "rest"
        expected = np.radians(zr.read_log(tmp_path / "a.csv").data)
        # A factor once as a constant and once as a product: one rounding.
        np.testing.assert_allclose(recording.log.data, expected, rtol=1e-15)

    def test_a_reference_is_no_gyro(self, tmp_path):
        z = BIAS + noise(500)
        path = write_table(tmp_path / "a.csv", gyros(z) | {"table_rate_dps": z[:, 0]})
        recording = read_trial(path, reference="table_rate_dps")
        assert recording.kind == "turning"
        assert recording.log.names == ("gyro_x_dps", "gyro_y_dps", "gyro_z_dps")
        np.testing.assert_array_equal(recording.reference.rate, recording.log.data[:, 0])

    def test_the_unit_of_an_angle_is_that_of_its_name(self, tmp_path):
        angle, rate = motion(np.arange(500) / RATE)
        columns = {"a_deg": angle, "a_rad": np.radians(angle), "a": angle}
        path = write_table(tmp_path / "a.csv", gyros(noise(500)) | columns)
        read = [read_trial(path, reference=name).reference.rate for name in columns]
        for one in read:
            # The cubic through 60 ms of a motion of up to 3.1 rad/s.
            np.testing.assert_allclose(one[3:-3], np.radians(rate[3:-3]), atol=1e-4)

    def test_quaternions_are_found_in_their_order(self, tmp_path):
        recording = read_trial(oriented(tmp_path / "a.csv"))
        assert recording.kind == "orientation"
        assert recording.orientation.names == tuple(f"ref_quat_{x}" for x in "wxyz")

    def test_quaternions_by_name(self, tmp_path):
        columns = {name: np.ones(50) for name in "dbca"}
        path = write_table(tmp_path / "a.csv", gyros(noise(50)) | columns)
        recording = read_trial(path, quaternion=list("abcd"))
        assert recording.orientation.names == tuple("abcd")
        assert read_trial(path).kind == "rest"

    def test_chosen_columns_alone_are_at_rest(self, tmp_path):
        recording = read_trial(oriented(tmp_path / "a.csv"), columns=["gyro_x_dps"])
        assert (recording.kind, recording.log.names) == ("rest", ("gyro_x_dps",))

    @pytest.mark.parametrize(
        ("columns", "arguments", "match"),
        [
            ({}, {"reference": "encoder"}, "there is no column 'encoder'"),
            ({"quat_w": 0}, {}, "are not one quaternion"),
            ({"temp_g": 0}, {"reference": "temp_g"}, "is in g, expected an angle or a rate"),
            ({}, {"quaternion": ["a", "b"]}, "four columns w, x, y, z, got 2"),
            ({}, {"quaternion": list("wxyz"), "reference": "a"}, "not with both"),
        ],
    )
    def test_refusals(self, tmp_path, columns, arguments, match):
        more = {name: np.zeros(50) for name in columns}
        path = write_table(tmp_path / "a.csv", gyros(noise(50)) | more)
        with pytest.raises(ValueError, match=match):
            read_trial(path, **arguments)

    def test_motion_needs_a_unit(self, tmp_path):
        path = write_table(tmp_path / "a.csv", {"gyro_z": np.ones(50), "angle": np.ones(50)})
        with pytest.raises(LogError, match="motion needs gyros of a known unit"):
            read_trial(path, reference="angle")
        assert read_trial(path, reference="angle", unit="deg/s").kind == "turning"


class TestSlope:
    def test_of_a_cubic_is_exact(self):
        t = np.arange(200) / RATE
        found = slope(0.3 * t**3 - t, RATE)
        assert np.isnan(found[[0, 1, 2, -3, -2, -1]]).all()
        # Weights of up to 25 a second on angles of up to 0.4, each rounded.
        np.testing.assert_allclose(found[3:-3], (0.9 * t**2 - 1.0)[3:-3], atol=1e-12)

    def test_whole_turns_are_no_motion(self):
        turned = np.linspace(0.0, 20.0, 500)
        wrapped = np.mod(turned, 2.0 * np.pi)
        # As above, of angles of up to 20.
        np.testing.assert_allclose(slope(wrapped, RATE), slope(turned, RATE), atol=1e-11)

    def test_missing_angles_blank_their_neighbours(self):
        angle = np.linspace(0.0, 1.0, 100)
        angle[50] = np.nan
        assert np.flatnonzero(np.isnan(slope(angle, RATE)[3:-3])).tolist() == list(range(44, 51))


class TestMethods:
    def test_raw_and_mean(self):
        z = BIAS[0] + noise(300, axes=1)[:, 0]
        raw, mean = (run_on_axis(name, z, RATE, no_gain) for name in ("raw", "mean"))
        assert raw.estimate is z
        assert not raw.bias.any()
        np.testing.assert_array_equal(mean.bias, zr.metrics.running_mean(z))

    @pytest.mark.parametrize("method", ["kf", "akf", "fading"])
    def test_filters_are_those_of_the_package(self, method):
        z = BIAS[0] + noise(3000, axes=1)[:, 0]
        z[700:720] = np.nan
        found = run_on_axis(method, z, RATE, no_gain)
        trace = zr.DriftFilter(RATE, method=method).trace(z)
        np.testing.assert_array_equal(found.estimate, trace.estimate)
        np.testing.assert_array_equal(found.innovation, trace.innovation)
        np.testing.assert_array_equal(found.innovation_variance, trace.innovation_variance)
        np.testing.assert_array_equal(
            found.smooth, np.where(np.isfinite(z), trace.estimate, np.nan)
        )
        assert 1.0 / RATE <= found.time_constant < 30.0

    @pytest.mark.parametrize("method", ["median", "fading+", "fading+wings", "median+hold"])
    def test_the_filter_says_which_methods_it_knows(self, method):
        with pytest.raises(ValueError, match="method must be"):
            run_on_axis(method, noise(100, axes=1)[:, 0], RATE, no_gain)

    @pytest.mark.parametrize(
        ("name", "arguments"),
        [
            ("kf", {"method": "kf"}),
            ("kf+hold", {"method": "kf", "motion": "hold"}),
            ("kf+reject", {"method": "kf", "outliers": "reject"}),
            ("kf+hold+reject", {"method": "kf", "motion": "hold", "outliers": "reject"}),
        ],
    )
    def test_words_after_a_plus_are_options(self, name, arguments):
        z = BIAS[0] + noise(3000, axes=1)[:, 0]
        z[::50] += 20.0
        found = run_on_axis(name, z, RATE, no_gain)
        expected = zr.DriftFilter(RATE, output="estimate", **arguments).process(z)
        np.testing.assert_array_equal(found.estimate, expected)


class TestAtRest:
    def test_measures_are_those_of_the_metrics(self, tmp_path):
        recording = read_trial(resting(tmp_path / "a.csv", axes=1))
        (found,) = compare_methods([recording])
        z = recording.log.data[:, 0]
        start = round(scoring_start(60.0) * RATE)
        values = by_method(found)
        assert tuple(values) == METHODS
        estimate = zr.DriftFilter(RATE, method="akf", output="estimate").process(z)
        error = zr.metrics.coasting_error(z[start:], estimate[start:], RATE, 10.0)
        best = zr.metrics.best_ema(z, RATE, 10.0, start=start / RATE).error
        assert values["akf"]["coasting_10"] == error
        assert values["akf"]["coasting_10_over_best"] == error / best
        assert values["akf"]["reduction"] == zr.metrics.reduction(z[start:], estimate[start:])
        assert values["ema"]["coasting_10_over_best"] == 1.0
        assert math.isnan(values["akf"]["coasting_60"])

    def test_every_method_has_an_error(self, tmp_path):
        (found,) = compare_methods([read_trial(resting(tmp_path / "a.csv", axes=1))])
        values = by_method(found)
        assert tuple(values) == METHODS
        assert all(0.0 < value["coasting_10"] < math.radians(1.0) for value in values.values())
        marked = {name for name in METHODS if f"\n  {name}‡ " in format_compare([found])}
        assert marked == set(WHOLE_RECORD_METHODS) & set(METHODS)

    def test_with_missing_samples_what_needs_all_of_them_has_no_error(self, tmp_path):
        recording = read_trial(resting(tmp_path / "a.csv", axes=1))
        recording.log.data[100:120] = np.nan
        (found,) = compare_methods([recording])
        for method, values in by_method(found).items():
            # Wu & Ran's filter predicts what is missing before the wavelet sees it.
            assert math.isnan(values["coasting_10"]) == (method == "visushrink")

    def test_channels_do_not_mix(self, tmp_path):
        recording = read_trial(resting(tmp_path / "a.csv", n=4000))
        alone = read_trial(tmp_path / "a.csv", columns=["gyro_y_dps"])
        (together,), (single,) = compare_methods([recording]), compare_methods([alone])
        of_y = [row.values for row in together.rows if row.axis == "gyro_y_dps"]
        np.testing.assert_equal(of_y, [row.values for row in single.rows])

    def test_a_record_too_short_to_coast_is_refused(self, tmp_path):
        recording = read_trial(resting(tmp_path / "a.csv", n=1200))
        with pytest.raises(LogError, match="holds no 10 s without missing samples"):
            compare_methods([recording])

    def test_motion_is_told(self, tmp_path):
        (found,) = compare_methods(
            [read_trial(oriented(tmp_path / "a.csv"), columns=["gyro_x_dps"])]
        )
        assert any("gyro_x_dps seems to move" in note for note in found.notes)

    @pytest.mark.parametrize("duration", [30.0, 600.0])
    def test_the_start_is_not_scored(self, duration):
        assert scoring_start(duration) == {30.0: 10.0, 600.0: 120.0}[duration]


class TestTurning:
    def test_scale_sign_and_delay_are_found(self, tmp_path):
        recording = read_trial(turning(tmp_path / "a.csv"), reference="encoder_deg")
        match = fit_reference(recording, recording.reference)
        assert match.axis == "gyro_z_dps"
        # Noise of 0.05 deg/s over sqrt(6000) samples is a hundred-thousandth of the motion's size;
        # the delay's parabola errs by some hundredths of a sample.
        assert match.scale == pytest.approx(-0.98, rel=1e-3)
        assert match.delay == pytest.approx(0.02, abs=5e-4)
        assert math.degrees(match.offset) == pytest.approx(BIAS[2], abs=0.02)

    def test_a_bias_and_its_angle(self, tmp_path):
        recording = read_trial(turning(tmp_path / "a.csv"), reference="encoder_deg")
        (found,) = compare_methods([recording])
        values = by_method(found)
        # The bias of 0.2 deg/s over a minute, and a motion of 70 deg that ends elsewhere.
        assert math.degrees(values["raw"]["angle_drift"]) == pytest.approx(12.0, abs=0.5)
        assert math.degrees(values["raw"]["compensated_rmse"]) == pytest.approx(
            math.hypot(BIAS[2], 0.05), rel=0.1
        )
        assert values["fading"]["smooth_rmse"] > values["raw"]["compensated_rmse"]
        assert math.isnan(values["raw"]["smooth_rmse"])

    def test_a_reference_that_no_gyro_follows(self, tmp_path):
        columns = gyros(BIAS + noise(3000)) | {"still_deg": np.zeros(3000)}
        path = write_table(tmp_path / "a.csv", columns)
        with pytest.raises(
            LogError, match=r"a\.csv: no gyro follows still_deg: reference is constant"
        ):
            compare_methods([read_trial(path, reference="still_deg")])

    def test_a_record_too_short_for_a_delay(self, tmp_path):
        recording = read_trial(turning(tmp_path / "a.csv", n=90), reference="encoder_deg")
        with pytest.raises(LogError, match=r"motion needs more than 1 s, got 0\.9 s"):
            compare_methods([recording])

    def test_gaps_are_left_out_of_all(self, tmp_path):
        recording = read_trial(turning(tmp_path / "a.csv"), reference="encoder_deg")
        recording.log.data[1000:1300] = np.nan
        (found,) = compare_methods([recording], ("raw", "kf"))
        values = by_method(found)
        # The noise and the bias alone, as without a gap.
        assert math.degrees(values["raw"]["compensated_rmse_lowpass"]) == pytest.approx(
            math.hypot(BIAS[2], 0.05), rel=0.1
        )

    @needs_recordings
    def test_of_a_motor_shaft(self):
        recording = read_trial(RECORDINGS / ENCODER, reference="encoder_deg")
        match = fit_reference(recording, recording.reference)
        assert match.axis == "shaft_gyro_z_dps"
        # What the notes of the recording say, found there by other means.
        assert match.scale == pytest.approx(-1.01, abs=0.01)
        assert match.delay == pytest.approx(0.01, abs=0.003)


class TestOrientation:
    def test_the_bias_of_the_first_rest_is_what_counts(self, tmp_path):
        (found,) = compare_methods([read_trial(oriented(tmp_path / "a.csv"))])
        values = by_method(found)
        methods = [name for name in METHODS if name not in ("raw", "mean", "ema")]
        assert list(values) == ["raw", "first rest", "mean", *methods]
        # The mean of ten seconds is off by 0.05 deg/s / sqrt(1000) an axis, and noise walks as far.
        assert math.degrees(values["first rest"]["growth_10"]) < 0.1
        # No angle grows faster than the size of the bias.
        assert 1.0 < math.degrees(values["raw"]["growth_10"]) <= 10.0 * np.linalg.norm(BIAS) + 0.1
        assert math.isnan(values["raw"]["growth_60"])
        assert values["fading"]["smooth_growth_10"] > values["first rest"]["growth_10"]

    def test_every_axis_needs_samples(self, tmp_path):
        recording = read_trial(oriented(tmp_path / "a.csv"))
        recording.log.data[:, 1] = np.nan
        with pytest.raises(LogError, match="gyro_y_dps holds no sample"):
            compare_methods([recording])

    def test_three_gyros_are_needed(self, tmp_path):
        names = [f"ref_quat_{x}" for x in "wxyz"]
        recording = read_trial(
            oriented(tmp_path / "a.csv"), columns=["gyro_x_dps"], quaternion=names
        )
        with pytest.raises(LogError, match="orientation needs three gyros, got gyro_x_dps"):
            compare_methods([recording])

    @needs_recordings
    def test_of_a_hand_moved_body(self):
        (found,) = compare_methods(
            [read_trial(RECORDINGS / BROAD, rate=2000.0 / 7.0)], ("raw", "kf")
        )
        values = by_method(found)
        raw, rest = (math.degrees(values[name]["growth_60"]) for name in ("raw", "first rest"))
        # The bias of the first rest, 0.32 deg/s, explains nearly all; what is left is scale,
        # misalignment and the reference's own error.
        assert 10.0 < raw < 0.32 * 60.0
        assert rest < 0.1 * raw


def test_methods_must_differ(tmp_path):
    recording = read_trial(resting(tmp_path / "a.csv"))
    with pytest.raises(ValueError, match="at least one and all different"):
        compare_methods([recording], ("kf", "kf"))


def test_progress_ends_at_one(tmp_path):
    told = []
    recordings = [
        read_trial(resting(tmp_path / "a.csv")),
        read_trial(turning(tmp_path / "b.csv"), reference="encoder_deg"),
        read_trial(oriented(tmp_path / "c.csv")),
    ]
    compare_methods(recordings, ("raw", "kf"), lambda step, fraction: told.append(fraction))
    assert told == sorted(told)
    assert told[-1] == 1.0


FAULTS = "share=0.02,size=50,one-sided"


def both(path, kind, faults=FAULTS, methods=("raw", "mean", "fading", "auto"), **arguments):
    """Return what came of a record and of its contaminated copy, by method."""
    clean, faulty = compare_methods([read_trial(path, **arguments)], methods, contaminate=faults)
    assert (clean.kind, faulty.kind) == (kind, kind)
    assert clean.contamination is None
    assert (faulty.contamination, faulty.notes) == (Contamination.parse(faults), ())
    return by_method(clean), by_method(faulty)


class TestContaminated:
    def test_the_clean_record_is_what_counts(self, tmp_path):
        path = resting(tmp_path / "a.csv", axes=1)
        _, faulty = both(path, "rest")
        z = read_trial(path).log.data[:, 0]
        start = round(scoring_start(60.0) * RATE)
        fed = Contamination.parse(FAULTS).apply(z, RATE, seed=1)
        mean = zr.metrics.running_mean(fed)[start:]
        error = zr.metrics.coasting_error(z[start:], mean, RATE, 10.0)
        assert faulty["mean"]["coasting_10"] == error

    def test_degradation_is_over_the_same_method_on_the_clean_record(self, tmp_path):
        clean, faulty = both(resting(tmp_path / "a.csv", axes=1), "rest")
        for method, values in faulty.items():
            ratio = values["coasting_10"] / clean[method]["coasting_10"]
            assert values["coasting_10_degradation"] == ratio
        # The mean is shifted by a whole deviation, 0.05 deg/s, in ten seconds.
        assert math.degrees(faulty["mean"]["coasting_10"]) == pytest.approx(0.5, rel=0.2)
        assert not any("degradation" in name for values in clean.values() for name in values)

    def test_the_clean_rows_stay_what_they_are(self, tmp_path):
        path = resting(tmp_path / "a.csv")
        (alone,) = compare_methods([read_trial(path)])
        clean, *faulty = compare_methods([read_trial(path)], contaminate=["stuck=5", FAULTS])
        np.testing.assert_equal([r.values for r in clean.rows], [r.values for r in alone.rows])
        assert [str(one.contamination) for one in faulty] == ["stuck=5", FAULTS]
        assert [one.methods for one in faulty] == [clean.methods] * 2

    def test_the_best_average_keeps_its_gain(self, tmp_path):
        path = resting(tmp_path / "a.csv", axes=1)
        clean, faulty = both(path, "rest", methods=("ema",))
        assert clean["ema"]["coasting_10_over_best"] == 1.0
        assert faulty["ema"]["coasting_10_degradation"] == (faulty["ema"]["coasting_10_over_best"])
        assert faulty["ema"]["coasting_10_degradation"] > 2.0

    def test_beside_a_reference(self, tmp_path):
        path = turning(tmp_path / "a.csv")
        _, faulty = both(path, "turning", reference="encoder_deg")
        # Outliers of the raw rate are no error of a bias that is zero.
        assert faulty["raw"]["compensated_rmse_degradation"] == 1.0
        assert faulty["fading"]["smooth_rmse_degradation"] > 1.0
        recording = read_trial(path, reference="encoder_deg")
        match = fit_reference(recording, recording.reference)
        fed = Contamination.parse(FAULTS).apply(recording.log.data, RATE, seed=1)[:, 2]
        rate = match.raw - zr.metrics.running_mean(fed)
        error = zr.metrics.motion_error(match.rate, rate, RATE, raw=match.raw).rmse
        assert faulty["mean"]["compensated_rmse"] == error

    def test_orientation(self, tmp_path):
        path = oriented(tmp_path / "a.csv")
        clean, faulty = both(path, "orientation")
        assert list(clean) == list(faulty)
        assert faulty["raw"]["growth_10_degradation"] == 1.0
        assert faulty["first rest"]["growth_10_degradation"] > 1.5

    def test_a_constant_axis_has_no_outliers_and_may_be_stuck(self, tmp_path):
        path = write_table(tmp_path / "a.csv", gyros(np.ones((6000, 1))))
        faults = (FAULTS, "stuck=5,at-zero")
        found = compare_methods([read_trial(path)], ("mean",), contaminate=faults)
        errors = [one.rows[0].values["coasting_10"] for one in found]
        assert errors[0] == errors[1] < errors[2]

    @pytest.mark.parametrize(
        ("faults", "message"),
        [
            ("share=2,size=3", "share must be 0 to 1"),
            (["stuck=1", "stuck=1.0"], "all be different"),
        ],
    )
    def test_refusals(self, tmp_path, faults, message):
        recording = read_trial(resting(tmp_path / "a.csv"))
        with pytest.raises(ValueError, match=message):
            compare_methods([recording], ("mean",), contaminate=faults)

    def test_progress_counts_every_run(self, tmp_path):
        told = []
        recording = read_trial(resting(tmp_path / "a.csv"))
        compare_methods(
            [recording], ("raw", "mean"), lambda _, done: told.append(done), ["stuck=1"]
        )
        np.testing.assert_allclose(told, np.arange(1, 13) / 12)

    def test_its_tables_show_errors_and_their_ratios(self, tmp_path):
        recordings = [
            read_trial(resting(tmp_path / "a.csv")),
            read_trial(turning(tmp_path / "b.csv"), reference="encoder_deg"),
            read_trial(oriented(tmp_path / "c.csv")),
        ]
        text = format_compare(
            compare_methods(recordings, ("raw", "mean", "kf"), contaminate=FAULTS)
        )
        assert max(map(len, text.split("\n"))) <= WIDTH
        lines = text.split("\n")
        rest = lines.index(f"At rest, {FAULTS}: mean and worst of 3 axes")
        assert "10 s/best  worst  60 s/best  worst  10 s/clean  worst" in lines[rest + 1]
        for title in ("In motion, raw minus bias, ", "In motion, smoothed rate, ", "Orientation, "):
            at = next(
                i for i, line in enumerate(lines) if line.startswith(title) and FAULTS in line
            )
            assert "/clean" in lines[at + 1]
        assert "run on the contaminated record, scored on the clean one" in text


class TestReport:
    def test_kinds_have_their_tables(self, tmp_path):
        recordings = [
            read_trial(resting(tmp_path / "a.csv")),
            read_trial(turning(tmp_path / "b.csv"), reference="encoder_deg"),
            read_trial(oriented(tmp_path / "c.csv")),
        ]
        text = format_compare(compare_methods(recordings))
        titles = ("At rest: mean and worst of 3 axes", "In motion, raw minus bias: b.csv", "Orient")
        assert all(title in text for title in titles)
        assert max(map(len, text.split("\n"))) <= WIDTH

    def test_the_mean_and_the_worst(self, tmp_path):
        (found,) = compare_methods([read_trial(resting(tmp_path / "a.csv"))], ("raw", "mean"))
        line = next(
            line for line in format_compare([found]).split("\n") if line.startswith("  mean")
        )
        ratios = [r.values["coasting_10_over_best"] for r in found.rows if r.method == "mean"]
        shown = [float(word) for word in line.split()[1:3]]
        # Three digits are shown.
        assert shown == pytest.approx([np.mean(ratios), max(ratios)], rel=6e-3)

    def test_every_axis_has_a_table(self, tmp_path):
        (found,) = compare_methods([read_trial(resting(tmp_path / "a.csv"))], ("raw", "ema"))
        text = format_compare([found], per_axis=True)
        assert [f"a.csv, gyro_{x}_dps" in text for x in "xyz"] == [True] * 3
        assert "10 s, deg" in text
        assert text.count("ema†") == 3

    def test_unknown_units_are_not_called_degrees(self, tmp_path):
        path = write_table(tmp_path / "a.csv", {"gyro_x": BIAS[0] + noise(6000, axes=1)[:, 0]})
        text = format_compare(compare_methods([read_trial(path)], ("raw",)), per_axis=True)
        assert "deg" not in text
        assert "the unit of gyro_x is not known" in " ".join(text.split())


def test_a_recording_is_compared_as_it_is(tmp_path):
    path = turning(tmp_path / "a.csv")
    (found,) = compare_methods([zr.read_recording(path)], ("raw",))
    (asked,) = compare_methods([read_trial(path, reference="encoder_deg")], ("raw",))
    assert found == asked
    (rest,) = compare_methods([zr.read_recording(resting(tmp_path / "b.csv"))], ("raw",))
    assert rest.kind == "rest"


def test_a_slower_reference_is_spread_over_the_samples_of_the_gyro(tmp_path):
    recording = zr.read_recording(oriented(tmp_path / "a.csv"))
    slow = recording.reference.data.copy()
    slow[np.arange(len(slow)) % 4 != 0] = np.nan
    sparse = zr.read_recording(
        {"t": recording.gyro.time, "gyro_dps": recording.gyro.data}
        | {name: slow[:, i] for i, name in enumerate(recording.reference.names)}
    )
    assert sparse.reference.rate == RATE / 4
    np.testing.assert_array_equal(Trial.of(sparse).orientation.quaternions, slow)


def test_a_recording_without_a_gyro_is_refused():
    recording = zr.read_recording({"accel_g": np.ones((9, 3))}, RATE)
    with pytest.raises(LogError, match="no column looks like a gyro"):
        Trial.of(recording)
