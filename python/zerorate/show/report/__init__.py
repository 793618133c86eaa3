"""Results as plain text: tables, and the sentences under them."""

from zerorate.show.report.allan import format_allan, format_allan_notes
from zerorate.show.report.learned import format_learned
from zerorate.show.report.replay import format_notes, format_table
from zerorate.show.report.text import WIDTH

__all__ = [
    "WIDTH",
    "format_allan",
    "format_allan_notes",
    "format_learned",
    "format_notes",
    "format_table",
]
