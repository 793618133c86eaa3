"""The figure of a replay: panels, limits, sizes, and no label over another."""

import dataclasses
import re
from functools import cache

import numpy as np
import pytest
from matplotlib.colors import to_hex

from support.figures import check_contrast, check_layout
from support.logs import make_log, noise
from zerorate.show import plot_replay, save_figure
from zerorate.show.style import ROSE
from zerorate.tasks.replay.run import run_filters


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


METHODS = ("auto", "fading")


def figure_of(data, method="auto", everything=True, **options):
    return plot_replay(run_filters(make_log(data), methods=(method,), **options), everything)


@cache
def drawn(name, method="auto", everything=True):
    return figure_of(LOGS[name], method, everything)


@pytest.mark.every(5)
@pytest.mark.parametrize("everything", [False, True])
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", LOGS)
def test_panels_and_limits(name, method, everything):
    figure = drawn(name, method, everything)
    axes = LOGS[name].shape[1]
    assert len(figure.axes) == (5 * axes if everything else 1 + axes)
    for axes in figure.axes:
        for low, high in (axes.get_xlim(), axes.get_ylim()):
            assert np.isfinite([low, high]).all()
            assert low < high


@pytest.mark.every(2)
@pytest.mark.parametrize("name", ["one sample", "gaps", "one axis missing", "huge", "spikes"])
def test_drawing(name, tmp_path):
    save_figure(drawn(name, everything=False), tmp_path / "figure.png")
    assert (tmp_path / "figure.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.every(5)
@pytest.mark.parametrize("everything", [False, True])
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["plain", "one axis", "walk", "far from zero", "tiny", "stuck"])
def test_nothing_lies_over_a_neighbour_or_outside(name, method, everything):
    figure = drawn(name, method, everything)
    check_layout(figure)
    check_contrast(figure)


@pytest.mark.parametrize(("everything", "wide"), [(False, 85.0), (True, 180.0)])
def test_a_page_is_wide_enough(everything, wide):
    figure = drawn("plain", everything=everything)
    assert figure.get_figwidth() * 25.4 == pytest.approx(wide)


def test_one_time_axis_and_the_unit_over_each_panel():
    figure = drawn("plain", everything=False)
    assert {axes.get_xlim() for axes in figure.axes} == {(0.0, 200.0)}
    assert [axes.get_xlabel() for axes in figure.axes] == ["", "", "", "time [s]"]
    heads = [axes.get_title(loc="left") for axes in figure.axes]
    assert heads == ["raw rate [deg/s]", *(f"bias of gyro_{i} [deg/s]" for i in range(3))]


def test_the_answer_is_the_bias_at_the_end():
    question, answer, *_, corner = (
        text.get_text() for text in drawn("plain", everything=False).texts
    )
    assert question == "What is the gyro's bias, and how well is it known?"
    assert answer.startswith("At the end: ")
    assert corner.endswith("100 Hz · 200 s")


def test_a_burst_does_not_flatten_the_rest():
    z = noise(20_000, 1)
    z[10_000:10_100] = 1e3
    low, high = figure_of(z, everything=False).axes[0].get_ylim()
    assert high - low < 20.0
    z[5_000:15_000] = 1e3 * noise(10_000, 1)
    assert figure_of(z, everything=False).axes[0].get_ylim()[1] > 800.0


def test_a_power_of_ten_stands_in_the_unit():
    heads = [axes.get_title(loc="left") for axes in drawn("tiny", everything=False).axes]
    assert heads[0].startswith("raw rate [10⁻¹⁵")
    heads = [axes.get_title(loc="left") for axes in drawn("far from zero", everything=False).axes]
    assert all(", from its median 1" in head for head in heads[1:])


