"""An identification as a page."""

from collections.abc import Iterator, Mapping, Sequence
from html import escape

from zerorate._native import __version__
from zerorate.identify.conclusions import is_fit, model_name, per_cent
from zerorate.identify.identification import Identification
from zerorate.show.report.identify_tables import tables
from zerorate.show.report.page import as_html, bullets, image, page
from zerorate.show.report.tables import Table

__all__ = ["identification_page"]


def identification_page(
    found: Sequence[Identification], source: str, figures: Mapping[str, bytes], notes: Sequence[str]
) -> str:
    """Return a page with a section for each axis.

    Parameters
    ----------
    found : sequence of Identification
        One an axis, of different names.
    source : str
        Name of the log.
    figures : mapping of str to bytes
        SVG of the axes that have a figure.
    notes : sequence of str
        What there is to say of the log.
    """
    return page(f"{source}: identification", _body(found, source, figures, notes))


def _body(
    found: Sequence[Identification], source: str, figures: Mapping[str, bytes], notes: Sequence[str]
) -> Iterator[str]:
    survey = found[0].survey
    yield f"<h1>{escape(source)}: drift models</h1>"
    yield (
        f'<p class="about">{survey.samples:,} samples at {survey.rate:g} Hz, '
        f"{survey.duration:,.6g} s. zerorate {__version__}.</p>"
    )
    if notes:
        yield bullets(notes)
    if len(found) > 1:
        links = (f'<a href="#axis{i}">{escape(one.name)}</a>' for i, one in enumerate(found))
        yield f"<nav>{''.join(links)}</nav>"
    yield as_html(_summary(found))
    for i, one in enumerate(found):
        yield f'<section id="axis{i}">\n<h2>{escape(one.name)} [{escape(one.unit)}]</h2>'
        yield f'<div class="verdict{"" if is_fit(one) else " unfit"}">{bullets(one.verdict)}</div>'
        if one.name in figures:
            yield image(figures[one.name], f"Record, tests and models of {one.name}")
        yield from map(as_html, tables(one))
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
