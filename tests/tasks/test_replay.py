"""One log through the filters: data, scores, history, curves and text."""

import dataclasses
import math

import numpy as np
import pytest

import zerorate as zr
from support.logs import RATE, make_log, noise
from zerorate import LogError, metrics
from zerorate._native import allan_deviations
from zerorate.io import write_log
from zerorate.options import METHODS
from zerorate.record.log import Header
from zerorate.show import (
    WIDTH,
    format_bias,
    format_biases,
    format_learned,
    format_notes,
    format_replay,
    format_table,
)
from zerorate.simulation.devices import device as find_device
from zerorate.tasks.replay.filters import Block
from zerorate.tasks.replay.history import last_finite, moments
from zerorate.tasks.replay.measures import Measures
from zerorate.tasks.replay.result import Readings
from zerorate.tasks.replay.run import run_filters
from zerorate.tasks.simulate import simulated_gyro
from zerorate.texts import use_line_width
from zerorate.units import convert

PUBLISHED = ("kf", "akf", "fading")


def alone_of(method, channels=2, **options):
    """Return the filter of the drift that a replay of a log in deg/s makes."""
    limits = {"rest_limit": 10.0} if method == "auto" else {}
    asked = {"output": "estimate", **limits, **options}
    return zr.DriftFilter(RATE, method=method, channels=channels, **asked)


@pytest.fixture(scope="module")
def result():
    return run_filters(make_log(noise(9000)), methods=PUBLISHED, output="estimate")


@pytest.fixture(scope="module")
def auto():
    return run_filters(make_log(noise(9000)))


@pytest.mark.parametrize("method", PUBLISHED)
def test_filtered_equals_the_filter_alone_to_the_last_bit(result, method):
    alone = zr.DriftFilter(RATE, method=method, channels=2, output="estimate").process(
        result.log.data
    )
    np.testing.assert_array_equal(result.filtered[method], alone)


def test_filtered_log_is_that_of_the_last_method():
    methods = ("fading", "kf")
    last = run_filters(make_log(noise(500)), methods=methods, output="estimate")
    assert (last.method, last.output, last.to_log().extra) == ("kf", "estimate", {})
    compensated = run_filters(make_log(noise(500)), methods=methods)
    assert (compensated.method, compensated.output) == ("kf", "compensated")
    assert next(iter(compensated.to_log().extra)) == "bias_gyro_0_dps"
    np.testing.assert_array_equal(last.to_log().data, last.filtered["kf"])
    assert last.to_log().names == last.log.names


def test_scores_are_the_public_metrics(result):
    scores = {(s.axis, s.method): s for s in result.scores}
    assert list(scores) == [
        (axis, method) for axis in result.log.names for method in ("raw", *PUBLISHED)
    ]
    raw, kf = result.log.data[:, 1], result.filtered["kf"][:, 1]
    one = scores[("gyro_1", "kf")]
    assert one.mean == pytest.approx(kf.mean(), rel=1e-12)
    assert one.deviation == pytest.approx(kf.std(), rel=1e-12)
    assert one.reduction == pytest.approx(metrics.reduction(raw, kf), rel=1e-12)
    expected = [metrics.coasting_error(raw, kf, RATE, horizon) for horizon in (10.0, 60.0)]
    assert one.coasting == pytest.approx(expected, rel=1e-12)
    assert scores[("gyro_1", "raw")].reduction == 1.0
    assert math.isnan(one.error)


def test_error_to_the_truth():
    truth = np.full((3000, 1), 0.5)
    scores = run_filters(make_log(noise(3000, 1)), truth=truth).scores
    assert scores[0].error == pytest.approx(0.1, rel=0.05)
    assert all(score.error < scores[0].error for score in scores[1:])


def test_history_ends_with_the_state_of_the_filter(result):
    filter_ = zr.DriftFilter(RATE, method="fading", channels=2, output="estimate")
    filter_.process(result.log.data)
    history = result.history
    assert history.samples[-1] == result.log.n
    np.testing.assert_array_equal(history.measurement_noise[-1], filter_.measurement_noise)
    np.testing.assert_array_equal(history.gain[-1], filter_.gain)
    np.testing.assert_array_equal(history.coefficients[-1], filter_.coefficients)
    np.testing.assert_array_equal(history.angle_random_walk[-1], filter_.angle_random_walk)
    np.testing.assert_array_equal(history.bias[-1], filter_.bias)
    np.testing.assert_array_equal(history.bias_sigma[-1], filter_.bias_sigma)
    np.testing.assert_array_equal(result.guard_count["fading"], filter_.guard_count)


