"""Pieces of a page that stands alone: no script, no network, nothing beside it."""

from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files

from zerorate.show.report.tables import Table

__all__ = ["as_html", "bullets", "image", "page"]


def page(title: str, body: Iterable[str]) -> str:
    """Return a whole document of a title and the elements of its body."""
    style = files("zerorate.show.report").joinpath("page.css").read_text(encoding="utf-8")
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n"
        + "\n".join(body)
        + "\n</body>\n</html>\n"
    )


def as_html(table: Table) -> str:
    """Return a table with its title and its note."""
    head = f"<thead>{_row(table.head, 'th', table.words)}</thead>\n" if table.head else ""
    rows = "\n".join(_row(row, "td", table.words) for row in table.rows)
    note = f'\n<p class="note">{escape(table.note)}</p>' if table.note else ""
    return f"<h3>{escape(table.title)}</h3>\n<table>\n{head}<tbody>\n{rows}\n</tbody></table>{note}"


def bullets(sentences: Sequence[str]) -> str:
    """Return sentences as a list."""
    return "<ul>" + "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences) + "</ul>"


def image(svg: bytes, description: str) -> str:
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
