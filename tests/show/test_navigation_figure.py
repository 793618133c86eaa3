"""Figures and tables of a track: what they show, and no label over another."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import zerorate as zr
from support.figures import check_colours, check_contrast, check_layout
from zerorate.show import (
    WIDTH,
    format_outages,
    format_track,
    plot_outages,
    plot_track,
    save_figure,
)

DRIVE = zr.simulate_drive(50.0, 160.0, seed=7)


def filter_(heading="course", **options):
    start = zr.align(DRIVE.recording(), latitude=48.0, heading=heading, span=(0.0, 25.0))
    return zr.NavigationFilter(start, **options)


@cache
def track(smoothed=False):
    found = filter_().process(DRIVE.recording(), DRIVE.fixes)
    return found.smooth() if smoothed else found


@cache
def outages(smooth=True, **options):
    imu = DRIVE.recording()
    nav = filter_(**options)
    return zr.navigation.outages(imu, DRIVE.fixes, seconds=(10, 20), nav=nav, smooth=smooth)


@pytest.mark.parametrize("smoothed", [False, True])
@pytest.mark.parametrize("marked", [False, True])
def test_nothing_lies_over_another(smoothed, marked):
    figure = track(smoothed).plot(outages() if marked else None)
    check_layout(figure)
    check_contrast(figure)
    check_colours(figure)
    assert len(figure.axes) == 6
    assert figure.get_figwidth() * 25.4 == pytest.approx(85.0)
    labels = [line.get_label() for line in figure.axes[0].lines]
    assert ("outages of 20 s" in labels) == marked


def test_innovations_are_asked_for_or_given():
    figure = plot_track(track(), everything=True)
    check_layout(figure)
    assert len(figure.axes) == 7
    # Of a smoothed track they are not known.
    assert len(plot_track(track(smoothed=True), everything=True).axes) == 6
    given = plot_track(track(smoothed=True), nis=track().nis(), everything=True)
    assert len(given.axes) == 7


def test_one_time_axis():
    figure = plot_track(track(), everything=True)
    assert len({axes.get_xlim() for axes in figure.axes[1:]}) == 1
    assert [axes.get_xlabel() for axes in figure.axes] == ["east [m]", *[""] * 5, "time [s]"]


def test_a_track_that_did_not_begin():
    nothing = filter_(heading=None).process(DRIVE.recording(), DRIVE.fixes)
    figure = nothing.plot()
    check_layout(figure)
    assert figure.axes[0].texts[0].get_text() == "the filter did not start"
    assert "At the end" not in nothing.table()
    assert "no heading" in nothing.table()


def test_the_path_is_to_scale(tmp_path):
    figure = track().plot()
    save_figure(figure, tmp_path / "a.svg")
    axes = figure.axes[0]
    box = axes.get_position()
    width, height = figure.get_size_inches()
    east, north = (np.ptp(lim) for lim in (axes.get_xlim(), axes.get_ylim()))
    ratio = east / (box.width * width) / (north / (box.height * height))
    assert ratio == pytest.approx(1.0)


def test_the_growth_of_errors():
    wheels = outages(smooth=False, vehicle="wheeled")
    figure = plot_outages(outages(), {"with wheels": wheels}, seconds=10.0)
    check_layout(figure)
    check_contrast(figure)
    check_colours(figure)
    curves = {line.get_label(): line for line in figure.axes[0].lines}
    assert [*curves] == ["position held", "velocity held", "filter", "smoothed", "with wheels"]
    one = outages()[10.0]
    since, rms = curves["filter"].get_data()
    assert since[-1] == 10.0
    assert rms[-1] == pytest.approx(one.rms())
    with pytest.raises(KeyError):
        plot_outages(outages(), seconds=15.0)


def test_fixes_at_any_time_have_a_growth_too():
    one = outages()[10.0]
    random = np.random.default_rng(1)
    shaken = replace(one, time=one.time + random.uniform(-0.4, 0.0, one.time.size))
    figure = plot_outages(replace(outages(), lengths=(shaken,)))
    assert all(np.isfinite(line.get_ydata()).all() for line in figure.axes[1].lines)


def test_tables():
    nis = track().nis()
    text = format_track(track(), nis=nis)
    assert "NIS of velocity, median" in text
    assert "NIS" not in track().table()
    assert f"  {track().fix_count['used']}\n  rejected" in text
    assert "smoothed" in format_track(track(smoothed=True)).splitlines()[0]
    for lines in (text, format_outages(outages())):
        assert max(map(len, lines.splitlines())) <= WIDTH
    rows = format_outages(outages()).splitlines()
    assert rows[1].split() == ["outage", "n", "rms", "median", "largest", "over", "σ"]
    assert rows[4].split()[-1] == f"{outages()[10.0].error_over_sigma():.2f}"
    assert rows[2].split()[:5] == ["10", "s", "position", "held", str(outages()[10.0].n)]
    assert len(rows) == 2 + 2 * 4 + 1
