"""Sources at addresses: a server of this machine, stores of pyarrow, bytes in memory."""

import io
import threading
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pyarrow.fs
import pytest

import zerorate as zr
from support.logs import write_gyros
from zerorate.io import remote

SUFFIXES = [".csv", ".parquet", ".npz", ".arrow", ".tsv"]


@contextmanager
def served(content, length=None, status=200):
    """Serve bytes under any path, whose length may be stated wrongly."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(status)
            if length != "none":
                self.send_header("Content-Length", str(len(content) if length is None else length))
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, *_):
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_address[1]}"
        server.shutdown()


def written(folder, suffix):
    if suffix == ".arrow":
        path = write_gyros(folder / "log.parquet")
        import pyarrow.feather
        import pyarrow.parquet

        pyarrow.feather.write_feather(pyarrow.parquet.read_table(path), folder / "log.arrow")
        return folder / "log.arrow"
    return write_gyros(folder / f"log{suffix}")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_log_of_a_server_is_that_of_its_file(tmp_path, suffix):
    path = written(tmp_path, suffix)
    own = zr.read_log(path)
    with served(path.read_bytes()) as address:
        for query in ("", "?token=a.b/c", "#part"):
            log = zr.read_log(f"{address}/a%20b/log{suffix}{query}")
            np.testing.assert_array_equal(log.data, own.data)
            assert (log.rate, log.unit, log.names) == (own.rate, own.unit, own.names)


@pytest.mark.parametrize("kind", ["s3", "gs", "abfss"])
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_log_of_a_store_is_that_of_its_file(tmp_path, monkeypatch, kind, suffix):
    path = written(tmp_path, suffix)
    store = pyarrow.fs.SubTreeFileSystem(str(tmp_path), pyarrow.fs.LocalFileSystem())

    class Store:
        @staticmethod
        def from_uri(address):
            assert address.startswith(f"{kind}://bucket/")
            return store, address.removeprefix(f"{kind}://bucket/")

    monkeypatch.setattr(pyarrow.fs, "FileSystem", Store)
    log = zr.read_log(f"{kind}://bucket/log{suffix}")
    np.testing.assert_array_equal(log.data, zr.read_log(path).data)
    with pytest.raises(OSError, match=f"{kind}://bucket/none{suffix} cannot be read"):
        zr.read_log(f"{kind}://bucket/none{suffix}")


def test_a_file_by_its_address(tmp_path):
    path = write_gyros(tmp_path / "log.csv")
    np.testing.assert_array_equal(zr.read_log(path.as_uri()).data, zr.read_log(path).data)


@pytest.mark.parametrize("seed", range(4))
def test_what_comes_cut_is_refused(tmp_path, seed):
    raw = write_gyros(tmp_path / "log.csv").read_bytes()
    cut = int(np.random.default_rng(seed).integers(1, len(raw)))
    with (
        served(raw[:cut], length=len(raw)) as address,
        pytest.raises(OSError, match=r"cannot be read|is cut"),
    ):
        zr.read_log(f"{address}/log.csv")


def test_what_cannot_be_had_is_a_sentence(monkeypatch):
    monkeypatch.setattr(remote, "_MAX_BYTES", 1000)
    with served(b"1,2\n" * 1000, length="none") as address:
        for place in (f"{address}/log.csv", "http://127.0.0.1:1/log.csv", "http://a..b/log.csv"):
            with pytest.raises(OSError, match="cannot be read"):
                zr.read_log(place)
    with served(b"no", status=404) as address, pytest.raises(OSError, match="Not Found"):
        zr.read_log(f"{address}/log.csv")


def test_bytes_in_memory(tmp_path):
    path = write_gyros(tmp_path / "log.csv")
    log = zr.read_log(io.BytesIO(path.read_bytes()))
    np.testing.assert_array_equal(log.data, zr.read_log(path).data)
