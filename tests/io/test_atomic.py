"""Files appear whole or not at all."""

import errno
import os

import numpy as np
import pytest

from support.killed import temporary_of
from zerorate.io import write_log
from zerorate.record import Log, atomic_path, check_writable
from zerorate.record.atomic import remove_leftovers


def test_success_leaves_one_file(tmp_path):
    target = tmp_path / "figure.png"
    with atomic_path(target) as temporary:
        assert temporary.parent == tmp_path
        assert temporary.suffix == ".png"
        temporary.write_text("whole")
        assert not target.exists()
    assert target.read_text() == "whole"
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, SystemExit])
def test_any_exception_leaves_the_old_file(tmp_path, error):
    target = tmp_path / "a.csv"
    target.write_text("old")

    def write_half():
        with atomic_path(target, force=True) as temporary:
            temporary.write_text("half")
            raise error

    with pytest.raises(error):
        write_half()
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_a_write_without_room_says_where(tmp_path):
    with pytest.raises(OSError, match="No space left") as told, atomic_path(tmp_path / "a.csv"):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert str(told.value).endswith(f": '{tmp_path}'")


def test_existing_file_needs_force(tmp_path):
    target = tmp_path / "a.csv"
    target.write_text("old")
    with pytest.raises(FileExistsError, match=r"a\.csv exists already; pass force=True"):
        check_writable(target)
    with atomic_path(target, force=True) as temporary:
        temporary.write_text("new")
    assert target.read_text() == "new"


def test_file_that_appears_meanwhile_is_kept(tmp_path):
    target = tmp_path / "a.csv"

    def write():
        with atomic_path(target) as temporary:
            temporary.write_text("mine")
            target.write_text("theirs")

    with pytest.raises(FileExistsError):
        write()
    assert target.read_text() == "theirs"
    assert list(tmp_path.iterdir()) == [target]


def test_link_keeps_pointing_at_the_replaced_file(tmp_path):
    real, link = tmp_path / "real.txt", tmp_path / "link.txt"
    real.write_text("old")
    link.symlink_to(real)
    with atomic_path(link, force=True) as temporary:
        temporary.write_text("new")
    assert link.is_symlink()
    assert real.read_text() == "new"


def test_bad_places_are_named_before_any_work(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(FileNotFoundError, match=r"folder .*missing does not exist"):
        check_writable(tmp_path / "missing" / "a.csv")
    with pytest.raises(NotADirectoryError, match="is not a folder"):
        check_writable(tmp_path / "file" / "a.csv")
    with pytest.raises(IsADirectoryError, match="it is a folder"):
        check_writable(tmp_path, force=True)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes with names are of POSIX")
def test_a_pipe_or_a_device_is_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with (
        pytest.raises(OSError, match="it is no file but a device or a pipe"),
        atomic_path(tmp_path / "pipe", force=True),
    ):
        raise AssertionError
    assert (tmp_path / "pipe").is_fifo()


def test_folder_without_permission(tmp_path, monkeypatch):
    # Not by chmod: root may write anywhere.
    monkeypatch.setattr(os, "access", lambda _, mode: not mode & os.W_OK)
    with pytest.raises(PermissionError, match="not writable"):
        check_writable(tmp_path / "a.csv")


def test_write_log_refuses_and_replaces(tmp_path):
    log = Log(np.arange(2.0), 1.0, [1.0, 2.0], ["gyro_x_dps"], "deg/s")
    write_log(log, tmp_path / "a.npz")
    with pytest.raises(FileExistsError, match="force=True"):
        write_log(log, tmp_path / "a.npz")
    write_log(log, tmp_path / "a.npz", force=True)
    assert [p.name for p in tmp_path.iterdir()] == ["a.npz"]


@pytest.mark.parametrize(
    "name",
    [
        "\U0001f9ed" * 62 + ".csv",
        "a." + "b" * 250,
        "x" * 251 + ".npz",
        os.fsdecode(b"r\xe9s.csv"),
        "ü.ü",
    ],
)
def test_names_of_any_length_and_letters(tmp_path, name):
    with atomic_path(tmp_path / name) as temporary:
        assert temporary.name.isascii()
        assert len(temporary.name) < 80
        temporary.write_text("whole")
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_what_this_process_is_writing_stays(tmp_path):
    target = tmp_path / "a.csv"
    with atomic_path(target) as temporary:
        temporary.write_text("half")
        # Numbers of processes come again, after a restart of a container above all.
        left = temporary_of(target, os.getpid())
        left.write_text("left")
        remove_leftovers([target, tmp_path / "b.csv"])
        assert (temporary.exists(), left.exists()) == (True, False)


def test_sweeping_a_folder_that_is_not_there(tmp_path):
    remove_leftovers([tmp_path / "none" / "a.csv"])
    assert list(tmp_path.iterdir()) == []
