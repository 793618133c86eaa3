"""Figures of deviation curves: lines where they belong, limits, and no label over another."""

import itertools
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import zerorate as zr
from support.figures import check_layout
from zerorate import Log, NoiseModel
from zerorate.noise.characterise import characterise_log
from zerorate.noise.quantities import choose_display_unit
from zerorate.show import (
    format_allan,
    plot_allan,
    plot_characterisation,
    plot_dynamic,
    save_figure,
)
from zerorate.show.allan_terms import select_terms
from zerorate.units import convert

RATE = 100.0
TRUE = NoiseModel(
    angle_random_walk=1e-4,
    bias_instability=3e-5,
    rate_random_walk=2e-6,
    rate_ramp=5e-8,
    quantization=3e-6,
)


def record(n=50_000, axes=1):
    return zr.simulate(TRUE, RATE, n / RATE, seed=1, axes=axes)[0].reshape(n, axes)


def with_gaps():
    z = record(20_000, 2)
    z[4000:9000, 0] = np.nan
    z[::701, 1] = np.nan
    return z


RECORDS = {
    "one axis": record(),
    "three axes": record(20_000, 3),
    "six axes": record(2000, 6),
    "short": record(200),
    "gaps": with_gaps(),
    "huge": 1e6 * record(5000),
    "tiny": 1e-9 * record(5000),
    "walk": np.cumsum(record(5000), axis=0),
}


@cache
def result_of(name, unit="rad/s"):
    z = RECORDS[name]
    return zr.allan(z, RATE, unit=unit, names=[f"axis {i}" for i in range(z.shape[1])])


@cache
def drawn(name, unit="rad/s"):
    result = result_of(name, unit)
    return result.plot(result.fit())


def lists_of(axes):
    return [text for text in axes.texts if text.get_text()[:2] in ("Q ", "N ", "B ", "K ", "R ")]


@pytest.mark.every(3)
@pytest.mark.parametrize("unit", ["rad/s", "g"])
@pytest.mark.parametrize("name", RECORDS)
def test_nothing_lies_over_a_neighbour_or_outside(name, unit):
    figure = drawn(name, unit)
    assert len(figure.axes) == RECORDS[name].shape[1]
    check_layout(figure)
    for axes in figure.axes:
        frame, title = axes.get_window_extent(), axes.title.get_window_extent()
        boxes = [text.get_window_extent() for text in lists_of(axes)]
        assert boxes
        assert all(frame.x0 <= box.x0 and box.x1 < frame.x1 + 1.0 for box in boxes)
        # The frame of a text is a little higher than its letters.
        assert all(frame.y1 < box.y0 + 2.0 and box.y1 < title.y0 + 2.0 for box in boxes)
        for one, other in itertools.combinations(boxes, 2):
            assert not one.padded(-1.0).overlaps(other.padded(-1.0))


