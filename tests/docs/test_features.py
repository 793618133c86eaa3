"""The page of formats and libraries says what the tables in the code say, and what libraries do."""

import io
import re
from importlib.util import find_spec

import matplotlib.figure
import numpy as np
import polars
import pyarrow
import pytest
from scipy.spatial.transform import Rotation

import zerorate as zr
from support.features import PAGE, TABLES, rendered
from zerorate.tasks.assistant import build_server
from zerorate.tasks.batch import process_log

TEXT = PAGE.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def recording():
    return zr.simulate_motion("hand", duration=20.0).recording()


def test_the_tables_are_those_of_the_code():
    assert rendered(TEXT) == TEXT, "run python -m support.features in tests"
    assert set(re.findall(r"<!-- table: (\w+) -->", TEXT)) == set(TABLES)


def numpy_arrays(recording):
    gyro = recording.gyro
    assert zr.read_log({"gyro_dps": np.asarray(gyro)}, rate=100.0).channels == 3
    rows = np.rec.fromarrays(gyro.data.T, names=[f"gyro_{axis}_dps" for axis in "xyz"])
    assert zr.read_log(rows, rate=100.0).channels == 3
    assert np.asarray(zr.estimate_attitude(recording)).shape == (gyro.n, 4)


def pandas_frames(recording):
    frame = recording.gyro.to_pandas()
    np.testing.assert_array_equal(zr.read_log(frame).data, recording.gyro.data)
    drift = zr.DriftFilter(100.0).process(frame["gyro_x_radps"])
    assert len(drift) == len(frame)


def polars_frames(recording):
    frame = polars.DataFrame(recording.gyro)
    np.testing.assert_array_equal(zr.read_log(frame).data, recording.gyro.data)
    assert len(zr.DriftFilter(100.0).process(frame["gyro_x_radps"])) == len(frame)


def arrow_tables(recording):
    for given in (recording.gyro.to_arrow(), pyarrow.table(recording.gyro)):
        np.testing.assert_array_equal(zr.read_log(given).data, recording.gyro.data)

    class Stream:
        def __arrow_c_stream__(self, requested_schema=None):
            return recording.gyro.__arrow_c_stream__(requested_schema)

    np.testing.assert_array_equal(zr.read_log(Stream()).data, recording.gyro.data)


def scipy_rotations(recording):
    turned = zr.record.body_axes(recording, Rotation.from_euler("x", 90.0, degrees=True))
    np.testing.assert_allclose(turned.gyro.data[:, 2], recording.gyro.data[:, 1], atol=1e-15)
    assert len(zr.estimate_attitude(recording).rotation) == recording.gyro.n


def matplotlib_axes(recording):
    figure = matplotlib.figure.Figure()
    assert recording.gyro.plot(ax=figure.add_subplot()) is figure
    assert isinstance(recording.gyro.plot(), matplotlib.figure.Figure)


def notebooks(recording):
    for shown in (recording.gyro, zr.allan(recording.gyro)):
        assert "<pre" in shown._repr_html_()
        assert "<img" in shown._repr_html_()


def one_log_as_a_task(recording):
    frame = recording.gyro.to_pandas()
    buffer = io.BytesIO()
    frame.to_parquet(buffer)
    assert process_log("no.parquet")[0]["status"] == "failed"


LIBRARIES = {
    "NumPy": numpy_arrays,
    "pandas": pandas_frames,
    "polars": polars_frames,
    "pyarrow": arrow_tables,
    "DuckDB": arrow_tables,
    "SciPy": scipy_rotations,
    "matplotlib": matplotlib_axes,
    "Jupyter": notebooks,
    "Dask": lambda _: find_spec("distributed"),
    "Ray, Daft": one_log_as_a_task,
    "assistants (MCP)": lambda _: build_server("."),
    "ROS 2": lambda _: find_spec("rosbags"),
    "C and C++": lambda _: None,
}
"""What shows each row; workers, ROS 2 and C have their own tests."""


def test_every_library_of_the_page_is_shown():
    rows = TEXT.partition("## Libraries")[2].splitlines()
    names = [row.split(" | ")[0].removeprefix("| ") for row in rows if row.startswith("| ")]
    assert names[2:] == list(LIBRARIES)


@pytest.mark.parametrize("name", LIBRARIES)
def test_a_library_takes_and_gives_what_the_page_says(name, recording):
    LIBRARIES[name](recording)