@pytest.mark.parametrize("biases", [(1.0, -300.0, 2e-3), (1e-4, 2e-4, -3e-4), (5.0, 5.0, 5.0)])
def test_panels_of_one_quantity_have_one_scale_and_one_power(biases):
    random = np.random.default_rng(1)
    z = np.array(biases) + random.normal(0.0, [1e-3, 1e-4, 1e-5], (6000, 3))
    panels = figure_of(z, everything=False).axes[1:]
    spans = [high - low for low, high in (panel.get_ylim() for panel in panels)]
    assert spans == pytest.approx([spans[0]] * 3)
    heads = [panel.get_title(loc="left") for panel in panels]
    assert len({head[head.index("[") :] for head in heads}) == 1
    medians = [re.search(r"median (\S+) \[", head) for head in heads]
    assert len({found is None for found in medians}) == 1
    if medians[0] is not None:
        found = [float(one[1].replace("\u2212", "-")) for one in medians]
        assert found == pytest.approx(biases, abs=0.3 * spans[0])


def test_axes_beyond_five_are_named():
    figure = figure_of(noise(300, 8), everything=False)
    assert len(figure.axes) == 6
    assert "the first 5 of 8 axes" in " ".join(figure.texts[2].get_text().split())


def test_axes_that_do_not_fit_are_named():
    figure = figure_of(noise(300, 8))
    assert len(figure.axes) == 30
    assert "the first 6 of 8 axes" in " ".join(figure.texts[-1].get_text().split())


@pytest.mark.parametrize("order", [(1, 0), (3, 3), (2, 0)])
def test_orders(order):
    figure = figure_of(noise(2000, 1), "fading", order=order, adapt_for=None)
    labels = [line.get_label() for line in figure.axes[3].lines]
    assert len(labels) == sum(order) + 1


@pytest.mark.parametrize("method", ["kf", "akf"])
def test_methods(method):
    figure = figure_of(noise(2000, 1), method, output="compensated")
    assert [line.get_label() for line in figure.axes[4].lines] == ["raw", "compensated"]


def with_motion(spans, n=4000, method="auto"):
    """Return a replay whose first axis was taken for moving in spans of samples."""
    result = run_filters(make_log(noise(n, 2)), methods=(method,), motion="hold")
    at_rest = np.ones_like(result.readings.at_rest)
    for begin, end in spans:
        at_rest[begin:end, 0] = False
    return dataclasses.replace(
        result, readings=dataclasses.replace(result.readings, at_rest=at_rest)
    )


def shaded(axes):
    """Return the spans of time in which a panel is shaded, s."""
    (band,) = [c for c in axes.collections if c.get_zorder() == 0.5]
    return [(path.vertices[:, 0].min(), path.vertices[:, 0].max()) for path in band.get_paths()]


@pytest.mark.parametrize("method", METHODS)
def test_motion_is_shaded_where_it_was(method):
    figure = plot_replay(with_motion([(1000, 2000), (3500, 4000)], method=method), True)
    # The figure has 400 places over 40 s.
    assert np.ravel(shaded(figure.axes[0])) == pytest.approx([10.0, 20.0, 35.0, 40.0], abs=0.1)
    assert "motion" in figure.texts[-1].get_text()
    if method == "auto":
        # Where the band of the bias lies over it, a colour would make a third one.
        (hatched,) = [c for c in figure.axes[2].collections if c.get_zorder() == 0.5]
        assert hatched.get_hatch()
        assert len(hatched.get_facecolor()) == 0


@pytest.mark.parametrize("method", METHODS)
def test_a_panel_has_one_scale(method):
    """Every panel of the first column says what it shows, and in which unit."""
    labels = [axes.get_ylabel() for axes in drawn("plain", method).axes[::3]]
    units = {"auto": ("deg/s", "deg/s", "deg/√h", "deg/h/√h", "deg/s")}.get(
        method, ("deg/s", "deg/s", "", "", "deg/s")
    )
    for label, unit in zip(labels, units, strict=True):
        assert label
        assert label.endswith(f"[{unit}]" if unit else "")


