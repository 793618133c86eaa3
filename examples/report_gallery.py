"""Gallery of the report: pages of a healthy log, of a log with faults, and of before and after.

``python examples/report_gallery.py -o docs/figures`` simulates the logs, makes their pages, and
takes pictures with ``chromium`` from Debian. ``--pages FOLDER`` keeps the pages.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

import zerorate as zr
from report_screens import browser
from report_study import DEVICES, Simulated, clip, fault_folded, fault_gaps, fault_moving_bias

WIDE = 900
PARTS = (("<h1>", 800), ('<section id="figures">', 580))
"""Parts of a page: the text at which each starts, and its height, pixels."""
COLOURS = 128
"""Number of colours of a picture; the page has few, and full colour needs four times the size."""


def named(log, name):
    """Return the report on a simulated log with a given name."""
    return zr.report(zr.Recording({**log.recording()}, name))


def healthy():
    """Return the report on two IMUs that are moved by hand, without faults."""
    return named(Simulated(DEVICES["autopilot, 200 Hz"], "hand", 1), "healthy.csv")


def faulty():
    """Return the report on a rotorcraft with lost samples, clipping and a bias change."""
    log = Simulated(DEVICES["autopilot, 200 Hz"], "rotor craft", 5)
    clip(log, "gyro", 0.02)
    fault_folded(log, 1.5)
    fault_moving_bias(log, 2.0)
    fault_gaps(log, 1.5)
    return named(log, "faults.csv")


def before_and_after():
    """Return the reports on a device with bias and scale errors, and without them."""
    device = DEVICES["consumer, 200 Hz"]
    before, after = Simulated(device, "hand", 3), Simulated(device, "hand", 4)
    for log in (before, after):
        for gyro in log.gyro:
            gyro -= np.median(gyro[: round(10 * log.rate)], axis=0)
    before.gyro[0] += [5.6, -1.2, 0.4]
    before.accel[0] *= 1.05
    return zr.findings.before_after(named(before, "before.csv"), named(after, "after.csv"))


PAGES = {"healthy": healthy, "faults": faulty, "before_after": before_and_after}


def picture(page, output):
    """Take a picture of the parts of a page, one below the other, with few colours."""
    whole = Image.new("RGB", (WIDE, sum(tall for _, tall in PARTS)))
    text, top = page.read_text(encoding="utf-8"), 0
    with tempfile.TemporaryDirectory() as profile:
        part_page = Path(profile, "part.html")
        for begins, tall in PARTS:
            # The browser takes pictures of the top of a page only.
            head = text[: text.index("<h1>")]
            part_page.write_text(head + text[text.index(begins) :], encoding="utf-8")
            shot, size = f"--screenshot={output}", f"--window-size={WIDE},{tall}"
            for line in browser(Path(profile, "browser"), size, shot, part_page.as_uri()):
                print(f"{page.name}: {line}")
            with Image.open(output) as part:
                whole.paste(part.convert("RGB"), (0, top))
            top += tall
    small = whole.quantize(COLOURS, dither=Image.Dither.NONE)
    small.save(output, optimize=True)


def main():
    """Write the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=Path())
    parser.add_argument("--pages", type=Path)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        pages = asked.pages or Path(folder)
        pages.mkdir(parents=True, exist_ok=True)
        for name, made in PAGES.items():
            page = pages / f"report_{name}.html"
            page.write_text(made().to_html(), encoding="utf-8")
            shot = (asked.output / f"report_{name}.png").absolute()
            picture(page, shot)
            sizes = [f"{one.stat().st_size / 1e3:.0f} kB" for one in (shot, page)]
            print(f"{shot.name}: {sizes[0]}, its page {sizes[1]}")


if __name__ == "__main__":
    main()
