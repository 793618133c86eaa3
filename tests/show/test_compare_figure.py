"""The figure of a comparison: what it answers, and which numbers stand in it."""

import math

import pytest

from zerorate.tasks.compare.comparison import Comparison
from zerorate.tasks.compare.measures import Row

NAMES = "total", "heading", "inclination", "time"


def row(method, total, source="a.csv", causal=True):
    values = dict(zip(NAMES, (math.radians(total), 0.1, 0.2, 1e-7), strict=True))
    return Row(source, "all", method, "rad", values, causal)


def compared(*rows):
    return Comparison("attitude", rows, ())


def texts(figure):
    return [text.get_text() for text in figure.texts]


def numbers(panel):
    return [text.get_text() for text in panel.texts]


def test_it_answers_with_the_best_and_with_what_later_samples_gain():
    found = compared(row("slow", 2.0), row("good", 1.0), row("whole", 0.5, causal=False))
    figure = found.plot()
    assert texts(figure)[:2] == [
        "Which filter estimates attitude best (nine axes)?",
        "good: 1.00 (total, deg); with later samples whole: 0.500",
    ]
    assert [text.get_weight() for text in figure.axes[0].texts] == ["normal", "bold", "normal"]
    labels = [one.get_text() for one in figure.axes[0].get_yticklabels()]
    assert labels == ["slow", "good", "whole‡"]


def test_numbers_are_means_of_all_recordings():
    rows = [row(name, total, source) for source in "ab" for name, total in (("x", 1), ("y", 3))]
    rows[2] = row("x", 2.0, "b")
    figure = compared(*rows).plot()
    assert numbers(figure.axes[0]) == ["1.50", "3.00"]
    assert "2 recordings" in texts(figure)


def test_at_most_three_panels_and_none_without_a_number():
    assert len(compared(row("x", 1.0)).plot().axes) == 3
    panels = compared(row("x", math.nan)).plot().axes
    assert [one.get_title(loc="left") for one in panels] == ["heading", "inclination", "ns"]
    nothing = Row("a.csv", "all", "x", "rad", {}, True)
    figure = compared(nothing).plot()
    assert (len(figure.axes), texts(figure)[1]) == (0, "no measure applies here")


def test_it_is_as_wide_as_a_column():
    width = compared(row("x", 1.0)).plot().get_figwidth()
    assert width * 25.4 == pytest.approx(85.0)
