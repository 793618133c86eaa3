"""Units of time axes, and figures outside of matplotlib's global state."""

import itertools
import subprocess
import sys

import pytest

from support.figures import APART, SEEN_BY, distance
from zerorate.show import style
from zerorate.show.style import contrast, text_colour, time_unit


@pytest.mark.parametrize(("duration", "unit"), [(10, "s"), (600, "s"), (7200, "min"), (1e5, "h")])
def test_time_unit(duration, unit):
    assert time_unit(duration)[0] == unit


def test_contrast_is_that_of_wcag():
    assert contrast("#000000", "#FFFFFF") == pytest.approx(21.0)
    # The example of the standard's own "understanding" page: the least grey that passes on white.
    assert contrast("#767676", "#FFFFFF") == pytest.approx(4.54, abs=0.01)


@pytest.mark.parametrize("name", ["ORANGE", "SKY", "GREEN", "BLUE", "VERMILION", "PURPLE", "GREY"])
@pytest.mark.parametrize("ground", ["#FFFFFF", style.GREY, style.ROSE])
def test_text_is_readable_on_every_ground(name, ground):
    colour = text_colour(getattr(style, name))
    assert colour == getattr(style, f"{name}_TEXT")
    assert contrast(colour, ground) >= 4.5


@pytest.mark.parametrize("readers", SEEN_BY)
def test_the_axes_are_told_apart_without_red_or_green(readers):
    for one, other in itertools.combinations(style.AXIS_COLOURS, 2):
        assert distance(one, other, readers) > 1.5 * APART


def test_the_simulation_confuses_what_people_confuse():
    """Distances as published of the primaries; red and a dark green that a deuteranope mixes."""
    assert distance("#ff0000", "#00ff00") == pytest.approx(170.6, abs=0.1)
    assert distance("#a05a00", "#5c7a00", "everybody") > 40.0
    assert distance("#a05a00", "#5c7a00", "deuteranopes") < 15.0


def test_a_path_is_shortened_in_its_middle():
    name = style.shorten_source("/data/" + "a" * 40 + "b" * 40 + ".csv", 20)
    assert len(name) == 21
    assert name.startswith("aaaa")
    assert name.endswith(".csv")
    assert style.shorten_source("/data/imu.csv") == "imu.csv"


def test_pyplot_is_not_touched():
    code = (
        "import sys, numpy as np, zerorate as zr\n"
        "from zerorate.identification import identify\n"
        "from zerorate.tasks.replay import replay\n"
        "from zerorate.show import plot_replay\n"
        "z = np.random.default_rng(1).standard_normal(500)\n"
        "result = zr.allan(z, 10.0)\n"
        "models, found = result.fit(), identify(z, 10.0)\n"
        "log = zr.Log(np.arange(500) / 10, 10.0, z, ['x'])\n"
        "replayed = replay(log)\n"
        "assert 'matplotlib' not in sys.modules\n"
        "result.plot(models), found.plot(), plot_replay(replayed)\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
