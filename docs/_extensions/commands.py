"""The directive ``commands``: every command of the program, with what its help says."""

import inspect
from collections import defaultdict

from sphinx.util.docutils import SphinxDirective

from zerorate.cli.app import COMMANDS, taker_of
from zerorate.cli.parameters import Argument


class Commands(SphinxDirective):
    """Sections of all commands: usage, arguments, options by the panels of the help."""

    def run(self):
        """Return the sections."""
        text = "\n\n".join(map(_section, COMMANDS))
        return self.parse_text_to_nodes(text, allow_section_headings=True)


def setup(app):
    """Add the directive."""
    app.add_directive("commands", Commands)
    return {"parallel_read_safe": True}


def _section(name):
    taker = taker_of(name)
    options = [*taker.options()]
    usage = [one.typed for one in options if isinstance(one, Argument)]
    panels = defaultdict(list)
    for one in options:
        title = "Arguments" if isinstance(one, Argument) else one.panel or "Options"
        panels[title].append((one.typed, one.meaning))
    typed = " ".join(("zerorate", name, *usage, "[OPTIONS]"))
    parts = [f"## {name}", f"```sh\n{typed}\n```", _prose(inspect.getdoc(taker.takes))]
    for title, rows in panels.items():
        lines = [f"| {title} | |", "| --- | --- |"]
        lines += [f"| {_options(first)} | {_cell(second)} |" for first, second in rows]
        parts.append("\n".join(lines))
    parts.append(f"```console\nExample: {COMMANDS[name].examples[0]}\n```")
    return "\n\n".join(parts)


def _options(text):
    """Return the names of an option and what it takes as code."""
    return ", ".join(f"`{one}`" for one in text.split(", ")).replace("|", "\\|")


def _prose(text):
    return " ".join((text or "").split())


def _cell(text):
    return _prose(text).replace("|", "\\|").replace("*", "\\*").replace("[", "\\[")
