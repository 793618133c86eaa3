"""Settings of the streaming classes for hypothesis, and filters made from them."""

from dataclasses import replace
from functools import cache

import numpy as np
from hypothesis import strategies as st

import zerorate as zr
from support.linear import model

RATE = 100.0
METHODS = ["kf", "akf", "fading"]
MOTIONS = ["ignore", "hold"]
OUTPUTS = ["estimate", "compensated"]
ORDERS = [(p, q) for p in (1, 2, 3) for q in (0, 1, 2, 3)]

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
    "saturated",
    "stuck",
]
CONDUCT = {
    "motion": st.sampled_from(MOTIONS),
    "startup": st.sampled_from([1e-3, 0.2, 1.0]),
    "scale": st.sampled_from([None, 1e-6, 1.0, 1e6]),
    "limit": st.sampled_from([None, 2.0, 30.0, 1e6]),
}
# From less than any noise to more than any motion.
REST_LIMITS = {
    "rest_limit": st.sampled_from([None, 0.5, 3.0, 1e4]),
    "bias_limit": st.sampled_from([None, 0.2, 10.0]),
}


@cache
def drift_settings(channels=None):
    """Arguments of a DriftFilter of any method; `drift` takes them."""
    return st.one_of(
        published_settings(channels),
        started_settings(channels),
        robust_settings(channels),
        auto_settings(channels),
    )


@cache
def published_settings(channels=None):
    """Arguments of a filter with an ARMA model that learns its own start."""
    return st.fixed_dictionaries(
        {
            "rate": st.just(RATE),
            "order": st.sampled_from(ORDERS),
            "method": st.sampled_from(METHODS),
            "channels": st.just(channels),
            # The estimate is what the filters alone return, and what shares registers.
            "output": st.sampled_from(OUTPUTS),
        },
        optional={
            "fading": st.sampled_from([1e-3, 0.5, 0.9, 0.97, 1.0]),
            "adapt_for": st.sampled_from([None, 0.0, 0.5, 120.0]),
            "forgetting_factor": st.sampled_from([1e-3, 0.9, 0.99, 1.0]),
            "process_noise": st.sampled_from([0.0, 1e-12, 1e-8, 1e-4, 0.1, 1.0, 1e6]),
            "process_noise_memory": st.sampled_from([0.0, 0.5, 10.0, 1e6]),
            "noise": st.sampled_from(["allan", "hadamard"]),
            "outliers": st.sampled_from(["keep", "reject"]),
            **CONDUCT,
        },
    ).map(only_used)


def only_used(arguments):
    """Leave out what the method would refuse."""
    unused = set() if arguments["method"] == "fading" else {"fading", "process_noise_memory"}
    unused |= {"outliers"} if arguments["method"] == "robust" else set()
    # Where every sample is taken for rest there is nothing to limit.
    unused |= set(REST_LIMITS) if arguments.get("motion") == "ignore" else set()
    return {name: value for name, value in arguments.items() if name not in unused}


@cache
def started_settings(channels=None):
    """The same with a start."""
    return published_settings(channels).flatmap(
        lambda arguments: starts(arguments["order"], channels).map(
            lambda start: {**arguments, "start": start}
        )
    )


ZONES = ((4.0, 0.75), (2.0, 0.3), (1e-3, 1.0), (1e6, 1e-3))


@cache
def robust_settings(channels=None, zones=ZONES):
    """Arguments of the robust filter, with and without a start."""
    own = st.fixed_dictionaries(
        {"zones": st.sampled_from(zones)},
        optional={
            "damping": st.sampled_from([0.0, 0.1, 1.0]),
            "correction": st.sampled_from([0.0, 0.1, 1.0]),
        },
    )
    others = st.one_of(published_settings(channels), started_settings(channels))
    return st.builds(
        lambda others, own: only_used({**others, **own, "method": "robust"}), others, own
    )


@cache
def robust_as_published_settings(channels=None):
    """The same with the radii of the source, which have a unit."""
    return robust_settings(channels, ("published",))


