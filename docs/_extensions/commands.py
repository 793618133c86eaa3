"""The directive ``commands``: every command of the program, with what its help says."""

from collections import defaultdict

from sphinx.util.docutils import SphinxDirective
from typer.main import get_command

from zerorate.cli.app import program


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
    with group.make_context("zerorate", [], resilient_parsing=True) as parent:
        context = command.context_class(command, info_name=name, parent=parent)
        usage = " ".join(command.collect_usage_pieces(context))
        panels = defaultdict(list)
        for parameter in command.get_params(context):
            row = parameter.get_help_record(context)
            if row is not None:
                panels[_panel(parameter)].append(row)
    parts = [f"## {name}", f"```sh\nzerorate {name} {usage}\n```", _prose(command.help)]
    for title, rows in panels.items():
        lines = [f"| {title} | |", "| --- | --- |"]
        lines += [f"| {_options(first)} | {_cell(second)} |" for first, second in rows]
        parts.append("\n".join(lines))
    if command.epilog:
        parts.append(f"```console\n{command.epilog}\n```")
    return "\n\n".join(parts)


def _panel(parameter):
    usual = "Arguments" if parameter.param_type_name == "argument" else "Options"
    return getattr(parameter, "rich_help_panel", None) or usual


def _options(text):
    """Return the names of an option and what it takes as code."""
    return ", ".join(f"`{one}`" for one in text.split(", ")).replace("|", "\\|")


def _prose(text):
    return " ".join((text or "").split())


def _cell(text):
    return _prose(text).replace("|", "\\|").replace("*", "\\*").replace("[", "\\[")
