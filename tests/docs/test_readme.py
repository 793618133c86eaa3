"""README is read in a minute or two."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
WORDS = 900


def test_it_stays_short():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    shown = re.sub(r"<!--.*?-->|\]\([^)]*\)", " ", text)
    words = [word for word in shown.split() if re.search(r"\w", word)]
    assert len(words) <= WORDS
