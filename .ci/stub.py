"""Docstrings of the compiled classes in their stub, where editors look for them.

They are written once, in Rust: the stub of the sources has none, that of a wheel has them all.
"""

import ast
import base64
import hashlib
import importlib.util
import inspect
import sys
import tempfile
import textwrap
import zipfile
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

STUB = "zerorate/_native.pyi"


def documented(text: str, native: ModuleType) -> Iterator[tuple[ast.AST, str]]:
    """Yield what has a docstring of its own in the module: the node of the stub, and the text."""
    for owner in ast.parse(text).body:
        if not isinstance(owner, ast.ClassDef):
            continue
        # What all streaming classes have is alike in all of them.
        kind = getattr(native, owner.name, native.DriftFilter)
        told = {owner.name: kind.__doc__ if hasattr(native, owner.name) else None}
        for node in (owner, *owner.body):
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                told[node.name] = inspect.getdoc(getattr(kind, node.name))
            if isinstance(node, ast.ClassDef | ast.FunctionDef) and told.get(node.name):
                yield node, inspect.cleandoc(str(told[node.name]))


def with_docstrings(text: str, native: ModuleType) -> str:
    """Return a stub without docstrings with those of the module that is built."""
    lines = text.split("\n")
    for node, told in reversed(list(documented(text, native))):
        indent = " " * (node.col_offset + 4)
        new = textwrap.indent(f'"""{told}\n"""' if "\n" in told else f'"""{told}"""', indent)
        if isinstance(node, ast.ClassDef):
            lines[node.lineno] = f"{new}\n\n{lines[node.lineno]}"
        else:
            last = node.end_lineno - 1
            lines[last] = f"{lines[last].removesuffix(' ...')}\n{new}"
    return "\n".join(lines)


def document(wheel: Path) -> None:
    """Write the docstrings into the stub of a wheel."""
    with zipfile.ZipFile(wheel) as archive:
        entries = {info: archive.read(info) for info in archive.infolist()}
    record = next(info for info in entries if info.filename.endswith(".dist-info/RECORD"))
    stub = next(info for info in entries if info.filename == STUB)
    module = next(
        info for info in entries if info.filename.startswith("zerorate/_native.") and info != stub
    )
    text = with_docstrings(entries[stub].decode(), _loaded(module.filename, entries[module]))
    entries[stub] = text.encode()
    entries[record] = _recorded(entries[record].decode(), entries[stub]).encode()
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for info, data in entries.items():
            archive.writestr(info, data, compresslevel=9)


def _recorded(record: str, stub: bytes) -> str:
    digest = base64.urlsafe_b64encode(hashlib.sha256(stub).digest()).rstrip(b"=").decode()
    row = f"{STUB},sha256={digest},{len(stub)}"
    return "\n".join(row if old.startswith(f"{STUB},") else old for old in record.split("\n"))


def _loaded(name: str, data: bytes) -> ModuleType:
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        path = Path(folder, Path(name).name)
        path.write_bytes(data)
        spec = importlib.util.spec_from_file_location("zerorate._native", path)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    return module


if __name__ == "__main__":
    # Wheels that maturin alone has built.
    for found in sorted(Path(sys.argv[1]).glob("*.whl")):
        document(found)
