"""Memory that is not there is a MemoryError, and the interpreter goes on."""

import numpy as np
import pytest

import zerorate as zr
from support.classes import STREAMS
from support.programs import run
from zerorate import _native

CLASSES = {
    "kf": lambda k: zr.DriftFilter(rate=100.0, method="kf", channels=k, output="estimate"),
    "holding": lambda k: zr.DriftFilter(rate=100.0, method="akf", motion="hold", channels=k),
    "auto": lambda k: zr.DriftFilter(rate=100.0, method="auto", channels=k),
    "least-squares": lambda k: zr.identification.RecursiveLeastSquares(channels=k),
    "noise": lambda k: zr.noise.AllanNoise(channels=k),
    "motion": lambda k: zr.noise.MotionDetector(rate=100.0, channels=k),
    "rest": lambda k: zr.RestDetector(rate=100.0, channels=k),
    "streaming": lambda k: zr.StreamingAllan(rate=100.0, octaves=24, channels=k),
    "corrector": lambda k: zr.ImuCorrector(np.eye(3), np.zeros(3), channels=k),
    "temperature": lambda k: zr.TemperatureFilter(100.0, channels=k),
    "attitude": lambda k: zr.Attitude(100.0, channels=k),
    "foot": lambda k: zr.FootFilter(100.0, channels=k),
    "tilt": lambda k: zr.Tilt(100.0, channels=k),
    "position": lambda k: zr.PositionFilter(1.0, channels=k),
    "wavelet": lambda k: zr.WaveletDenoiser(rate=100.0, level=10, channels=k),
    "linear": lambda k: zr.LinearKalman(1.0, [[1.0]], 1.0, 1.0, channels=k),
}


def test_every_streaming_class_with_channels_is_here():
    kinds = {stream.kind for stream in STREAMS.values() if stream.side_by_side}
    assert {type(make(1)) for make in CLASSES.values()} == kinds


@pytest.mark.parametrize("channels", [10**12, 2**48, 2**60, 2**62, 2**63 - 1, 2**64 - 1])
@pytest.mark.parametrize("name", CLASSES)
def test_more_channels_than_any_memory_holds(name, channels):
    with pytest.raises(MemoryError, match="bytes of memory were refused"):
        CLASSES[name](channels)


@pytest.mark.parametrize("name", CLASSES)
def test_no_machine_has_so_many_channels(name):
    with pytest.raises(ValueError, match="channels must be at least 1, got"):
        CLASSES[name](2**64)


def test_windows_and_orders_of_any_size():
    z = np.random.default_rng(1).standard_normal(1000)
    whole, _ = _native.without_outliers(z, 2**63, 3.0, 0.0)
    np.testing.assert_array_equal(whole, _native.without_outliers(z, 2001, 3.0, 0.0)[0])
    for lags in (10**13, 2**62, 2**64 - 1):
        with pytest.raises(MemoryError):
            _native.lagged_products(z, lags)
    for order in (1000, 10**9, 2**62, 2**64 - 1):
        for method in ("least-squares", "burg", "yule-walker"):
            with pytest.raises(ValueError, match=f"order {order} needs more than {order} samples"):
                _native.fit_autoregression(z, order, method, True)
    for horizon in (10**14, 2**62):
        with pytest.raises(MemoryError):
            _native.ReplayScores(1, 1, [horizon])
    with pytest.raises(MemoryError):
        _native.ReplayScores(2**62, 1, [1])
    with pytest.raises(ValueError, match="horizon must be at least 1, got 0"):
        _native.ReplayScores(1, 1, [0])


def test_any_number_of_threads():
    z = np.random.default_rng(1).standard_normal((1000, 3))
    expected = zr.DriftFilter(rate=100.0, method="fading", channels=3, output="estimate").process(z)
    got = zr.DriftFilter(rate=100.0, method="fading", channels=3, output="estimate").process(
        z, threads=10**9
    )
    np.testing.assert_array_equal(got, expected)


