"""The table of the evidence page: a drive with standing at both ends, twenty receivers."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from support.recordings import RECORDINGS, needs_recordings

STUDY = Path(__file__).parents[2] / "examples" / "position_study.py"


def run(*arguments):
    return subprocess.run(
        [sys.executable, STUDY, *map(os.fspath, arguments)],
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, "PYTHONIOENCODING": "utf-8"},
        encoding="utf-8",
    )


@pytest.fixture(scope="module")
def table():
    """Error at rest, path drawn at rest and error under way, by the name of the filter."""
    done = run(RECORDINGS, "--markdown")
    assert done.returncode == 0, done.stderr
    rows = [line.strip("| ").split(" | ") for line in done.stdout.splitlines()[4:] if line]
    return {name.strip(): tuple(map(float, numbers)) for name, *numbers in rows}


@needs_recordings
def test_aided_keeps_to_what_was_asked(table):
    """Errors of 2.95 and 2.93 m within five per cent; at most 8.2 m of path a minute."""
    rest, drawn, moving = table["aided"]
    assert rest == pytest.approx(2.95, rel=0.05)
    assert moving == pytest.approx(2.93, rel=0.05)
    assert drawn < 8.2


@needs_recordings
def test_every_aid_is_worth_something(table):
    drawn = {name: numbers[1] for name, numbers in table.items()}
    aided = drawn["aided"]
    assert aided < 0.7 * drawn["aided, without rest"]
    assert aided < 0.7 * drawn["aided, without strength"]
    assert drawn["aided by nothing"] == pytest.approx(drawn["raw"], rel=0.01)


@needs_recordings
def test_no_method_of_papers_is_as_good(table):
    papers = [name for name in table if not name.startswith("aided")]
    assert len(papers) == 7
    for name in papers:
        assert all(got > 1.2 * best for got, best in zip(table[name], table["aided"], strict=True))
    # The mean of ten fixes is some 40 m late on a road.
    assert table["moving average of 10"][2] > 40.0


def test_it_says_in_one_line_that_the_drive_is_absent(tmp_path):
    done = run(tmp_path)
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1
    assert str(tmp_path) in done.stderr
