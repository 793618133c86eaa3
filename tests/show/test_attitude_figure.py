"""Figures of an attitude: what they show, and no label over another."""

import runpy
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import zerorate as zr
from support.figures import check_colours, check_contrast, check_layout
from zerorate.geometry.rotations import product
from zerorate.show import save_figure
from zerorate.show.attitude_figure import heading_and_tilt_errors, signed_errors

EXAMPLE = runpy.run_path(
    str(Path(__file__).parents[2] / "examples" / "attitude_panels.py"), run_name="panels"
)
ASKED = {
    "usual": {},
    "offline": {"offline": True, "frame": "ned"},
    "six axes": {"mag": False},
    "named": {"method": "madgwick"},
}


@cache
def estimate(name, reference=True):
    recording = zr.simulate_motion("hand", duration=30.0, seed=2, magnet=[[15.0, 20.0]]).recording()
    logs = {k: v for k, v in recording.items() if reference or k != "reference"}
    return zr.estimate_attitude(zr.Recording(logs, "a.csv"), **ASKED[name])


@pytest.mark.every(3)
@pytest.mark.parametrize("name", ASKED)
@pytest.mark.parametrize("reference", [True, False])
def test_nothing_lies_over_another(name, reference):
    figure = estimate(name, reference).plot()
    check_layout(figure)
    check_contrast(figure)
    check_colours(figure)
    # A gradient knows neither deviations nor the gyro.
    told = len(figure.axes) - (1 + 2 * reference if name == "named" else 5)
    heads = [axes.get_title(loc="left") for axes in figure.axes]
    assert told == ("misalignment [%]" in heads) + ("events" in heads)
    assert ("events" in heads) == (ASKED[name].get("mag", True) and name != "named")
    assert figure.get_figwidth() * 25.4 == pytest.approx(85.0)


def test_the_error_of_inclination_has_two_signed_parts():
    """A turn about the vertical, then one about a level axis: the parts are those of the second."""
    vertical, level = np.array([np.cos(0.4), 0.0, 0.0, np.sin(0.4)]), 0.2 * np.array([0.6, -0.8])
    size = np.linalg.norm(level)
    tilted = np.array([np.cos(size / 2), *(np.sin(size / 2) * level / size), 0.0])
    turned = product(tilted, vertical)[np.newaxis]
    found = signed_errors(turned, np.array([[1.0, 0.0, 0.0, 0.0]]))
    np.testing.assert_allclose(found[0], [0.8, *level], rtol=1e-12)


def test_two_sigma_stand_on_both_sides():
    figure = estimate("usual").plot()
    for axes in figure.axes[1:3]:
        (low, high) = axes.get_ylim()
        assert low == -high
        band = axes.collections[-1 - len(axes.lines) + 1].get_paths()[0].vertices[:, 1]
        assert band.min() == pytest.approx(-band.max())


def test_the_study(tmp_path):
    curves = {"auto": estimate("six axes"), "none": estimate("six axes")}
    scales = np.array([-0.01, 0.0, 0.01])
    errors = {name: np.array([0.02, 0.01, 0.03]) for name in curves}
    magnet = {"auto": estimate("usual"), "madgwick": estimate("named")}
    figure = EXAMPLE["plot_attitude_study"](curves, magnet, np.eye(3), scales, errors)
    check_layout(figure)
    check_contrast(figure)
    check_colours(figure)
    assert [axes.get_ylabel() for axes in figure.axes] == [
        "heading error [deg]",
        "M - 1 [%]",
        "error [deg]",
        "heading error, RMS [deg]",
    ]
    save_figure(figure, tmp_path / "a.svg")


def test_errors_are_those_of_the_metrics():
    found = estimate("usual")
    heading, tilt = heading_and_tilt_errors(found.quaternion, found.reference)
    assert np.sqrt(np.mean(heading**2)) == pytest.approx(found.errors().heading, rel=1e-9)
    assert np.sqrt(np.mean(tilt**2)) == pytest.approx(found.errors().inclination, rel=1e-9)


def test_a_drift_begins_with_none():
    found = estimate("six axes")
    assert heading_and_tilt_errors(found.quaternion, found.reference, relative=True)[0][0] == 0.0