def test_history_is_nan_until_the_start_up_is_over(result):
    before = result.history.samples < RATE
    assert np.isnan(result.history.gain[before]).all()
    assert np.isfinite(result.history.gain[result.history.samples > RATE]).all()


@pytest.mark.parametrize("n", [1, 2, 7, 100, 12_345, 10_000_000])
def test_moments_rise_to_the_end_and_stay_few(n):
    counts = moments(n)
    assert counts[0] >= 1
    assert counts[-1] == n
    assert (np.diff(counts) > 0).all()
    assert len(counts) <= 2000


def test_allan_curves(result):
    curves = result.allan
    assert curves.taus[0] == 0.01
    assert curves.raw.shape == curves.filtered.shape == (2, len(curves.taus))
    z = np.ascontiguousarray(result.log.data[:, 1])
    assert curves.raw[1, 3] == allan_deviations(z, [8])[0][0]
    y = np.ascontiguousarray(result.filtered["fading"][:, 0])
    assert curves.filtered[0, 2] == allan_deviations(y, [4])[0][0]


def test_every_averaging_time_uses_all_clusters():
    walk = (
        np.cumsum(np.random.default_rng(5).standard_normal(60_000)) + 30.0 * noise(60_000, 1)[:, 0]
    )
    curves = run_filters(make_log(walk), methods=("kf",)).allan
    exact, _, _ = allan_deviations(walk, [round(RATE * tau) for tau in curves.taus])
    np.testing.assert_array_equal(curves.raw[0], exact)


def test_memory_is_the_time_of_a_step(result):
    """The filter as it ended, its gain held, makes 63 % of a step in that time."""
    history = result.history
    late = history.samples > history.samples[-1] // 2
    for i in range(2):
        phi1, phi2, _, _ = history.coefficients[-1, i]
        k0, k1, kc = np.median(history.gain[late, i], axis=0)
        newest = older = constant = 0.0
        responses = []
        for _ in range(100):
            predicted = phi1 * newest + phi2 * older + constant
            e = 1.0 - predicted
            newest, older, constant = predicted + k0 * e, newest + k1 * e, constant + kc * e
            responses.append(newest)
        first = 1 + int(np.argmax(np.array(responses) >= 1.0 - math.exp(-1.0)))
        assert result.time_constant[i] == pytest.approx(first / RATE)


def test_progress_rises():
    calls = []
    run_filters(
        make_log(noise(300)), progress=lambda step, fraction: calls.append((step, fraction))
    )
    assert list(dict.fromkeys(step for step, _ in calls)) == ["filtering"]
    fractions = [fraction for _, fraction in calls]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"methods": ("median",)}, "median"),
        ({"methods": ()}, "at least one"),
        ({"methods": ("kf", "kf")}, "all different"),
        ({"fading": 2.0}, "fading"),
        (
            {"methods": ("kf", "auto"), "fading": 0.9},
            "fading has no effect on methods 'kf' and 'auto'",
        ),
        ({"order": (7, 1)}, "order"),
        ({"motion": "stop"}, "motion"),
        ({"output": "bias"}, "output must be 'compensated' or 'estimate'"),
        ({"truth": [1.0, 2.0]}, "truth must have the log's shape"),
    ],
)
def test_bad_arguments(options, match):
    with pytest.raises(ValueError, match=match):
        run_filters(make_log(noise(50)), **options)


def test_no_sample_at_all():
    with pytest.raises(LogError, match="no axis has a sample"):
        run_filters(make_log(np.full((100, 2), np.nan)))


def test_predictions_in_a_gap_count_nowhere():
    z = noise(4000, 1)
    z[1000:3000] = np.nan
    result = run_filters(make_log(z), methods=("kf",), output="estimate")
    there = np.isfinite(z[:, 0])
    assert result.scores[1].deviation == pytest.approx(result.filtered["kf"][there].std())
    hidden = np.where(there, result.filtered["kf"][:, 0], np.nan)
    assert result.allan.filtered[0, 5] == allan_deviations(hidden, [32])[0][0]


