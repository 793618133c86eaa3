"""Links between pages: each leads to a file of the repository, and to a heading that is there."""

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LINK = re.compile(r"(?<!\\)\]\(<?([^)\s>]+)>?\)")
FENCE = re.compile(r"^(```|:::).*?^\1\s*$", re.MULTILINE | re.DOTALL)
HEADING = re.compile(r"^#{1,6} +(.*?) *$", re.MULTILINE)
SCHEME = re.compile(r"[a-z]+:")


def pages():
    command = ["git", "-C", str(ROOT), "ls-files", "*.md"]
    try:
        listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    except (OSError, subprocess.CalledProcessError):
        listed = [str(path.relative_to(ROOT)) for path in (ROOT / "docs").rglob("*.md")]
    return sorted(name for name in listed if (ROOT / name).exists())


def anchors(text):
    """Return the names of a page's headings, as hosts and Sphinx make them."""
    names = re.findall(r"^\(([\w-]+)\)=$", text, re.MULTILINE)
    for heading in HEADING.findall(FENCE.sub("", text)):
        plain = re.sub(r"\[([^]]*)\]\([^)]*\)|[`*]", r"\1", heading).lower()
        name = re.sub(r"[^\w\- ]", "", plain).replace(" ", "-")
        names.append(f"{name}-{names.count(name)}" if name in names else name)
    return names


def leads_to(page, path, anchor):
    """Return what is missing at the end of a link, or nothing."""
    target = (page.parent / path).resolve() if path else page
    if not target.exists():
        return "no such file"
    if target.suffix != ".md" or not anchor:
        return ""
    known = anchors(target.read_text(encoding="utf-8"))
    return "" if anchor in known else "no such heading"


def broken(name):
    """Yield the links of a page that lead nowhere here; those to other hosts are not looked at."""
    page = ROOT / name
    text = page.read_text(encoding="utf-8")
    for link in LINK.findall(re.sub(r"`[^`\n]*`", "", FENCE.sub("", text))):
        path, _, anchor = link.partition("#")
        if not SCHEME.match(link) and not path.startswith("api/"):
            missing = leads_to(page, path, anchor)
            if missing:
                yield f"{link}: {missing}"


@pytest.mark.parametrize("name", pages())
def test_links_lead_somewhere(name):
    assert list(broken(name)) == []


def test_what_leads_nowhere_is_found(tmp_path, monkeypatch):
    monkeypatch.setattr(f"{__name__}.ROOT", tmp_path)
    (tmp_path / "a.md").write_text(
        "# A b, *c*\n[1](a.md#a-b-c) [2](#a) [3](b.md) `[4](c.md)`\n```\n[5](d.md)\n```\n"
    )
    assert list(broken("a.md")) == ["#a: no such heading", "b.md: no such file"]
