"""A rate table: closed forms, the choice of terms, errors that hold, and the sources' example."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import zerorate as zr
from support.figures import check_contrast, check_layout

STEPS = np.array([5.0, 10.0, 25.0, 50.0, 100.0, 150.0, 200.0, 250.0])
RATES = np.concatenate((-STEPS[::-1], [0.0], STEPS))
SIGMA = 0.01


def noisy(means, seed):
    return means + SIGMA * np.random.default_rng(seed).standard_normal(np.shape(means))


class TestLine:
    def test_least_squares_of_a_line(self):
        z = noisy(0.5 + 0.98 * RATES, 1)
        axis = zr.calibrate_rate_table(RATES, z, sigma=SIGMA).axes[0]
        scale, bias = np.polyfit(RATES, z, 1)
        assert axis.terms == ()
        assert (axis.scale, axis.bias) == (pytest.approx(scale), pytest.approx(bias))
        chi_squared = np.sum((z - bias - scale * RATES) ** 2) / SIGMA**2 / (RATES.size - 2)
        assert axis.chi_squared == pytest.approx(chi_squared)
        # Symmetric rates: the errors of bias and scale do not depend on each other.
        inflated = SIGMA * math.sqrt(max(chi_squared, 1.0))
        assert axis.bias.sigma == pytest.approx(inflated / math.sqrt(RATES.size))
        assert axis.scale.sigma == pytest.approx(inflated / math.sqrt(np.sum(RATES**2)))

    def test_without_sigma_the_residuals_say_it(self):
        z = noisy(0.5 + 0.98 * RATES, 2)
        told, untold = (
            zr.calibrate_rate_table(RATES, z, sigma=SIGMA),
            zr.calibrate_rate_table(RATES, z),
        )
        ratio = math.sqrt(told.axes[0].chi_squared / max(told.axes[0].chi_squared, 1.0))
        assert untold.axes[0].scale.sigma == pytest.approx(ratio * told.axes[0].scale.sigma)
        assert math.isnan(untold.axes[0].chi_squared)
        assert untold.sigma[0, 0] == pytest.approx(SIGMA * math.sqrt(told.axes[0].chi_squared))

    def test_count_makes_errors_of_means(self):
        z = noisy(0.5 + 0.98 * RATES, 3)
        of_means = zr.calibrate_rate_table(RATES, z, sigma=SIGMA)
        of_samples = zr.calibrate_rate_table(RATES, z, sigma=10.0 * SIGMA, count=100)
        assert of_samples.axes == of_means.axes

    def test_a_mean_of_more_samples_weighs_more(self):
        rates, z = np.array([-1.0, 0.0, 1.0]), np.array([-1.0, 0.3, 1.0])
        bias = [
            float(zr.calibrate_rate_table(rates, z, count=count).axes[0].bias)
            for count in ((1, 1, 1), (1, 1000, 1))
        ]
        assert bias == pytest.approx([0.1, 0.3], abs=1e-3)

    @given(st.floats(1e-3, 1e3), st.floats(1e-3, 1e3))
    def test_units_do_not_matter(self, of_rates, of_output):
        z = noisy(0.5 + 0.98 * RATES + 1e-8 * RATES**3, 4)
        plain = zr.calibrate_rate_table(RATES, z).axes[0]
        other = zr.calibrate_rate_table(of_rates * RATES, of_output * z).axes[0]
        assert other.terms == plain.terms == ("cubic",)
        assert other.cubic == pytest.approx(plain.cubic * of_output / of_rates**3, rel=1e-6)
        assert other.scale.sigma == pytest.approx(
            plain.scale.sigma * of_output / of_rates, rel=1e-6
        )
        assert other.nonlinearity == pytest.approx(plain.nonlinearity, rel=1e-6)


class TestTerms:
    @pytest.mark.parametrize(
        ("bend", "term"),
        [
            (lambda w: 1e-6 * w**2, "quadratic"),
            (lambda w: 1e-8 * w**3, "cubic"),
            (lambda w: 3e-4 * np.abs(w), "asymmetry"),
        ],
    )
    def test_a_bend_is_found(self, bend, term):
        found = [
            zr.calibrate_rate_table(RATES, noisy(RATES + bend(RATES), seed), sigma=SIGMA).axes[0]
            for seed in range(20)
        ]
        # A square and an absolute value are alike on such a table: one may stand for the other.
        assert sum(term in axis.terms for axis in found) >= 14
        right = [axis for axis in found if axis.terms == (term,)]
        expected = bend(1.0)
        assert all(abs(getattr(a, term) - expected) < 4.0 * getattr(a, term).sigma for a in right)

    def test_none_is_found_in_a_line(self):
        found = [
            zr.calibrate_rate_table(RATES, noisy(RATES, seed), sigma=SIGMA).axes[0]
            for seed in range(40)
        ]
        # Chance bends a fifth of them; of those the bend is within its own error.
        assert sum(axis.terms == () for axis in found) >= 28
        straight = next(axis for axis in found if not axis.terms)
        for term in ("quadratic", "cubic", "asymmetry"):
            known = getattr(straight, term)
            assert (float(known), known.identifiable) == (0.0, False)
            assert 0.0 < known.upper_bound < 1e-2

    def test_errors_hold(self):
        z = []
        for seed in range(100):
            axis = zr.calibrate_rate_table(RATES, noisy(0.3 + RATES, seed), sigma=SIGMA).axes[0]
            z += [(axis.bias - 0.3) / axis.bias.sigma, (axis.scale - 1.0) / axis.scale.sigma]
        # 200 squares, five deviations of their mean; a chosen bend takes some of the scale.
        assert np.mean(np.square(z)) == pytest.approx(1.0, abs=0.5)

    def test_rates_of_one_sign_tell_no_asymmetry(self):
        axis = zr.calibrate_rate_table(STEPS, noisy(STEPS, 1), sigma=SIGMA).axes[0]
        assert not axis.asymmetry.known
        assert "asymmetry     not identifiable" in str(zr.calibrate_rate_table(STEPS, STEPS))

    def test_nonlinearity(self):
        z = RATES.copy()
        z[-1] += 2.5
        table = zr.calibrate_rate_table(RATES, z)
        slope, bias = np.polyfit(RATES, z, 1)
        expected = np.abs(z - bias - slope * RATES).max() / (slope * 250.0)
        assert table.axes[0].nonlinearity == pytest.approx(expected)


class TestCorrection:
    @given(
        st.floats(-0.1, 0.1),
        st.floats(0.5, 1.5),
        st.floats(-3e-4, 3e-4),
        st.floats(-4e-7, 4e-7),
        st.floats(-0.02, 0.02),
    )
    def test_it_inverts_the_prediction(self, bias, scale, quadratic, cubic, asymmetry):
        w = RATES
        z = bias + scale * w + quadratic * w**2 + cubic * w**3 + asymmetry * np.abs(w)
        table = zr.calibrate_rate_table(w, z)
        np.testing.assert_allclose(table.residuals, 0.0, atol=1e-6)
        beyond = np.linspace(-500.0, 500.0, 101)
        assume(abs(table.axes[0].scale) > 0.1)
        # 60 halvings of at most 500.
        np.testing.assert_allclose(table.correct(table.predict(beyond)), beyond, atol=1e-9)

    def test_beyond_the_table_the_tangent_goes_on(self):
        table = zr.calibrate_rate_table(RATES, RATES + 1e-7 * RATES**3)
        far = table.predict([300.0, 350.0, 400.0])
        assert far[2] - far[1] == pytest.approx(far[1] - far[0])
        assert far[1] - far[0] == pytest.approx(50.0 * (1.0 + 3e-7 * 250.0**2))

    def test_what_it_takes(self):
        table = zr.calibrate_rate_table(RATES, 1.0 + 2.0 * RATES)
        assert float(table.correct(21.0)) == pytest.approx(10.0)
        np.testing.assert_allclose(table.correct([21.0, np.nan]), [10.0, np.nan])
        log = zr.Log(np.arange(3) / 10, 10.0, [1.0, 3.0, 5.0], ("gyro_z_dps",), "deg/s")
        corrected = table.correct(log)
        assert (corrected.unit, corrected.names) == ("deg/s", ("gyro_z_dps",))
        np.testing.assert_allclose(corrected.data[:, 0], [0.0, 1.0, 2.0], atol=1e-12)

    def test_three_axes(self):
        W = np.array([[1.01, 0.01, -0.02], [0.003, 0.98, 0.01], [-0.01, 0.02, 1.02]])
        bias = np.array([0.1, 0.2, 0.3])
        rates = np.concatenate([RATES[:, None] * e for e in np.eye(3)])
        truth = rates @ W.T + bias + 1e-8 * rates**3
        table = zr.calibrate_rate_table(rates, noisy(truth, 1), sigma=SIGMA)
        for i, axis in enumerate(table.axes):
            others = [W[i, j] for j in range(3) if j != i]
            for known, true in zip((axis.scale, *axis.cross), (W[i, i], *others), strict=True):
                assert abs(known - true) < 4.0 * known.sigma
        z = np.random.default_rng(2).uniform(-200.0, 200.0, (50, 3))
        corrected = table.correct(z @ W.T + bias + 1e-8 * z**3)
        np.testing.assert_allclose(corrected, z, atol=0.1)
        np.testing.assert_allclose(table.correct(table.predict(z)), z, atol=1e-9)
        with pytest.raises(ValueError, match="z must have 3 axes in its last dimension"):
            table.correct(np.zeros((5, 2)))

    def test_an_axis_that_is_not_turned_about_has_no_cross_term(self):
        rates = np.concatenate([RATES[:, None] * e for e in np.eye(3)[:2]])
        with pytest.raises(ValueError, match="rates must differ about each axis"):
            zr.calibrate_rate_table(rates, rates)


class TestPublished:
    """Fu and Han: without calibration the gyro reads 4.844 deg/s where the table turns at 5."""

    def test_calibration_takes_the_difference_away(self):
        rates = np.array([-20.0, -10.0, -5.0, 0.0, 5.0, 10.0, 20.0])
        reading = -0.156 + rates
        table = zr.calibrate_rate_table(rates, noisy(reading, 1) / 1.0, sigma=SIGMA)
        assert reading[4] == pytest.approx(4.844)
        # What is left is of the means' noise.
        assert float(table.correct(4.844)) == pytest.approx(5.0, abs=4.0 * SIGMA)

    def test_one_rate_tells_no_scale_from_bias(self):
        with pytest.raises(ValueError, match="one rate cannot separate scale and bias"):
            zr.calibrate_rate_table([5.0, 5.0, 5.0], [4.844, 4.845, 4.843])

    def test_a_bias_that_is_removed_leaves_the_spread(self):
        """The random part, of which their filter takes away most, is none of calibration's."""
        noise = zr.simulate(zr.NoiseModel(0.05), 100.0, 20.0, seed=1)[0]
        table = zr.calibrate_rate_table([-5.0, 0.0, 5.0], [-5.156, -0.156, 4.844])
        corrected = table.correct(4.844 + noise)
        assert corrected.std() == pytest.approx(noise.std())
        assert corrected.mean() - 5.0 == pytest.approx(noise.mean(), abs=1e-9)


