"""Pictures of a report page in a browser: on a phone, on a desktop, in dark mode, on paper.

``python examples/report_screens.py LOG... -o FOLDER`` takes one log, or two logs for before and
after. It needs ``chromium`` from Debian. It prints the browser's messages about the page; there
should be none.
"""

import argparse
import shutil
import subprocess
import tempfile
from pathlib import Path

import zerorate as zr

VIEWS = {
    "phone": (400, 3000, ()),
    "desk": (1000, 3000, ()),
    "dark": (1000, 3000, ("--blink-settings=preferredColorScheme=0",)),
}
"""Width and height of each view, and further options of the browser."""


def browser(profile, *options):
    """Run the browser, and return its messages about the page."""
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    command = (
        program, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
        "--enable-logging=stderr", f"--user-data-dir={profile}", *options,
    )  # fmt: skip
    run = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    return [line for line in run.stderr.splitlines() if "CONSOLE" in line]


def main():
    """Write the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", nargs="+", type=Path)
    parser.add_argument("-o", "--output", type=Path, default=Path())
    asked = parser.parse_args()
    asked.output.mkdir(parents=True, exist_ok=True)
    reports = [zr.report(zr.read_recording(log)) for log in asked.logs]
    found = zr.findings.before_after(*reports) if len(reports) > 1 else reports[0]
    page = (asked.output / "page.html").absolute()
    page.write_text(found.to_html(), encoding="utf-8")
    # A browser window cannot be as narrow as a phone, but a frame can.
    frame = page.with_name("frame.html")
    with tempfile.TemporaryDirectory() as profile:
        for name, (wide, tall, options) in VIEWS.items():
            frame.write_text(
                f'<body style="margin:0"><iframe src="{page.name}" '
                f'style="width:{wide}px;height:{tall}px;border:0"></iframe>'
            )
            shown = frame if name == "phone" else page
            picture = f"--screenshot={page.with_name(f'{name}.png')}"
            size = f"--window-size={wide},{tall}"
            for line in browser(profile, size, *options, picture, shown.as_uri()):
                print(f"{name}: {line}")
        browser(profile, f"--print-to-pdf={page.with_name('paper.pdf')}", page.as_uri())
    frame.unlink()
    print(f"wrote {', '.join(VIEWS)} and paper to {asked.output}")


if __name__ == "__main__":
    main()
