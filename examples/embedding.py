"""The filter inside other programs: ``python examples/embedding.py``.

The examples are a loop of another tool, records in structured arrays, read-only mapped files, and
filters that move between processes.
"""

import tempfile
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import numpy.typing as npt

import zerorate as zr

RATE = 100.0
BIAS = np.array([0.5, -0.2, 1.0])
SAMPLE = np.dtype([("time", "f8"), ("gyro", "f4", 3), ("temperature", "i2")])
"""Record of a driver; it is packed, so the fields are not aligned for a float64."""


def main() -> None:
    """Run each example, and check that all give the same numbers."""
    records = recorded(6000)
    stepped = in_a_loop(records)
    ways = {
        "a field of a structured array": of_a_field,
        "a read-only memory map": of_a_map,
        "two processes in turn": across_processes,
    }
    for name, way in ways.items():
        same = np.array_equal(way(records), stepped)
        print(f"{name}: {'the same bits' if same else 'other numbers'} as stepping in a loop")


def recorded(n: int) -> npt.NDArray[np.void]:
    """Return simulated samples in the form of a driver."""
    records = np.zeros(n, dtype=SAMPLE)
    records["time"] = np.arange(n) / RATE
    records["gyro"] = BIAS + 0.05 * np.random.default_rng(1).standard_normal((n, 3))
    return records


def new_filter() -> zr.DriftFilter:
    """Return the filter with which each example starts."""
    return zr.DriftFilter(RATE, method="auto", output="compensated", channels=3)


class Robot:
    """Example of another tool's loop, which calls a controller every tick."""

    def __init__(self, controller: Callable[[np.void], npt.NDArray[np.float64]]) -> None:
        self.controller = controller
        self.angle = np.zeros(3)

    def run(self, records: npt.NDArray[np.void]) -> npt.NDArray[np.float64]:
        """Return the rates from the controller, and store their integral."""
        rates = np.array([self.controller(record) for record in records])
        self.angle = rates.sum(axis=0) / RATE
        return rates


def in_a_loop(records: npt.NDArray[np.void]) -> npt.NDArray[np.float64]:
    """Call the filter in the loop of another tool."""
    gyro = new_filter()
    robot = Robot(lambda record: gyro.update(record["gyro"]))
    rates = robot.run(records)
    raw = np.abs(records["gyro"].sum(axis=0) / RATE).max()
    left = np.abs(robot.angle).max()
    print(f"angle after {len(records) / RATE:.0f} s at rest: {left:.3f} deg, raw {raw:.1f} deg")
    return rates


def of_a_field(records: npt.NDArray[np.void]) -> npt.NDArray[np.float64]:
    """Filter a field in place; any stride and any real dtype is allowed."""
    return new_filter().process(records["gyro"])


def of_a_map(records: npt.NDArray[np.void]) -> npt.NDArray[np.float64]:
    """Filter a file in blocks; it may be larger than the memory."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "records.npy"
        np.save(path, records)
        mapped, gyro = np.load(path, mmap_mode="r"), new_filter()
        blocks = [gyro.process(mapped[i : i + 1000]["gyro"]) for i in range(0, len(mapped), 1000)]
        # Windows cannot remove a mapped file.
        del mapped
    return np.concatenate(blocks)


def across_processes(records: npt.NDArray[np.void]) -> npt.NDArray[np.float64]:
    """Move a filter between processes as a pickle; each process continues the work."""
    gyro, blocks = new_filter(), []
    # "spawn" shares nothing, so everything that arrives was pickled.
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        for block in np.split(records["gyro"], 4):
            gyro, rates = pool.submit(filtered, gyro, block).result()
            blocks.append(rates)
    return np.concatenate(blocks)


def filtered(
    gyro: zr.DriftFilter, block: npt.NDArray[np.float32]
) -> tuple[zr.DriftFilter, npt.NDArray[np.float64]]:
    """Return the filter after a block, and its output."""
    rates = gyro.process(block)
    return gyro, rates


if __name__ == "__main__":
    main()
