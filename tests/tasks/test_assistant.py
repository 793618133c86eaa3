"""The tools of ``zerorate mcp``: their answers, and the folder that they stay in."""

import json
import os
import sys

import anyio
import jsonschema
import numpy as np
import pytest
from mcp.client import Client
from mcp.client.stdio import StdioServerParameters, stdio_client

import zerorate as zr
from support.calibrations import write_imu
from support.drives import drive
from zerorate.tasks.assistant import Folder, build_server

TOOLS = ["report", "check", "allan", "attitude", "navigate"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with logs, next to one that must not be read."""
    top = tmp_path_factory.mktemp("assistant")
    logs = top / "logs"
    (logs / "deep").mkdir(parents=True)
    hand = zr.simulate_motion("hand", duration=60.0).recording()
    imu = zr.Recording({name: hand[name] for name in ("gyro", "accel")})
    write_imu(logs / "deep" / "hand.csv", imu)
    write_imu(top / "secret.csv", imu)
    moving = drive()
    recording = moving.recording()
    write_imu(
        logs / "drive.csv", zr.Recording({name: recording[name] for name in ("gyro", "accel")})
    )
    rows = np.column_stack([moving.fixes.time, moving.fixes.position, moving.fixes.velocity])
    head = ["time_s", "latitude_deg", "longitude_deg", "height_m"]
    head += [f"velocity_{way}_mps" for way in ("north", "east", "down")]
    np.savetxt(logs / "fixes.csv", rows, delimiter=",", header=",".join(head), comments="")
    return logs


def call(folder, tool, **arguments):
    """Return text and fault of a tool, as the SDK's client gets them."""

    async def ask():
        async with Client(build_server(folder)) as client:
            answer = await client.call_tool(tool, arguments)
            return answer.content[0].text, answer.is_error

    return anyio.run(ask)


def test_the_client_sees_five_tools_that_only_read(folder):
    async def ask():
        async with Client(build_server(folder)) as client:
            return (await client.list_tools()).tools

    tools = anyio.run(ask)
    assert [tool.name for tool in tools] == TOOLS
    for tool in tools:
        assert tool.annotations.read_only_hint
        assert "path" in tool.input_schema["required"]
        assert "JSON" in tool.description


@pytest.mark.parametrize(("tool", "schema"), [("report", "report"), ("check", "check")])
def test_an_answer_is_the_json_of_its_command(folder, tool, schema):
    text, fault = call(folder, tool, path="deep/hand.csv")
    assert not fault
    content = json.loads(text)
    jsonschema.validate(content, zr.schemas.load_schema(schema))
    expected = json.loads(getattr(zr, tool)(folder / "deep" / "hand.csv").to_json())
    assert content == expected


def test_the_noise_is_that_of_allan(folder, tmp_path):
    text, fault = call(folder, "allan", path="deep/hand.csv")
    assert not fault
    made = zr.characterise(folder / "deep" / "hand.csv")
    paths = made.save(tmp_path, figure=False, export="json", doubtful=True)
    (models,) = [path for path in paths if path.suffix == ".json"]
    assert json.loads(text) == json.loads(models.read_text())


def test_orientation_and_track_have_table_and_samples(folder):
    for tool, arguments, columns in (
        ("attitude", {"path": "deep/hand.csv", "frame": "ned"}, ("time", "quat_w", "roll_deg")),
        ("navigate", {"path": "drive.csv", "fixes": "fixes.csv"}, ("time", "navigating")),
    ):
        text, fault = call(folder, tool, **arguments)
        assert not fault, text
        content = json.loads(text)
        assert (content["format"], content["version"]) == (f"zerorate {tool}", 1)
        samples = content["samples"]
        assert len({len(values) for values in samples.values()}) == 1
        assert 2 < len(samples["time"]) <= 50
        assert content["table"]
        assert set(columns) <= set(samples), list(samples)


OUTSIDE = ["../secret.csv", "deep/../../secret.csv", "link.csv", "linked/secret.csv", "bag"]


@pytest.mark.parametrize("name", [*OUTSIDE, "whole"])
@pytest.mark.parametrize("tool", TOOLS)
def test_no_path_leads_out_of_the_folder(folder, tool, name):
    secret = folder.parent / "secret.csv"
    for link, target in (("link.csv", secret), ("linked", folder.parent)):
        if not (folder / link).is_symlink():
            (folder / link).symlink_to(target)
    bag = folder / "bag"
    bag.mkdir(exist_ok=True)
    listed = "relative_file_paths:\n    - ../../secret.csv\n"
    (bag / "metadata.yaml").write_text(f"rosbag2_bagfile_information:\n  {listed}")
    text, fault = call(folder, tool, path=str(secret) if name == "whole" else name)
    assert fault
    assert "path must be that of a file in the folder" in text


def test_a_folder_of_sensors_with_a_link_is_refused(folder, tmp_path):
    (tmp_path / "phone").mkdir()
    (tmp_path / "phone" / "Gyroscope.csv").symlink_to(folder.parent / "secret.csv")
    with pytest.raises(ValueError, match="path must be that of a file in the folder"):
        Folder(tmp_path).find("phone")


@pytest.mark.parametrize("name", ["none.csv", "s3://bucket/log.csv", "http://localhost/log.csv"])
def test_a_file_that_is_not_there_is_one_sentence(folder, name):
    text, fault = call(folder, "report", path=name)
    assert fault
    assert f"there is no file '{name}' in the folder" in text


def test_fixes_stay_in_the_folder(folder):
    text, fault = call(folder, "navigate", path="drive.csv", fixes="../secret.csv")
    assert fault
    assert "path must be that of a file in the folder" in text


def test_nothing_is_written(folder):
    before = sorted(folder.rglob("*"))
    for tool in TOOLS[:4]:
        call(folder, tool, path="deep/hand.csv")
    assert sorted(folder.rglob("*")) == before


def test_the_command_speaks_on_stdin_and_stdout(folder):
    server = StdioServerParameters(
        command=sys.executable, args=["-m", "zerorate", "mcp", str(folder)], env={**os.environ}
    )

    async def ask():
        async with Client(stdio_client(server)) as client:
            answer = await client.call_tool("check", {"path": "deep/hand.csv"})
            return answer.content[0].text

    text = anyio.run(ask)
    assert json.loads(text)["format"] == "zerorate checks"