def test_samples_before_the_first_one_stay_missing():
    z = noise(500)
    z[:50, 0] = np.nan
    filtered = run_filters(make_log(z)).filtered["fading"]
    assert np.isnan(filtered[:50, 0]).all()
    assert np.isfinite(filtered[50:, 0]).all()
    assert np.isfinite(filtered[:, 1]).all()


class TestAuto:
    def test_it_is_the_default_and_compensates(self, auto):
        alone = alone_of("auto", output="compensated")
        assert (auto.method, auto.output) == ("auto", "compensated")
        np.testing.assert_array_equal(auto.to_log().data, alone.process(auto.log.data))

    def test_drift_and_scores_are_of_the_estimate(self, auto):
        drift = alone_of("auto").process(auto.log.data)
        np.testing.assert_array_equal(auto.bias, drift)
        score = next(s for s in auto.scores if s.method == "auto")
        # Without the start, in which it is not yet seen to rest.
        rest = alone_of("auto").trace(auto.log.data).at_rest[:, 0]
        assert score.deviation == pytest.approx(drift[rest, 0].std(), rel=1e-12)

    @pytest.mark.parametrize("method", ["fading", "auto"])
    @pytest.mark.parametrize("output", ["estimate", "compensated"])
    def test_either_output_of_either_kind(self, method, output):
        log = make_log(noise(700))
        log.data[300:320, 1] = np.nan
        options = {"motion": "hold", "output": output}
        result = run_filters(log, methods=(method,), **options)
        alone = alone_of(method, **options)
        np.testing.assert_array_equal(result.to_log().data, alone.process(log.data))

    def test_extra_columns_of_the_compensated_rate(self, auto):
        trace = alone_of("auto").trace(auto.log.data)
        columns = auto.to_log().extra
        assert list(columns)[:3] == ["bias_gyro_0_dps", "bias_sigma_gyro_0_dps", "at_rest_gyro_0"]
        np.testing.assert_array_equal(columns["bias_gyro_1_dps"], trace.bias[:, 1])
        np.testing.assert_array_equal(columns["bias_sigma_gyro_1_dps"], trace.bias_sigma[:, 1])
        np.testing.assert_array_equal(columns["at_rest_gyro_1"], trace.at_rest[:, 1])

    def test_nothing_is_known_before_the_first_sample(self):
        z = noise(500)
        z[:50, 0] = np.nan
        columns = run_filters(make_log(z), methods=("auto",)).to_log().extra
        for name in ("bias_gyro_0_dps", "bias_sigma_gyro_0_dps"):
            assert np.isnan(columns[name][:50]).all()
            assert np.isfinite(columns[name][50:]).all()

    def test_memory_is_the_time_of_a_small_step(self):
        z = noise(9000, 64)
        known = run_filters(make_log(z), methods=("auto",)).time_constant
        filter_ = alone_of("auto", channels=64)
        filter_.process(z)
        np.testing.assert_allclose(known, 1.0 / (filter_.gain[:, 0] * RATE), rtol=1e-12)
        stepped, n = filter_.copy(), round(2.5 * known.max() * RATE)
        quiet, step = noise(n, 64, seed=2), 0.1 * filter_.bias_sigma
        response = (stepped.process(quiet + step) - filter_.process(quiet)) / step
        there = response > 1.0 - math.exp(-1.0)
        reached = np.where(there.any(axis=0), there.argmax(axis=0) / RATE, np.inf)
        # Members of unlike memories make no exponential: the long ones come late.
        assert 1.0 <= np.median(reached / known) <= 2.0

    def test_learned_noise_is_that_of_the_data(self):
        z = 0.5 + 0.1 * np.random.default_rng(3).standard_normal((60_000, 1))
        learned = run_filters(make_log(z), methods=("auto",)).history.angle_random_walk
        # It is learned from the last 240 ticks or so, whose Allan variance is known to 8 %.
        assert last_finite(learned)[0] == pytest.approx(0.1 / math.sqrt(RATE), rel=0.2)

    def test_last_known_value(self):
        values = np.array([[1.0, np.nan], [2.0, 3.0], [np.nan, np.nan]])
        np.testing.assert_array_equal(last_finite(values), [2.0, 3.0])
        assert np.isnan(last_finite(np.full((2, 1), np.nan))).all()

    def test_measures_are_of_the_rest(self):
        log, rest = make_log(noise(3000, 1)), np.ones((3000, 1), dtype=bool)
        log.data[1000:2000] += 50.0
        rest[1000:2000] = False
        measures = Measures(Header.of(log), ["auto"], [5.0], holds=True)
        held = np.full((1, 3000), 0.5)
        # What it says in motion counts nowhere, least of all when the rest begins.
        held[:, 1000:2000] = -40.0
        raw = np.ascontiguousarray(log.data.T)
        measures.take(Block(0, raw, {"auto": held}, held, np.ascontiguousarray(rest.T)))
        measured = measures.finish()
        raw, auto = measured.scores
        assert measured.sample_counts.at_rest_count == [2000]
        # What is held in motion is not held through the rest that follows.
        known = np.where(rest[:, 0], 0.5, np.nan)
        # Where a motion began is known to half a second.
        rest[950:1000] = False
        calm = np.where(rest, log.data, np.nan)
        there = np.isfinite(calm)
        assert raw.mean == pytest.approx(calm[there].mean(), rel=1e-12)
        assert raw.deviation == pytest.approx(calm[there].std(), rel=1e-12)
        expected = metrics.coasting_error(calm[:, 0], known, RATE, 5.0)
        assert auto.coasting[0] == pytest.approx(expected, rel=1e-12)
        assert measured.compensated_deviation[0] == pytest.approx(calm[there].std(), rel=1e-12)


