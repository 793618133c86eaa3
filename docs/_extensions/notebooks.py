"""Pages of the folder ``notebooks`` are run when they are read, and show what their cells give.

Output, the value of the last line and the figures follow each cell. A cell that raises fails the
build.
"""

import ast
import base64
import io
import os
import re
import tempfile
from contextlib import chdir, redirect_stdout

from matplotlib.figure import Figure

FOLDER = "notebooks/"
CELL = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
RESOLUTION = 120


def setup(app):
    """Run the pages of notebooks before they are parsed."""
    app.connect("source-read", run_page)
    return {"parallel_read_safe": True}


def run_page(app, docname, source):
    """Add its output below each cell of a notebook."""
    if not docname.startswith(FOLDER):
        return
    names = {"__name__": "__main__"}
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        os.environ.setdefault("MPLBACKEND", "agg")
        source[0] = CELL.sub(
            lambda cell: f"{cell[0]}\n{run_cell(cell[1], names, docname)}", source[0]
        )


def run_cell(code, names, docname):
    """Return the output of a cell as lines of a page."""
    tree, shown = ast.parse(code), []
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    printed = io.StringIO()
    with redirect_stdout(printed):
        exec(compile(tree, docname, "exec"), names)
        value = None
        if last is not None:
            value = eval(compile(ast.Expression(last.value), docname, "eval"), names)
    if text := printed.getvalue().rstrip():
        shown.append(f"```text\n{text}\n```")
    if isinstance(value, Figure):
        shown.append(picture(value))
    elif value is not None:
        shown.append(f"```text\n{value!r}\n```")
    return "\n\n" + "\n\n".join(shown) + "\n" if shown else ""


def picture(figure):
    """Return a figure as HTML that holds it."""
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=RESOLUTION)
    data = base64.b64encode(file.getvalue()).decode("ascii")
    return f'<img alt="figure" src="data:image/png;base64,{data}">'
