"""Tables of docs/reference/formats-and-libraries.md, made from those in the code.

``python -m support.features`` in tests writes them into the page.
"""

import re
from pathlib import Path

from zerorate.io.fixes import RECEIVERS
from zerorate.io.formats import FORMATS
from zerorate.io.packets import PACKETS
from zerorate.io.writing import WRITTEN_SUFFIXES
from zerorate.schemas import FORMATS as SCHEMAS
from zerorate.tasks import calibrate, characterise
from zerorate.tasks.live.sources import SOURCES
from zerorate.tasks.saving import FIGURE_FORMATS

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "formats-and-libraries.md"
_BLOCK = re.compile(r"(<!-- table: (\w+) -->\n).*?(?=<!-- end -->)", re.DOTALL)


def _without_article(text):
    return re.sub(r"^(an?|the) ", "", text)


def _code(words):
    return f"`{' '.join(words)}`" if words else "by its content"


def _files():
    yield "format", "files read", "files written", "extra to read"
    for form in FORMATS:
        written = [suffix for suffix in form.suffixes if suffix in WRITTEN_SUFFIXES]
        extra = f"`[{form.needs.extra}]`" if form.needs else ""
        name = _without_article(form.description)
        yield name, _code(form.suffixes), _code(written) if written else "", extra


def _receivers():
    yield "receivers' format", "files read", "extra"
    for form in RECEIVERS.values():
        extra = f"`[{form.needs.extra}]`" if form.needs else ""
        yield _without_article(form.description), _code(form.suffixes), extra


def _live():
    yield "live", "address or form", "meaning"
    for kind in SOURCES.values():
        yield "`zerorate stream --from`", f"`{kind.address}`", kind.meaning
    for protocol in PACKETS.values():
        yield "`zerorate stream --form`", f"`{protocol.name}`", protocol.meaning


def _given():
    yield "result", "given as"
    yield "figure", _code(FIGURE_FORMATS)
    yield "noise, `zerorate allan --export`", _code(characterise.EXPORTS)
    yield "calibration, `zerorate calibrate --export`", _code(calibrate.EXPORTS)
    yield "JSON with a [schema](json.md)", _code(SCHEMAS)


TABLES = {"files": _files, "receivers": _receivers, "live": _live, "given": _given}


def table(name):
    """Return a table of the page as Markdown."""
    head, *rows = (" | ".join(row).replace("``", "") for row in TABLES[name]())
    rule = " | ".join("---" for _ in head.split(" | "))
    return "".join(f"| {row} |\n" for row in (head, rule, *rows))


def rendered(text):
    """Return the text of the page with the tables of the code."""
    return _BLOCK.sub(lambda block: block[1] + table(block[2]), text)


if __name__ == "__main__":
    PAGE.write_text(rendered(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
