"""Public recordings by name: told, downloaded once, checked. Nothing here uses the network."""

import functools
import hashlib
import http.server
import re
import threading
from dataclasses import replace

import pytest

import zerorate as zr
from zerorate import datasets
from zerorate.datasets import DATASETS, fetch

TEXT = b"t,gyro_x_dps\n0.00,1\n0.01,2\n0.02,3\n"
NAME = "xsens/sit-to-stand"


@pytest.fixture
def published(tmp_path, monkeypatch):
    """Put a recording of ours in the place of a public one, on a server of this machine."""
    root = tmp_path / "served"
    one = replace(DATASETS[NAME], sha256=hashlib.sha256(TEXT).hexdigest())
    file = root / one.repository / one.commit / one.path
    file.parent.mkdir(parents=True)
    file.write_bytes(TEXT)

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_):
            pass

    with http.server.HTTPServer(
        ("127.0.0.1", 0), functools.partial(Quiet, directory=root)
    ) as server:
        threading.Thread(target=server.serve_forever).start()
        monkeypatch.setattr(datasets, "_HOST_URL", "http://{}:{}".format(*server.server_address))
        monkeypatch.setitem(DATASETS, NAME, one)
        yield file
        server.shutdown()


def test_it_is_told_downloaded_once_and_read(published, tmp_path, capsys):
    first = fetch(NAME, tmp_path / "kept")
    said = capsys.readouterr().err
    assert DATASETS[NAME].licence in said
    assert DATASETS[NAME].about in said
    published.unlink()
    assert fetch(NAME, tmp_path / "kept") == first
    assert capsys.readouterr().err == ""
    assert zr.read_log(first).n == 3


def test_another_file_than_the_known_one_is_refused(published, tmp_path):
    published.write_bytes(TEXT + b"0.03,4\n")
    with pytest.raises(ValueError, match="hash"):
        fetch(NAME, tmp_path / "kept")
    assert not any(file.is_file() for file in (tmp_path / "kept").glob("xsens*"))


def test_that_no_checksum_is_known_is_told(published, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(DATASETS, NAME, replace(DATASETS[NAME], sha256=None))
    fetch(NAME, tmp_path / "kept")
    assert "pinned by its commit, no checksum is known" in capsys.readouterr().err


@pytest.fixture
def without_checksum(published, monkeypatch):
    monkeypatch.setitem(DATASETS, NAME, replace(DATASETS[NAME], sha256=None))


@pytest.mark.usefixtures("without_checksum")
def test_the_checksum_of_the_first_download_is_kept(published, tmp_path):
    first = fetch(NAME, tmp_path)
    assert fetch(NAME, tmp_path) == first
    published.unlink()
    first.write_bytes(TEXT + b"0.03,4\n")
    with pytest.raises((ValueError, OSError)):
        fetch(NAME, tmp_path)


@pytest.mark.usefixtures("without_checksum")
def test_a_foreign_file_under_the_name_is_refused(tmp_path):
    (tmp_path / "xsens-sit-to-stand.txt").write_bytes(TEXT)
    with pytest.raises(ValueError, match="delete the file to download it again"):
        fetch(NAME, tmp_path)


def test_an_unknown_name_is_refused_with_those_near_it():
    with pytest.raises(ValueError, match=r"name is no public recording: 'broad/5'; such as broad/"):
        fetch("broad/5")


def test_without_pooch_the_extra_is_named(monkeypatch):
    monkeypatch.setattr(datasets, "find_spec", lambda name: None)
    with pytest.raises(ImportError, match=r"needs pooch: run pip install '.\[data\]'"):
        fetch("broad/05")


def test_each_says_what_it_is_and_where():
    for name, one in DATASETS.items():
        assert name == one.name
        assert re.fullmatch(r"[a-z0-9]+/[a-z0-9-]+", name)
        assert re.fullmatch(r"[0-9a-f]{40}", one.commit)
        assert one.sha256 is None or re.fullmatch(r"[0-9a-f]{64}", one.sha256)
        assert one.about
        assert one.licence
        assert " " not in one.url
