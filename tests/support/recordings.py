"""Where the real recordings lie, the mark for tests that need them, and what is read of them."""

from functools import cache
from pathlib import Path

import pyarrow.parquet as pq
import pytest

import zerorate as zr

RECORDINGS: Path = Path(__file__).parents[3] / "shared" / "data"

needs_recordings = pytest.mark.skipif(
    not RECORDINGS.is_dir(), reason="the real recordings are not next to the checkout"
)


@cache
def column(name, field):
    """Return a column of a recording as it is written, read once."""
    z = pq.read_table(RECORDINGS / f"{name}.parquet", columns=[field])[field].to_numpy()
    z.flags.writeable = False
    return z


@cache
def recorded(name, rate, field):
    """Return a column of a recording as ``read_log`` reads it, at so many samples a second."""
    z = zr.read_log(RECORDINGS / f"{name}.parquet", rate=rate, columns=field).data[:, 0]
    z.flags.writeable = False
    return z
