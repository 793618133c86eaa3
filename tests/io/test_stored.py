"""NPZ and HDF5: only what is asked for is read, and only from the file itself."""

import io
import time
import zipfile

import h5py
import numpy as np
import pytest

from zerorate.io import read_log, read_recording
from zerorate.io.readers import hdf5 as hdf5_reader
from zerorate.io.readers.isolated import run_isolated
from zerorate.record import LogError

N = 100
TIME = np.arange(N) / 100
GYRO = np.random.default_rng(1).standard_normal((N, 3))
ARRAYS = {"time_s": TIME, "gyro_dps": GYRO, "picture": np.zeros((N, 60)), "temp": TIME}


def hdf5(folder, name="a.h5"):
    with h5py.File(folder / name, "w") as file:
        file.update(ARRAYS)
    return folder / name


def npz(folder):
    np.savez(folder / "a.npz", **ARRAYS)
    return folder / "a.npz"


def test_an_npz_reads_no_other_member(tmp_path, monkeypatch):
    path, opened = npz(tmp_path), []
    read = np.lib.format.read_array
    monkeypatch.setattr(
        np.lib.format, "read_array", lambda file, **_: opened.append(file.name) or read(file)
    )
    log = read_log(path, columns=["gyro_z_dps", "gyro_x_dps"])
    np.testing.assert_array_equal(log.data, GYRO[:, [2, 0]])
    assert sorted(opened) == ["gyro_dps.npy", "time_s.npy"]
    opened.clear()
    read_log(path, columns="temp")
    assert sorted(opened) == ["temp.npy", "time_s.npy"]


def readings(monkeypatch):
    """Return the list to which every reading of a data set adds its name, and that of a field."""
    opened = []

    def watched(work, path, *arguments):
        if work == "hdf5_values":
            opened.append(arguments[:2])
        return run_isolated(work, path, *arguments)

    monkeypatch.setattr(hdf5_reader, "run_isolated", watched)
    return opened


def test_hdf5_reads_no_other_data_set(tmp_path, monkeypatch):
    path, opened = hdf5(tmp_path), readings(monkeypatch)
    np.testing.assert_array_equal(read_log(path).data, GYRO)
    assert sorted(opened) == [("gyro_dps", None), ("time_s", None)]


def test_damage_elsewhere_does_no_harm(tmp_path):
    path = npz(tmp_path)
    with zipfile.ZipFile(path) as archive:
        place = archive.getinfo("picture.npy").header_offset + 9000
    raw = bytearray(path.read_bytes())
    raw[place] ^= 1
    path.write_bytes(raw)
    assert read_log(path, columns="gyro_x_dps").n == N
    with pytest.raises(LogError, match="damaged"):
        read_log(path, columns="picture_0")


def test_hdf5_with_named_fields_reads_those_asked_for(tmp_path, monkeypatch):
    rows = np.zeros(N, [("t", "f8"), ("wx_dps", "f4"), ("temp", "f8")])
    rows["t"] = TIME
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["imu"] = rows
    opened = readings(monkeypatch)
    assert read_log(tmp_path / "a.h5").rate == 100
    assert sorted(opened) == [("imu", "t"), ("imu", "wx_dps")]


def external_link(folder):
    hdf5(folder, "other.h5")
    with h5py.File(folder / "a.h5", "w") as file:
        file["gyro_x"] = TIME
        file["imu/gyro_y"] = h5py.ExternalLink("other.h5", "temp")


def external_storage(folder):
    (folder / "secret.bin").write_bytes(TIME.tobytes())
    with h5py.File(folder / "a.h5", "w") as file:
        place = [(str(folder / "secret.bin"), 0, 8 * N)]
        file.create_dataset("gyro_x", (N,), "f8", external=place)


def virtual_data_set(folder):
    hdf5(folder, "other.h5")
    layout = h5py.VirtualLayout((N,), "f8")
    layout[:] = h5py.VirtualSource(folder / "other.h5", "temp", (N,))
    with h5py.File(folder / "a.h5", "w") as file:
        file.create_virtual_dataset("gyro_x", layout)


@pytest.mark.parametrize("write", [external_link, external_storage, virtual_data_set])
def test_hdf5_that_reaches_into_other_files_is_refused(tmp_path, write):
    write(tmp_path)
    for read in (read_log, read_recording):
        with pytest.raises(LogError, match="lies in another file, expected an HDF5 file that"):
            read(tmp_path / "a.h5", rate=100)


@pytest.mark.parametrize("chunks", [None, (1000,)])
def test_values_that_were_never_written_are_not_zeros(tmp_path, chunks):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        gyro = file.create_dataset("gyro_x", (10**12,), "f8", chunks=chunks)
        if chunks:
            gyro[:1000] = 1.0
        file["gyro_y"] = TIME
    written = 1000 if chunks else 0
    message = f"'gyro_x' declares 1000000000000 values, but only {written} were written"
    with pytest.raises(LogError, match=message):
        read_log(tmp_path / "a.h5", rate=100, columns="gyro_x")
    assert read_log(tmp_path / "a.h5", rate=100, columns="gyro_y").n == N


def test_soft_links_and_empty_data_sets(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["gyro_x"] = TIME
        file["again"] = h5py.SoftLink("/gyro_x")
        file["nothing"] = h5py.Empty("f8")
    assert read_log(tmp_path / "a.h5", rate=100).n == N


@pytest.mark.parametrize("shape", [(10**10,), (10**10, 3), (0, 10**10), (3, 10**12), (1 << 62, 4)])
@pytest.mark.parametrize("kind", ["S0", "V0", "U0", "S1", "f8", "c16", [("gx", "S0")], []])
@pytest.mark.parametrize("suffix", [".npy", ".npz"])
def test_absurd_sizes_are_a_sentence(tmp_path, shape, kind, suffix):
    header = io.BytesIO()
    descr = np.lib.format.dtype_to_descr(np.dtype(kind))
    np.lib.format.write_array_header_1_0(
        header, {"descr": descr, "fortran_order": False, "shape": shape}
    )
    path = tmp_path / f"log{suffix}"
    if suffix == ".npy":
        path.write_bytes(header.getvalue())
    else:
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("data.npy", header.getvalue())
    begin = time.monotonic()
    with pytest.raises(LogError, match="log"):
        read_log(path, rate=100)
    assert time.monotonic() - begin < 5.0