LIMITED = """
import gc, resource, sys
import numpy as np
import zerorate as zr
from zerorate import _native

N = 3_000_000
z = np.random.default_rng(1).standard_normal(N)
short = z[:1000].copy()
{setup}
# Threads, buffers and caches that stay.
def work(z):
    return {work}
work(short)
zr.allan(short, 100.0)
gc.collect()
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
refused = 0
for megabytes in {megabytes}:
    resource.setrlimit(resource.RLIMIT_AS, (used + megabytes * 2**20, resource.RLIM_INFINITY))
    try:
        work(z)
    except MemoryError:
        refused += 1
    resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
assert refused, "nothing was refused"
work(z[:100_000])
print("alive")
"""
NAVIGATION = """
start = zr.navigation.Alignment(
    time=0.0, quaternion=np.eye(4)[0], latitude=0.0, heading_known=True, course=False,
    gyro_bias=np.zeros(3), accel_bias=np.zeros(3), level_sigma=0.01, heading_sigma=0.01,
    gyro_bias_sigma=1e-4, accel_bias_sigma=0.01,
)
def navigate(n, record):
    nav = zr.NavigationFilter(start)
    gyro, accel = np.zeros((n, 3)), np.tile([0.0, 0.0, -9.78], (n, 1))
    fix = np.array([[0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 2.0, 2.0, 0.1, 0.1, 0.1]])
    return nav.process_arrays(np.arange(n) / 10.0, gyro, accel, fix, None, record)
"""
WORK = {
    "process": ("f = zr.DriftFilter(rate=100.0, method='fading')", "f.process(z)"),
    "process-other-floats": (
        "f = zr.DriftFilter(rate=100.0, method='fading')",
        "f.process(z.astype('f4'))",
    ),
    "process-strided": ("f = zr.DriftFilter(rate=100.0, method='fading')", "f.process(z[::-1])"),
    "process-into": (
        "f = zr.DriftFilter(rate=100.0, method='fading'); out = np.empty((N, 2))",
        "f.process(z, out=out[: len(z), 1])",
    ),
    "channels": (
        "f = zr.DriftFilter(rate=100.0, method='fading', channels=4)",
        "f.process(z.reshape(-1, 4), threads=2)",
    ),
    "auto": ("f = zr.DriftFilter(rate=100.0, method='auto')", "f.process(z)"),
    "trace": ("f = zr.DriftFilter(rate=100.0, method='fading')", "f.trace(z)"),
    "models": ("f = zr.identification.RecursiveLeastSquares()", "f.process(z)"),
    "rest": ("f = zr.RestDetector(rate=100.0)", "f.process(z.astype('f4'))"),
    "attitude": ("f = zr.Attitude(100.0)", "f.process(*3 * [z[: len(z) // 3 * 3].reshape(-1, 3)])"),
    "attitude-trace": (
        "f = zr.Attitude(100.0)",
        "f.trace(*2 * [z[: len(z) // 30 * 3].reshape(-1, 3)])",
    ),
    "smoothed": (
        "f = zr.Attitude(100.0)",
        "f.smooth(*2 * [z[: len(z) // 150 * 3].reshape(-1, 3)])",
    ),
    "position": ("f = zr.PositionFilter(1.0)", "f.process(z[: len(z) // 6 * 2].reshape(-1, 2))"),
    "position-trace": (
        "f = zr.PositionFilter(1.0)",
        "f.trace(z[: len(z) // 6 * 2].reshape(-1, 2))",
    ),
    "linear": ("f = zr.LinearKalman(1.0, [[1.0]], 1.0, 1.0)", "f.process(z[: len(z) // 6])"),
    "linear-smooth": (
        "f = zr.LinearKalman(1.0, [[1.0]], 1.0, 1.0)",
        "f.process(z[: len(z) // 6]).smooth()",
    ),
    "navigation": (NAVIGATION, "navigate(len(z) // 40, record=False)"),
    "navigation-smoother": (NAVIGATION, "navigate(len(z) // 40, record=True)[1].smoothed()"),
    "many-channels": ("", "zr.DriftFilter(rate=100.0, method='fading', channels=len(z) // 10)"),
    "copy": (
        "f = {n: zr.StreamingAllan(rate=100.0, octaves=n) for n in (2, 20)}; f[20].process(z)",
        "f[20 if len(z) == N else 2].copy()",
    ),
    "copy-of-channels": (
        "f = {k: zr.DriftFilter(rate=100.0, method='fading', channels=k) for k in (2, 50_000)}",
        "f[50_000 if len(z) == N else 2].copy()",
    ),
    "allan": ("", "zr.allan(z, 100.0)"),
    "allan-of-columns": ("", "zr.allan(z[: len(z) // 2 * 2].reshape(-1, 2), 100.0, 'mdev')"),
    "allan-with-gaps": ("z[::3] = np.nan", "zr.allan(z, 100.0)"),
    "hadamard-total": ("", "_native.allan_deviations(z, [2], 'htotdev')"),
    "outliers": ("", "_native.without_outliers(z, 5, 0.1, 0.0)"),
    "reversals": ("", "_native.reversals(z)"),
    "residuals": ("", "_native.arma_residuals(z, [0.5], [0.1], 0.0, 0.0)"),
    "burg": ("", "_native.fit_autoregression(z, 3, 'burg', True)"),
    "order": ("", "_native.fit_autoregression(z, min(len(z) // 100, 2000), 'least-squares', True)"),
    "arma": ("", "_native.arma_grid(z, 1, 1)"),
    "average": ("", "_native.exponential_mean(z, 0.1)"),
}


@pytest.mark.every(12)
@pytest.mark.parametrize("name", WORK)
def test_a_limit_of_memory(name):
    """From hardly anything to enough: an answer, or MemoryError."""
    setup, work = WORK[name]
    program = LIMITED.format(setup=setup, work=work, megabytes=[4, 10, 20, 30, 45, 70, 120])
    assert run(program) == "alive\n"
