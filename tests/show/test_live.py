"""A stream that is watched: in a terminal, and on a page in a browser."""

import http.client
import io
import json
import math
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

import zerorate as zr
from support.browser import CHROMIUM, Browser
from zerorate.show.live_page import LivePage
from zerorate.show.live_terminal import LiveTerminal, format_bars
from zerorate.tasks.live import AttitudeSettings, LineStream, Settings
from zerorate.tasks.live.view import View, Watcher

PIXELS = """(function () {{
  var c = document.getElementById("{}"), d = c.getContext("2d");
  var bytes = d.getImageData(0, 0, c.width, c.height).data;
  return bytes.reduce((n, x, i) => n + (i % 4 == 3 && x > 0), 0);
}})()"""
"""How many pixels of a canvas are drawn on."""
STATE = "document.getElementById('state').textContent"
VIEW = View(
    seconds=12.5,
    names=("gx", "gy", "gz"),
    unit="deg/s",
    rate=(0.25, math.nan, -3.0),
    bias=(0.5, -0.125, 0.0),
    bias_sigma=(0.01, 0.02, 0.03),
    status="at rest",
    quaternion=(1.0, 0.0, 0.0, 0.0),
    euler_deg=(1.0, -2.0, 90.0),
)


def drift():
    stream = LineStream(Settings(rate=100.0, unit="deg/s"))
    assert stream.view() is None
    stream.take("t,gx,gy")
    assert stream.view() is None
    return stream


def test_a_view_of_a_drift_filter_is_what_the_filter_says():
    stream, z = drift(), 0.5 + 0.1 * np.random.default_rng(1).standard_normal((500, 2))
    answers = [stream.take(f"0.0,{a},{b}") for a, b in z.tolist()]
    view = stream.view()
    gyro = zr.DriftFilter(100.0, channels=2, rest_limit=10.0, bias_limit=20.0)
    gyro.process(z)
    assert (view.seconds, view.names, view.unit) == (5.0, ("gx", "gy"), "deg/s")
    assert view.rate == tuple(float(cell) for cell in answers[-1].split(",")[1:])
    assert view.bias == tuple(gyro.bias)
    assert view.bias_sigma == tuple(gyro.bias_sigma)
    assert view.status == gyro.status[0]
    assert view.quaternion is None


def test_a_missing_sample_has_no_rate():
    stream = drift()
    stream.take("0.0,,0.5")
    assert math.isnan(stream.view().rate[0])
    assert stream.view().to_json()["rate"] == [None, 0.5]  # no bias is known yet


@pytest.mark.parametrize("frame", ["enu", "nwu", "ned"])
def test_a_view_of_an_attitude_has_up_as_its_third_axis(frame):
    settings = AttitudeSettings(100.0, frame, gyro_unit="rad/s", accel_unit="g", mag=False)
    stream = LineStream(settings)
    # On its side: what was x of the sensor points up.
    for _ in range(200):
        stream.take("0,0,0,1,0,0")
    view = stream.view()
    w, x, y, z = view.quaternion
    up = 2 * (x * z - w * y)  # of the sensor's x axis
    assert up == pytest.approx(1.0, abs=1e-3)
    assert view.euler_deg == pytest.approx(np.degrees(stream._engine._filter.euler))


