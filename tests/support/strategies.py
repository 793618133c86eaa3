"""Records, settings and filters for hypothesis, and what it takes to compare them."""

import numpy as np
from hypothesis import strategies as st

import zerorate as zr

METHODS = ["kf", "akf", "fading"]
MOTIONS = ["ignore", "hold"]
OUTPUTS = ["estimate", "compensated"]
ORDERS = [(p, q) for p in (1, 2, 3) for q in (0, 1, 2, 3)]
RATE = 100.0

DRIFT_PROPERTIES = [
    "estimate",
    "innovation",
    "innovation_variance",
    "gain",
    "measurement_noise",
    "process_noise",
    "coefficients",
    "covariance",
    "bias",
    "bias_sigma",
    "at_rest",
    "guard_count",
    "ready",
    "samples_seen",
]
MODEL_PROPERTIES = ["coefficients", "covariance", "ready", "samples_seen"]
PROPERTIES = {
    zr.DriftFilter: DRIFT_PROPERTIES,
    zr.RecursiveLeastSquares: MODEL_PROPERTIES,
    zr.AllanNoise: ["variance"],
    zr.RestDetector: ["at_rest"],
    zr.StreamingAllan: [
        "deviation",
        "hadamard_deviation",
        "terms",
        "hadamard_terms",
        "samples_seen",
    ],
}
TRACE = [
    "estimate",
    "innovation",
    "innovation_variance",
    "gain",
    "measurement_noise",
    "process_noise",
    "coefficients",
    "covariance",
    "missing",
    "guarded",
    "bias",
    "bias_sigma",
    "at_rest",
]


def drift_settings(channels=None):
    """Arguments of a DriftFilter of any method; `drift` takes them."""
    return st.one_of(published_settings(channels), auto_settings(channels))


def published_settings(channels=None):
    """Arguments of a filter with an ARMA model, half of them with a start."""
    return plain_settings(channels).flatmap(
        lambda arguments: st.one_of(
            st.just(arguments),
            starts(arguments["order"], channels).map(lambda start: {**arguments, "start": start}),
        )
    )


def plain_settings(channels):
    return st.fixed_dictionaries(
        {
            "rate": st.just(RATE),
            "order": st.sampled_from(ORDERS),
            "method": st.sampled_from(METHODS),
            "channels": st.just(channels),
        },
        optional={
            "fading": st.sampled_from([1e-3, 0.5, 0.9, 0.97, 1.0]),
            "adapt_for": st.sampled_from([None, 0.0, 0.5, 120.0]),
            "forgetting_factor": st.sampled_from([1e-3, 0.9, 0.99, 1.0]),
            "process_noise": st.sampled_from([0.0, 1e-12, 1e-8, 1e-4, 0.1, 1.0, 1e6]),
            "process_noise_memory": st.sampled_from([0.0, 0.5, 10.0, 1e6]),
            "noise": st.sampled_from(["allan", "hadamard"]),
            **COMMON,
        },
    )


def auto_settings(channels=None):
    """Arguments of the filter that tunes itself; ticks from one sample to many."""
    return st.fixed_dictionaries(
        {
            "rate": st.sampled_from([1.0, 10.0, 62.5, RATE]),
            "method": st.just("auto"),
            "channels": st.just(channels),
        },
        optional=COMMON,
    )


COMMON = {
    "motion": st.sampled_from(MOTIONS),
    "output": st.sampled_from(OUTPUTS),
    "startup": st.sampled_from([1e-3, 0.2, 1.0]),
    "scale": st.sampled_from([None, 1e-6, 1.0, 1e6]),
}


def drift(arguments):
    """A DriftFilter, started if the arguments say with what."""
    arguments = dict(arguments)
    start = arguments.pop("start", None)
    if start is None:
        return zr.DriftFilter(**arguments)
    return zr.DriftFilter.started(start, **arguments)


