"""The page of the preparation has the rows of its table."""

from pathlib import Path

from zerorate.checks.preparation import PREPARATIONS

PAGE = Path(__file__).parents[2] / "docs/reference/preparation.md"
HEAD = ("check", "evidence", "threshold", "default", "option", "used by")


def table():
    """Return the lines of the table, as the page has them."""
    rows = [HEAD, ("---",) * len(HEAD)]
    rows += [
        (*row[:4], f"`{row.option}`" if row.option else "", row.used_by) for row in PREPARATIONS
    ]
    return [f"| {' | '.join(cells)} |" for cells in rows]


def test_the_page_has_the_table():
    assert [line for line in PAGE.read_text().splitlines() if line.startswith("|")] == table()


def test_a_check_says_what_it_judges_and_what_follows():
    for row in PREPARATIONS:
        assert row.evidence
        assert row.default
        assert row.used_by
        assert row.threshold or row.name == "known errors"
    assert len({row.name for row in PREPARATIONS}) == len(PREPARATIONS)
