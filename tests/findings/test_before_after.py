"""Two reports side by side: what became of each finding, and the page of both."""

import json
import re
from functools import cache

import numpy as np
import pytest

import zerorate as zr
from zerorate.findings import before_after

N, RATE = 3000, 100.0


@cache
def log(bias=0.1, seed=1, repeated=False):
    random = np.random.default_rng(seed)
    table = {"time_s": np.arange(N) / RATE}
    for i, axis in enumerate("xyz"):
        table[f"gyro_{axis}_dps"] = bias * (i == 0) + 0.05 * random.standard_normal(N)
        table[f"accel_{axis}_mps2"] = 9.80665 * (i == 2) + 0.02 * random.standard_normal(N)
    if repeated:
        table["time_s"][500] = table["time_s"][499]
    return zr.report(zr.read_recording(table))


@pytest.mark.parametrize(
    ("before", "after", "kind", "verdict"),
    [
        ({}, {"bias": 6.0}, "gyro bias", "worse"),
        ({"bias": 6.0}, {}, "gyro bias", "better"),
        ({}, {"bias": 0.3}, "gyro bias", "differs"),
        ({}, {"seed": 2}, "gyro bias", "unchanged"),
        ({}, {"repeated": True}, "repeated stamps", "new"),
        ({"repeated": True}, {}, "repeated stamps", "gone"),
    ],
)
def test_a_change_has_its_verdict(before, after, kind, verdict):
    found = before_after(log(**before), log(**after))
    (one, *_) = [one for one in found.changes if one.finding.kind == kind]
    assert one.verdict == verdict
    if verdict == "worse":
        assert found.changes[0] is one
        value, sigma = one.difference
        assert abs(value - 5.9) < 4.0 * sigma


def test_the_page_has_both_logs_and_every_anchor_lands():
    found = before_after(log(), log(bias=6.0))
    page = found.to_html()
    anchors = re.findall(r'id="([^"]*)"', page)
    assert len(set(anchors)) == len(anchors)
    assert set(re.findall(r'href="#([^"]*)"', page)) <= set(anchors)
    assert {"before-figure-gyro", "after-figure-gyro"} <= set(anchors)
    assert not re.search(r"https?://|url\(|@import", page)
    content = json.loads(found.to_json())
    assert content["changes"][0]["verdict"] == "worse"
    assert "worse: gyro shows" in found.table()
    assert found.plot().axes[0].get_yticklabels()


def test_only_reports_are_compared():
    with pytest.raises(TypeError, match="expected a Report"):
        before_after(log(), 3)


@pytest.mark.parametrize(("count", "message"), [(1, "1 differs."), (2, "2 differ.")])
def test_one_differs_and_several_differ(count, message):
    found = before_after(log(0.1), log(0.3))
    one = next(change for change in found.changes if change.verdict == "differs")
    vars(found)["changes"] = (one,) * count
    assert found.summary == message
