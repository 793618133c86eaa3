"""Ctrl-C ends long work at once: a filter is then as it was before, or the call was over."""

import pytest

from support.programs import run

# Of each the work goes on until it is interrupted.
FILTERS = {
    "kf": "zr.DriftFilter(rate=100.0, method='kf', order=(3, 3), output='estimate')",
    "fading": "zr.DriftFilter(rate=100.0, method='fading', output='estimate')",
    "channels": "zr.DriftFilter(rate=100.0, method='fading', channels=3, output='estimate')",
    "auto": "zr.DriftFilter(rate=100.0, method='auto')",
    "holding": "zr.DriftFilter(rate=100.0, method='akf', motion='hold')",
    "least-squares": "zr.identification.RecursiveLeastSquares()",
    "noise": "zr.noise.AllanNoise()",
    "rest": "zr.RestDetector(rate=100.0)",
    "streaming": "zr.StreamingAllan(rate=100.0, octaves=6)",
    "wavelet": "zr.WaveletDenoiser(rate=100.0, wavelet='db4', level=5)",
    "temperature": "zr.TemperatureFilter(rate=100.0)",
    "attitude": "zr.Attitude(rate=100.0, mag=False)",
    "tilt": "zr.Tilt(rate=100.0, method='kalman')",
    "position": "zr.PositionFilter(rate=1.0)",
    "linear": "zr.LinearKalman(1.0, [[1.0]], 1.0, 1.0)",
    "corrector": "zr.ImuCorrector(np.eye(3), np.zeros(3), g_sensitivity=np.eye(3))",
}
PROGRAM = """
import os, signal, sys, threading, time
import numpy as np
import zerorate as zr
from zerorate import _native

rng = np.random.default_rng(int(sys.argv[1]))
z = rng.standard_normal({samples})

def late():
    time.sleep(rng.uniform(0.0, 0.25))
    global sent
    sent = time.monotonic()
    os.kill(os.getpid(), signal.SIGINT)

def interrupted(work):
    thread = threading.Thread(target=late)
    try:
        thread.start()
        while True:
            work()
    except KeyboardInterrupt:
        took = time.monotonic() - sent
    thread.join()
    assert took < 2.0, took

{then}
print("done")
"""
FILTER = """
f = {make}
z = z if f.channels is None else np.stack([z] * f.channels, axis=1)
z = np.stack([z] * 6, axis=-1) if isinstance(f, zr.ImuCorrector) else z
z = np.stack([z] * 3, axis=-1) if isinstance(f, zr.Attitude) else z
z = np.stack([z] * 2, axis=-1) if isinstance(f, zr.PositionFilter) else z
z = (z, z) if isinstance(f, (zr.TemperatureFilter, zr.Attitude, zr.Tilt)) else (z,)
f.process(*(part[:1000] for part in z))
before = f.to_bytes()
f.{method}(*z)
after = f.to_bytes()

def work():
    global f
    f = kind.from_bytes(before)
    f.{method}(*z)

kind, left = type(f), []
for _ in range(2):
    interrupted(work)
    left.append(f.to_bytes())
# A signal may come once the call is over, while its answer is put away.
assert before in left and set(left) <= {{before, after}}
# And works on.
f.{method}(*(part[:100] for part in z))
"""


@pytest.mark.every(6)
@pytest.mark.parametrize("kind", FILTERS)
def test_a_filter_is_as_it_was_before(kind):
    then = FILTER.format(make=FILTERS[kind], method="process")
    assert run(PROGRAM.format(samples=4_000_000, then=then), 1) == "done\n"


@pytest.mark.every(2)
@pytest.mark.parametrize("kind", ["kf", "fading", "auto", "attitude"])
def test_a_trace_too(kind):
    then = FILTER.format(make=FILTERS[kind], method="trace")
    assert run(PROGRAM.format(samples=1_500_000, then=then), 2) == "done\n"


NAVIGATION = """
from zerorate import NavigationFilter
from zerorate.navigation import Alignment
axes = np.zeros(3)
start = Alignment(0.0, np.eye(4)[0], 0.0, True, False, axes, axes, 0.01, 0.01, 1e-4, 0.01)
n = 1_000_000
seconds, gyro, accel = np.arange(n) / 10.0, np.zeros((n, 3)), np.tile([0.0, 0.0, -9.78], (n, 1))
fix = np.array([[0.5, *[0.0] * 6, *[2.0] * 3, *[0.1] * 3]])
nav = NavigationFilter(start)
before, left = nav.to_bytes(), []

def work():
    nav.reset()
    nav.process_arrays(seconds, gyro, accel, fix)

work()
after = nav.to_bytes()
for _ in range(3):
    interrupted(work)
    left.append(nav.to_bytes())
assert before in left and set(left) <= {before, after}
nav.reset()
_, record = nav.process_arrays(seconds[::10], gyro[::10], accel[::10], fix, record=True)
for _ in range(2):
    interrupted(record.smoothed)
"""


def test_navigation_ends():
    assert run(PROGRAM.format(samples=10, then=NAVIGATION), 4) == "done\n"


RECORDS = {
    "allan": "zr.allan(z, 100.0, taus='all')",
    "alone": "zr.allan(z, 100.0, 'mdev', taus='all', threads=1)",
    "total": "zr.allan(z, 100.0, 'mtotdev')",
    "hadamard-total": "zr.allan(z, 100.0, 'htotdev')",
    "total-of-one": "_native.allan_deviations(z, [len(z) // 4], 'mtotdev')",
    "theo1": "zr.allan(z, 100.0, 'theo1', taus='all')",
    "parabolic": "zr.allan(z, 100.0, 'pdev', taus='all')",
    "order": "_native.arma_grid(z, 3, 3)",
    "arma": "_native.arma_fit(z, 3, 3, True, True)",
    "likelihood": "_native.arma_likelihood(z, [0.5], [0.1], 0.0)",
    "outliers": "_native.without_outliers(z, 100_001, 3.0, 0.0)",
    "lags": "_native.lagged_products(z, len(z) - 1)",
    "burg": "_native.fit_autoregression(z, 2_000, 'burg', True)",
    "reversals": "_native.reversals(z)",
    "turns": "_native.propagate_turns(z[:999_999].reshape(-1, 3), z[:333_332], [(0, 333_333)] * 99,"
    " np.zeros((99, 3)), np.eye(3))",
    "smoothed": "zr.Attitude(100.0, mag=False).smooth(*2 * [z[:999_999].reshape(-1, 3)])",
    "orientation": "_native.integrate_rates(np.zeros((10**7, 3)), np.zeros(10**7 - 1), 'coning')",
}


@pytest.mark.every(6)
@pytest.mark.parametrize("name", RECORDS)
def test_work_on_a_record_ends(name):
    then = f"for _ in range(2): interrupted(lambda: {RECORDS[name]})"
    assert run(PROGRAM.format(samples=1_000_000, then=then), 3) == "done\n"
