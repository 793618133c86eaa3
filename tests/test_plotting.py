"""The figure of a replay: panels, limits, sizes, and no label over another."""

import itertools
import subprocess
import sys

import numpy as np
import pytest

from test_replay import make_log, noise
from zerorate.plotting import plot_replay, save_figure
from zerorate.plotting.envelope import BUCKETS, limits, outline, spans
from zerorate.plotting.style import time_unit
from zerorate.replay import replay


def gaps():
    z = noise(5000, 3)
    z[1000:2000] = np.nan
    z[:700, 1] = np.nan
    return z


LOGS = {
    "plain": noise(20_000, 3),
    "one axis": noise(3000, 1),
    "one sample": noise(1, 1),
    "two samples": noise(2, 2),
    "twenty samples": noise(20, 3),
    "start-up just over": noise(101, 1),
    "gaps": gaps(),
    "stuck": np.full((1000, 1), 2.5),
    "zero": np.zeros((1000, 1)),
    "one axis missing": np.column_stack((noise(1000, 1), np.full(1000, np.nan))),
    "walk": 1e-3 * np.cumsum(noise(5000, 2) - 0.5, axis=0),
    "huge": 1e150 * noise(2000, 1),
    "tiny": 1e-150 * noise(2000, 1),
    "far from zero": 1e6 + noise(2000, 2),
    "spikes": np.where(noise(2000, 1) > 0.8, 1e6, noise(2000, 1)),
}


def figure_of(data, **options):
    return plot_replay(replay(make_log(data), **options))


@pytest.mark.parametrize("name", LOGS)
def test_panels_and_limits(name):
    data = LOGS[name]
    figure = figure_of(data)
    assert len(figure.axes) == 5 * data.shape[1]
    for axes in figure.axes:
        for low, high in (axes.get_xlim(), axes.get_ylim()):
            assert np.isfinite([low, high]).all()
            assert low < high


@pytest.mark.parametrize("name", ["one sample", "gaps", "one axis missing", "huge", "spikes"])
def test_drawing(name, tmp_path):
    save_figure(figure_of(LOGS[name]), tmp_path / "figure.png")
    assert (tmp_path / "figure.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("name", ["plain", "one axis", "walk", "far from zero", "tiny", "stuck"])
def test_nothing_lies_over_a_neighbour_or_outside(name):
    figure = figure_of(LOGS[name])
    figure.draw_without_rendering()
    right = figure.axes[LOGS[name].shape[1] * 4 :]
    panels = [axes for axes in figure.axes if axes not in right]
    boxes = [axes.get_tightbbox() for axes in panels] + [
        t.get_window_extent() for t in figure.texts
    ]
    for one, other in itertools.combinations(boxes, 2):
        assert not one.overlaps(other)
    for box in (*boxes, *(axes.get_tightbbox() for axes in right)):
        assert box.x0 >= 0.0
        assert box.y0 >= 0.0
        assert box.x1 <= figure.bbox.x1
        assert box.y1 <= figure.bbox.y1


def test_a_page_is_wide_enough_for_three_axes():
    assert figure_of(noise(300, 3)).get_figwidth() * 25.4 == pytest.approx(180.0)


def test_axes_that_do_not_fit_are_named():
    figure = figure_of(noise(300, 8))
    assert len(figure.axes) == 30
    assert "the first 6 of 8 axes" in " ".join(figure.texts[-1].get_text().split())


@pytest.mark.parametrize("order", [(1, 0), (3, 3), (2, 0)])
def test_orders(order):
    figure = figure_of(noise(2000, 1), order=order, adapt_for=None)
    labels = [line.get_label() for line in figure.axes[2].lines]
    assert len(labels) == sum(order) + 1


@pytest.mark.parametrize("method", ["kf", "akf"])
def test_methods(method):
    assert figure_of(noise(2000, 1), methods=(method,)).axes


def test_a_million_samples_make_small_vector_files(tmp_path):
    figure = figure_of(noise(1_000_000, 3), methods=("fading",))
    for suffix in ("svg", "pdf"):
        path = tmp_path / f"figure.{suffix}"
        save_figure(figure, path)
        assert path.stat().st_size < 500_000


def test_six_axes_make_a_small_svg(tmp_path):
    save_figure(figure_of(noise(20_000, 6), methods=("fading",)), tmp_path / "figure.svg")
    assert (tmp_path / "figure.svg").stat().st_size < 500_000


def test_without_allan_deviations_it_says_so():
    with pytest.raises(ValueError, match="allan=True"):
        plot_replay(replay(make_log(noise(300)), allan=False))


def test_pyplot_is_not_touched():
    code = (
        "import sys, numpy as np\n"
        "from zerorate import Log\n"
        "from zerorate.replay import replay\n"
        "from zerorate.plotting import plot_replay\n"
        "assert 'matplotlib' not in sys.modules\n"
        "z = np.random.default_rng(1).standard_normal(500)\n"
        "plot_replay(replay(Log(np.arange(500) / 10, 10.0, z, ['x'])))\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


class TestEnvelope:
    def test_every_peak_is_inside(self):
        z = np.random.default_rng(3).standard_normal(12_345)
        t, least, most = spans(z, 10.0)
        assert len(t) == BUCKETS
        assert (least.min(), most.max()) == (z.min(), z.max())
        _, y = outline(z, 10.0)
        assert (y.min(), y.max()) == (z.min(), z.max())

    def test_short_series_stay_as_they_are(self):
        z = np.array([3.0, np.inf, 1.0])
        t, least, most = spans(z, 2.0)
        np.testing.assert_array_equal(t, [0.0, 0.5, 1.0])
        np.testing.assert_array_equal(least, [3.0, np.nan, 1.0])
        np.testing.assert_array_equal(most, least)

    def test_a_gap_stays_a_gap(self):
        z = np.ones(10_000)
        z[4000:6000] = np.nan
        _, least, _ = spans(z, 1.0)
        assert np.isnan(least).sum() == pytest.approx(0.2 * BUCKETS, abs=1)

    @pytest.mark.parametrize("z", [[np.nan], [0.0], [5.0, 5.0], [1e300, 1e300], [1.0, 2.0]])
    def test_limits_are_apart(self, z):
        low, high = limits(np.array(z))
        assert np.isfinite([low, high]).all()
        assert low < high

    def test_an_outlier_does_not_flatten_the_rest(self):
        z = np.append(np.random.default_rng(4).standard_normal(10_000), 1e9)
        assert limits(z)[1] < 10.0


@pytest.mark.parametrize(("duration", "unit"), [(10, "s"), (600, "s"), (7200, "min"), (1e5, "h")])
def test_time_unit(duration, unit):
    assert time_unit(duration)[0] == unit
