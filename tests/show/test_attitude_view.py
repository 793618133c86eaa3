"""The page of an attitude in 3D: it stands alone, and a browser draws what the estimate says."""

import json
import re
import subprocess
from html.parser import HTMLParser

import numpy as np
import pytest

import zerorate as zr
from support.browser import CHROMIUM
from zerorate.geometry.rotations import about_z, product
from zerorate.show.attitude_view import attitude_view


class Elements(HTMLParser):
    """Tags of a page by their ids."""

    def __init__(self):
        super().__init__()
        self.by_id = {}

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        if "id" in found:
            self.by_id[found["id"]] = (tag, found)


def data_of(page):
    return json.loads(re.search(r"^const VIEW = (.*);$", page, re.MULTILINE)[1])


@pytest.fixture(scope="module")
def hand():
    return zr.simulate_motion("hand", duration=45.0, seed=2, magnet=[[20.0, 30.0]]).recording()


@pytest.fixture(scope="module")
def estimate(hand):
    return zr.estimate_attitude(zr.Recording(hand, "</script><b>.csv"))


def test_it_stands_alone_and_takes_names_as_text(estimate):
    page = attitude_view(estimate)
    assert not re.search(r"(src|href)=\"(?!#|data:)|url\(|@import|https?://", page)
    assert page.count("</script>") == 1
    assert "&lt;" in page[: page.index("</title>")]
    elements = Elements()
    elements.feed(page)
    assert elements.by_id["scene"][0] == "canvas"
    assert len(elements.by_id["scene"][1]["aria-label"]) > 20
    assert elements.by_id["time"][1]["type"] == "range"
    used = set(re.findall(r"getElementById\(\"(\w+)\"\)", page))
    assert used <= set(elements.by_id)


def test_its_frames_are_those_of_the_estimate(estimate):
    data = data_of(attitude_view(estimate))
    rows = np.unique(np.linspace(0, estimate.n - 1, 3000).round().astype(int))
    # Five digits are written.
    np.testing.assert_allclose(data["time"], estimate.time[rows] - estimate.time[0], atol=1e-5)
    np.testing.assert_allclose(data["q"], estimate.quaternion[rows], atol=1e-5)
    np.testing.assert_allclose(data["euler"], np.degrees(estimate.euler[rows]), atol=1e-5)
    errors = np.array(data["error"])
    total = np.degrees(estimate.errors().total)
    assert np.sqrt((errors**2).mean()) == pytest.approx(total, rel=0.02)
    assert data["disturbed"].count("1") == estimate.disturbed[rows].sum() > 0


@pytest.mark.parametrize("frame", ["enu", "ned", "nwu"])
@pytest.mark.parametrize("heading", ["relative", "aligned"])
def test_headings_of_the_reference_are_compared_as_the_table_does(hand, frame, heading):
    turned = hand["reference"]
    turned = turned.with_data(product(about_z(1.0), turned.data))
    recording = zr.Recording({**hand, "reference": turned}, "turned")
    found = zr.estimate_attitude(
        recording, frame=frame, reference_frame="enu", mag=False, reference_heading=heading
    )
    errors = np.array(data_of(attitude_view(found))["error"])
    total = np.degrees(found.errors().total)
    assert np.sqrt((errors**2).mean()) == pytest.approx(total, rel=0.02)


def test_without_a_reference_there_is_no_error_and_no_north_without_a_magnetometer(hand):
    logs = {name: log for name, log in hand.items() if name in ("gyro", "accel")}
    page = attitude_view(zr.estimate_attitude(zr.Recording(logs, "six.csv")))
    data = data_of(page)
    assert "error" not in data
    assert not data["mag"]
    assert "the heading at the start" in page


def test_the_command_writes_it(hand, tmp_path):
    (_, page, *_) = zr.estimate_attitude(hand).save(tmp_path, view=True, figure=False)
    assert page.suffix == ".html"
    assert page.read_text(encoding="utf-8") == attitude_view(zr.estimate_attitude(hand))


@pytest.mark.skipif(CHROMIUM is None, reason="no chromium")
@pytest.mark.parametrize("width", [400, 1280])
def test_a_browser_shows_the_frame_of_a_time_and_nothing_overflows(estimate, tmp_path, width):
    page = tmp_path / "view.html"
    probe = (
        "<script>addEventListener('load', function () { document.body.dataset.wide ="
        " document.documentElement.scrollWidth; var c = document.getElementById('scene');"
        " document.body.dataset.ink = c.getContext('2d').getImageData(0, 0, c.width, c.height)"
        ".data.some(Boolean); });</script></body>"
    )
    page.write_text(attitude_view(estimate).replace("</body>", probe), encoding="utf-8")
    shown = subprocess.run(
        [
            CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", f"--window-size={width},900",
            f"--user-data-dir={tmp_path / 'profile'}", "--virtual-time-budget=3000", "--dump-dom",
            f"{page.as_uri()}#t=25",
        ],
        capture_output=True, text=True, timeout=120, check=True,
    ).stdout  # fmt: skip
    data = data_of(page.read_text(encoding="utf-8"))
    frame = int(re.search(r'data-frame="(\d+)"', shown)[1])
    assert data["time"][frame] >= 25.0 > data["time"][frame - 1]
    assert f"{data['error'][frame]:.1f}°" in shown
    # Browsers have a least width of their window, of 500 px at most.
    assert int(re.search(r'data-wide="(\d+)"', shown)[1]) <= max(width, 500)
    assert 'data-ink="true"' in shown
