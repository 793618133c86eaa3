"""The core against its literal NumPy twin."""

import numpy as np
import pytest

import oracle
import zerorate as zr
from support.records import SIGNALS, white, with_missing
from support.settings import METHODS, ORDERS, RATE, drift
from zerorate._native import allan_deviations

# Both sides round each of some hundred operations a sample to 1.1e-16, and least squares and
# Kalman filter forget old errors: some hundred times what is seen (2e-13).
TOLERANCE = 1e-10
SETTINGS = {
    "default": {},
    "g1e-8": {"process_noise": 1e-8},
    "g1e-4": {"process_noise": 1e-4},
    "g1": {"process_noise": 1.0},
    "memory": {"process_noise_memory": 50.0},
    "forgetting": {"forgetting_factor": 0.99, "adapt_for": None},
    "short": {"adapt_for": 2.0, "startup": 0.3, "fading": 0.9},
    "hadamard": {"noise": "hadamard"},
    "equal-weights": {"fading": 1.0},
    "scale": {"scale": 2.0},
}
BY_ORDER = pytest.mark.parametrize("order", ORDERS, ids=str)
BY_METHOD = pytest.mark.parametrize("method", METHODS)
BY_SIGNAL = pytest.mark.parametrize("signal", SIGNALS)
BY_SETTING = pytest.mark.parametrize("setting", SETTINGS)


def record(signal, n, seed=1):
    return 0.3 + 0.1 * SIGNALS[signal](np.random.default_rng(seed), n)


def differences(trace, twin, z):
    """Largest difference of each array, relative to what it is made of."""
    deviation = np.nanstd(np.where(np.isfinite(z), z, np.nan))
    offset = max(deviation, np.nanmax(np.abs(np.where(np.isfinite(z), z, np.nan))))
    coefficient = np.maximum(np.abs(twin["coefficients"]), 1.0)
    coefficient[:, -1] = offset
    scales = {
        "estimate": deviation,
        "innovation": deviation,
        "innovation_variance": twin["innovation_variance"],
        "measurement_noise": twin["measurement_noise"],
        "process_noise": deviations_product(twin["process_noise"]),
        "covariance": deviations_product(twin["covariance"]),
        "gain": np.max(np.abs(twin["gain"]), axis=-1, keepdims=True),
        "coefficients": coefficient,
    }
    return {name: relative(getattr(trace, name), twin[name], scales[name]) for name in scales}


def deviations_product(P):
    deviations = np.sqrt(np.einsum("kii->ki", P))
    return deviations[:, :, None] * deviations[:, None, :]


def relative(got, expected, scale):
    difference = np.abs(got - expected)
    # Nothing may differ where the scale is zero: before the first two unequal samples.
    return np.max(difference / np.where(scale > 0.0, scale, np.finfo(float).tiny))


def both(z, arguments, tolerance=TOLERANCE):
    """The trace and its twin; their numbers agree."""
    arguments = {"method": "fading", **arguments}
    trace = drift({"rate": RATE, "output": "estimate", **arguments}).trace(z)
    twin = oracle.DriftFilter(rate=RATE, **arguments).trace(z)
    np.testing.assert_array_equal(trace.missing, twin["missing"])
    found = differences(trace, twin, z)
    assert max(found.values()) <= tolerance, found
    return trace, twin


def assert_equal_to_twin(z, **arguments):
    """Returns the trace, for further questions."""
    trace, twin = both(z, arguments)
    np.testing.assert_array_equal(trace.guarded, twin["guarded"])
    return trace


def every_other(*places):
    """Whether the second of two values is tried: both come with every value of every list."""
    return sum(places) % 2 == 1


@pytest.mark.every(2)
@BY_ORDER
@BY_METHOD
def test_every_order_and_method(order, method):
    """Of filters that learn their start and, every other one, of those that are given it."""
    started = every_other(ORDERS.index(order), METHODS.index(method))
    start = {"start": start_of(order)} if started else {}
    assert_equal_to_twin(record("with_missing", 800), order=order, method=method, **start)


@pytest.mark.every(3)
@BY_SIGNAL
@BY_SETTING
def test_every_setting_on_every_signal(signal, setting):
    """Of filters that learn their start and, every other one, of those that are given it."""
    started = every_other([*SIGNALS].index(signal), [*SETTINGS].index(setting))
    start = {"start": start_of((2, 1))} if started else {}
    assert_equal_to_twin(record(signal, 400), **SETTINGS[setting], **start)


@BY_METHOD
@pytest.mark.parametrize("order", [(1, 0), (3, 3)], ids=str)
@pytest.mark.parametrize("setting", ["g1e-8", "g1", "forgetting", "hadamard"])
def test_every_method_on_drift(order, method, setting):
    assert_equal_to_twin(record("walk", 300), order=order, method=method, **SETTINGS[setting])


@pytest.mark.every(4)
@BY_ORDER
@pytest.mark.parametrize("process_noise", [1e-6, 1e-4, 0.1, 1.0, 10.0])
def test_where_the_guard_acts_often(order, process_noise):
    z = record("white", 500)
    z[100:] = 0.3 + 1e-4 * (z[100:] - 0.3)
    trace = assert_equal_to_twin(z, order=order, process_noise=process_noise)
    assert trace.guarded[100:].mean() > 0.3


@pytest.mark.every(4)
@BY_SIGNAL
@BY_ORDER
def test_every_order_on_every_signal(signal, order):
    """With a process noise that the guard has to act on and, every other one, from zero."""
    z = record(signal, 300)
    if every_other([*SIGNALS].index(signal), ORDERS.index(order)):
        trace = assert_equal_to_twin(z, order=order, process_noise=2.0)
        assert trace.guarded[100:].mean() > 0.1
        return
    # G begins on the floor itself: G - floor has lost four digits, and with four rows the room in
    # it loses as many again. Only G shows it; the estimate agrees to 1e-14.
    tolerance = 1e-9 if order[0] == 3 else TOLERANCE
    both(z, {"order": order, "process_noise": 0.0}, tolerance)


