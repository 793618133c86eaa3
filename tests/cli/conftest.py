"""What every test of a command needs: a folder for its files."""

import pytest


@pytest.fixture
def out(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    return folder
