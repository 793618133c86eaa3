"""The page of a report: it stands alone, its anchors land, and a browser has nothing to say."""

import json
import re
import subprocess
from html import unescape
from html.parser import HTMLParser

import numpy as np
import pytest

import zerorate as zr
from support.browser import CHROMIUM


class Links(HTMLParser):
    """Anchors of a page, what refers to them, and elements that want text beside."""

    def __init__(self):
        super().__init__()
        self.anchors, self.links, self.drawings = [], [], []

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.anchors += [found["id"]] if "id" in found else []
        self.links += [found["href"]] if tag == "a" else []
        self.drawings += [found] if tag == "svg" else []


@pytest.fixture(scope="module")
def page():
    recording = zr.simulate_motion("hand", duration=60.0).recording()
    gyro = recording.gyro.with_data(recording.gyro.data.clip(-1.0, 1.0))
    nasty = zr.Recording({**recording, "gyro": gyro}, "<script>alert(1)</script>.csv")
    return zr.report(nasty).to_html()


def test_every_anchor_lands_and_every_figure_has_a_text(page):
    links = Links()
    links.feed(page)
    assert len(set(links.anchors)) == len(links.anchors)
    assert {one for one in links.links if one[0] != "#"} == set()
    assert {one[1:] for one in links.links} <= set(links.anchors)
    assert {one["role"] for one in links.drawings} == {"img"}
    assert all(len(one["aria-label"]) > 20 for one in links.drawings)


def test_both_axes_have_ticks_and_limits_are_folded_at_the_end(page):
    figures = re.findall(r"<figure id.*?</figure>", page, re.DOTALL)
    for figure in figures:
        for axis in ("rows", "columns"):
            (text,) = re.findall(f'<div class="{axis}">(.*?)</div>', figure, re.DOTALL)
            ticks = [float(tick) for tick in re.findall(r">([-\d.e]+)</span>", text)]
            assert 3 <= len(ticks) <= 8
            assert np.diff(ticks) == pytest.approx(ticks[1] - ticks[0])
    limits = page[page.index('<section id="limits">') :]
    assert limits.index("<details>") < limits.index("<table>")
    assert "own: 0.1 deg/s is 6 deg of heading in a minute" in limits


def test_a_finding_of_the_whole_log_does_not_paint_the_picture():
    n = 6000
    table = {"time_s": np.arange(n) / 100.0}
    random = np.random.default_rng(1)
    for i, axis in enumerate("xyz"):
        table[f"gyro_{axis}_dps"] = 6.0 * (i == 0) + 0.05 * random.standard_normal(n)
        table[f"accel_{axis}_mps2"] = 9.81 * (i == 2) + 0.02 * random.standard_normal(n)
    found = zr.report(zr.read_recording(table))
    (one,) = [one for one in found.findings if one.kind == "gyro bias"]
    assert one.spans[0][1] - one.spans[0][0] > 55.0
    assert 'rect class="act"' not in found.to_html()
    assert 'rect class="look"' not in found.to_html()


def test_it_stands_alone_and_takes_names_as_text(page):
    assert not re.search(r"(src|href)=\"(?!#|data:)|url\(|@import|https?://", page)
    assert "<script>alert" not in page
    assert "act</b> gyro was at its limit" in page
    assert "act</b> gyro: share of samples at the limit of the sensor" in page
    assert len(page) < 3e6


def test_a_long_log_makes_no_long_page():
    n = 300_000
    table = {
        "time_s": np.arange(n) / 100.0,
        "gyro_dps": np.random.default_rng(1).normal(size=(n, 3)),
    }
    assert len(zr.report(zr.read_recording(table)).to_html()) < 1e5


TRIED = """
<script>
(function () {
  "use strict";
  var told = { missed: [], steps: {}, loaded: [] };
  var view = function () { return document.querySelector("svg.plot").getAttribute("viewBox"); };
  document.querySelectorAll("a").forEach(function (link) {
    link.click();
    var target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    var place = target && target.getBoundingClientRect();
    if (link.hash !== location.hash || !target || place.height === 0 || place.top > innerHeight) {
      told.missed.push(link.getAttribute("href"));
    }
  });
  document.querySelector('button[data-step="all"]').click();
  told.whole = view();
  document.querySelector("a[data-from]").click();
  told.span = view();
  ["all", "closer", "left", "right", "wider", "all"].forEach(function (step) {
    document.querySelector('button[data-step="' + step + '"]').click();
    told.steps[step] = view();
  });
  told.views = new Set(Array.from(document.querySelectorAll("svg.plot"), function (one) {
    return one.getAttribute("viewBox");
  })).size;
  told.bar = !document.querySelector(".bar").hidden;
  told.loaded = performance.getEntriesByType("resource").map(function (one) { return one.name; });
  document.body.dataset.told = JSON.stringify(told);
}());
</script>
"""
"""Follows each link, presses each button, and writes down what then is."""