@st.composite
def starts(draw, order, channels=None):
    """What a filter is started with, from nearly certain to ignorant, some of it singular."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    size = draw(st.sampled_from([0.0, 1e-8, 1.0, 1e4]))
    known = [random_start(rng, order, size) for _ in range(channels or 1)]
    if channels is None:
        return known[0]
    return {name: np.stack([np.asarray(start[name]) for start in known]) for name in known[0]}


def random_start(rng, order, size=1.0):
    """For one channel; `size` is that of its uncertainty."""
    (p, q), scale = order, rng.choice([1e-6, 0.1, 1.0, 300.0])
    n, m = p + 1, p + q + 1
    return {
        "offset": rng.choice([0.0, -0.35, 1e7 * scale]),
        "scale": scale,
        "coefficients": rng.uniform(-1.2, 1.2, m) * np.append(np.ones(m - 1), scale),
        "covariance": size * semidefinite(rng, m),
        "measurement_noise": scale**2 * rng.choice([0.0, 1e-8, 1.0, 1e6]),
        "process_noise": scale**2 * rng.choice([0.0, 1e-8, 1.0, 1e6]),
        "state_covariance": size * scale**2 * semidefinite(rng, n),
    }


def semidefinite(rng, size):
    """Symmetric to the bit; with one direction fewer than its size, now and then."""
    root = rng.standard_normal((size, size - rng.integers(2)))
    product = root @ root.T
    return (product + product.T) / 2.0


def of_channel(arguments, channel):
    """The arguments that make one channel alone."""
    alone = {**arguments, "channels": None}
    if "start" in alone:
        alone["start"] = {name: values[channel] for name, values in alone["start"].items()}
    return alone


def model_settings(channels=None):
    """Arguments of a RecursiveLeastSquares."""
    return st.fixed_dictionaries(
        {"order": st.sampled_from(ORDERS), "channels": st.just(channels)},
        optional={
            "forgetting_factor": st.sampled_from([1e-3, 0.9, 0.99, 1.0]),
            "startup": st.sampled_from([2, 10, 100]),
            "scale": st.sampled_from([None, 1e-6, 1.0, 1e6]),
        },
    )


def noise_settings(channels=None):
    """Arguments of an AllanNoise."""
    return st.fixed_dictionaries(
        {"channels": st.just(channels)},
        optional={
            "fading": st.sampled_from([1e-3, 0.5, 0.97, 1.0]),
            "noise": st.sampled_from(["allan", "hadamard"]),
            "floor": st.sampled_from([0.0, 1e-12, 1.0]),
        },
    )


def recipes(channels=None):
    """A class and its arguments."""
    return st.one_of(
        st.tuples(st.just(zr.DriftFilter), drift_settings(channels)),
        st.tuples(st.just(zr.RecursiveLeastSquares), model_settings(channels)),
        st.tuples(st.just(zr.AllanNoise), noise_settings(channels)),
    )


def make(recipe):
    kind, arguments = recipe
    return drift(arguments) if kind is zr.DriftFilter else kind(**arguments)


def white(rng, n):
    return rng.standard_normal(n)


def autoregressive(rng, n):
    """ARMA(2, 1)."""
    noise = rng.standard_normal(n + 2)
    y = np.zeros(n + 2)
    for k in range(2, n + 2):
        y[k] = 1.5 * y[k - 1] - 0.6 * y[k - 2] + noise[k] - 0.4 * noise[k - 1]
    return y[2:]


def walk(rng, n):
    return rng.standard_normal(n) + np.cumsum(0.05 * rng.standard_normal(n))


def quantised(rng, n):
    """Most samples repeat the one before."""
    return np.round(0.5 * rng.standard_normal(n))


def with_missing(rng, n):
    """At the start, at random and in one long gap."""
    z = autoregressive(rng, n)
    z[rng.random(n) < 0.1] = np.nan
    z[:7] = np.inf
    z[n // 2 : n // 2 + n // 10] = np.nan
    return z


SIGNALS = {f.__name__: f for f in (white, autoregressive, walk, quantised, with_missing)}


@st.composite
def ordinary_records(draw, max_size=600):
    """What a gyro gives: noise or drift on an offset, in any unit."""
    signal = draw(st.sampled_from(list(SIGNALS.values())))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    size = draw(st.integers(200, max_size))
    offset = draw(st.sampled_from([0.0, -0.35, 5.0]))
    return offset + signal(rng, size) * draw(st.sampled_from([0.1, 1.0, 300.0]))


FINITE = st.floats(allow_nan=False, allow_infinity=False)
ANY = st.one_of(FINITE, st.sampled_from([np.nan, np.inf, -np.inf]))
EDGES = st.sampled_from(
    [0.0, -0.0, 5e-324, 1e-310, 1e-150, 1e-4, 1.0, 1e7, 1e12, 1e150, 1e300, np.finfo(float).max]
)


@st.composite
def segments(draw):
    """A stretch of one kind of misbehaviour."""
    n = draw(st.integers(1, 120))
    size = draw(st.one_of(EDGES, FINITE))
    k = np.arange(n)
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):
        return draw(st.sampled_from(SHAPES))(k, size)


def constant(k, size):
    return np.full(len(k), size)


def alternating(k, size):
    return size * (-1.0) ** k


def ramp(k, size):
    return size * (k / len(k))


def growth(k, size):
    return size * 10.0**k


def decay(k, size):
    return size / 10.0**k


def noise(k, size):
    return size * np.random.default_rng(len(k)).uniform(-1.0, 1.0, len(k))


def tiny_noise(k, size):
    return size + 1e-4 * np.random.default_rng(len(k)).standard_normal(len(k))


def outlier(k, size):
    return np.where(k == len(k) // 2, size, noise(k, 1.0))


def gap(k, size):
    return np.full(len(k), np.nan)


SHAPES = [constant, alternating, ramp, growth, decay, noise, tiny_noise, outlier, gap]


@st.composite
def hostile_records(draw):
    """Stretches of misbehaviour, one after the other, and single wild samples among them."""
    stretches = draw(st.lists(segments(), min_size=1, max_size=6))
    loose = np.array(draw(st.lists(ANY, max_size=12)), dtype=float)
    stretches.insert(draw(st.integers(0, len(stretches))), loose)
    return np.concatenate(stretches)


def records():
    return st.one_of(ordinary_records(), hostile_records())


def state(f):
    """Every property, as arrays by name."""
    return {name: np.asarray(getattr(f, name)) for name in PROPERTIES[type(f)]}


def traced(f, z):
    """A trace as arrays by name."""
    trace = f.trace(z)
    return {name: getattr(trace, name) for name in TRACE}


def answers(arguments, trace, z):
    """What `process` answers where `trace` told this."""
    if arguments.get("output") != "compensated":
        return trace["estimate"]
    # The bound of all samples keeps the difference finite.
    compensated = np.clip(np.clip(z, -1e300, 1e300) - trace["bias"], -1e300, 1e300)
    return np.where(np.isfinite(z), compensated, np.nan)


def assert_same_bits(got, expected):
    got, expected = np.asarray(got), np.asarray(expected)
    assert got.dtype == expected.dtype
    assert got.shape == expected.shape
    assert got.tobytes() == expected.tobytes(), "differs in the last bits at least"


def assert_same_state(got, expected):
    for name, value in state(expected).items():
        assert_same_bits(getattr(got, name), value)
    assert got.to_bytes() == expected.to_bytes()


def assert_finite(arrays):
    for name, values in arrays.items():
        assert np.all(np.isfinite(values)), name


def assert_covariance(P):
    assert_symmetric(P)
    assert_semidefinite(P)


def assert_symmetric(P):
    """To the bit, for a stack of matrices."""
    assert_same_bits(np.swapaxes(P, -1, -2).copy(), P)


def assert_semidefinite(P):
    """For a stack of symmetric matrices."""
    P = changing(P)
    variances = np.einsum("...ii->...i", P)
    assert np.all(variances >= 0.0)
    largest = np.max(variances, axis=-1)
    # On a scale on which the factors neither overflow nor underflow.
    scaled = P / np.where(largest > 0.0, largest, 1.0)[..., None, None]
    # A factorisation errs by a few units in the last place of the norm, at most the size times the
    # largest variance; so does the rounding of the elements themselves to the samples' unit.
    tolerance = 8.0 * P.shape[-1] * np.finfo(float).eps
    # Cholesky's fails if an eigenvalue is below minus the tolerance, and is faster than finding it.
    factors = np.linalg.cholesky(scaled + tolerance * np.eye(P.shape[-1]))
    assert np.all(np.isfinite(factors))


def changing(P):
    """A stack without the matrices that equal the one before."""
    stack = P.reshape(-1, *P.shape[-2:])
    changes = np.any(stack[1:] != stack[:-1], axis=(1, 2))
    return stack[np.append(len(stack) > 0, changes)[: len(stack)]]
