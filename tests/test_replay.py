"""One log through the filters: data, scores, history, curves and text."""

import math

import numpy as np
import pytest

import zerorate as zr
from zerorate import Log, LogError, metrics
from zerorate._native import allan_deviations
from zerorate.replay import replay
from zerorate.replay.history import moments
from zerorate.report import WIDTH, format_notes, format_table

RATE = 100.0


def make_log(data, rate=RATE, names=None, unit="deg/s", **meta):
    data = np.asarray(data, dtype=np.float64)
    data = data[:, np.newaxis] if data.ndim == 1 else data
    names = names or [f"gyro_{i}" for i in range(data.shape[1])]
    return Log(np.arange(len(data)) / rate, rate, data, names, unit, meta)


def noise(n=6000, axes=2, seed=1):
    return 0.5 + 0.1 * np.random.default_rng(seed).standard_normal((n, axes))


@pytest.fixture(scope="module")
def result():
    return replay(make_log(noise(9000)))


@pytest.mark.parametrize("method", ["kf", "akf", "fading"])
def test_filtered_equals_the_filter_alone_to_the_last_bit(result, method):
    alone = zr.DriftFilter(RATE, method=method, channels=2).process(result.log.data)
    np.testing.assert_array_equal(result.filtered[method], alone)


def test_filtered_log_is_that_of_the_last_method():
    last = replay(make_log(noise(500)), methods=("fading", "kf"))
    assert last.method == "kf"
    np.testing.assert_array_equal(last.filtered_log.data, last.filtered["kf"])
    assert last.filtered_log.names == last.log.names


def test_scores_are_the_public_metrics(result):
    scores = {(s.axis, s.method): s for s in result.scores}
    assert list(scores) == [
        (axis, method) for axis in result.log.names for method in ("raw", "kf", "akf", "fading")
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
    scores = replay(make_log(noise(3000, 1)), truth=truth).scores
    assert scores[0].error == pytest.approx(0.1, rel=0.05)
    assert all(score.error < scores[0].error for score in scores[1:])


def test_history_ends_with_the_state_of_the_filter(result):
    filter_ = zr.DriftFilter(RATE, channels=2)
    filter_.process(result.log.data)
    history = result.history
    assert history.samples[-1] == result.log.n
    np.testing.assert_array_equal(history.measurement_noise[-1], filter_.measurement_noise)
    np.testing.assert_array_equal(history.gain[-1], filter_.gain)
    np.testing.assert_array_equal(history.coefficients[-1], filter_.coefficients)
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
    curves = replay(make_log(walk), methods=("kf",)).allan
    exact, _, _ = allan_deviations(walk, [round(RATE * tau) for tau in curves.taus])
    np.testing.assert_array_equal(curves.raw[0], exact)


def test_allan_curves_can_be_left_out():
    assert replay(make_log(noise(300)), allan=False).allan is None


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
        assert result.memory[i] == pytest.approx(first / RATE)


def test_progress_rises_step_by_step():
    calls = []
    replay(make_log(noise(300)), progress=lambda step, fraction: calls.append((step, fraction)))
    assert list(dict.fromkeys(step for step, _ in calls)) == ["filtering", "measuring"]
    for step in ("filtering", "measuring"):
        fractions = [fraction for name, fraction in calls if name == step]
        assert fractions == sorted(fractions)
        assert fractions[-1] == 1.0


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"methods": ("median",)}, "median"),
        ({"methods": ()}, "at least one"),
        ({"methods": ("kf", "kf")}, "all different"),
        ({"fading": 2.0}, "fading"),
        ({"order": (7, 1)}, "order"),
        ({"truth": [1.0, 2.0]}, "truth must have the log's shape"),
    ],
)
def test_bad_arguments(options, match):
    with pytest.raises(ValueError, match=match):
        replay(make_log(noise(50)), **options)


def test_no_sample_at_all():
    with pytest.raises(LogError, match="no axis holds a sample"):
        replay(make_log(np.full((100, 2), np.nan)))


def test_predictions_in_a_gap_count_nowhere():
    z = noise(4000, 1)
    z[1000:3000] = np.nan
    result = replay(make_log(z), methods=("kf",))
    there = np.isfinite(z[:, 0])
    assert result.scores[1].deviation == pytest.approx(result.filtered["kf"][there].std())
    hidden = np.where(there, result.filtered["kf"][:, 0], np.nan)
    assert result.allan.filtered[0, 5] == allan_deviations(hidden, [32])[0][0]


def test_samples_before_the_first_one_stay_missing():
    z = noise(500)
    z[:50, 0] = np.nan
    filtered = replay(make_log(z)).filtered["fading"]
    assert np.isnan(filtered[:50, 0]).all()
    assert np.isfinite(filtered[50:, 0]).all()
    assert np.isfinite(filtered[:, 1]).all()


class TestText:
    def test_table_is_aligned_and_narrow(self, result):
        lines = format_table(result).split("\n")
        assert max(map(len, lines)) <= WIDTH
        rows = lines[2 : 2 + 8]
        assert len({len(row) for row in rows}) == 1
        assert [row.split()[-1] for row in (rows[0], rows[1])] == ["-", "M"]

    def test_long_names_and_the_truth_still_fit(self):
        log = make_log(noise(300, 2), names=["a" * 60 + "_x", "a" * 60 + "_y"])
        table = format_table(replay(log, truth=noise(300, 2)))
        assert max(map(len, table.split("\n"))) <= WIDTH
        assert "…" in table
        assert "true error" in table

    def test_it_warns_of_the_deviation(self, result):
        assert "low-pass" in format_table(result)
        assert "Coasting error" in format_table(result)

    def test_horizon_longer_than_the_record_is_a_dash(self):
        row = format_table(replay(make_log(noise(3000, 1)))).split("\n")[3].split()
        assert row[0] == "kf"
        assert row[5] == "-"
        assert row[4] != "-"

    def test_stuck_axis_has_no_ratio(self):
        log = make_log(np.column_stack((noise(3000, 1), np.full(3000, 2.5))))
        result = replay(log)
        assert math.isnan(result.scores[-1].reduction)
        assert "gyro_1: all samples are equal" in format_notes(result)

    def test_short_record_says_what_it_lacks(self):
        notes = " ".join(format_notes(replay(make_log(noise(20, 1)))).split())
        assert "it needs 100 samples, has 20: no noise, model or gain was learned" in notes

    def test_notes_of_the_log_and_missing_samples(self):
        z = noise(300, 1)
        z[10:15] = np.nan
        notes = format_notes(replay(make_log(z, notes=("the unit is a guess",))))
        assert "gyro_0 5 of 300" in notes
        assert "the unit is a guess" in notes

    def test_coasting_error_is_an_angle(self):
        per_hour = replay(make_log(3600.0 * noise(3000, 1), unit="deg/h"))
        per_second = replay(make_log(noise(3000, 1)))
        cells = [format_table(r).split("\n")[2].split()[5] for r in (per_hour, per_second)]
        assert float(cells[0]) == pytest.approx(float(cells[1]), rel=1e-3)


@pytest.mark.parametrize("scale", [1e-150, 1e150])
def test_hostile_scales(scale):
    result = replay(make_log(scale * noise(1500, 1)))
    assert max(map(len, format_table(result).split("\n"))) <= WIDTH
    assert np.isfinite(result.filtered["fading"]).all()
