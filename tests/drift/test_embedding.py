"""The filter inside other programs: their arrays, their loops, and the examples that show it."""

import multiprocessing
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import zerorate as zr

EXAMPLES = Path(__file__).parents[2] / "examples"
Z = 0.5 + 0.1 * np.random.default_rng(1).standard_normal((500, 3)).astype(np.float32)
PACKED = np.dtype([("flag", "u1"), ("gyro", "f8", 3), ("count", "i2")])
ALIGNED = np.dtype([("time", "f8"), ("gyro", "f8", 3)], align=True)
SINGLE = np.dtype([("count", "i2"), ("gyro", "f4", 3)])
RECORDS = pytest.mark.parametrize("dtype", [PACKED, ALIGNED, SINGLE], ids=str)


def drift():
    return zr.DriftFilter(100.0, method="auto", output="compensated", channels=3)


def records(dtype):
    made = np.zeros(len(Z), dtype=dtype)
    made["gyro"] = Z
    return made


def example(name, *options):
    command = [sys.executable, "-W", "error", EXAMPLES / name, *options]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


@RECORDS
def test_fields_of_records_in_a_batch_and_one_by_one(dtype):
    made, expected = records(dtype), drift().process(Z)
    one = drift()
    np.testing.assert_array_equal(drift().process(made["gyro"]), expected)
    np.testing.assert_array_equal([one.update(record["gyro"]) for record in made], expected)


@RECORDS
def test_records_in_a_read_only_map(dtype, tmp_path):
    np.save(tmp_path / "z.npy", records(dtype))
    mapped = np.load(tmp_path / "z.npy", mmap_mode="r")
    one, expected = drift(), drift().process(Z)
    np.testing.assert_array_equal(drift().process(mapped["gyro"]), expected)
    np.testing.assert_array_equal([one.update(row) for row in mapped["gyro"]], expected)
    np.testing.assert_array_equal(drift().process(mapped["gyro"][::-1]), drift().process(Z[::-1]))


@RECORDS
def test_a_field_takes_the_answers(dtype):
    made = records(dtype)
    if dtype is SINGLE:
        with pytest.raises(TypeError, match="out must be a writeable float64 array"):
            drift().process(Z, out=made["gyro"])
        return
    drift().process(made["gyro"], out=made["gyro"])
    np.testing.assert_array_equal(made["gyro"], drift().process(Z))


def test_a_read_only_map_takes_no_answers(tmp_path):
    np.save(tmp_path / "z.npy", Z.astype(np.float64))
    mapped = np.load(tmp_path / "z.npy", mmap_mode="r")
    with pytest.raises(ValueError, match="got a read-only one"):
        drift().process(Z, out=mapped)


def test_whole_records_are_refused_in_words():
    with pytest.raises(TypeError, match="z must hold real numbers, got dtype"):
        drift().process(records(PACKED))


def test_a_pickle_in_another_process_goes_on(tmp_path):
    gyro = drift()
    expected = drift().process(Z)[250:]
    gyro.process(Z[:250])
    (tmp_path / "in").write_bytes(pickle.dumps((gyro, Z[250:])))
    code = (
        "import pickle, pathlib, sys; folder = pathlib.Path(sys.argv[1]);"
        "gyro, z = pickle.loads((folder / 'in').read_bytes());"
        "(folder / 'out').write_bytes(pickle.dumps(gyro.process(z)))"
    )
    subprocess.run([sys.executable, "-c", code, tmp_path], check=True)
    found = pickle.loads((tmp_path / "out").read_bytes())
    np.testing.assert_array_equal(found, expected)


def test_the_example_of_embedding():
    told = example("embedding.py")
    assert told.count("the same bits as stepping in a loop") == 3
    assert "other numbers" not in told


def test_the_example_with_asyncio():
    told = example("asyncio_stream.py", "--seconds", "1", "--rate", "100")
    left = float(told.split("after compensation: ")[1].split()[0])
    # The mean of 50 samples of 0.05 has a deviation of 0.007, that of the bias learned is like it;
    # three axes.
    assert left < 0.05
    assert "the last checkpoint holds" in told


def _filtered_on_threads(z):
    """Return the bytes of channels on two threads, and of deviations on as many as there are."""
    f = zr.DriftFilter(rate=100.0, method="fading", channels=z.shape[1], output="estimate")
    deviations = zr.allan(z[:, 0], 100.0).deviation
    return f.process(z, threads=2).tobytes() + deviations.tobytes()


def test_threads_survive_a_fork():
    """A fork takes over no threads: the child makes its own and does not wait for its parent's."""
    z = np.random.default_rng(4).standard_normal((40_000, 8))
    expected = _filtered_on_threads(z)
    context = multiprocessing.get_context("fork")
    with context.Pool(1) as pool:
        assert pool.apply_async(_filtered_on_threads, (z,)).get(timeout=60) == expected
