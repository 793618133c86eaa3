"""The way of an axis from a record to a model, and whether the verdict follows the numbers."""

import json

import numpy as np
import pytest

from support.recordings import RECORDINGS, needs_recordings
from zerorate.identification import ArmaModel, identify
from zerorate.identification.as_json import as_json
from zerorate.identification.conclusions import format_percent, is_fit, join_words, model_name
from zerorate.identification.record_tests import summarise_record
from zerorate.io import read_log
from zerorate.show.identify_tables import format_identify
from zerorate.show.tables import WIDTH

RATE = 100.0
PHI, THETA = np.array([1.2, -0.5]), np.array([0.6])
SIGMA = 0.02


def arma(n=15_000, seed=1, phi=PHI, theta=THETA, sigma=SIGMA, mean=3.0):
    """Return a record of a known model, its beginning left out until it is stationary."""
    a = sigma * np.random.default_rng(seed).standard_normal(n + 1000)
    z = np.zeros(n + 1000)
    for k in range(2, n + 1000):
        z[k] = phi @ z[k - 1 : k - 3 : -1] if k > 2 else 0.0
        z[k] += a[k] + theta[0] * a[k - 1]
    return z[1000:] + mean


def white(n=15_000, seed=1):
    return np.random.default_rng(seed).standard_normal(n)


@pytest.fixture(scope="module")
def found():
    return identify(arma(), RATE, name="gyro_x_dps", unit="deg/s")


def said(found):
    return " ".join(found.verdict)


class TestKnownModel:
    def test_order_and_coefficients(self, found):
        assert found.model.order == (2, 1)
        errors = found.model.standard_errors
        # Four standard errors: one seed in 4000 would miss one of the three.
        np.testing.assert_array_less(np.abs(found.model.phi - PHI), 4.0 * errors[:2])
        np.testing.assert_array_less(np.abs(found.model.theta - THETA), 4.0 * errors[2:3])
        # The variance's standard error is sqrt(2 / n); four of them.
        assert found.model.sigma2 == pytest.approx(SIGMA**2, rel=4.0 * np.sqrt(2.0 / 15_000))
        # So is the deviation of the mean of 15 000 samples of this model: sigma times the gain at
        # zero frequency over sqrt(n).
        gain = (1.0 + THETA.sum()) / (1.0 - PHI.sum())
        assert abs(found.model.mean - 3.0) < 4.0 * SIGMA * gain / np.sqrt(15_000)

    def test_all_is_well(self, found):
        assert is_fit(found)
        assert found.moving == ()
        assert found.tests.stationary
        assert not found.tests.adf.accepted
        assert found.whiteness.white
        assert "Fit for modelling: at rest" in said(found)
        assert "ARMA(2, 1)" in said(found)
        assert "residuals are white" in said(found)
        for alarm in ("Not ", "not ", "Normality", "Quantised", "Smoothed"):
            assert alarm not in said(found)

    def test_the_online_model_ends_beside_the_offline_one(self, found):
        assert found.online.coefficients.shape == (found.online.samples.size, 4)
        assert found.online.samples[-1] == 15_000
        # Both use all samples; they part by what the recursion learned before it knew anything.
        assert np.abs(found.online.distance).max() < 3.0

    def test_the_unit_does_not_matter(self, found):
        other = identify(3600.0 * arma(), RATE)
        assert other.model.order == (2, 1)
        # Both searches end at relative changes of 1e-9; a factor of a thousand over it.
        np.testing.assert_allclose(other.model.phi, found.model.phi, rtol=1e-6)
        assert other.model.sigma2 == pytest.approx(3600.0**2 * found.model.sigma2, rel=1e-6)

    def test_an_order_may_be_given(self):
        other = identify(arma(), RATE, order=(1, 0))
        assert other.model.order == (1, 0)
        assert "AR(1) was requested; the clear choice by AIC is ARMA(2, 1)" in said(other)
        assert not other.whiteness.white
        assert "The residuals are not white" in said(other)

    def test_missing_samples(self):
        z = arma()
        z[4000:5000] = np.nan
        z[::3000] = np.nan
        other = identify(z, RATE)
        assert other.record.missing_count == np.isnan(z).sum()
        assert other.record.stretch_count == 6
        assert other.model.order == (2, 1)
        errors = other.model.standard_errors
        np.testing.assert_array_less(np.abs(other.model.phi - PHI), 4.0 * errors[:2])

    def test_progress_rises(self):
        told = []
        identify(arma(2000), RATE, progress=lambda *step: told.append(step))
        assert [step for step, _ in told] == ["preparing", "tests", "orders", "models"]
        assert sorted(fraction for _, fraction in told) == [fraction for _, fraction in told]


