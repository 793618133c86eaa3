"""`plot(ax=…)` draws the main panel of every result into axes of the caller."""

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from show.test_views import RESULTS


def ink(axes):
    """Return the numbers of the artists in an axes."""
    return [type(artist).__name__ for artist in axes.get_children()]


def empty():
    figure = Figure()
    return ink(figure.add_subplot())


@pytest.mark.every(2)
@pytest.mark.parametrize("name", RESULTS)
def test_the_main_panel_goes_into_given_axes(name):
    result = RESULTS[name]()
    figure = Figure(layout="constrained")
    left, right = figure.subplots(1, 2)
    assert result.plot(ax=right) is figure
    assert ink(left) == empty()
    assert len(ink(right)) > len(empty())
    assert set(figure.axes) == {left, right}
    figure.canvas.draw()


@pytest.mark.parametrize("name", ["Log", "Replay", "Identification", "AllanResult", "Track"])
def test_the_panel_shows_what_the_figure_shows(name):
    """Its curves are those of one panel of the figure, its letters as large as the caller's."""
    result = RESULTS[name]()
    axes = Figure().add_subplot()
    with mpl.rc_context({"font.size": 9.0}):
        result.plot(ax=axes)
    curves = [line.get_xydata() for line in axes.get_lines()]
    same = [
        panel
        for panel in result.plot().axes
        if len(panel.get_lines()) == len(curves)
        and all(
            np.array_equal(one.get_xydata(), other, equal_nan=True)
            for one, other in zip(panel.get_lines(), curves, strict=True)
        )
    ]
    assert curves
    assert same
    assert axes.get_xlabel()
    assert axes.xaxis.label.get_fontsize() == pytest.approx(9.0)


def test_several_axes_get_the_panels_that_follow():
    replay = RESULTS["Replay"]()
    axes = Figure().subplots(3)
    replay.plot(ax=axes)
    for one, name in zip(axes, "xyz", strict=True):
        assert f"gyro_{name}" in one.get_title(loc="left")


@pytest.mark.parametrize("count", [0, 5])
def test_axes_without_a_panel_are_refused(count):
    axes = list(Figure().subplots(1, 5))[:count]
    with pytest.raises(ValueError, match="ax must be 1 to 3 axes"):
        RESULTS["Replay"]().plot(ax=axes)


def test_a_dollar_sign_in_a_name_begins_no_formula():
    log = RESULTS["Log"]()
    axes = Figure().add_subplot()
    log.__class__(log.time, log.rate, log.data, ("a$\\b$", "b", "c"), log.unit).plot(ax=axes)
    axes.figure.canvas.draw()
