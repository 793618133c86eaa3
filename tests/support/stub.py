"""Docstrings of the native classes in their stub, where editors look for them.

They are written once, in Rust. Copy them by ``python -m support.stub`` from tests/, and format.
"""

import ast
import inspect
import textwrap
from pathlib import Path

from zerorate import _native

STUB = Path(_native.__file__).with_name("_native.pyi")


def documented(tree):
    """Yield each public class of a stub, and each public method or property: node and docstring."""
    for owner in tree.body:
        if isinstance(owner, ast.ClassDef) and not owner.name.startswith("_"):
            kind = getattr(_native, owner.name)
            yield owner, inspect.getdoc(kind)
            for node in owner.body:
                if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                    yield node, inspect.getdoc(getattr(kind, node.name))


def with_docstrings(text):
    """Return the stub with those of the module that is built."""
    lines = text.split("\n")
    for node, told in reversed(list(documented(ast.parse(text)))):
        if told is None:
            continue
        first, last = node.body[0], node.body[0]
        old = ast.get_docstring(node) is not None or isinstance(node, ast.FunctionDef)
        indent = " " * (node.col_offset + 4)
        new = textwrap.indent(f'"""{told}\n"""' if "\n" in told else f'"""{told}"""', indent)
        new = "\n".join(line.rstrip() for line in new.split("\n"))
        if not old:
            lines.insert(first.lineno - 1 - len(getattr(first, "decorator_list", [])), f"{new}\n")
            continue
        head = lines[first.lineno - 1][: first.col_offset].rstrip()
        lines[first.lineno - 1 : last.end_lineno] = [*([head] if head else []), *new.split("\n")]
    return "\n".join(lines)


if __name__ == "__main__":
    STUB.write_text(with_docstrings(STUB.read_text(encoding="utf-8")), encoding="utf-8")