class TestReadings:
    @staticmethod
    def rest(*, moving, n=400):
        at_rest = np.ones((n, 1), dtype=bool)
        at_rest[moving] = False
        return Readings(np.zeros((n, 1)), at_rest, np.zeros((n, 1), dtype=bool))

    def test_half_a_second_before_a_motion_is_in_doubt(self):
        certain = self.rest(moving=slice(200, 300)).certain_rest(RATE)
        expected = np.ones(400, dtype=bool)
        expected[150:300] = False
        np.testing.assert_array_equal(certain[:, 0], expected)

    def test_at_low_rates_it_is_eight_samples(self):
        certain = self.rest(moving=slice(200, 300)).certain_rest(2.0)
        assert np.flatnonzero(~certain)[0] == 192

    def test_motion_near_the_start(self):
        certain = self.rest(moving=slice(5, 8)).certain_rest(RATE)
        assert np.flatnonzero(certain)[0] == 8

    def test_a_stuck_sensor_does_not_rest(self):
        still = self.rest(moving=slice(0))
        still.stuck[200:300] = True
        certain = still.certain_rest(RATE)
        np.testing.assert_array_equal(certain, self.rest(moving=slice(200, 300)).certain_rest(RATE))

    def test_a_sensor_that_never_moves_rests(self):
        assert self.rest(moving=slice(0)).certain_rest(RATE).all()


LIMIT = 250.0


@pytest.fixture(scope="module")
def dirty():
    z = noise(9000)
    z[500::500, 0] += 10.0
    z[3000:3800, 0] = z[3000, 0]
    z[6000:6050, 1] = LIMIT
    return run_filters(make_log(z), limit=LIMIT)


