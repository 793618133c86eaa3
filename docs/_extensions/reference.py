"""The directive ``names``: a table of public names, each with a page of its own and its first line.

A line is a name, or a package and ``.*`` for all that its ``__all__`` lists; `` -- `` may be
followed by what to say of a name that has no docstring. Pages are written next to the table's, into
a folder named as it, before anything is read; those of names that are gone are removed. Each second
heading of the table's page is a group of the sidebar, with a page that lists its names.
"""

import inspect
import re
from importlib import import_module
from pathlib import Path

from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).parents[2]
TABLE = "reference/api"
GROUP = re.compile(r"^## (.+?)\n(.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL)
BLOCK = re.compile(r"^```\{names\}\n(.*?)^```$", re.MULTILINE | re.DOTALL)


class Names(SphinxDirective):
    """A row a name: a link to its page, and the first line of its docstring."""

    has_content = True

    def run(self):
        """Return the table."""
        lines = ["| | |", "| --- | --- |"]
        for name, said in listed(self.content):
            shown = name.replace("zerorate.", "zr.", 1)
            # From the page of a group as from that of all names.
            lines.append(f"| [`{shown}`](/{TABLE}/{name}.md) | {said or summary(found(name))} |")
        return self.parse_text_to_nodes("\n".join(lines))


def setup(app):
    """Add the directive, and write the pages before any is read."""
    app.add_directive("names", Names)
    app.connect("builder-inited", write_pages)
    return {"parallel_read_safe": True}


def write_pages(app):
    """Write a page for each name of the table, where it is not there as it should be."""
    source = Path(app.srcdir, f"{TABLE}.md").read_text(encoding="utf-8")
    folder = Path(app.srcdir, TABLE)
    folder.mkdir(exist_ok=True)
    pages = {}
    for title, text in GROUP.findall(source):
        blocks = BLOCK.findall(text)
        names = [name for block in blocks for name, _ in listed(block.splitlines())]
        pages[slug(title)] = group_page(title, blocks, names)
        pages |= {name: page(name) for name in names}
    for gone in {path.stem for path in folder.glob("*.md")} - set(pages):
        (folder / f"{gone}.md").unlink()
    for name, text in pages.items():
        path = folder / f"{name}.md"
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def slug(title):
    """Return the name of the page of a group."""
    return "-".join(("group", *re.findall(r"\w+", title.lower())))


def group_page(title, blocks, names):
    """Return the page of a group: its table, and its names in the sidebar."""
    tables = "\n".join(f"```{{names}}\n{block}```\n" for block in blocks)
    listing = "\n".join(f"{name.rpartition('.')[2]} <{name}>" for name in names)
    return f"# {title}\n\n{tables}\n```{{toctree}}\n:hidden:\n{listing}\n```\n"


def listed(lines):
    """Yield the names of a block, and what is said of each if it is not its docstring."""
    for line in filter(None, map(str.strip, lines)):
        name, _, said = line.partition(" -- ")
        if name.endswith(".*"):
            package = name.removesuffix(".*")
            yield from ((f"{package}.{one}", "") for one in import_module(package).__all__)
        else:
            yield name, said


def found(name):
    """Return what has this name."""
    module, _, own = name.rpartition(".")
    return getattr(import_module(module), own)


def summary(thing):
    """Return the first sentence of a docstring, as a cell of a table; none of mere data."""
    if not callable(thing):
        return ""
    first = (inspect.getdoc(thing) or "").partition("\n\n")[0]
    return " ".join(first.replace("``", "`").split()).replace("|", "\\|")


def page(name):
    """Return the page of a name."""
    kind, members = described(found(name))
    where = source_of(found(name))
    return f"""# {name.rpartition(".")[2]}

```{{eval-rst}}
.. auto{kind}:: {name}
{members}```

Source: {{download}}`{where} </../{where}>`. [All names](../api.md).
"""


def described(thing):
    """Return the directive that describes a thing, and its options as lines."""
    if inspect.isclass(thing) and issubclass(thing, BaseException):
        return "exception", ""
    if inspect.isclass(thing):
        return "class", "   :members:\n"
    return ("function", "") if callable(thing) else ("data", "   :no-value:\n")


def source_of(thing):
    """Return the file that a thing is in, from the root: of a native one that of its signatures."""
    try:
        path = Path(inspect.getsourcefile(thing) or "")
    except TypeError:
        return "python/zerorate/_native.pyi"
    inside = path.parts[len(path.parts) - 1 - path.parts[::-1].index("zerorate") :]
    return "/".join(("python", *inside))
