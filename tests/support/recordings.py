"""Where the real recordings lie, and the mark for tests that need them."""

from pathlib import Path

import pytest

RECORDINGS: Path = Path(__file__).parents[3] / "shared" / "data"

needs_recordings = pytest.mark.skipif(
    not RECORDINGS.is_dir(), reason="the real recordings are not beside the checkout"
)
