"""The directive ``commands``: every command of the program, with what its help says."""

from collections import defaultdict

from sphinx.util.docutils import SphinxDirective
from typer.main import get_command

from zerorate.cli.app import function_of, program
from zerorate.cli.help import taken_by


class Commands(SphinxDirective):
    """Sections of all commands: usage, arguments, options by the panels of the help."""

    def run(self):
        """Return the sections."""
        group = get_command(program())
        text = "\n\n".join(_section(group, name) for name in group.commands)
        return self.parse_text_to_nodes(text, allow_section_headings=True)


def setup(app):
    """Add the directive."""
    app.add_directive("commands", Commands)
    return {"parallel_read_safe": True}


def _section(group, name):
    command = group.commands[name]
    takes = taken_by(command, function_of(name))
    usage = " ".join((*(one.typed for one in takes if one.is_argument), "[OPTIONS]"))
    panels = defaultdict(list)
    for one in takes:
        panels[one.panel].append((one.typed, one.meaning))
    parts = [f"## {name}", f"```sh\nzerorate {name} {usage}\n```", _prose(command.help)]
    for title, rows in panels.items():
        lines = [f"| {title} | |", "| --- | --- |"]
        lines += [f"| {_options(first)} | {_cell(second)} |" for first, second in rows]
        parts.append("\n".join(lines))
    if command.epilog:
        parts.append(f"```console\n{command.epilog}\n```")
    return "\n\n".join(parts)


def _options(text):
    """Return the names of an option and what it takes as code."""
    return ", ".join(f"`{one}`" for one in text.split(", ")).replace("|", "\\|")


def _prose(text):
    return " ".join((text or "").split())


def _cell(text):
    return _prose(text).replace("|", "\\|").replace("*", "\\*").replace("[", "\\[")
