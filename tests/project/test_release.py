"""What a release is made by: workflows, versions, and what may be in a wheel."""

import importlib.util
import re
import zipfile
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
WORKFLOWS = sorted((ROOT / ".github/workflows").glob("*.yml"))
PINNED = re.compile(r"uses: [\w.-]+/[\w./-]+@[0-9a-f]{40} # v\d+(\.\d+)*$")


def script(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / f".ci/{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def wheel_of(folder, *, without=(), more=(), requires="numpy>=2.0", tag="cp311-abi3-linux_x86_64"):
    """Write a wheel of empty files; return its path."""
    info = "zerorate-1.0.dist-info"
    names = {
        "zerorate/__init__.py",
        "zerorate/record/log.py",
        "zerorate/show/page.css",
        "zerorate/py.typed",
        "zerorate/_native.pyi",
        "zerorate/_native.abi3.so",
        f"{info}/WHEEL",
        f"{info}/RECORD",
        f"{info}/entry_points.txt",
        f"{info}/licenses/LICENSE-MIT",
    }
    path = folder / f"zerorate-1.0-{tag}.whl"
    metadata = f"Name: zerorate\nRequires-Dist: {requires}\nRequires-Dist: typer ; extra == 'cli'\n"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(f"{info}/METADATA", metadata)
        for name in sorted(names - set(without) | set(more)):
            archive.writestr(name, b"")
    return path


def test_a_wheel_as_it_should_be(tmp_path):
    assert script("wheel").faults(wheel_of(tmp_path)) == []


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"more": ["zerorate/notes.txt"]}, "does not belong there: zerorate/notes.txt"),
        ({"more": ["tests/test_a.py"]}, "does not belong there: tests/test_a.py"),
        ({"more": ["zerorate/a.pyc"]}, "does not belong there: zerorate/a.pyc"),
        ({"without": ["zerorate/py.typed"]}, "is missing: zerorate/py.typed"),
        ({"without": ["zerorate/_native.abi3.so"]}, "there is not one compiled module"),
        ({"requires": "rich"}, "needs more than NumPy: rich"),
        ({"tag": "cp311-cp311-linux_x86_64"}, "is of one Python alone"),
    ],
)
def test_a_wheel_as_it_should_not_be(tmp_path, how, message):
    assert script("wheel").faults(wheel_of(tmp_path, **how)) == [message]


def test_a_wheel_that_is_too_large(tmp_path, monkeypatch):
    wheel = script("wheel")
    monkeypatch.setattr(wheel, "LIMIT", 10)
    (fault,) = wheel.faults(wheel_of(tmp_path))
    assert fault.endswith("bytes, at most 10 are meant")


def test_all_that_carries_the_version_carries_one():
    version = script("version")
    version.check(version.of_cargo())


def test_a_tag_of_another_version_is_refused(monkeypatch):
    version = script("version")
    monkeypatch.setattr("sys.argv", ["version.py", "v99.0.0"])
    with pytest.raises(SystemExit, match=r"tag v99\.0\.0 is not v"):
        version.main()


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)
def test_a_workflow_is_pinned_and_may_only_read(path):
    text = path.read_text(encoding="utf-8")
    uses = [line.strip().removeprefix("- ") for line in text.splitlines() if "uses:" in line]
    assert uses
    assert [line for line in uses if not PINNED.fullmatch(line)] == []
    workflow = yaml.safe_load(text)
    assert workflow["permissions"] == {"contents": "read"}
    writing = {name for name, job in workflow["jobs"].items() if "permissions" in job}
    assert writing <= {"publish"}
    for command in re.findall(r"\bmake ([a-z-]+)", text):
        makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
        assert re.search(rf"^{command}:", makefile, re.MULTILINE), command
    for name in re.findall(r"\.ci/[\w.]+", text):
        assert (ROOT / name).exists(), name


def test_a_release_has_a_wheel_for_each_platform_and_is_published_by_a_tag_alone():
    text = (ROOT / ".github/workflows/release.yml").read_text(encoding="utf-8")
    jobs = yaml.safe_load(text)["jobs"]
    targets = {row["target"] for row in jobs["wheels"]["strategy"]["matrix"]["include"]}
    assert targets == {
        *(
            f"{cpu}-unknown-linux-{libc}"
            for cpu in ("x86_64", "aarch64")
            for libc in ("gnu", "musl")
        ),
        *("x86_64-apple-darwin", "aarch64-apple-darwin", "x86_64-pc-windows-msvc"),
    }
    publish = jobs["publish"]
    # Started by hand, on a tag too, it publishes nothing.
    assert publish["if"] == "github.event_name == 'push' && github.ref_type == 'tag'"
    assert set(publish["needs"]) == {"wheels", "free-threaded", "sources"}
    assert publish["permissions"]["id-token"] == "write"
    assert "password" not in text
    assert "secrets." not in text


def test_a_wheel_under_test_never_comes_from_an_index():
    """A package of the same name with a higher version would run before the wheel is attested."""
    text = (ROOT / ".github/workflows/release.yml").read_text(encoding="utf-8")
    installs = re.findall(r"pip install ([^&]*?\bzerorate)(?= &&|\s)", text)
    assert len(installs) == 2
    for arguments in installs:
        assert {"--no-index", "--no-deps", "--find-links"} <= set(arguments.split())


def test_every_dependency_has_an_oldest_version():
    lines = list(script("minimal").constraints())
    assert len(lines) > 5
    assert lines[0].startswith("numpy==")
