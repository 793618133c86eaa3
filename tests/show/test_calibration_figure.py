"""Figures of a calibration: what they show, and no label over another."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from support.calibrations import COUNTS, INVALID, calibration
from support.figures import check_contrast, check_layout
from zerorate import Log, Recording
from zerorate.show import plot_calibration, save_figure
from zerorate.show.calibration_panels import _project, _raw_norm_errors

UNKNOWN = np.ones(33, dtype=bool)
UNKNOWN[[12, 13, 7]] = False
MADE = {
    "usual": calibration(rests=12),
    "bare": calibration(),
    "invalid": replace(calibration(rests=3, **INVALID), identifiable=UNKNOWN),
    "counts": calibration(units=COUNTS, scales=(1670.0, 7509.0), rests=6),
    "many": calibration(rests=120),
}


def recording(made):
    """Raw samples of rests alone; nothing is known between them."""
    n = made.rests[-1].last + 100
    data = np.full((n, 3), np.nan)
    for rest in made.rests:
        data[rest.first : rest.last] = rest.accel
    time, names = np.arange(n) / made.rate, ["x", "y", "z"]
    gyro = Log(time, made.rate, 0.0 * np.nan_to_num(data), names, made.gyro_units[0])
    return Recording(
        {"accel": Log(time, made.rate, data, names, made.accel_units[0]), "gyro": gyro}
    )


@cache
def drawn(name, with_log=False):
    made = MADE[name]
    return made.plot(recording(made) if with_log else None)


@pytest.mark.every(3)
@pytest.mark.parametrize(
    ("name", "with_log"), [*((name, False) for name in MADE), ("usual", True), ("many", True)]
)
def test_nothing_lies_over_another(name, with_log):
    figure = drawn(name, with_log)
    check_layout(figure)
    check_contrast(figure)
    assert len(figure.axes) == (6 if with_log else 5)
    assert figure.get_figwidth() * 25.4 == pytest.approx(85.0)


def test_everything_has_the_gyro_too():
    figure = plot_calibration(MADE["usual"], recording(MADE["usual"]), everything=True)
    check_layout(figure)
    heads = [axes.get_title(loc="left") for axes in figure.axes[:2]]
    assert heads == ["raw [g]", "raw [deg/s]"]
    assert [axes.get_xlabel() for axes in figure.axes[:2]] == ["", "time [s]"]


def panel(figure, title):
    return next(axes for axes in figure.axes if title in axes.get_title(loc="left"))


def test_the_verdict_stands_above_all():
    for name, said in (("usual", "is valid"), ("invalid", "is not valid: the scale of the gyro")):
        answer = " ".join(drawn(name).texts[1].get_text().split())
        assert answer.startswith(f"The calibration {said}")


def test_norms_before_and_after():
    made = MADE["usual"]
    lines = panel(drawn("usual"), "gravity at rest").lines
    used = [rest.used for rest in made.rests]
    after = np.array([abs(1e3 * rest.norm_error) for rest in made.rests])
    before = [abs(np.linalg.norm(rest.accel) * 9.80665 / made.gravity - 1) for rest in made.rests]
    np.testing.assert_allclose(lines[2].get_ydata(), after[used])
    np.testing.assert_allclose(lines[0].get_ydata(), 1e3 * np.array(before)[used])
    assert lines[3].get_markerfacecolor() == "none"


def test_carry_errors_before_and_after():
    made = MADE["usual"]
    lines = panel(drawn("usual"), "error after a rotation").lines
    used = [turn for turn in made.turns if turn.used]
    np.testing.assert_allclose(lines[2].get_ydata(), np.degrees([t.residual for t in used]))
    np.testing.assert_allclose(lines[0].get_ydata(), np.degrees([t.residual_raw for t in used]))


def test_counts_have_norms_in_gravities():
    assert np.abs(_raw_norm_errors(MADE["counts"])).max() < 0.1


def test_the_projection_keeps_areas():
    """Lambert: a cap of height h has the area of a disc of radius sqrt(2 h)."""
    angle = np.linspace(0.0, np.pi / 2, 9)
    up = np.stack((np.sin(angle), 0 * angle, np.cos(angle)), axis=1)
    x, y = _project(up, 1.0)
    np.testing.assert_allclose(x**2 + y**2, 2.0 * (1.0 - np.cos(angle)), atol=1e-15)


def shaded(figure):
    """Return the part of each half sphere's square that is shaded."""
    return [1.0 - np.ma.getmaskarray(image.get_array()).mean() for image in figure.axes[0].images]


def test_gaps_are_where_no_pose_is():
    assert shaded(drawn("many")) == [0.0, 0.0]
    # A disc in its square: pi / 4.
    np.testing.assert_allclose(shaded(drawn("bare")), np.pi / 4, atol=0.01)


def test_the_rests_stand_behind_the_log():
    figure = drawn("usual", True)
    shaded = [one for one in figure.axes[0].collections if one.get_zorder() == 0.5]
    assert sum(len(one.get_paths()) for one in shaded) == len(MADE["usual"].rests)
    assert figure.axes[0].get_title(loc="left") == "raw [g]"
    assert figure.axes[0].get_xlabel() == "time [s]"


def test_a_file(tmp_path):
    save_figure(plot_calibration(MADE["bare"]), tmp_path / "a.svg")
    assert (tmp_path / "a.svg").stat().st_size > 1000


def test_the_peaks_of_turns_that_were_used_are_not_cut():
    """Ten samples of a thousand, and beside them motion that is no part of the calibration."""
    made = replace(calibration(rests=2), turns=calibration(rests=2).turns)
    data = np.zeros((3000, 3))
    turn = made.turns[0]
    data[turn.first : turn.first + 10, 1] = 150.0
    data[2000:] = 2000.0
    log = Log(np.arange(3000) / 100.0, 100.0, data, ["x", "y", "z"], "deg/s")
    figure = plot_calibration(made, Recording({"gyro": log}), everything=True)
    low, high = figure.axes[0].get_ylim()
    assert low < 0.0
    assert 150.0 < high < 250.0