class TestFigure:
    @pytest.mark.parametrize("axes", [1, 3])
    def test_it_can_be_read(self, axes):
        rates = np.concatenate([RATES[:, None] * e for e in np.eye(axes)])
        table = zr.calibrate_rate_table(rates, noisy(rates + 1e-8 * rates**3, 3), sigma=SIGMA)
        figure = table.plot()
        check_contrast(figure)
        check_layout(figure)
        assert len(figure.axes) == axes
        line = figure.axes[0].lines[1]
        assert line.get_label().endswith("line, cubic")
        np.testing.assert_allclose(np.ptp(line.get_ydata()), 2e-8 * 250.0**3, rtol=0.1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"rates": [1.0, 2.0], "means": [1.0, 2.0]}, "2 means cannot give the 2 coefficients"),
        ({"means": np.zeros(4)}, "must have one shape"),
        ({"rates": np.zeros((17, 2)), "means": np.zeros((17, 2))}, "must have one shape"),
        ({"means": np.full(17, np.nan)}, "means must be finite"),
        ({"sigma": 0.0}, "sigma must be positive"),
        ({"sigma": np.ones(4)}, "sigma must be one number, or one a mean"),
        ({"count": -1}, "count must be positive"),
        ({"means": RATES + 2e-5 * RATES**3}, "the curve cannot be inverted safely"),
    ],
)
def test_refusals(arguments, message):
    with pytest.raises(ValueError, match=message):
        zr.calibrate_rate_table(**{"rates": RATES, "means": RATES, **arguments})