def test_a_watcher_looks_now_and_then(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("zerorate.tasks.live.view.monotonic", lambda: now[0])
    seen = []
    stream, watcher = drift(), Watcher(seen.append)
    watcher.after_answer(stream)
    assert seen == []
    for _ in range(100):
        stream.take("0.0,0.5,0.5")
        watcher.after_answer(stream)
        now[0] += 0.01
    assert 18 <= len(seen) <= 22


def test_what_a_terminal_shows():
    text = io.StringIO()
    console = Console(file=text, force_terminal=True, width=100, color_system=None)
    with LiveTerminal(console) as terminal:
        terminal.put(VIEW)
        terminal.put(replace(VIEW, seconds=13.0, rate=(0.5, 1.0, -2.0)))
    last = text.getvalue().split("13.0 s")[-1]
    assert "at rest" in last
    assert "rate, deg/s" in last
    for told in ("+0.5", "-0.125", "+0.03", "▁█", "roll     1.0°", "yaw    90.0°"):
        assert told in last
    assert " ▁ " in last  # of gy there is one sample


def test_bars():
    assert format_bars([0, 7, math.nan, 3.5]) == "▁█ ▅"
    assert format_bars([2.0, 2.0]) == "▁▁"
    assert format_bars([math.nan]) == " "


def asked(page, path, host=None):
    """Return the status, the headers and the connection's answer."""
    place = page.address.removeprefix("http://").rstrip("/")
    connection = http.client.HTTPConnection(place, timeout=20)
    connection.request("GET", path, headers={"Host": host or place})
    return connection, connection.getresponse()


def test_the_page_is_whole_and_asks_nothing_of_others():
    with LivePage(0) as page:
        for path, kind in (
            ("/", "html"),
            ("/live_page.css", "css"),
            ("/live_page.js", "javascript"),
        ):
            connection, answer = asked(page, path)
            body = answer.read().decode()
            assert answer.status == 200
            assert kind in answer.headers["Content-Type"]
            assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
            assert "http:" not in body
            assert "https:" not in body
            connection.close()


def test_the_page_is_for_this_machine_alone():
    with LivePage(0) as page:
        assert page.address.startswith("http://127.0.0.1:")
        for path, host, status in (("/../pyproject.toml", None, 404), ("/", "evil.example", 403)):
            connection, answer = asked(page, path, host)
            assert answer.status == status
            connection.close()


def test_a_page_gets_what_was_what_comes_and_the_end():
    page = LivePage(0)
    with page:
        page.put(VIEW)
        connection, answer = asked(page, "/events")
        assert answer.headers["Content-Type"] == "text/event-stream"
        first = json.loads(answer.readline().decode().removeprefix("data: "))
        assert (first["seconds"], first["rate"]) == (12.5, [0.25, None, -3.0])
        answer.readline()
        page.put(replace(VIEW, seconds=13.0))
        assert json.loads(answer.readline().decode().removeprefix("data: "))["seconds"] == 13.0
    assert answer.read().endswith(b"event: end\ndata: \n\n")
    connection.close()


def test_a_page_that_does_not_read_holds_nobody_up():
    with LivePage(0) as page:
        events = page.events()
        page.put(VIEW)
        next(events)
        for k in range(2000):
            page.put(replace(VIEW, seconds=float(k)))
        # It lost the oldest.
        assert json.loads(next(events).decode().removeprefix("data: "))["seconds"] == 1800.0
        events.close()


def test_a_port_in_use_is_told():
    with LivePage(0) as page, pytest.raises(OSError, match="in use"):
        LivePage(int(page.address.rstrip("/").rpartition(":")[2]))


@pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium")
@pytest.mark.parametrize("width", [390, 1280])
def test_a_browser_draws_it(tmp_path, width):
    with Browser(tmp_path / "profile", width) as browser:
        with LivePage(0) as page:
            for k in range(200):
                page.put(replace(VIEW, seconds=0.05 * k, rate=(math.sin(0.1 * k), math.nan, 1.0)))
            browser.go(page.address)
            browser.wait(f"{STATE} == '9.9 s, at rest' || {STATE} == '10.0 s, at rest'")
            text = browser.value("document.body.innerText")
            assert "missing" in text
            assert all(text.count(name) == 3 for name in ("gx", "gy", "gz"))
            assert "roll 1.0°, pitch -2.0°, yaw 90.0°" in text
            assert browser.value("document.documentElement.scrollWidth") <= width
            before = browser.value(PIXELS.format("cube"))
            assert before > 100

            half = math.sqrt(0.5)
            page.put(replace(VIEW, seconds=10.5, quaternion=(half, 0.0, half, 0.0)))
            browser.wait(f"{STATE} == '10.5 s, at rest'")
            assert browser.value(PIXELS.format("cube")) != before
            assert browser.value(PIXELS.format("rate")) > 100
            (tmp_path / "page.png").write_bytes(browser.picture())
        browser.wait(f"{STATE}.endsWith('ended')")
        assert browser.complaints == []