class TestLeftOut:
    """A sensor at rest with spikes, stuck for 8 s, and at its limit for half a second."""

    def test_saturated_samples_are_missing(self, dirty):
        alone = alone_of("auto", output="compensated", limit=LIMIT)
        np.testing.assert_array_equal(dirty.to_log().data, alone.process(dirty.log.data))
        assert np.isnan(dirty.to_log().data[6000:6050, 1]).all()
        assert (
            dirty.sample_counts.missing_count.tolist()
            == dirty.left_out.saturated_count.tolist()
            == [0, 50]
        )

    def test_counts_are_those_of_the_filter(self, dirty):
        alone = alone_of("auto", limit=LIMIT)
        alone.process(dirty.log.data)
        left_out = dirty.left_out
        for counts, name in (
            (left_out.saturated_count, "saturated_count"),
            (left_out.outlier_count, "outlier_count"),
            (left_out.stuck_count, "stuck_count"),
        ):
            np.testing.assert_array_equal(counts, getattr(alone, name))
        assert left_out.outlier_count[0] >= 15
        assert left_out.stuck_count.tolist() == [800, 0]

    def test_flags_are_extra_columns_of_the_compensated_rate(self, dirty):
        trace = alone_of("auto", limit=LIMIT).trace(dirty.log.data)
        columns = dirty.to_log().extra
        assert list(columns)[2:5] == ["at_rest_gyro_0", "stuck_gyro_0", "saturated_gyro_0"]
        np.testing.assert_array_equal(columns["stuck_gyro_0"], trace.stuck[:, 0])
        np.testing.assert_array_equal(columns["saturated_gyro_1"], trace.saturated[:, 1])
        assert columns["stuck_gyro_0"][3010:3800].all()

    def test_a_stuck_sensor_is_measured_as_little_as_one_in_motion(self, dirty):
        stuck = dirty.readings.stuck[:, 0]
        assert dirty.sample_counts.stuck_count.tolist() == [np.count_nonzero(stuck), 0]
        assert dirty.sample_counts.at_rest_count[0] == np.count_nonzero(
            dirty.readings.at_rest[:, 0] & ~stuck
        )
        counted = dirty.readings.certain_rest(RATE)[:, 0]
        raw = dirty.scores[0]
        assert raw.mean == pytest.approx(dirty.log.data[counted, 0].mean(), rel=1e-12)

    def test_they_are_told_by_axis(self, dirty):
        notes = format_notes(dirty)
        flat = " ".join(notes.split())
        assert "saturated, at or beyond the limit of 250, so missing: gyro_1 50 of 9000" in flat
        assert f"left out as outliers: gyro_0 {dirty.left_out.outlier_count[0]}" in flat
        assert "left out because the sensor was stuck at one value: gyro_0 800 of 9000" in flat
        assert max(map(len, notes.split("\n"))) <= WIDTH
        assert format_learned(dirty).split("\n")[3].split()[1:3] == ["79.8", "2.2"]

    def test_nothing_is_said_of_what_there_is_not(self):
        notes = format_notes(run_filters(make_log(np.full((3000, 1), 0.5) + noise(3000, 1) % 0.4)))
        assert "left out because" not in notes
        assert "saturated" not in notes

    def test_a_limit_below_all_samples_is_named(self):
        with pytest.raises(LogError, match="all are missing, or beyond the limit of 0"):
            run_filters(make_log(noise(100)), limit=0.01)

    def test_a_published_method_counts_what_it_rejects(self):
        z = noise(3000, 1)
        z[500::500] += 10.0
        rejecting = run_filters(make_log(z), methods=("kf",), outliers="reject")
        assert rejecting.left_out.outlier_count[0] >= 5
        assert not run_filters(make_log(z), methods=("kf",)).left_out.outlier_count.any()


class TestLimitsOfRest:
    """What a record that begins in motion is to be judged by."""

    @pytest.mark.parametrize("unit", ["deg/s", "rad/s", "deg/h"])
    def test_what_rest_can_be_is_known_where_the_unit_is(self, unit):
        z = noise(3000, 1)
        z[:1000] += 20.0 * np.sin(np.arange(1000) / 30.0)[:, np.newaxis]
        log = make_log(convert(z, "deg/s", unit), unit=unit)
        result = run_filters(log, methods=("auto",))
        assert result.params["rest_limit"] == pytest.approx(convert(10.0, "deg/s", unit))
        assert result.params["bias_limit"] is None
        assert not result.readings.at_rest[:1000].any()
        assert (result.bias[:1000] == 0.0).all()

    @pytest.mark.parametrize("unit", ["unit", "g", "deg/s, rad/s"])
    def test_elsewhere_there_is_none(self, unit):
        result = run_filters(make_log(noise(500), unit=unit), methods=("auto",))
        assert result.params["rest_limit"] is None

    @pytest.mark.parametrize("options", [{"rest_limit": None}, {"motion": "ignore"}])
    def test_it_can_be_switched_off(self, options):
        log = make_log(noise(3000, 1))
        result = run_filters(log, methods=("auto",), **options)
        assert result.params["rest_limit"] is None
        alone = zr.DriftFilter(RATE, channels=1, output="estimate", **options)
        np.testing.assert_array_equal(result.bias, alone.process(log.data))

    def test_a_steady_turn_is_no_bias_beyond_the_limit_of_one(self):
        turning = noise(6000, 1)
        turning[:2000] += 60.0
        taken = run_filters(make_log(turning), methods=("auto",))
        assert taken.bias[1900, 0] > 50.0
        refused = run_filters(make_log(turning), methods=("auto",), bias_limit=20.0)
        assert (refused.bias[:2000] == 0.0).all()
        assert abs(refused.bias[-1, 0] - 0.5) < 0.05

    def test_what_is_not_known_for_certain_is_told(self):
        notes = " ".join(format_notes(run_filters(make_log(noise(2000, 1), unit="unit"))).split())
        assert "gyro_0: the rest may be slow motion" in notes
        assert "may be slow motion" not in format_notes(run_filters(make_log(noise(2000, 1))))

    @pytest.mark.parametrize("name", ["rest_limit", "bias_limit"])
    def test_a_limit_without_effect_is_refused(self, name):
        message = f"{name} has no effect on motion 'ignore', only on 'hold'"
        with pytest.raises(ValueError, match=message):
            run_filters(make_log(noise(50)), motion="ignore", **{name: 3.0})


