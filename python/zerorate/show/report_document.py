"""Frame of self-contained pages: style, script, and sources."""

from collections.abc import Iterable
from html import escape
from importlib.resources import files
from typing import Final

_CONTENT_POLICY: Final = (
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:"
)
"""Content policy for a browser: the page loads nothing from elsewhere."""


_STYLE, _SCRIPT = "report_page.css", "report_page.js"


def document(title: str, body: Iterable[str], style: str = "", script: str | None = None) -> str:
    """Return an HTML page with a title (text) and a body (HTML).

    `style` is the name of a further style file. `script` replaces the script of the report.
    """
    heading = escape(title)
    styles = "".join(map(_read_file, filter(None, (_STYLE, style))))
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_CONTENT_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<link rel="icon" href="data:,">\n<title>{heading}</title>\n'
        f"<style>\n{styles}</style>\n</head>\n<body>\n<main>\n<h1>{heading}</h1>\n"
        + "\n".join(body)
        + f"\n</main>\n<script>\n{script or _read_file(_SCRIPT)}</script>\n</body>\n</html>\n"
    )


def _read_file(name: str) -> str:
    return files("zerorate.show").joinpath(name).read_text(encoding="utf-8")
