"""Figures of an identification: what they show, and no label over another."""

from functools import cache

import numpy as np
import pytest

from support.figures import check_colours, check_contrast, check_layout
from zerorate.identification import identify
from zerorate.noise.spectrum import Spectrum
from zerorate.show import plot_identification, save_figure
from zerorate.show.identify_panels import _one_sided_density

RATE = 100.0


def coloured(n=5000, seed=1):
    a = np.random.default_rng(seed).standard_normal(n)
    z = np.zeros(n)
    for k in range(2, n):
        z[k] = 1.2 * z[k - 1] - 0.5 * z[k - 2] + a[k] + 0.6 * a[k - 1]
    return z


def moved():
    z = 0.05 * coloured()
    z[2000:2300] += 30.0
    return z


def with_gaps():
    z = coloured()
    z[1000:1500] = np.nan
    z[::333] = np.nan
    return z


RECORDS = {
    "coloured": coloured(),
    "white": np.random.default_rng(1).standard_normal(5000),
    "moved": moved(),
    "gaps": with_gaps(),
    "short": coloured(250),
    "huge": 1e9 * coloured(),
    "tiny": 1e-9 * coloured() + 1.0,
    "quantised": np.round(coloured()),
}


@cache
def identified(name):
    return identify(RECORDS[name], RATE, name=name, unit="deg/s")


@cache
def drawn(name, everything=True):
    return plot_identification(identified(name), everything)


@pytest.fixture
def one():
    return identified("coloured")


@pytest.fixture
def figure():
    return drawn("coloured")


@pytest.fixture(scope="module")
def long():
    return plot_identification(identify(np.tile(RECORDS["coloured"], 40), RATE, name="x"))


def by_title(figure, start):
    (axes,) = (axes for axes in figure.axes if axes.get_title().startswith(start))
    return axes


@pytest.mark.every(3)
@pytest.mark.parametrize(("everything", "panels", "wide"), [(False, 6, 85.0), (True, 9, 180.0)])
@pytest.mark.parametrize("name", RECORDS)
def test_nothing_lies_over_a_neighbour_or_outside(name, everything, panels, wide):
    figure = drawn(name, everything)
    assert len(figure.axes) == panels
    assert figure.get_figwidth() * 25.4 == pytest.approx(wide)
    check_layout(figure)
    check_contrast(figure)
    check_colours(figure)


def test_the_answer_is_the_model_and_what_it_leaves():
    question, answer, *_ = (text.get_text() for text in drawn("white", False).texts)
    assert question == "Which model describes the drift?"
    assert answer.startswith("White noise; its residuals may be white (Ljung-Box, p = ")


class TestPanels:
    def test_correlation(self, one, figure):
        axes = by_title(figure, "autocorrelation of the record")
        points = next(line for line in axes.lines if line.get_marker() == "o")
        np.testing.assert_array_equal(points.get_ydata(), one.correlogram.acf)

    def test_orders(self, one, figure):
        axes = by_title(figure, "orders of ARMA models")
        marks = [line for line in axes.lines if len(line.get_xdata()) == 1]
        orders = one.arma_orders
        assert [line.get_xdata()[0] for line in marks] == [orders.minimum[0], orders.clear[0]]
        assert marks[0].get_ydata()[0] == 0.0
        assert 0.0 <= marks[1].get_ydata()[0] <= orders.margin
        assert [marks[0].get_markerfacecolor(), marks[1].get_markerfacecolor()][0] == "white"

    def test_online_ends_in_the_band(self, one, figure):
        axes = by_title(figure, "coefficients learned online")
        labelled = [line for line in axes.lines if not line.get_label().startswith("_")]
        assert [line.get_label() for line in labelled] == ["φ₁", "φ₂", "θ₁"]
        for i, line in enumerate(labelled):
            assert line.get_ydata()[-1] == one.online.last[i]

    def test_the_spectrum_of_the_model_is_that_of_the_record(self, figure):
        axes = by_title(figure, "spectrum")
        record, _, model = axes.lines
        level = np.interp(record.get_xdata(), model.get_xdata(), model.get_ydata())
        # Bands average at least ten lines each, so that ratios scatter by a third at most.
        assert np.median(record.get_ydata() / level) == pytest.approx(1.0, abs=0.1)

    def test_quantiles_of_gaussian_residuals_are_straight(self, figure):
        axes = by_title(figure, "quantiles")
        points = next(line for line in axes.lines if line.get_marker() == "o")
        x, y = points.get_xydata().T
        middle = np.abs(x) < 2.0
        # The standard error of the quantile at two deviations is 0.04 of 5000 samples; four.
        assert np.abs(x - y)[middle].max() < 0.16

    def test_motion_is_shaded(self):
        assert identified("moved").moving
        axes = drawn("moved").axes[0]
        assert "not at rest" in [text.get_text() for text in axes.get_legend().get_texts()]

    def test_white_noise_has_nothing_to_learn(self):
        axes = by_title(drawn("white"), "coefficients learned online")
        assert [text.get_text() for text in axes.texts] == ["white noise is not learned online"]


def test_the_density_of_white_noise():
    z = 3.0 * np.random.default_rng(1).standard_normal(100_000)
    frequencies, density = _one_sided_density(Spectrum.of(z, RATE), RATE)
    assert 0.0 < frequencies[0] < frequencies[-1] <= RATE / 2.0
    # 2 sigma^2 / rate; the upper half holds 50 000 lines, which average to 0.5 %: three times it.
    assert density[frequencies > RATE / 8.0].mean() == pytest.approx(18.0 / RATE, rel=0.015)


def test_a_sine_stands_at_its_frequency():
    z = np.sin(2.0 * np.pi * 12.5 * np.arange(100_000) / RATE)
    z += 1e-3 * np.random.default_rng(1).standard_normal(z.size)
    frequencies, density = _one_sided_density(Spectrum.of(z, RATE), RATE)
    # A band is an eighth of an octave.
    assert frequencies[np.argmax(density)] == pytest.approx(12.5, rel=0.09)


@pytest.mark.every(2)
@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_files(tmp_path, suffix, long):
    save_figure(long, tmp_path / f"figure.{suffix}")
    # As much for 200 000 samples as for a few.
    assert 5_000 < (tmp_path / f"figure.{suffix}").stat().st_size < 500_000
