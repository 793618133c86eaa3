"""What a publication needs: the metadata of wheel and crate agree, and so does the conda recipe."""

import re
import tomllib
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
WORKSPACE = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]
CORE = tomllib.loads((ROOT / "rust/core/Cargo.toml").read_text())["package"]
RECIPE = yaml.safe_load((ROOT / "packaging/conda/recipe.yaml").read_text())


def test_the_crate_has_what_its_registry_shows():
    assert CORE["documentation"] == f"https://docs.rs/{CORE['name']}"
    assert CORE["metadata"]["docs"]["rs"]["all-features"]
    assert 1 <= len(CORE["keywords"]) <= 5
    assert all(re.fullmatch(r"[a-z][\w-]{0,19}", word) for word in CORE["keywords"])
    folder = ROOT / "rust/core"
    assert {path.name for path in folder.glob("LICENSE*")} == set(PROJECT["license-files"])
    assert (folder / CORE["readme"]).is_file()


def test_wheel_and_workspace_say_the_same():
    assert PROJECT["license"] == WORKSPACE["license"]
    assert PROJECT["description"] == WORKSPACE["description"]
    assert [one["name"] for one in PROJECT["authors"]] == ["The zerorate developers"]
    minimum = PROJECT["requires-python"].removeprefix(">=")
    assert f"Programming Language :: Python :: {minimum}" in PROJECT["classifiers"]


def test_every_extra_is_in_all_and_is_explained():
    extras = set(PROJECT["optional-dependencies"]) - {"all"}
    (whole,) = PROJECT["optional-dependencies"]["all"]
    assert set(re.search(r"\[(.*)\]", whole)[1].split(",")) == extras
    page = (ROOT / "docs/how-to/install.md").read_text()
    rows = "".join(line for line in page.splitlines() if line.startswith("| `"))
    assert extras <= set(re.findall(r"`(\w+)`", rows))


def test_the_conda_recipe_builds_this_package():
    assert RECIPE["context"]["version"] == WORKSPACE["version"]
    assert RECIPE["context"]["python_min"] == PROJECT["requires-python"].removeprefix(">=")
    assert RECIPE["package"]["name"] == PROJECT["name"]
    assert RECIPE["about"]["license"] == PROJECT["license"]
    assert RECIPE["about"]["summary"] == PROJECT["description"]
    assert set(PROJECT["license-files"]) < set(RECIPE["about"]["license_file"])
    run = {one.replace(" ", "") for one in RECIPE["requirements"]["run"]}
    assert run == {"python", *PROJECT["dependencies"]}
    scripts = [f"{name} = {target}" for name, target in PROJECT["scripts"].items()]
    assert RECIPE["build"]["python"]["entry_points"] == scripts
    build = tomllib.loads((ROOT / "pyproject.toml").read_text())["build-system"]["requires"]
    assert {one.replace(" ", "") for one in RECIPE["requirements"]["host"]} >= set(build)