class TestVerdict:
    def test_white_noise_needs_no_model(self):
        found = identify(white(), RATE)
        assert found.model.order == (0, 0)
        assert found.online is None
        assert "AIC chooses white noise" in said(found)
        assert "explains" not in said(found)

    def test_motion_is_said_with_its_place(self):
        z = 0.05 * white()
        z[6000:7000] += 20.0 * np.sin(np.arange(1000) / 50.0)
        found = identify(z, RATE)
        assert not is_fit(found)
        (span,) = found.moving
        # A second more or less: it is looked for in windows of that length.
        assert span.start == pytest.approx(60.0, abs=1.0)
        assert span.end == pytest.approx(70.0, abs=1.0)
        assert f"not at rest from {span.start:.1f} to {span.end:.1f} s" in said(found)

    def test_a_walk_is_not_fit(self):
        z = white() + np.cumsum(white(seed=2))
        found = identify(z, RATE)
        assert not is_fit(found)
        assert "Not fit as it is" in said(found)
        assert "use a filter with a random walk" in said(found)

    def test_a_ramp_is_seen_and_can_be_taken_off(self):
        z = white() + np.linspace(0.0, 0.3, 15_000)
        found = identify(z, RATE)
        assert not found.tests.means.accepted
        assert "with a small drift: the means of 100 segments rise" in said(found)
        straight = identify(z, RATE, trend="linear")
        assert straight.tests.means.accepted

    def test_quantisation_is_the_reason(self):
        z = 0.05 * np.round(0.02 * white() / 0.05)
        found = identify(z, RATE, unit="deg/s")
        assert found.record.step == pytest.approx(0.05)
        assert "Quantised in steps of 0.0500 deg/s" in said(found)
        assert "Not Gaussian" not in said(found)

    def test_heavy_tails(self):
        z = np.random.default_rng(1).laplace(size=15_000)
        assert "Not Gaussian" in said(identify(z, RATE))

    def test_smoothing_makes_correlation(self):
        found = identify(white(), RATE, smooth=5)
        assert "correlates even white noise by 0.8 at lag 1" in said(found)
        # Bartlett's bound for a moving average is wider than that of white noise: three of them.
        assert found.correlogram.acf[0] == pytest.approx(0.8, abs=3.0 * found.correlogram.bound)

    def test_a_drift_that_the_order_leaves_out_is_seen(self):
        # Residuals of the first order are nearly white, but the walk is not in them.
        z = white(60_000) + np.cumsum(0.001 * white(60_000, seed=2))
        blind = identify(z, RATE, order=(0, 0))
        assert blind.slow_ratio > 3.0
        assert "so the model lacks a slow drift" in said(blind)

    def test_a_model_knows_its_own_slow_part(self, found):
        # A hundred means tell a variance to a seventh: three of that.
        assert found.slow_ratio == pytest.approx(1.0, abs=3.0 / 7.0)
        assert "slow drift" not in said(found)
        assert np.isnan(identify(white(), RATE, segments=20).slow_ratio)

    def test_the_end_of_the_orders_is_said(self):
        z = arma()
        assert "the highest order tried" in said(identify(z, RATE, max_p=2, max_q=0))
        assert "the highest order tried" not in said(identify(z, RATE))

    def test_much_data_reject_what_does_not_matter(self):
        # An echo of 1 %, far beyond the lags of any model of the grid.
        a = white(200_000)
        z = a + 0.02 * np.roll(a, 12)
        found = identify(z, RATE)
        assert not found.whiteness.white
        assert "not quite white (Ljung-Box); 0.0" in said(found)


class TestNumbers:
    def test_json_is_strict_and_gives_the_models_back(self, found):
        text = as_json([found], "static.csv")
        content = json.loads(text, parse_constant=pytest.fail)
        assert content["schema"] == "zerorate-identify/1"
        axis = content["axes"]["gyro_x_dps"]
        assert axis == found.to_dict()
        model = ArmaModel.from_json(json.dumps(axis["models"]["arma"]))
        np.testing.assert_array_equal(model.phi, found.model.phi)
        assert model.sigma2 == found.model.sigma2
        assert axis["orders"]["arma"]["clear"] == [2, 1]
        assert [test["name"] for test in axis["tests"]] == [
            test.name for test in (*found.tests.all, found.whiteness.ljung_box)
        ]

    def test_what_is_unknown_is_null(self):
        axis = identify(white(2000), RATE).to_dict()
        json.dumps(axis, allow_nan=False)
        assert axis["online"] is None
        assert axis["tests"][2]["lower"] is None

    def test_text_is_narrow(self, found):
        # A quantised record has the longest notes.
        coarse = identify(np.round(white()), RATE, name="gyro_y_dps", unit="deg/s")
        assert any(test.note for test in coarse.tests.all)
        lines = format_identify([found, coarse]).split("\n")
        assert max(map(len, lines)) <= WIDTH
        assert lines[0] == "gyro_x_dps [deg/s]"

    def test_summary_of_a_record(self):
        z = np.array([np.nan, 1.0, 2.0, np.nan, np.nan, 3.0, np.nan])
        record = summarise_record(z, 2.0)
        assert (record.sample_count, record.missing_count, record.stretch_count) == (7, 4, 2)
        assert (record.mean, record.duration, record.step) == (2.0, 3.5, 0.0)
        assert record.deviation == pytest.approx(np.sqrt(2.0 / 3.0), rel=1e-15)

    def test_a_summary_does_not_lose_noise_under_an_offset(self):
        noise = np.round(white(2000) * 1024.0) / 1024.0
        # Multiples of 1/1024 under 2^30 are exact.
        assert summarise_record(noise + 2.0**30, RATE).deviation == pytest.approx(
            noise.std(), rel=1e-12
        )