class TestText:
    def test_table_is_aligned_and_narrow(self, result):
        lines = format_table(result).split("\n")
        assert max(map(len, lines)) <= WIDTH
        rows = lines[3 : 3 + 8]
        assert len({len(row) for row in rows}) == 1

    def test_long_names_and_the_truth_still_fit(self):
        log = make_log(noise(300, 2), names=["a" * 60 + "_x", "a" * 60 + "_y"])
        table = format_table(run_filters(log, truth=noise(300, 2)))
        assert max(map(len, table.split("\n"))) <= WIDTH
        assert "…" in table
        assert "true error" in table

    def test_the_error_at_the_end_is_the_bias_less_the_truth(self, tmp_path):
        gyro = find_device("MPU-6050")
        log, drift = simulated_gyro(gyro, 100.0, 30.0, 3)
        paths = [tmp_path / name for name in ("gyro.csv", "gyro-truth.csv")]
        for one, path in zip((log, drift), paths, strict=True):
            write_log(one, path)
        found = zr.replay(paths[0], truth=paths[1])
        expected = found.history.bias[-1] - drift.data[-1000:].mean(axis=0)
        # The file has decimals that read back to the same number.
        np.testing.assert_allclose(found.error_at_end, expected, rtol=1e-7)
        np.testing.assert_array_equal(found.truth, drift.data)
        assert "error at the end" in found.table()
        lines = found.plot().axes[1].get_lines()
        assert "truth" in [line.get_label() for line in lines]

    def test_nobody_reads_the_estimate_for_the_log(self, auto, result):
        """The column is of the estimate; what the log keeps stands below, as a number."""
        text = format_table(auto)
        assert text.startswith("Bias as each method estimates it")
        assert "reduction" not in text
        said = " ".join(text.split())
        ratio = np.std((auto.log.data - auto.bias)[auto.readings.rest[:, 0], 0])
        ratio /= np.std(auto.log.data[auto.readings.rest[:, 0], 0])
        assert 0.97 < ratio < 1.0
        assert f"keeps the sensor's noise: its deviation over raw is gyro_0 {ratio:.3f}," in said
        assert "low-pass" in said
        assert "Coasting: angle error" in said
        assert "over raw, motion included: gyro_0 " in " ".join(format_table(result).split())

    def test_the_answer_comes_first(self, auto, result):
        lines = format_replay(auto).split("\n")
        assert lines[0].startswith("Bias at the end, by auto")
        assert lines[1].split()[:3] == ["axis", "bias,", auto.log.unit]
        bias, _, sigma = lines[2].split()[1:4]
        assert abs(float(bias) - 0.5) < 4.0 * float(sigma)
        assert "Bias as each method estimates it" in format_replay(result)
        one = format_replay(run_filters(make_log(noise(3000, 1)), methods=("auto",)))
        assert "as each method" not in one

    @pytest.mark.parametrize("letters", [60, 80, 200])
    def test_what_is_said_is_as_wide_as_the_terminal(self, auto, letters):
        with use_line_width(letters):
            texts = (format_replay(auto), format_biases({"a": auto, "b": auto}), format_notes(auto))
        widest = max(len(line) for text in texts for line in text.split("\n"))
        assert widest <= letters
        assert "bias, deg/s" in texts[0]
        assert ("K, deg/h/√h" in texts[0]) == (letters > 80)

    def test_horizon_longer_than_the_record_is_a_dash(self):
        row = format_table(run_filters(make_log(noise(3000, 1)))).split("\n")[4].split()
        assert row[0] == "kf"
        assert row[5] == "-"
        assert row[4] != "-"

    def test_stuck_axis_has_no_ratio(self):
        log = make_log(np.column_stack((noise(3000, 1), np.full(3000, 2.5))))
        result = run_filters(log, methods=PUBLISHED)
        assert math.isnan(result.scores[-1].reduction)
        assert "gyro_1: all samples are equal" in format_notes(result)

    def test_short_record_says_what_it_lacks(self):
        notes = " ".join(format_notes(run_filters(make_log(noise(20, 1)))).split())
        assert "it needs 100 samples, has 20: no noise, model or gain was learned" in notes

    def test_notes_of_the_log_and_missing_samples(self):
        z = noise(300, 1)
        z[10:15] = np.nan
        notes = format_notes(run_filters(make_log(z, notes=("the unit is a guess",))))
        assert "gyro_0 5 of 300" in notes
        assert "the unit is a guess" in notes

    def test_coasting_error_is_an_angle(self):
        per_hour = run_filters(make_log(3600.0 * noise(3000, 1), unit="deg/h"))
        per_second = run_filters(make_log(noise(3000, 1)))
        cells = [format_table(r).split("\n")[3].split()[5] for r in (per_hour, per_second)]
        assert float(cells[0]) == pytest.approx(float(cells[1]), rel=1e-3)