def test_motion_is_shaded_where_the_bias_is_held():
    figure = plot_replay(with_motion([(1000, 2000)]))
    assert np.ravel(shaded(figure.axes[1])) == pytest.approx([10.0, 20.0], abs=0.1)
    assert not [c for c in figure.axes[2].collections if c.get_zorder() == 0.5]
    assert "motion" in figure.texts[2].get_text()


def test_a_short_motion_is_seen_and_the_other_axis_stays_white():
    figure = plot_replay(with_motion([(1234, 1235)]), True)
    ((begin, end),) = shaded(figure.axes[0])
    assert begin <= 12.34 < end
    assert all(c.get_zorder() != 0.5 for c in figure.axes[1].collections)
    assert "stuck" not in figure.texts[-1].get_text()


@pytest.mark.parametrize("method", METHODS)
def test_a_stuck_and_a_saturated_sensor_are_shaded_in_another_colour(method):
    z = noise(4000, 2)
    z[1000:2000, 0] = z[1000, 0]
    z[3500:, 0] = 250.0
    result = run_filters(make_log(z), methods=(method,), motion="hold", limit=250.0)
    figure = plot_replay(result, True)
    bands = [c for c in figure.axes[0].collections if c.get_zorder() == 0.5]
    rose = bands[-1]
    assert to_hex(rose.get_facecolor()[0]) == ROSE.lower()
    edges = [(path.vertices[:, 0].min(), path.vertices[:, 0].max()) for path in rose.get_paths()]
    # The figure has 400 places over 40 s; it takes a few samples to see that a sensor is stuck.
    assert np.ravel(edges) == pytest.approx([10.0, 20.0, 35.0, 40.0], abs=0.2)
    assert "stuck or saturated" in figure.texts[-1].get_text()


def test_the_bias_is_compared_with_the_rest_alone():
    figure = plot_replay(with_motion([(1000, 2000)]), True)
    dots = next(line for line in figure.axes[2].lines if line.get_label() == "raw, mean at rest")
    times = dots.get_xdata()[np.isfinite(dots.get_ydata())]
    # The half second before a motion is in doubt; a mean is of 2/3 s and stands at its middle.
    assert not ((times > 9.5 + 1 / 3) & (times < 20.0 - 1 / 3)).any()
    assert times.size > 0.7 * dots.get_xdata().size


def test_an_axis_that_learned_nothing_does_not_stretch_the_others():
    alone = figure_of(1e-3 * noise(3000, 1))
    beside = figure_of(np.column_stack((1e-3 * noise(3000, 1), np.full(3000, np.nan))))
    assert beside.axes[4].get_ylim() == beside.axes[5].get_ylim() == alone.axes[2].get_ylim()


def test_the_band_of_the_bias_is_two_sigma():
    result = run_filters(make_log(noise(4000, 1)), methods=("auto",))
    band = plot_replay(result).axes[1].collections[0].get_paths()[0].vertices
    bias, sigma = result.history.bias[-1, 0], result.history.bias_sigma[-1, 0]
    last = band[band[:, 0] == 40.0, 1]
    assert (last.min(), last.max()) == pytest.approx((bias - 2 * sigma, bias + 2 * sigma))


@pytest.mark.every(2)
@pytest.mark.parametrize("method", METHODS)
def test_a_million_samples_make_small_vector_files(tmp_path, method):
    figure = figure_of(noise(1_000_000, 3), method, everything=False)
    for suffix in ("svg", "pdf"):
        path = tmp_path / f"figure.{suffix}"
        save_figure(figure, path)
        assert path.stat().st_size < 500_000


@pytest.mark.every(2)
@pytest.mark.parametrize("method", METHODS)
def test_six_axes_make_a_small_svg(tmp_path, method):
    save_figure(figure_of(noise(20_000, 6), method), tmp_path / "figure.svg")
    assert (tmp_path / "figure.svg").stat().st_size < 500_000
