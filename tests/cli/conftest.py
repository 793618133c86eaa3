"""What every test of a command needs: a way to call it, and a folder for its files."""

import pytest

from zerorate.cli import run


@pytest.fixture
def call(capsys):
    """Run ``zerorate`` with these arguments; return its code, stdout and stderr."""

    def call(*arguments):
        code = run([str(argument) for argument in arguments])
        return code, *capsys.readouterr()

    return call


@pytest.fixture
def out(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    return folder