def key_of(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_the_key_has_what_is_drawn_and_nothing_else():
    result = result_of("one axis")
    assert key_of(result.plot()) == [
        "measured", "68 % bounds", "right of it: below 5 degrees of freedom",
    ]  # fmt: skip
    without = replace(result, lower=np.full_like(result.lower, np.nan))
    assert "68 % bounds" not in key_of(without.plot())
    sure = replace(TRUE, markov=[zr.noise.Markov(1e-6, 10.0)])
    assert key_of(plot_allan(result, sure))[2:6] == [
        "model", "one term of the model", "Markov noise or sine", "read here (IEEE Std 952)",
    ]  # fmt: skip
    texts = [text.get_text() for text in drawn("short").texts]
    assert texts == ["Recorded: 2 s at 100 Hz."]


def test_records_of_several_lengths_share_limits_and_are_shaded_where_they_end():
    z = record()[:, 0]
    results = [zr.allan(part, RATE, unit="deg/s", names="z") for part in (z[:1000], z)]
    figure = plot_allan(results, title="one gyro")
    assert key_of(figure)[-1] == "record too short"
    assert figure.texts[-1].get_text() == "Recorded: 10 s at 100 Hz, 500 s at 100 Hz."
    assert len({axes.get_xlim() for axes in figure.axes}) == 1
    check_layout(figure)
    other = zr.allan(z, RATE, unit="rad/s")
    with pytest.raises(ValueError, match="of one kind and unit, got oadev in deg/s, oadev in rad"):
        plot_allan([results[0], other])


def test_all_axes_of_a_sensor_are_in_one_unit():
    """One axis is quiet enough for deg/h, another would do in deg/s."""
    z = record(5000, 2) * [1.0, 1e4]
    log = Log(np.arange(5000) / RATE, RATE, z, ["x", "y"], "rad/s")
    found = characterise_log(log, second_opinion=False)
    loud = plot_characterisation([found]).axes[1].lines[0].get_ydata()
    np.testing.assert_allclose(loud, convert(found.curve.deviation[:, 1], "rad/s", "deg/h"))
    (row,) = (line for line in format_allan([found]).splitlines() if line.startswith("  1.28 s"))
    numbers = [float(word) for word in row.split() if re.fullmatch(r"[\d.]+", word)]
    assert numbers[2] > 1000.0 * numbers[1]


def test_points_and_band_are_in_the_unit_of_the_scale():
    result = result_of("one axis")
    (axes,) = result.plot().axes
    assert axes.get_ylabel() == "overlapping Allan deviation [deg/h]"
    points = axes.lines[0].get_ydata()
    np.testing.assert_allclose(points, convert(result.deviation[:, 0], "rad/s", "deg/h"))


@pytest.mark.parametrize(
    ("unit", "shown"), [("deg/s", "deg/s"), ("g", "m/s²"), (None, "unit of the samples")]
)
def test_large_deviations_are_in_the_coarse_unit(unit, shown):
    figure = zr.allan(1e3 * np.random.default_rng(1).standard_normal(1000), RATE, unit=unit).plot()
    assert figure.axes[0].get_ylabel().endswith(f"[{shown}]")


def test_marks_stand_where_the_standard_reads_them():
    result = result_of("one axis")
    shown = choose_display_unit(result)
    terms = {term.symbol: term for term in select_terms(TRUE, result.axis(0), shown)}
    values = {
        "N": (1.0, TRUE.angle_random_walk),
        "K": (3.0, TRUE.rate_random_walk),
        "R": (2.0**0.5, TRUE.rate_ramp),
        "Q": (3.0**0.5, TRUE.quantization),
    }
    for symbol, (tau, value) in values.items():
        assert terms[symbol].read_at == tau
        # Straight between octaves, and of a sampled walk: K's line is bent by 1 in 2 m^2.
        expected = pytest.approx(convert(value, "rad/s", "deg/h"), rel=1e-4)
        assert terms[symbol].height == expected
        assert terms[symbol].inside
    floor = convert(0.664 * TRUE.bias_instability, "rad/s", "deg/h")
    # 0.664 has three digits.
    assert terms["B"].height == pytest.approx(floor, rel=1e-3)


def test_a_mark_outside_the_record_is_hollow():
    result = result_of("short")
    terms = select_terms(TRUE, result.axis(0), choose_display_unit(result))
    assert {term.symbol: term.inside for term in terms} == {
        "Q": False, "N": False, "B": True, "K": False, "R": False,
    }  # fmt: skip
    (axes,) = plot_allan(result, TRUE).axes
    marks = {line.get_marker(): line for line in axes.lines if len(line.get_xdata()) == 1}
    assert "white" in {line.get_markerfacecolor() for line in marks.values()}


def test_bounds_are_triangles():
    bounded = zr.noise.Coefficient(0.0, identifiable=False, upper_bound=4e-5)
    model = NoiseModel(angle_random_walk=1e-4, rate_random_walk=bounded)
    (axes,) = plot_allan(result_of("one axis"), model).axes
    assert [t.get_text() for t in lists_of(axes)] == ["N = 0.3438 deg/√h", "K < 500 deg/h/√h"]
    marks = [line.get_marker() for line in axes.lines if len(line.get_xdata()) == 1]
    assert marks == ["D", "v"]
    assert {"not identifiable: 95 % bound", "bound, read here"} <= set(key_of(axes.figure))


def test_what_is_unknown_is_not_drawn():
    figure = plot_allan(result_of("one axis"), NoiseModel(angle_random_walk=1e-4))
    assert [t.get_text() for t in lists_of(figure.axes[0])] == ["N = 0.3438 deg/√h"]


def test_the_vertical_line_leaves_few_degrees_of_freedom_to_its_right():
    result = result_of("one axis").axis(0)
    (axes,) = result.plot().axes
    (edge,) = (line.get_xdata()[0] for line in axes.lines if line.get_linestyle() == ":")
    assert (result.edf[result.taus < edge] >= 5.0).all()
    assert (result.edf[result.taus > edge] < 5.0).all()


@pytest.mark.parametrize(
    "data", [np.ones((1000, 1)), np.column_stack((np.ones(1000), record(1000)))]
)
def test_constants_are_told(data):
    figure = zr.allan(data, RATE, names=[str(i) for i in range(data.shape[1])]).plot()
    assert "no noise" in [text.get_text() for text in figure.axes[0].texts]
    check_layout(figure)


def test_one_model_an_axis():
    with pytest.raises(ValueError, match="models must be one an axis: 3, got 1"):
        plot_allan(result_of("three axes"), TRUE)


@pytest.mark.every(3)
@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_files(tmp_path, suffix):
    save_figure(drawn("three axes"), tmp_path / f"figure.{suffix}")
    assert 5_000 < (tmp_path / f"figure.{suffix}").stat().st_size < 500_000


@pytest.mark.parametrize(("gyros", "accelerometers"), [(3, 3), (1, 3), (6, 2)])
def test_all_sensors_of_a_log(gyros, accelerometers):
    logs = [
        Log(np.arange(2000) / RATE, RATE, record(2000, k), [f"{unit}{i}" for i in range(k)], unit)
        for k, unit in ((gyros, "rad/s"), (accelerometers, "g"))
    ]
    figure = plot_characterisation([characterise_log(log, second_opinion=False) for log in logs])
    assert len(figure.axes) == min(gyros, 4) + min(accelerometers, 4)
    assert ("the first 4 of 6 axes" in figure.texts[-1].get_text()) == (gyros == 6)
    check_layout(figure)


def test_a_record_that_moved_says_so():
    z = record(5000, 2)
    z[3000:3300, 0] += 0.5
    log = Log(np.arange(5000) / RATE, RATE, z, ["x", "y"], "rad/s")
    figure = plot_characterisation([characterise_log(log)])
    assert [axes.get_title() for axes in figure.axes] == ["x (moved?)", "y"]


def test_where_most_axes_moved_all_did():
    z = record(5000, 3)
    z[3000:3300, :2] += 0.5
    log = Log(np.arange(5000) / RATE, RATE, z, ["x", "y", "z"], "rad/s")
    found = characterise_log(log, second_opinion=False)
    assert found.moved == (True, True, True)
    assert "z: the other axes of this sensor moved, so it probably did too" in list(found.notes)


class TestDynamic:
    def test_the_map_has_the_right_colours_and_places(self):
        d = zr.noise.dynamic_allan(record(20_000)[:, 0], RATE, window=20.0, unit="rad/s")
        figure = plot_dynamic(d)
        axes, bar = figure.axes
        (mesh,) = axes.collections
        shown = convert(d.deviation.T, "rad/s", "deg/h")
        np.testing.assert_allclose(mesh.get_array().reshape(shown.shape), shown)
        low, high = axes.get_ylim()
        assert low < d.taus[0] < d.taus[-1] < high
        assert bar.get_ylabel() == "overlapping Allan deviation [deg/h]"
        assert axes.get_xlim() == (0.0, 200.0)
        assert "gaps" not in figure.texts[-1].get_text()
        check_layout(figure)

    @pytest.mark.parametrize("missing", [slice(0, 9000), slice(None)])
    def test_gaps_are_left_grey(self, missing):
        z = record(20_000)[:, 0]
        z[missing] = np.nan
        figure = zr.noise.dynamic_allan(z, RATE, window=20.0).plot()
        values = figure.axes[0].collections[0].get_array()
        assert np.ma.getmaskarray(values).any()
        assert "gaps" in figure.texts[-1].get_text()
        check_layout(figure)

    def test_one_window_and_constants(self):
        d = zr.noise.dynamic_allan(np.ones(1000), RATE, window=10.0)
        check_layout(plot_dynamic(d))
        check_layout(plot_dynamic(replace(d, taus=d.taus[:1], deviation=d.deviation[:, :1])))
