"""The page on scale says of every streaming class what its `process` takes."""

import inspect
import re
from pathlib import Path

import zerorate as zr
from zerorate import _native

PAGE = Path(__file__).parents[2] / "docs/explanation/scale.md"


def test_out_and_threads_follow_from_what_process_returns():
    text = PAGE.read_text(encoding="utf-8")
    rows = re.findall(r"^\|.*\| (yes|no) \| (yes|no) \| (.*) \|$", text, re.MULTILINE)
    told = {
        name: {"out": out == "yes", "threads": threads == "yes"}
        for out, threads, names in rows
        for name in re.findall(r"`(\w+)`", names)
    }
    streams = {
        name: one
        for name, one in vars(_native).items()
        if inspect.isclass(one) and hasattr(one, "process") and hasattr(one, "to_bytes")
    }
    found = {
        name: {
            one: one in inspect.signature(stream.process).parameters for one in ("out", "threads")
        }
        for name, stream in streams.items()
    }
    assert found == told


def test_a_trace_has_neither():
    for stream in (zr.DriftFilter, zr.GyroArray, zr.Attitude, zr.PositionFilter):
        assert not {"out", "threads"} & set(inspect.signature(stream.trace).parameters)