def moved(replay, status="in motion"):
    """Return a replay whose first axis moves in the second half of it."""
    at_rest = replay.sample_counts.at_rest_count - [replay.header.n // 2, 0]
    seen = dataclasses.replace(replay.sample_counts, at_rest_count=at_rest)
    return dataclasses.replace(replay, sample_counts=seen, status=(status, *replay.status[1:]))


class TestTextOfAuto:
    def test_published_methods_stand_beside_it(self, auto):
        rows = format_table(auto).split("\n")[3 : 4 + len(METHODS)]
        assert [row[8:].split()[0] for row in rows] == ["raw", *METHODS]

    def test_what_was_learned(self, auto):
        title, _, units, *rows = format_learned(auto).split("\n")
        assert title == "Learned by auto"
        assert units.split()[:3] == ["axis", "s", "s"]
        assert [row.split()[0] for row in rows[:2]] == ["gyro_0", "gyro_1"]
        # It takes two and a quarter seconds to see that a sensor rests.
        assert rows[0].split()[1:3] == ["87.8", "2.2"]
        bias, _, sigma = rows[0].split()[-3:]
        # Four deviations: one in sixteen thousand is farther.
        assert abs(float(bias) - 0.5) < 4.0 * float(sigma)
        assert max(map(len, format_learned(auto).split("\n"))) <= WIDTH

    def test_published_methods_learn_no_such_thing(self, result):
        assert format_learned(result) == ""

    def test_units_of_the_noise(self, auto):
        """The same sensor in deg/s and in deg/h has the same noise in data-sheet units."""
        per_hour = run_filters(make_log(3600.0 * noise(9000), unit="deg/h"), methods=("auto",))
        cells = [format_learned(r).split("\n")[3].split()[3:6] for r in (auto, per_hour)]
        assert cells[0] == cells[1]
        assert "unit √s" in format_learned(run_filters(make_log(noise(500), unit="unit")))

    def test_a_memory_beyond_the_record(self, auto):
        endless = dataclasses.replace(auto, time_constant=np.array([np.inf, 20.0]))
        cells = [row.split() for row in format_learned(endless).split("\n")[3:5]]
        assert cells[0][5:7] == [">", "90"]
        assert cells[1][5] == "20.0"

    def test_motion_is_told(self, auto):
        shown = moved(auto)
        assert format_learned(shown).split("\n")[3].split()[1:3] == ["42.8", "47.2"]
        assert format_bias(shown).split("\n")[2].split()[4:6] == ["42.8", "47.2"]

    def test_no_rest_at_all_is_told(self, auto):
        notes = " ".join(format_notes(moved(auto, status="no rest yet")).split())
        assert "gyro_0: no rest was found, so the bias is unknown" in notes

    def test_a_short_record_has_dashes(self):
        rows = format_learned(run_filters(make_log(noise(20, 1)))).split("\n")
        assert rows[3].split()[3:] == ["-", "-", "-", "-"]


@pytest.mark.parametrize("scale", [1e-150, 1e150])
def test_hostile_scales(scale):
    result = run_filters(make_log(scale * noise(1500, 1)))
    text = f"{format_table(result)}\n{format_learned(result)}"
    assert max(map(len, text.split("\n"))) <= WIDTH
    assert np.isfinite(result.filtered["fading"]).all()
    assert np.isfinite(result.to_log().data).all()
