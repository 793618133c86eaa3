"""The directive ``drawn``: a figure of this version, beside what draws it.

Its argument is the class of the result. Its content is Python whose last line is a figure, with the
option ``command`` for what draws the same of a log; or, with the option ``shell``, commands that
write one PNG file, the name of which it is. Figures are drawn anew at each build into a folder next
to the page, named as it.
"""

import ast
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from docutils.parsers.rst import directives
from matplotlib.figure import Figure
from sphinx.util.docutils import SphinxDirective

RESOLUTION = 120


class Drawn(SphinxDirective):
    """The figure, what draws it here, and what draws it of a log."""

    required_arguments = 1
    option_spec = {"command": directives.unchanged, "shell": directives.unchanged}  # noqa: RUF012
    has_content = True

    def run(self):
        """Return figure and code, and draw it."""
        self.env.note_reread()
        folder = Path(self.env.doc2path(self.env.docname)).with_suffix("")
        folder.mkdir(exist_ok=True)
        name, code = self.arguments[0], "\n".join(self.content)
        written = self.options.get("shell")
        picture = by_shell(code, written) if written else by_python(code)
        (folder / f"{name}.png").write_bytes(picture)
        parts = [
            f"![{name}]({folder.name}/{name}.png)",
            f"```{'sh' if written else 'python'}\n{code}\n```",
        ]
        if "command" in self.options:
            parts.append(f"Of a log: `{self.options['command']}`")
        return self.parse_text_to_nodes("\n\n".join(parts))


def by_python(code):
    """Return the picture of the figure that the last line of some Python is."""
    tree = ast.parse(code)
    last = tree.body.pop()
    names = {}
    exec(compile(tree, "gallery", "exec"), names)
    figure = eval(compile(ast.Expression(last.value), "gallery", "eval"), names)
    if not isinstance(figure, Figure):
        raise TypeError(f"the last line is no figure: {ast.unparse(last)}")
    with tempfile.NamedTemporaryFile(suffix=".png") as file:
        figure.savefig(file, dpi=RESOLUTION)
        return Path(file.name).read_bytes()


def by_shell(code, written):
    """Return a file that commands write in a folder of their own."""
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    with tempfile.TemporaryDirectory() as folder:
        command = ["bash", "-euo", "pipefail", "-c", code]
        environment = {**os.environ, "PATH": path}
        subprocess.run(command, cwd=folder, env=environment, capture_output=True, check=True)
        return Path(folder, written).read_bytes()


def setup(app):
    """Add the directive."""
    app.add_directive("drawn", Drawn)
    return {"parallel_read_safe": True}