@cache
def auto_settings(channels=None):
    """Arguments of the filter that tunes itself; ticks from one sample to many."""
    return st.fixed_dictionaries(
        {
            "rate": st.sampled_from([1.0, 10.0, 62.5, RATE]),
            "method": st.just("auto"),
            "channels": st.just(channels),
        },
        optional={"output": st.sampled_from(OUTPUTS), **CONDUCT, **REST_LIMITS},
    ).map(only_used)


def drift(arguments):
    """A DriftFilter, started if the arguments say with what."""
    arguments = dict(arguments)
    start = arguments.pop("start", None)
    if start is None:
        return zr.DriftFilter(**arguments)
    return zr.DriftFilter.started(start, **arguments)


@cache
@st.composite
def starts(draw, order, channels=None):
    """What a filter is started with, from nearly certain to ignorant, some of it singular."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    return start_of(rng, order, channels, draw(st.sampled_from([0.0, 1e-8, 1.0, 1e4])))


def start_of(rng, order, channels=None, size=1.0):
    """Another one for each channel."""
    if channels is None:
        return random_start(rng, order, size)
    known = [random_start(rng, order, size) for _ in range(channels)]
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


@cache
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


@cache
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


@cache
def rest_settings(channels=None):
    """Arguments of a RestDetector; ticks from four samples on."""
    return st.fixed_dictionaries(
        {"rate": st.sampled_from([1.0, 7.5, 20.0, 62.5]), "channels": st.just(channels)},
        optional=REST_LIMITS,
    )


@cache
def motion_settings(channels=None):
    """Arguments of a MotionDetector; ticks from four samples on."""
    return st.fixed_dictionaries(
        {"rate": st.sampled_from([1.0, 7.5, 20.0, 62.5]), "channels": st.just(channels)}
    )


@cache
def allan_settings(channels=None):
    """Arguments of a StreamingAllan."""
    return st.fixed_dictionaries(
        {"rate": st.just(RATE), "octaves": st.integers(1, 9), "channels": st.just(channels)}
    )


@cache
def attitude_settings(width, channels=None):
    """Arguments of an Attitude of six or nine axes."""
    return st.fixed_dictionaries(
        {
            "rate": st.sampled_from([5.0, 62.5, RATE, 1000.0]),
            "mag": st.just(width == 9),
            "channels": st.just(channels),
        },
        optional={
            "frame": st.sampled_from(["enu", "ned", "nwu"]),
            "gyro_unit": st.sampled_from(["rad/s", "deg/s"]),
            "accel_unit": st.sampled_from(["m/s^2", "g"]),
            "bias": st.just((0.01, 0.0, -0.02)),
            "bias_sigma": st.sampled_from([1e-4, 0.01]),
        },
    )


# A few values of each constant of a named method, usual ones and far ones.
NAMED_CONSTANTS = {
    "complementary": {"time_constant": [1e-6, 2.0, 1e6]},
    "mahony": {"kp": [0.0, 0.2, 1e6], "ki": [0.0, 0.01, 1e6]},
    "madgwick": {"beta": [0.0, 0.2, 1e3]},
    "ekf": {
        "gyro_noise": [1e-9, 0.01, 10.0],
        "accel_noise": [1e-6, 0.01, 1e6],
        "mag_noise": [1e-6, 1.0, 1e6],
        "bias_walk": [1e-12, 0.01, 1.0],
    },
}
NAMED_CONSTANTS["ukf"] = NAMED_CONSTANTS["ekf"]
BIAS_USERS = {"mahony": ["bias"], "ekf": ["bias", "bias_sigma"], "ukf": ["bias", "bias_sigma"]}


@cache
@st.composite
def named_attitude_settings(draw, channels=None):
    """Arguments of an Attitude by one of the named methods."""
    method = draw(st.sampled_from(list(NAMED_CONSTANTS)))
    arguments = draw(attitude_settings(9, channels))
    for name in {"bias", "bias_sigma"} - set(BIAS_USERS.get(method, ())):
        arguments.pop(name, None)
    constants = {name: st.sampled_from(few) for name, few in NAMED_CONSTANTS[method].items()}
    return arguments | {"method": method} | draw(st.fixed_dictionaries({}, optional=constants))


@cache
def foot_settings(channels=None):
    """Arguments of a FootFilter; nodes of one sample and of many."""
    return st.fixed_dictionaries(
        {"rate": st.sampled_from([48.0, 70.0, RATE, 1200.0]), "channels": st.just(channels)},
        optional={
            "floor": st.sampled_from([None, "level"]),
            "gyro_range": st.sampled_from([None, 0.1, 4.36, 1e4]),
        },
    )


@cache
def tilt_settings(channels=None):
    """Arguments of a Tilt; all that have a unit, for the defaults are of one."""
    noises = ("q_angle", "q_bias", "r_measure", "p_start")
    known = {"rate": st.sampled_from([0.5, RATE, 8000.0]), "channels": st.just(channels)}
    return st.one_of(
        st.fixed_dictionaries(known, optional={"time_constant": st.sampled_from([1e-6, 1.0, 1e6])}),
        st.fixed_dictionaries(
            {"method": st.just("kalman"), **known}
            | {name: st.sampled_from([1e-9, 0.1, 1e9]) for name in noises}
        ),
    )


# Those of a PositionFilter that have a unit, by method; its defaults are metres.
POSITION_CONSTANTS = {
    "aided": ("sigma", "error_sigma", "speed_sigma", "acceleration"),
    "moving_average": (),
    "kalman": ("sigma", "process_noise"),
    "heading": ("step",),
    "strength": ("sigma", "process_noise"),
}
POSITION_OTHERS = {
    "aided": {"error_time": [1e-6, 20.0, 1e9]},
    "moving_average": {"window": [1, 3, 64]},
    "heading": {"turn": [0.0, 0.5, np.pi]},
}


@cache
@st.composite
def position_settings(draw, channels=None):
    """Arguments of a PositionFilter; all that have a unit, for the defaults are of one."""
    method = draw(st.sampled_from(list(POSITION_CONSTANTS)))
    sizes = {name: st.sampled_from([1e-9, 0.1, 1e9]) for name in POSITION_CONSTANTS[method]}
    others = POSITION_OTHERS.get(method, {}).items()
    return draw(
        st.fixed_dictionaries(
            {
                "rate": st.sampled_from([0.1, 1.0, 25.0]),
                "method": st.just(method),
                "channels": st.just(channels),
                **sizes,
            },
            optional={name: st.sampled_from(few) for name, few in others},
        )
    )


@cache
def wavelet_settings(channels=None):
    """Arguments of a WaveletDenoiser."""
    return st.fixed_dictionaries(
        {
            "rate": st.sampled_from([0.1, 20.0, RATE]),
            "level": st.integers(1, 4),
            "channels": st.just(channels),
        },
        optional={
            "wavelet": st.sampled_from(["haar", "db2", "db4", "db8"]),
            "mode": st.sampled_from(["soft", "hard"]),
            "threshold": st.sampled_from([0.0, 0.5, 4.0, 1e300]),
        },
    )


@cache
@st.composite
def corrector_settings(draw, inputs, channels=None):
    """Arguments of an ImuCorrector of so many inputs, some of them left out."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    arguments = some_correction(rng, inputs)
    optional = arguments.keys() - {"gyro_matrix", "gyro_bias"}
    for name in draw(st.sets(st.sampled_from(sorted(optional)))) if optional else ():
        del arguments[name]
    return {**arguments, "inputs": inputs, "channels": channels}