class TestFaults:
    @pytest.mark.parametrize(
        ("z", "match"),
        [
            (np.ones(1000), "identification needs samples that differ, all 1000 are 1"),
            (np.full(1000, np.nan), "z holds no finite sample"),
            (white(199), "identification needs at least 200 samples, got 199"),
            (white(400).reshape(200, 2), r"z must be one axis of shape \(n,\), got shape"),
        ],
    )
    def test_records(self, z, match):
        with pytest.raises(ValueError, match=match):
            identify(z, RATE)

    @pytest.mark.parametrize(
        ("options", "match"),
        [
            ({"criterion": "dic"}, "criterion"),
            ({"method": "guess"}, "method"),
            ({"order": (-1, 0)}, "p"),
            ({"max_order": -1}, "max_order"),
            ({"max_order": 5000}, "max_order"),
            ({"smooth": 0}, "smooth"),
            ({"outliers": "scissors"}, "outliers"),
            ({"trend": "cubic"}, "must be one of 'mean', 'linear'"),
            ({"decimate": 0}, "decimate|factor"),
            ({"decimate": 50}, "identification after decimation needs at least 200 samples"),
            ({"segments": 1}, "segments"),
        ],
    )
    def test_options(self, options, match):
        with pytest.raises(ValueError, match=match) as raised:
            identify(white(5000), RATE, **options)
        assert "\n" not in str(raised.value)

    @pytest.mark.parametrize("rate", [0.0, -1.0, np.inf])
    def test_rates(self, rate):
        with pytest.raises(ValueError, match="rate"):
            identify(white(1000), rate)


@pytest.mark.parametrize(
    ("order", "name"), [((0, 0), "white noise"), ((2, 0), "AR(2)"), ((0, 1), "MA(1)")]
)
def test_names_of_models(order, name):
    assert model_name(order) == name


@pytest.mark.parametrize("spike", [1e9, -3.4e38, 1e150])
def test_one_sample_beyond_all_sense_is_named(spike):
    z = np.random.default_rng(4).standard_normal(3000)
    z[1234] = spike
    with pytest.raises(
        ValueError, match=r"similar size: sample 1234 is .*outliers= can replace it"
    ):
        identify(z, RATE)
    assert identify(z, RATE, outliers="hampel").whiteness.white


def test_phrases():
    assert join_words(["a"]) == "a"
    assert join_words(["a", "b", "c"]) == "a, b and c"
    assert format_percent(0.1234) == "12 %"
    assert format_percent(1e-6) == "less than 0.01 %"


@needs_recordings
class TestRecordings:
    def test_a_sensor_at_rest(self):
        log = read_log(RECORDINGS / "mpu6050_static_100hz.parquet", rate=RATE)
        for name, z in zip(log.names, log.data.T, strict=True):
            found = identify(z, log.rate, name=name, unit=log.unit)
            assert found.moving == ()
            assert is_fit(found)
            # 1/131 deg/s: the step of the sensor.
            assert found.record.step == pytest.approx(1.0 / 131.0, rel=1e-6)
            # White at all short lags, as the recording's notes say.
            assert found.whiteness.predictable < 0.01

    def test_a_sensor_in_motion(self):
        path = RECORDINGS / "broad_05_undisturbed_slow_rotation_with_breaks_B.parquet"
        log = read_log(path, rate=2000.0 / 7.0)
        found = identify(log.data[:, 0], log.rate, name=log.names[0], unit=log.unit)
        assert not is_fit(found)
        assert "Not fit for a drift model: the sensor was not at rest from" in said(found)
        # Where it moved first, by the recording's own column.
        assert found.moving[0].start == pytest.approx(35.4, abs=2.0)