def browsed(file, folder):
    """Return what a browser says of a page, and the page as it then is."""
    command = (
        CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr",
        f"--user-data-dir={folder / 'profile'}", "--dump-dom", file.as_uri(),
    )  # fmt: skip
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium")
@pytest.mark.parametrize("kind", ["report", "before and after"])
def test_in_a_browser_links_land_figures_zoom_and_nothing_is_loaded(page, tmp_path, kind):
    if kind != "report":
        motions = [zr.simulate_motion("hand", duration=30.0, seed=k) for k in (1, 2)]
        reports = [zr.report(one.recording()) for one in motions]
        page = zr.findings.before_after(*reports).to_html()
    file = tmp_path / "report.html"
    file.write_text(page.replace("</body>", f"{TRIED}</body>"), encoding="utf-8")
    run = browsed(file, tmp_path)
    assert "CONSOLE" not in run.stderr
    told = json.loads(unescape(re.search(r'data-told="([^"]*)"', run.stdout).group(1)))
    assert (told["missed"], told["loaded"]) == ([], [])
    assert (told["bar"], told["views"]) == (True, 1)
    assert told["whole"] == told["steps"]["all"] == "0 0 1000 200"
    assert told["span"] != told["whole"]
    # Half of it, from its middle; a quarter of that earlier, and back; then all again.
    steps = {name: [float(n) for n in view.split()] for name, view in told["steps"].items()}
    assert steps["closer"] == pytest.approx([250.0, 0.0, 500.0, 200.0])
    assert steps["left"] == pytest.approx([125.0, 0.0, 500.0, 200.0])
    assert steps["right"] == pytest.approx(steps["closer"])
    assert steps["wider"] == pytest.approx([0.0, 0.0, 1000.0, 200.0])


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium")
def test_what_a_page_may_not_load_a_browser_tells(page, tmp_path):
    """Else the test above would see nothing of it."""
    file = tmp_path / "report.html"
    picture = '<img src="https://example.org/one.png">'
    file.write_text(page.replace("</body>", f"{picture}</body>"), encoding="utf-8")
    assert "CONSOLE" in browsed(file, tmp_path).stderr


def test_findings_of_one_kind_on_many_sensors_are_one_line():
    n = 3000
    random = np.random.default_rng(1)
    table = {"time_s": np.arange(n) / 100.0}
    for k in range(1, 9):
        for axis in "xyz":
            table[f"imu{k}_gyro_{axis}_dps"] = 0.05 * random.standard_normal(n)
            rest = 9.80665 * (axis == "z") + (k == 8) * 0.5
            table[f"imu{k}_accel_{axis}_mps2"] = rest + 0.02 * random.standard_normal(n)
    text = zr.report(zr.read_recording(table)).to_html()
    assert re.search(
        r"<summary><b class=\"good\">good</b> gyro bias: 8 similar, [\d.]+ to [\d.]+ deg/s", text
    )
    assert "</b> gravity: 7 similar, " in text
    # First of all, and in its section.
    assert len(re.findall(r'<li class="act">[^\n]*imu8 accel[^\n]*9\.807', text)) == 2


def test_contrast_of_the_words_is_enough(page):
    from zerorate.show.style import contrast

    style = page[page.index("<style>") : page.index("</style>")]
    light, dark = style.split("@media (prefers-color-scheme: dark)")[:2]
    for part in (light, dark):
        known = dict(re.findall(r"--(\w+): (#\w{6})", part))
        for name in ("ink", "faint", "link", "act", "look", "good"):
            assert contrast(known[name], known["paper"]) >= 4.5, name


def test_text_and_figure_of_a_report_say_what_is_urgent():
    recording = zr.simulate_motion("hand", duration=60.0).recording()
    gyro = recording.gyro.with_data(recording.gyro.data.clip(-1.0, 1.0))
    found = zr.report(zr.Recording({**recording, "gyro": gyro}))
    assert "act: gyro: share of samples at the limit of the sensor's range" in found.table()
    assert found.plot().axes[0].get_yticklabels()[-1].get_text() == "act: at its limit"
