"""Counts words to avoid, and fails above the level of docs, Python or Rust.

``python .ci/words.py`` prints a line for each place; ``python .ci/words.py --list`` also prints the
lines that have such a word. Lower a level when its count has fallen; never raise one.
"""

import re
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent
PLACES = {
    "docs": ("*.md", "docs/**/*.md", "rust/*/README.md"),
    "python": ("python/**/*.py", "python/**/*.pyi"),
    "rust": ("rust/*/src/**/*.rs", "rust/c/include/*.h"),
}
LEVELS = {"docs": 0, "python": 0, "rust": 0}
FIRST_LEVELS = {"docs": 0, "python": 0, "rust": 0}
AVOIDED = (
    *("told", "beside", "anew", "alike", "so far", "as well as", "taken for", "takes? for"),
    *("twins?", "abreast", "wild", "witness(?:es)?", "what is known", "goes? by"),
)
WORDS = re.compile(rf"(?<![\w`.-])(?:{'|'.join(AVOIDED)})(?![\w`=(])", re.IGNORECASE)
FIRST = re.compile(r'(?:"""|///|//!) ?Returns? (?:what|which|whether|how|where|when)\b')


def files(place: str) -> Iterator[Path]:
    """Yield the files of a place, without generated pages of the reference."""
    for pattern in PLACES[place]:
        for path in sorted(ROOT.glob(pattern)):
            if "reference/api" not in path.as_posix().removesuffix(".md") or path.stem == "api":
                yield path


def main() -> None:
    """Print the counts of each place; fail if one is above its level."""
    failed = False
    for place in PLACES:
        words: Counter[str] = Counter()
        first = 0
        for path in files(place):
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                found = [one.lower() for one in WORDS.findall(line)]
                words.update(found)
                first += len(FIRST.findall(line))
                if "--list" in sys.argv[1:] and (found or FIRST.search(line)):
                    print(f"{path.relative_to(ROOT)}:{number}: {line.strip()}")
        count = words.total()
        print(f"{place}: {count} words of at most {LEVELS[place]}, ", end="")
        print(f"{first} first lines of at most {FIRST_LEVELS[place]}", dict(words.most_common()))
        failed |= count > LEVELS[place] or first > FIRST_LEVELS[place]
    if failed:
        raise SystemExit("more words to avoid than before: see CONTRIBUTING.md, Documentation")


if __name__ == "__main__":
    main()