@cache
def temperature_settings(channels=None):
    """Arguments of a TemperatureFilter; ticks from four samples on."""
    return st.fixed_dictionaries(
        {"rate": st.sampled_from([1.0, 20.0, 62.5]), "channels": st.just(channels)},
        optional={
            "reference": st.sampled_from([0.0, 25.0, -1e5]),
            "slope": st.sampled_from([None, 0.0, 0.1, -1e6]),
            "slope_sigma": st.sampled_from([None, 0.0, 0.1, 1e6]),
            "walk": st.sampled_from([None, 0.0, 0.01, 1e6]),
            **REST_LIMITS,
        },
    )


@cache
def array_settings(sensors, axes, channels=None):
    """Arguments of a GyroArray, which has no channels."""
    few = {
        "limit": st.sampled_from([None, 30.0]),
        "weights": st.sampled_from(["auto", "mean", "white"]),
        "scale_error": st.sampled_from([0.0, 0.05]),
    }
    fixed = {"sensors": st.just(sensors), "axes": st.just(axes)}
    return st.fixed_dictionaries(
        {"rate": st.sampled_from([20.0, RATE]), **fixed}, optional={**few, **REST_LIMITS}
    )


@cache
@st.composite
def linear_settings(draw, channels=None):
    """Arguments of a LinearKalman of two measurements."""
    n = draw(st.sampled_from([1, 2, 5, 9]))
    arguments = model(n, 2, seed=draw(st.integers(0, 50)))
    return {**arguments, "channels": channels}


