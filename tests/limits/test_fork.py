"""A fork takes over no threads: a child makes its own, and waits for none of its parent's."""

import pytest

from support.programs import run

# Every road that may use threads, by name. Each returns bytes.
ROADS = {
    "filter": "zr.DriftFilter(rate=100.0, method='fading', output='estimate', channels=8)"
    ".process(wide, threads=2)",
    "holding": "zr.DriftFilter(rate=100.0, method='kf', motion='hold', channels=8)"
    ".process(wide, threads=3)",
    "auto": "zr.DriftFilter(rate=100.0, method='auto', channels=8).process(wide, threads=2)",
    "least-squares": "zr.identification.RecursiveLeastSquares(channels=8).process(wide, threads=2)",
    "noise": "zr.noise.AllanNoise(channels=8).process(wide, threads=2)",
    "rest": "zr.RestDetector(rate=100.0, channels=8).process(wide, threads=2)",
    "trace": "zr.DriftFilter(rate=100.0, method='fading', channels=8).trace(wide).bias",
    "corrector": "zr.ImuCorrector(np.eye(3), np.zeros(3), channels=8)"
    ".process(np.stack([wide] * 3, axis=-1), threads=2)",
    "temperature": "zr.TemperatureFilter(100.0, channels=8).process(wide, z, threads=2)",
    "attitude": "zr.Attitude(100.0, channels=8)"
    ".process(*(np.stack([wide] * 3, axis=-1) for _ in range(3)), threads=2)",
    "named": "zr.Attitude(100.0, method='ekf', channels=8)"
    ".process(*(np.stack([wide[:9000]] * 3, axis=-1) for _ in range(3)), threads=2)",
    "tilt": "zr.Tilt(100.0, method='kalman', channels=8).process(wide, wide, threads=2)",
    "position": "zr.PositionFilter(1.0, channels=8)"
    ".process(np.stack([wide, wide], axis=-1), threads=2)",
    "smoothed": "zr.Attitude(100.0).smooth(*(wide[:, :3] for _ in range(3)))['quaternion']",
    "streaming": "streamed(zr.StreamingAllan(rate=100.0, octaves=4, channels=8))",
    "allan": "zr.allan(z, 100.0).deviation",
    "allan-of-columns": "zr.allan(wide, 100.0, 'mdev', threads=3).deviation",
    "total": "zr.allan(z[:6000], 100.0, 'mtotdev').deviation",
    "dynamic": "zr.noise.dynamic_allan(z[:20000], 100.0, window=50.0).deviation",
    "order": "_native.arma_grid(z[:9000], 2, 2)[0]",
    "arma": "zr.identification.fit_arma(z[:9000], 1, 1).phi",
    "autoregression": "zr.identification.fit_ar(z, 5).phi",
    "outliers": "_native.without_outliers(z, 101, 3.0, 0.0)[0]",
    "lags": "_native.lagged_products(z, 50)[0]",
    "reversals": "np.array(_native.reversals(z))",
}
PROGRAM = """
import multiprocessing, sys, threading
import numpy as np
import zerorate as zr
from zerorate import _native

z = np.random.default_rng(4).standard_normal(40_000)
wide = np.random.default_rng(5).standard_normal((40_000, 8))

def streamed(f):
    f.process(wide, threads=2)
    return f.deviation

def work():
    return np.ascontiguousarray({road}).tobytes()

def child(queue, depth):
    queue.put(work())
    if depth:
        forked(queue, depth - 1)

def forked(queue, depth):
    process = context.Process(target=child, args=(queue, depth))
    process.start()
    return process

context = multiprocessing.get_context("fork")
expected = work()
queue = context.Queue()
process = forked(queue, 0)
assert queue.get(timeout=60) == expected
process.join(60)
{then}
print("done")
"""
NESTED = """
grandchild = context.Process(target=lambda: (work(), forked(queue, 0).join(60)))
grandchild.start()
assert queue.get(timeout=60) == expected
grandchild.join(60)
"""
FROM_A_THREAD = """
# Other threads work all the time while this one forks.
stop = threading.Event()
def busy():
    while not stop.is_set():
        work()
others = [threading.Thread(target=busy) for _ in range(2)]
[thread.start() for thread in others]
def fork_now():
    process = forked(queue, 0)
    process.join(60)
forks = [threading.Thread(target=fork_now) for _ in range(3)]
[thread.start() for thread in forks]
found = [queue.get(timeout=60) for _ in forks]
stop.set()
[thread.join(60) for thread in forks + others]
assert found == [expected] * len(forks)
"""


@pytest.mark.every(6)
@pytest.mark.parametrize("road", ROADS)
def test_every_road_goes_on_in_a_child(road):
    assert run(PROGRAM.format(road=ROADS[road], then="")) == "done\n"


@pytest.mark.every(3)
@pytest.mark.parametrize("then", [NESTED, FROM_A_THREAD], ids=["nested", "from-a-thread"])
@pytest.mark.parametrize("road", ["filter", "allan", "order"])
def test_children_of_children_and_of_threads(road, then):
    assert run(PROGRAM.format(road=ROADS[road], then=then)) == "done\n"
