"""Progress of long work: as it is asked for, by a bar in a notebook, or not at all."""

import sys
from types import ModuleType, SimpleNamespace

import pytest

import zerorate as zr
from zerorate import progress


class Shown:
    """What a notebook shows, in the order of time."""

    def __init__(self):
        self.texts = []

    def update(self, text):
        self.texts.append(text)


@pytest.fixture
def notebook(monkeypatch):
    """Return what is shown in a kernel, which here is none."""
    shown = Shown()

    def display(text, display_id):
        assert display_id
        shown.update(text)
        return shown

    ipython, parts = ModuleType("IPython"), ModuleType("IPython.display")
    ipython.get_ipython = lambda: SimpleNamespace(kernel=object())
    parts.HTML, parts.display = str, display
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    monkeypatch.setitem(sys.modules, "IPython.display", parts)
    clock = iter(range(1000))
    monkeypatch.setattr(progress, "monotonic", lambda: float(next(clock)))
    return shown


def test_a_bar_is_shown_and_taken_away(notebook):
    report = progress.choose_reporter(None)
    report("filtering", 0.25)
    report("measuring <all>", 1.0)
    assert 'value="0.250"' in notebook.texts[0]
    assert notebook.texts[0].endswith("filtering 25 %")
    assert notebook.texts[1].endswith("measuring &lt;all&gt; 100 %")
    del report
    assert notebook.texts[-1] == ""


def test_short_work_shows_none(notebook, monkeypatch):
    monkeypatch.setattr(progress, "monotonic", lambda: 0.0)
    progress.choose_reporter(None)("filtering", 1.0)
    assert notebook.texts == []


def test_things_are_counted(notebook):
    progress.choose_counter(None)(3, 12)
    assert notebook.texts[0].endswith("3 of 12 25 %")


def test_what_is_asked_for_is_used(notebook):
    seen = []
    progress.choose_reporter(lambda *said: seen.append(said))("step", 0.5)
    progress.choose_counter(lambda *said: seen.append(said))(1, 2)
    assert seen == [("step", 0.5), (1, 2)]
    assert notebook.texts == []


@pytest.mark.parametrize("shell", [None, SimpleNamespace()])
def test_outside_of_a_notebook_nothing_is_shown(notebook, monkeypatch, shell):
    sys.modules["IPython"].get_ipython = lambda: shell
    assert progress.choose_reporter(None) is progress.report_nothing
    monkeypatch.delitem(sys.modules, "IPython")
    assert progress.choose_reporter(None) is progress.report_nothing


def test_long_work_of_the_package_is_shown(notebook):
    imu = zr.simulate_motion("hand", 50.0, 10.0, seed=1).recording()
    zr.estimate_attitude(imu)
    assert any("<progress" in text for text in notebook.texts)
    assert notebook.texts[-1] == ""