# Level, heading north, at HOME of support/feeding.py.
LEVEL = zr.navigation.Alignment(
    time=0.0,
    quaternion=np.array([1.0, 0.0, 0.0, 0.0]),
    latitude=48.0,
    heading_known=True,
    course=False,
    gyro_bias=np.zeros(3),
    accel_bias=np.zeros(3),
    level_sigma=0.01,
    heading_sigma=0.05,
    gyro_bias_sigma=1e-4,
    accel_bias_sigma=0.02,
)


@cache
def navigation_settings(channels=None):
    """Arguments of a NavigationFilter, which has no channels."""
    return st.fixed_dictionaries(
        {"start": st.sampled_from([LEVEL, replace(LEVEL, heading_known=False)])},
        optional={
            "vehicle": st.sampled_from([None, "wheeled"]),
            "antenna": st.just((0.4, -0.3, -1.2)),
            "antenna_sigma": st.sampled_from([0.0, 0.1, (0.3, 0.0, 0.1)]),
            "consider_antenna": st.booleans(),
            "adapt": st.sampled_from(["inflate", "free", "fixed"]),
            "kind": st.sampled_from(["rate", "increment"]),
            "gate": st.sampled_from([5.0, 50.0]),
        },
    )


def some_correction(rng, inputs):
    """All arguments of an ImuCorrector that samples of so many numbers have a use for."""

    def matrix():
        return np.eye(3) + 0.1 * rng.standard_normal((3, 3))

    arguments = {"gyro_matrix": matrix(), "gyro_bias": rng.standard_normal(3)}
    if inputs >= 6:
        arguments |= {"accel_matrix": matrix(), "accel_bias": rng.standard_normal(3)}
        arguments["g_sensitivity"] = 0.1 * rng.standard_normal((3, 3))
    if inputs == 7:
        coefficients = rng.standard_normal((3, rng.integers(1, 5)))
        low, high = np.sort(rng.uniform(-2.0, 2.0, 2)).tolist()
        arguments["temperature"] = {
            "reference": rng.uniform(-3.0, 3.0),
            "range": (low, high),
            "coefficients": coefficients,
        }
    return arguments


def curve_in_unit(curve, a):
    """A bias over temperature, multiplied by ``a``."""
    return {**curve, "coefficients": curve["coefficients"] * a}


def traced(f, z):
    """A trace as arrays by name."""
    trace = f.trace(z)
    return {name: getattr(trace, name) for name in TRACE}


def within_range(z, limit):
    """A record without the samples at the ends of the sensor's range, if it has any."""
    return z if limit is None else np.where(np.abs(z) >= limit, np.nan, z)


def answers(arguments, trace, z):
    """What `process` returns where `trace` told this."""
    z = within_range(z, arguments.get("limit"))
    if arguments.get("output") == "estimate":
        return trace["estimate"]
    # The bound of all samples keeps the difference finite.
    compensated = np.clip(np.clip(z, -1e300, 1e300) - trace["bias"], -1e300, 1e300)
    return np.where(np.isfinite(z), compensated, np.nan)
