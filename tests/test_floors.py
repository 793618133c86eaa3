"""The floors of the package: an import points down, lazy and type-only imports included."""

import ast
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import zerorate

ROOT = Path(zerorate.__file__).parent
FLOORS = (
    ("_native", "faults", "lazy", "numerals", "progress", "texts", "types", "units", "views"),
    ("geometry", "options", "schemas"),
    ("record",),
    ("datasets", "denoising", "io", "linear", "metrics", "noise"),
    ("calibration", "checks", "identification"),
    ("simulation",),
    ("array", "attitude", "navigation"),
    ("foot",),
    ("findings",),
    ("tasks",),
    ("show",),
    ("cli",),
)
HEIGHT = {name: height for height, names in enumerate(FLOORS) for name in names}
# Readers and writers stand on the records; what computes on these is given them, and opens nothing.
MATHEMATICS = {
    name
    for names in FLOORS[1 : FLOORS.index(("tasks",))]
    for name in names
    if name not in ("datasets", "io", "schemas")
}
TOUCHES_FILES = {
    *("exists", "is_file", "is_dir", "stat", "iterdir", "glob", "rglob"),
    *("read_text", "read_bytes", "load", "loadtxt", "genfromtxt", "fromfile", "memmap"),
}
# Writing that is whole or not at all, and results that are read back from their own JSON.
MAY_TOUCH_FILES = ("record/atomic.py", "record/regular.py", "record/saved.py")
# Whoever imports the root may reach anything: only those who start commands do.
ABOVE_ALL = ("__init__", "__main__")


@cache
def parsed(file):
    return ast.parse(file.read_text(encoding="utf-8"))


@cache
def imports_of(file):
    """Its import statements, at any depth."""
    nodes = ast.walk(parsed(file))
    return [node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom)]


def places(node):
    """Which parts of the package an import statement names."""
    if isinstance(node, ast.Import):
        names = [alias.name for alias in node.names]
    elif isinstance(node, ast.ImportFrom) and not node.level:
        named = node.module == "zerorate"
        names = [f"zerorate.{alias.name}" for alias in node.names] if named else [node.module]
    else:
        names = []
    return [name.split(".")[1] if "." in name else "" for name in names if is_ours(name)]


def is_ours(name):
    return name == "zerorate" or name.startswith("zerorate.")


def own_part(file):
    return file.relative_to(ROOT).parts[0].removesuffix(".py")


@pytest.mark.parametrize("floor", sorted(HEIGHT))
def test_imports_point_down(floor):
    files = files_of(floor)
    assert files or floor == "_native"
    for file in files:
        for node in imports_of(file):
            for place in places(node):
                where = f"{file.relative_to(ROOT)}, line {getattr(node, 'lineno', 0)}: {place}"
                assert place == floor or HEIGHT.get(place, len(FLOORS)) < HEIGHT[floor], where


@pytest.mark.parametrize("floor", sorted(MATHEMATICS))
def test_mathematics_knows_no_reader(floor):
    for file in files_of(floor):
        found = [place for node in imports_of(file) for place in places(node)]
        assert not {"io", "datasets"} & set(found), file


@pytest.mark.parametrize("floor", sorted(MATHEMATICS))
def test_mathematics_opens_no_file(floor):
    for file in files_of(floor):
        if file.relative_to(ROOT).as_posix() not in MAY_TOUCH_FILES:
            calls = (node for node in ast.walk(parsed(file)) if isinstance(node, ast.Call))
            found = [ast.unparse(call) for call in calls if opens(call)]
            assert not found, f"{file.relative_to(ROOT)}: {found[0]}"


def files_of(floor):
    return [one for one in ROOT.rglob("*.py") if own_part(one) == floor]


def opens(call):
    """Whether a call looks at a file or reads it: opening one to write is what `save` does."""
    name = getattr(call.func, "attr", None) or getattr(call.func, "id", "")
    if name == "open":
        modes = [
            one.value
            for one in (*call.args, *(k.value for k in call.keywords))
            if isinstance(one, ast.Constant)
        ]
        return "w" not in modes
    return name in TOUCHES_FILES or (isinstance(call.func, ast.Name) and name.startswith("read_"))


def test_the_test_sees_files_that_are_opened():
    seen = (
        "open(a)",
        "Path(a).open()",
        "a.read_text()",
        "read_fixes(a)",
        "np.load(a)",
        "a.exists()",
    )
    unseen = ("a.open('w')", "self.read_fixes()", "a.write_text(b)")
    assert all(opens(ast.parse(text, mode="eval").body) for text in seen)
    assert not any(opens(ast.parse(text, mode="eval").body) for text in unseen)


def test_everything_stands_on_a_floor():
    parts = {own_part(file) for file in ROOT.rglob("*.py")} - set(ABOVE_ALL)
    assert parts == set(HEIGHT) - {"_native"}


def test_nothing_circles():
    """No module imports what imports it; a class's methods may name it, for their types alone."""
    files = {module_of(file): file for file in ROOT.rglob("*.py")}
    TopologicalSorter({name: imports(file, files) for name, file in files.items()}).prepare()


def module_of(file):
    parts = ("zerorate", *file.relative_to(ROOT).with_suffix("").parts)
    return ".".join(parts).removesuffix(".__init__")


def imports(file, modules):
    """Which modules a file imports, lazily too, but not for types alone."""
    found, left = set(), [parsed(file)]
    while left:
        node = left.pop()
        for_types = isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        left += node.orelse if for_types else ast.iter_child_nodes(node)
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            inner = {f"{node.module}.{alias.name}" for alias in node.names} & set(modules)
            found |= inner or ({node.module} if not takes_native(node) else set())
    return found & set(modules)


def takes_native(node):
    """Whether the root is asked only for the compiled module."""
    return node.module == "zerorate" and {alias.name for alias in node.names} == {"_native"}


def test_nobody_below_show_names_it():
    for file in ROOT.rglob("*.py"):
        if HEIGHT.get(own_part(file), len(FLOORS)) < HEIGHT["show"]:
            assert "zerorate.show" not in file.read_text(encoding="utf-8").replace(
                "`zerorate.show`", ""
            ), file