def start_of(order, **changes):
    """What a drift of a deviation of 0.1 around 0.3 may be started with."""
    p, q = order
    covariance = np.fromfunction(lambda i, j: 0.5 ** abs(i - j), (p + q + 1, p + q + 1))
    return {
        "offset": 0.25,
        "scale": 0.1,
        "coefficients": np.array([1.2, -0.4, 0.1][:p] + [-0.5, 0.2, 0.1][:q] + [0.02]),
        "covariance": 1e-3 * covariance,
        "measurement_noise": 4e-3,
        "process_noise": 2e-4,
        "state_covariance": 5e-3 * covariance[: p + 1, : p + 1],
    } | changes


@BY_METHOD
@pytest.mark.parametrize(
    "changes",
    [
        {"covariance": np.zeros((4, 4))},
        {"covariance": 50.0 * np.eye(4)},
        {"state_covariance": np.zeros((3, 3))},
        {"coefficients": np.array([3.5, -1.0, 0.3, 0.0])},
        {"offset": -0.75},
    ],
    ids=lambda changes: "-".join(changes),
)
def test_started_filters_of_every_start(method, changes):
    start = start_of((2, 1), **changes)
    assert_equal_to_twin(record("autoregressive", 400), method=method, start=start)


@pytest.mark.parametrize("length", [1, 30, 500])
@BY_METHOD
def test_gap_after_the_start(length, method):
    z = record("autoregressive", 900)
    z[200 : 200 + length] = np.nan
    assert_equal_to_twin(z, method=method, adapt_for=None)


@pytest.mark.parametrize("startup", [2, 9, 150])
def test_missing_and_equal_samples_in_the_start_up(startup):
    z = record("white", 400)
    z[:5] = np.nan
    z[5:startup] = 0.25
    z[startup : startup + 3] = np.nan
    assert_equal_to_twin(z)


@pytest.mark.parametrize(
    ("order", "n"),
    [pytest.param((2, 1), 30_000, marks=pytest.mark.slow), ((3, 3), 10_000)],
    ids=str,
)
def test_many_samples(order, n):
    assert_equal_to_twin(with_missing_in_short_gaps(n), order=order, adapt_for=None)


def with_missing_in_short_gaps(n):
    """No gap of thousands: leaving one, P falls by so many digits that it has few left."""
    z = record("autoregressive", n)
    z[np.random.default_rng(2).random(n) < 0.05] = np.nan
    z[:7] = np.nan
    z[n // 2 : n // 2 + 1000] = np.nan
    return z


@pytest.mark.slow
@BY_ORDER
@BY_METHOD
@pytest.mark.parametrize("signal", ["autoregressive", "walk", "quantised"])
def test_a_hundred_thousand_samples_of_every_kind(order, method, signal):
    z = record(signal, 100_000)
    z[np.random.default_rng(2).random(len(z)) < 0.05] = np.nan
    assert_equal_to_twin(z, order=order, method=method)


@pytest.mark.every(3)
@BY_ORDER
@BY_SIGNAL
def test_least_squares(order, signal):
    """Each setting with every order and every signal."""
    arguments = [{}, {"forgetting_factor": 0.98}, {"scale": 3.0}]
    arguments = arguments[(ORDERS.index(order) + [*SIGNALS].index(signal)) % 3]
    z = record(signal, 700)
    model = zr.identification.RecursiveLeastSquares(order, **arguments)
    twin = oracle.RecursiveLeastSquares(order, **arguments)
    residuals = model.process(z)
    expected = np.array([twin.update(sample) for sample in z.tolist()])
    deviation = np.std(z[np.isfinite(z)])
    assert relative(residuals, expected, deviation) <= TOLERANCE
    assert relative(model.coefficients, twin.coefficients, 1.0) <= TOLERANCE
    scale = deviations_product(twin.model.P[None])
    assert relative(model.covariance[None], twin.model.P[None], scale) <= TOLERANCE


@pytest.mark.every(3)
@BY_SIGNAL
@pytest.mark.parametrize("kind", ["allan", "hadamard"])
@pytest.mark.parametrize("fading", [0.01, 0.5, 0.97, 1.0])
def test_allan_noise(signal, kind, fading):
    z = record(signal, 3000)
    twin = oracle.AllanNoise(fading, kind)
    variances = []
    for sample in z.tolist():
        twin.observe(sample)
        variances.append(twin.variance)
    for floor in (0.0, 1e-3):
        expected = np.maximum(variances, floor)
        got = zr.noise.AllanNoise(fading, kind, floor).process(z)
        assert relative(got, expected, expected) <= TOLERANCE


def test_equal_weights_are_the_allan_variance_of_the_record():
    z = white(np.random.default_rng(3), 10_000)
    got = zr.noise.AllanNoise(fading=1.0).process(z)[-1]
    # A running mean of 1e4 terms errs by 1e4 units in the last place at the very most.
    assert got == pytest.approx(np.mean(np.diff(z) ** 2) / 2.0, rel=1e-12)
    assert got == pytest.approx(allan_deviations(z, [1])[0][0] ** 2, rel=1e-12)


def test_missing_samples_are_told():
    z = with_missing(np.random.default_rng(4), 300)
    np.testing.assert_array_equal(
        zr.DriftFilter(rate=RATE, method="fading").trace(z).missing, ~np.isfinite(z)
    )
