"""An identification as a page that stands alone: no script, no network, no other file."""

from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from importlib.resources import files
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path

from zerorate._native import __version__
from zerorate.identification.conclusions import is_fit, model_name, per_cent
from zerorate.identification.identification import Identification
from zerorate.show.identify_tables import tables
from zerorate.show.tables import Table
from zerorate.tasks.identify import Identified
from zerorate.texts import extra_needed


def identified_page(found: Identified, drawn: bool = True, everything: bool = False) -> str:
    """Return the page of all axes of a log.

    `drawn`: with a figure of each axis, of all panels if `everything`; ImportError without
    matplotlib.
    """
    drawings = {one.name: _svg(one, everything) for one in found.axes} if drawn else {}
    return identification_page(found.axes, Path(found.source).name, drawings, found.notes)


def _svg(found: Identification, everything: bool) -> bytes:
    if find_spec("matplotlib") is None:
        raise ImportError(extra_needed("matplotlib", "plot"))
    from matplotlib import rc_context

    from zerorate.show.identify_figure import plot_identification

    buffer = BytesIO()
    # The same log gives the same bytes.
    with rc_context({"svg.hashsalt": found.name}):
        figure = plot_identification(found, everything)
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()


def identification_page(
    found: Sequence[Identification], source: str, figures: Mapping[str, bytes], notes: Sequence[str]
) -> str:
    """Return a page with a section for each axis.

    `found`: one an axis, of different names. `source`: name of the log. `figures`: SVG of the axes
    that have a figure. `notes`: sentences on the log.
    """
    return _page(f"{source}: identification", _body(found, source, figures, notes))


def _page(title: str, body: Iterable[str]) -> str:
    """Return a whole document of a title and the elements of its body."""
    style = files("zerorate.show").joinpath("page.css").read_text(encoding="utf-8")
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n"
        + "\n".join(body)
        + "\n</body>\n</html>\n"
    )


def _as_html(table: Table) -> str:
    """Return a table with its title and its note."""
    head = f"<thead>{_row(table.head, 'th', table.words)}</thead>\n" if table.head else ""
    rows = "\n".join(_row(row, "td", table.words) for row in table.rows)
    note = f'\n<p class="note">{escape(table.note)}</p>' if table.note else ""
    return f"<h3>{escape(table.title)}</h3>\n<table>\n{head}<tbody>\n{rows}\n</tbody></table>{note}"


def _bullets(sentences: Sequence[str]) -> str:
    """Return sentences as a list."""
    return "<ul>" + "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences) + "</ul>"


def _image(svg: bytes, description: str) -> str:
    """Return a drawing within the page, apart from the names that others use in theirs."""
    data = b64encode(svg).decode("ascii")
    return (
        f'<figure><img alt="{escape(description)}" src="data:image/svg+xml;base64,{data}"></figure>'
    )


def _row(cells: Sequence[str], tag: str, words: int) -> str:
    texts = (
        f'<{tag} class="word">{escape(cell)}</{tag}>'
        if i < words
        else f"<{tag}>{escape(cell)}</{tag}>"
        for i, cell in enumerate(cells)
    )
    return f"<tr>{''.join(texts)}</tr>"


def _body(
    found: Sequence[Identification], source: str, figures: Mapping[str, bytes], notes: Sequence[str]
) -> Iterator[str]:
    record = found[0].record
    yield f"<h1>{escape(source)}: drift models</h1>"
    yield (
        f'<p class="about">{record.sample_count:,} samples at {record.rate:g} Hz, '
        f"{record.duration:,.6g} s. zerorate {__version__}.</p>"
    )
    if notes:
        yield _bullets(notes)
    if len(found) > 1:
        links = (f'<a href="#axis{i}">{escape(one.name)}</a>' for i, one in enumerate(found))
        yield f"<nav>{''.join(links)}</nav>"
    yield _as_html(_summary(found))
    for i, one in enumerate(found):
        yield f'<section id="axis{i}">\n<h2>{escape(one.name)} [{escape(one.unit)}]</h2>'
        yield f'<div class="verdict{"" if is_fit(one) else " unfit"}">{_bullets(one.verdict)}</div>'
        if one.name in figures:
            yield _image(figures[one.name], f"Record, tests and models of {one.name}")
        yield from map(_as_html, tables(one))
        yield "</section>"


def _summary(found: Sequence[Identification]) -> Table:
    head = ("axis", "fit for a model", "model", "residuals", "still predictable")
    rows = (
        (
            one.name,
            "yes" if is_fit(one) else "no",
            model_name(one.model.order),
            "white" if one.whiteness.white else "not white",
            per_cent(one.whiteness.predictable),
        )
        for one in found
    )
    return Table("Summary", head, tuple(rows), words=4)
