"""Identification as a self-contained page, without script, network or other files."""

from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from importlib.resources import files
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path

from zerorate._native import __version__
from zerorate.identification.conclusions import format_percent, is_fit, model_name
from zerorate.identification.identification import Identification
from zerorate.show.identify_tables import identification_tables
from zerorate.show.tables import Table
from zerorate.tasks.identify import Identified
from zerorate.texts import describe_missing_extra


def identified_page(result: Identified, with_figures: bool = True, everything: bool = False) -> str:
    """Return the page with all axes of a log.

    `with_figures`: add a figure for each axis, with all panels if `everything` is True. This raises
    ImportError without matplotlib.
    """
    drawings = (
        {axis.name: _render_svg(axis, everything) for axis in result.axes} if with_figures else {}
    )
    return identification_page(result.axes, Path(result.source).name, drawings, result.notes)


def _render_svg(identification: Identification, everything: bool) -> bytes:
    if find_spec("matplotlib") is None:
        raise ImportError(describe_missing_extra("matplotlib", "plot"))
    from matplotlib import rc_context

    from zerorate.show.identify_figure import plot_identification

    buffer = BytesIO()
    # The same log must give the same bytes.
    with rc_context({"svg.hashsalt": identification.name}):
        figure = plot_identification(identification, everything)
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()


def identification_page(
    axes: Sequence[Identification], source: str, figures: Mapping[str, bytes], notes: Sequence[str]
) -> str:
    """Return a page with a section for each axis.

    `axes`: one identification per axis; the names of the axes must differ. `source`: name of the
    log. `figures`: SVG figures by axis. `notes`: sentences on the log.
    """
    return _make_page(f"{source}: identification", _make_body(axes, source, figures, notes))


def _make_page(title: str, body: Iterable[str]) -> str:
    """Return an HTML document with a title and the elements of its body."""
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
    head = f"<thead>{_html_row(table.head, 'th', table.words)}</thead>\n" if table.head else ""
    rows = "\n".join(_html_row(row, "td", table.words) for row in table.rows)
    note = f'\n<p class="note">{escape(table.note)}</p>' if table.note else ""
    return f"<h3>{escape(table.title)}</h3>\n<table>\n{head}<tbody>\n{rows}\n</tbody></table>{note}"


def _html_list(sentences: Sequence[str]) -> str:
    """Return sentences as an HTML list."""
    return "<ul>" + "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences) + "</ul>"


def _html_image(svg: bytes, description: str) -> str:
    """Return an SVG figure for the page, with ids that no other figure uses."""
    data = b64encode(svg).decode("ascii")
    return (
        f'<figure><img alt="{escape(description)}" src="data:image/svg+xml;base64,{data}"></figure>'
    )


def _html_row(cells: Sequence[str], tag: str, words: int) -> str:
    texts = (
        f'<{tag} class="word">{escape(cell)}</{tag}>'
        if i < words
        else f"<{tag}>{escape(cell)}</{tag}>"
        for i, cell in enumerate(cells)
    )
    return f"<tr>{''.join(texts)}</tr>"


def _make_body(
    axes: Sequence[Identification], source: str, figures: Mapping[str, bytes], notes: Sequence[str]
) -> Iterator[str]:
    record = axes[0].record
    yield f"<h1>{escape(source)}: drift models</h1>"
    yield (
        f'<p class="about">{record.sample_count:,} samples at {record.rate:g} Hz, '
        f"{record.duration:,.6g} s. zerorate {__version__}.</p>"
    )
    if notes:
        yield _html_list(notes)
    if len(axes) > 1:
        links = (f'<a href="#axis{i}">{escape(axis.name)}</a>' for i, axis in enumerate(axes))
        yield f"<nav>{''.join(links)}</nav>"
    yield _as_html(_make_summary(axes))
    for i, axis in enumerate(axes):
        yield f'<section id="axis{i}">\n<h2>{escape(axis.name)} [{escape(axis.unit)}]</h2>'
        yield (
            "<div "
            f'class="verdict{"" if is_fit(axis) else " unfit"}">{_html_list(axis.verdict)}</div>'
        )
        if axis.name in figures:
            yield _html_image(figures[axis.name], f"Record, tests and models of {axis.name}")
        yield from map(_as_html, identification_tables(axis))
        yield "</section>"


def _make_summary(axes: Sequence[Identification]) -> Table:
    head = ("axis", "fit for a model", "model", "residuals", "still predictable")
    rows = (
        (
            axis.name,
            "yes" if is_fit(axis) else "no",
            model_name(axis.model.order),
            "white" if axis.whiteness.white else "not white",
            format_percent(axis.whiteness.predictable),
        )
        for axis in axes
    )
    return Table("Summary", head, tuple(rows), words=4)
