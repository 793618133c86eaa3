"""Every streaming class in one table: what joins it is held to all laws of tests/laws.

A class comes as one or more streams, where its settings make it different things. A stream takes
records whose first axis is time; with channels the second axis is theirs, and where a sample is
several numbers the last one is these, for a class that takes them as several arguments, as a matrix
or as an event too: support/feeding.py hands them over. Several arrays that are returned at once are
joined along their last axis.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
from hypothesis import strategies as st

import zerorate as zr
from support.checks import (
    assert_covariance,
    assert_finite,
    assert_same_bits,
    assert_semidefinite,
    assert_symmetric,
)
from support.feeding import NAVIGATED
from support.linear import TRACKING, model
from support.records import (
    aided_records,
    driven_records,
    foot_records,
    imu_records,
    moving_records,
    ordinary_records,
    records,
    turning_records,
    warm_records,
    wide_records,
)
from support.settings import (
    LEVEL,
    METHODS,
    RATE,
    allan_settings,
    array_settings,
    attitude_settings,
    auto_settings,
    corrector_settings,
    curve_in_unit,
    drift,
    foot_settings,
    linear_settings,
    model_settings,
    motion_settings,
    named_attitude_settings,
    navigation_settings,
    noise_settings,
    position_settings,
    published_settings,
    rest_settings,
    robust_as_published_settings,
    robust_settings,
    some_correction,
    start_of,
    started_settings,
    temperature_settings,
    tilt_settings,
    wavelet_settings,
    within_range,
)
from zerorate.navigation.options import POSITION_METHODS

# The power of the samples' unit in [φ, θ, c]: none but in the constant.
CONSTANT_LAST = "constant last"


def sound_trace(trace, z, limit=None):
    """Of a DriftFilter: finite, with covariances that are some, and told where samples miss."""
    assert_finite(trace)
    sound_covariances(trace)
    seen = np.isfinite(within_range(z, limit))
    np.testing.assert_array_equal(trace["missing"], ~seen)
    np.testing.assert_array_equal(trace["saturated"], np.isfinite(z) & ~seen)


def sound_drift(f, z, answers):
    """Finite, and missing only where a compensated sample is."""
    within = np.isfinite(within_range(z, f.params["limit"]))
    seen = within | (f.params["output"] != "compensated")
    np.testing.assert_array_equal(np.isnan(answers), ~seen)
    known = state(f)
    assert_finite({"answers": answers[seen], **known})
    sound_covariances(known)
    counts = [known[name] for name in ("saturated_count", "outlier_count", "stuck_count")]
    assert np.all(sum(counts) <= known["samples_seen"])


def sound_covariances(known):
    assert_covariance(known["process_noise"])
    assert_covariance(known["covariance"])
    for name in ("innovation_variance", "measurement_noise", "bias_sigma"):
        assert np.all(known[name] >= 0.0), name


def sound_model(f, z, answers):
    assert_finite({"answers": answers, **state(f)})
    assert_semidefinite(f.covariance)


def sound_noise(f, z, answers):
    assert_finite({"answers": answers, **state(f)})
    assert np.all(answers >= 0.0)


def sound_rest(f, z, answers):
    assert answers.shape == z.shape


def sound_motion(f, z, answers):
    assert answers.shape == z.shape[:-1]


def sound_allan(f, z, answers):
    """A deviation wherever there are terms, and only there."""
    known = state(f)
    for name, terms in (("deviation", "term_count"), ("hadamard_deviation", "hadamard_term_count")):
        seen = known[terms] > 0
        assert np.all(np.isfinite(known[name][seen])), name
        assert np.all(known[name][seen] >= 0.0), name
        assert np.all(np.isnan(known[name][~seen])), name


def sound_corrector(f, z, answers):
    """Finite where no axis of a sensor misses, and missing as a whole where one does."""
    assert_finite(state(f))
    for first in range(0, answers.shape[-1], 3):
        axes = np.isfinite(z[..., first : first + 3])
        seen = np.broadcast_to(axes.all(axis=-1, keepdims=True), axes.shape)
        np.testing.assert_array_equal(np.isfinite(answers[..., first : first + 3]), seen)
        np.testing.assert_array_equal(np.isnan(answers[..., first : first + 3]), ~seen)


def sound_temperature(f, z, answers):
    known = state(f)
    assert_finite({"answers": answers, **known})
    assert np.all(known["bias_sigma"] >= 0.0)
    assert np.all(known["slope_sigma"] >= 0.0)


def sound_attitude(f, z, answers):
    """Rotations, and finite but where a force is missing; sound is what a checkpoint takes back."""
    np.testing.assert_allclose(np.sum(answers**2, axis=-1), 1.0, rtol=3e-6)
    known = state(f)
    linear = known.pop("linear_acceleration")
    assert_finite(known)
    np.testing.assert_array_equal(np.isnan(linear).any(axis=-1), np.isnan(linear).all(axis=-1))
    for name in known:
        assert not name.endswith("sigma") or np.all(known[name] >= 0.0), name
    # Its covariance is symmetric and positive semidefinite, or it would be refused.
    assert type(f).from_bytes(f.to_bytes()).to_bytes() == f.to_bytes()


def sound_learning_attitude(f, z, answers):
    """The same; of a hard iron that is not known yet there is no deviation."""
    sound_attitude(f, z, answers)
    iron, sigma = np.atleast_2d(f.hard_iron), np.atleast_2d(f.hard_iron_sigma)
    states = np.atleast_1d(f.magnetometer_state)
    assert np.isfinite(iron).all()
    for b, deviation, how in zip(iron, sigma, states, strict=True):
        assert np.all(deviation >= 0.0) or np.isnan(deviation).all()
        assert how in ("raw", "known", "kept", "withheld")
        assert how != "known" or np.isfinite(deviation).all()
        assert how != "raw" or not b.any()


def sound_named_attitude(f, z, answers):
    """The same, but for what the method does not know."""
    np.testing.assert_allclose(np.sum(answers**2, axis=-1), 1.0, rtol=1e-9)
    unknown = ("linear_acceleration", "bias", "gyro_matrix", "sigma")
    known = state(f)
    assert_finite({name: x for name, x in known.items() if not name.endswith(unknown)})
    learned = {name: known[name] for name in known if name == "bias" or name.endswith("sigma")}
    for name, values in learned.items():
        assert np.isfinite(values).all() or np.isnan(values).all(), name
        assert not np.any(values < 0.0) or name == "bias", name
    assert type(f).from_bytes(f.to_bytes()).to_bytes() == f.to_bytes()


def sound_tilt(f, z, answers):
    """Finite from the first angle on; what came before this record is not known here."""
    begun = np.logical_or.accumulate(np.abs(z[..., 1]) <= 1e150)
    assert_finite({"answers": answers[begun]})
    learned = f.bias, f.bias_sigma, f.angle_sigma
    assert np.isfinite(learned).all() if f.method == "kalman" else np.isnan(learned).all()
    assert not np.any(np.less([f.bias_sigma, f.angle_sigma], 0.0))


def sound_position(f, z, answers):
    """Finite from the first fix on; what came before this record is not known here."""
    begun = np.logical_or.accumulate((np.abs(z[..., :2]) <= 1e150).all(axis=-1))
    known = state(f)
    assert_finite({"answers": answers[begun]})
    if begun.size and begun[-1].all():
        assert_finite({"position": known["position"]})
        for name in ("sigma", "velocity"):
            knows = f.method not in ("moving_average", "heading")
            assert np.isfinite(known[name]).all() == knows, name
        assert np.isfinite(known["receiver_error"]).all() == (f.method == "aided")
    assert not np.any(known["sigma"] < 0.0)
    # Its covariance is symmetric and positive semidefinite, or it would be refused.
    assert type(f).from_bytes(f.to_bytes()).to_bytes() == f.to_bytes()


def sound_wavelet(f, z, answers):
    """Finite from the first sample on; what came before this record is not known here."""
    begun = np.logical_or.accumulate(np.isfinite(z))
    assert_finite({"answers": answers[begun], **state(f)})
    assert np.all(f.sigma >= 0.0)


def sound_array(f, z, answers):
    """Finite, and missing at most where a sensor is or is left out."""
    known = state(f)
    assert_finite({name: known[name] for name in ("bias", "weights")})
    assert not np.isinf(answers).any()
    assert type(f).from_bytes(f.to_bytes()).to_bytes() == f.to_bytes()


def sound_linear(f, z, answers):
    known = state(f)
    assert_finite({"answers": answers, "state": known["state"]})
    assert_covariance(known["covariance"])
    for name in ("innovation", "nis"):
        assert not np.isinf(known[name]).any(), name
    assert not np.any(known["nis"] < 0.0)
    assert type(f).from_bytes(f.to_bytes()).to_bytes() == f.to_bytes()


def sound_navigation(f, z, answers):
    """Finite where it navigates, and a covariance always."""
    known = state(f)
    assert_finite({name: known[name] for name in ("quaternion", "gyro_bias", "accel_bias")})
    assert np.isfinite(f.covariance).all()
    assert_symmetric(f.covariance)
    assert np.all(np.diag(f.covariance) >= 0.0)
    navigating = f.status not in ("waiting", "no heading")
    for name in ("position", "velocity", "sigma"):
        assert np.isfinite(known[name]).all() == navigating, name
    # Its covariance is positive semidefinite, or it would be refused.
    assert type(f).from_bytes(f.to_bytes()).to_bytes() == f.to_bytes()


def sound_foot(f, z, answers):
    """Known all, or not at all; covariances that are some, or it would be refused."""
    known = state(f)
    assert_finite({name: known[name] for name in ("quaternion", "gyro_bias", "accel_bias")})
    there = np.isfinite(known["position"]).all(axis=-1)
    for name in ("position", "velocity", "sigma"):
        finite = np.isfinite(known[name])
        assert (finite.all(axis=-1) == finite.any(axis=-1)).all(), name
        assert (finite.all(axis=-1) == there).all(), name
    told = np.isfinite(answers)
    assert (told.all(axis=-1) == told.any(axis=-1)).all()
    assert type(f).from_bytes(f.to_bytes()).to_bytes() == f.to_bytes()


@dataclass(frozen=True)
class Stream:
    """A streaming class with settings of one kind."""

    kind: type
    # From a number of channels, or None for a single signal, to a strategy of arguments.
    settings: Callable[[int | None], st.SearchStrategy]
    # Fixed arguments by name, for what is tried with each of them.
    examples: dict[str, dict]
    # All that can be asked of it, and the power of the samples' unit in it.
    properties: dict[str, int | str]
    # The power of the samples' unit in what it returns.
    answer: int
    # Raises if samples, finite or missing, must not lead to these answers and this state.
    sound: Callable
    make: Callable
    # Names of the arguments that have the samples' unit, with their powers, or with what becomes
    # of them in another one.
    units: dict[str, int | Callable]
    # Anything that it may be fed with, and what a sensor gives.
    records: Callable = records
    ordinary: Callable = ordinary_records
    # Powers of two that the samples may be multiplied by.
    powers: int = 60
    # Where the channels are in its properties.
    channel_axis: int = 0
    # Whether several signals go through one object side by side.
    side_by_side: bool = True
    # Whether its text is a call that makes it anew.
    told: bool = True
    # Numbers in a sample, and how many of the last ones have a unit of their own.
    width: int = 1
    foreign: int = 0

    def __post_init__(self):
        # Made once: a strategy that is drawn from for the first time is looked at in every part.
        for name in ("records", "ordinary"):
            object.__setattr__(self, name, cache(getattr(self, name)))

    @property
    def channels(self):
        """Numbers of channels that are tried."""
        return (None, 2) if self.side_by_side else (None,)

    def wide(self, z):
        """Records of as many numbers as a sample has, made of one."""
        if self.width == 1:
            return z
        return np.stack([np.roll(z, 7 * i, axis=0) for i in range(self.width)], axis=-1)

    def times(self, z, a):
        """Records in another unit."""
        return z * np.append(np.full(self.width - self.foreign, a), np.ones(self.foreign))

    def one_of(self, arguments, channel):
        """The arguments that make one channel alone."""
        alone = {**arguments, "channels": None}
        if "start" in alone:
            alone["start"] = {name: values[channel] for name, values in alone["start"].items()}
        return alone

    def in_unit(self, arguments, a):
        """The arguments for samples multiplied by ``a``."""
        scaled = dict(arguments)
        for name in scaled.keys() & self.units.keys():
            power = self.units[name]
            if scaled[name] is not None:
                scaled[name] = (
                    power(scaled[name], a) if callable(power) else scaled[name] * a**power
                )
        if isinstance(scaled.get("start"), dict):
            start = scaled["start"]
            scaled["start"] = {name: in_unit(start[name], START[name], a) for name in start}
        return scaled


def state(f):
    """Every property, as arrays by name."""
    return {name: np.asarray(getattr(f, name)) for name in PROPERTIES[type(f)]}


def assert_same_state(got, expected):
    for name, value in state(expected).items():
        assert_same_bits(getattr(got, name), value)
    assert got.to_bytes() == expected.to_bytes()


def in_unit(value, power, a):
    """A value in the unit of samples that were multiplied by ``a``."""
    if power == CONSTANT_LAST:
        return value * np.append(np.ones(value.shape[-1] - 1), a)
    # Flags stay flags.
    return value * a**power if power else value


def alone(kind):
    """Return what makes one of a class that has no channels."""

    def make(arguments):
        return kind(**{name: arguments[name] for name in arguments if name != "channels"})

    return make


# Of the arguments and the properties of a DriftFilter.
START = {
    "offset": 1,
    "scale": 1,
    "coefficients": CONSTANT_LAST,
    "covariance": 0,
    "measurement_noise": 2,
    "process_noise": 2,
    "state_covariance": 2,
}
DRIFT = {
    "estimate": 1,
    "innovation": 1,
    "innovation_variance": 2,
    "gain": 0,
    "measurement_noise": 2,
    "process_noise": 2,
    "coefficients": CONSTANT_LAST,
    "covariance": 2,
    "bias": 1,
    "bias_sigma": 1,
    "at_rest": 0,
    "saturated": 0,
    "stuck": 0,
    "saturated_count": 0,
    "outlier_count": 0,
    "stuck_count": 0,
    "guard_count": 0,
    "ready": 0,
    "samples_seen": 0,
}
# The walk of "auto" has a single coefficient, and that no unit.
AUTO = {**DRIFT, "coefficients": 0}
MODEL = {"coefficients": CONSTANT_LAST, "covariance": 0, "ready": 0, "samples_seen": 0}
ALLAN = {
    "deviation": 1,
    "hadamard_deviation": 1,
    "term_count": 0,
    "hadamard_term_count": 0,
    "samples_seen": 0,
}

CORRECTOR = {
    "gyro_matrix": 0,
    "gyro_bias": 1,
    "accel_matrix": 0,
    "accel_bias": 1,
    "g_sensitivity": 0,
    "bias": 1,
    "force": 1,
    "inputs": 0,
}

ATTITUDE = dict.fromkeys(
    (
        "quaternion",
        "euler",
        "heading",
        "up",
        "gravity",
        "linear_acceleration",
        "bias",
        "bias_sigma",
        "gyro_matrix",
        "gyro_matrix_sigma",
        "tilt_sigma",
        "heading_sigma",
        "at_rest",
        "disturbed",
        "samples_seen",
    ),
    0,
)

LIMITS = {"rest_limit": 1, "bias_limit": 1}
drift_stream = partial(
    Stream,
    kind=zr.DriftFilter,
    make=drift,
    sound=sound_drift,
    answer=1,
    units={"scale": 1, "limit": 1, **LIMITS},
)
FADING = {"rate": RATE, "method": "fading", "output": "estimate"}
SELF_TUNING = {"rate": RATE, "output": "estimate"}
ROBUST = {"rate": RATE, "method": "robust", "output": "estimate"}

STREAMS = {
    "published": drift_stream(
        settings=published_settings,
        examples={method: {**FADING, "method": method} for method in METHODS}
        | {
            "holding": {**FADING, "motion": "hold"},
            "compensating": {**FADING, "output": "compensated"},
            "rejecting": {**FADING, "outliers": "reject", "limit": 25.0},
        },
        properties=DRIFT,
    ),
    "started": drift_stream(
        settings=started_settings,
        examples={
            "started": {
                **FADING,
                "order": (2, 1),
                "start": start_of(np.random.default_rng(7), (2, 1)),
            }
        },
        properties=DRIFT,
    ),
    "robust": drift_stream(
        settings=robust_settings,
        examples={
            "robust": ROBUST,
            "robust-damping": {**ROBUST, "damping": 0.1, "correction": 0.1, "order": (2, 1)},
            "robust-holding": {**ROBUST, "motion": "hold"},
        },
        properties=DRIFT,
    ),
    "robust-published": drift_stream(
        settings=robust_as_published_settings,
        examples={"robust-published": {**ROBUST, "zones": "published", "damping": 0.1}},
        properties=DRIFT,
        # A variance is held against an innovation: in another unit it is another filter.
        powers=0,
    ),
    "auto": drift_stream(
        settings=auto_settings,
        examples={
            "auto": SELF_TUNING,
            "auto-compensating": {"rate": RATE},
            "auto-ignoring": {**SELF_TUNING, "motion": "ignore"},
            "auto-limited": {**SELF_TUNING, "limit": 25.0, "rest_limit": 4.0, "bias_limit": 5.0},
        },
        properties=AUTO,
    ),
    "least-squares": Stream(
        kind=zr.identification.RecursiveLeastSquares,
        make=lambda arguments: zr.identification.RecursiveLeastSquares(**arguments),
        settings=model_settings,
        examples={"least-squares": {}},
        properties=MODEL,
        answer=1,
        sound=sound_model,
        units={"scale": 1},
    ),
    "allan-noise": Stream(
        kind=zr.noise.AllanNoise,
        make=lambda arguments: zr.noise.AllanNoise(**arguments),
        settings=noise_settings,
        examples={"allan-noise": {}, "hadamard-noise": {"noise": "hadamard", "fading": 1.0}},
        properties={"variance": 2},
        answer=2,
        sound=sound_noise,
        units={"floor": 2},
    ),
    "rest-detector": Stream(
        kind=zr.RestDetector,
        make=lambda arguments: zr.RestDetector(**arguments),
        settings=rest_settings,
        examples={
            "rest-detector": {"rate": RATE},
            "rest-limited": {"rate": RATE, "rest_limit": 4.0, "bias_limit": 5.0},
        },
        properties={"at_rest": 0},
        answer=0,
        sound=sound_rest,
        units=LIMITS,
        records=lambda: st.one_of(moving_records(), records()),
        ordinary=moving_records,
        powers=400,
    ),
    "motion-detector": Stream(
        kind=zr.noise.MotionDetector,
        make=lambda arguments: zr.noise.MotionDetector(**arguments),
        settings=motion_settings,
        examples={"motion-detector": {"rate": RATE}},
        properties={"moving": 0},
        answer=0,
        sound=sound_motion,
        units={},
        records=lambda: st.one_of(turning_records(), wide_records(records(), 3)),
        ordinary=turning_records,
        powers=100,
        width=3,
    ),
    "streaming-allan": Stream(
        kind=zr.StreamingAllan,
        make=lambda arguments: zr.StreamingAllan(**arguments),
        settings=allan_settings,
        examples={"streaming-allan": {"rate": RATE, "octaves": 2}},
        properties=ALLAN,
        answer=0,
        sound=sound_allan,
        units={},
        channel_axis=-1,
    ),
    "wavelet": Stream(
        kind=zr.WaveletDenoiser,
        make=lambda arguments: zr.WaveletDenoiser(**arguments),
        settings=wavelet_settings,
        examples={
            "wavelet": {"rate": RATE},
            "wavelet-soft": {"rate": RATE, "wavelet": "haar", "level": 2, "mode": "soft"},
        },
        properties={"sigma": 1, "missing_count": 0, "samples_seen": 0},
        answer=1,
        sound=sound_wavelet,
        units={},
    ),
    **{
        f"corrector-{width}": Stream(
            kind=zr.ImuCorrector,
            make=lambda arguments: zr.ImuCorrector(**arguments),
            settings=partial(corrector_settings, width),
            examples={f"corrector-{width}": some_correction(np.random.default_rng(3), width)},
            properties=CORRECTOR,
            answer=1,
            sound=sound_corrector,
            units={"gyro_bias": 1, "accel_bias": 1, "temperature": curve_in_unit},
            foreign=max(width - 6, 0),
            records=lambda width=width: wide_records(records(), width),
            ordinary=lambda width=width: wide_records(ordinary_records(), width),
            width=width,
        )
        for width in (3, 6, 7)
    },
    **{
        name: Stream(
            kind=zr.Attitude,
            make=lambda arguments: zr.Attitude(**arguments),
            settings=partial(attitude_settings, width),
            examples={name: {"rate": RATE, **arguments}},
            properties=ATTITUDE,
            answer=0,
            sound=sound_attitude,
            units={},
            records=lambda width=width: st.one_of(
                imu_records(width), wide_records(records(), width)
            ),
            ordinary=lambda width=width: imu_records(width),
            # The unit of gyro and accelerometer is known, that of the field is any: beyond this it
            # is weaker or stronger than any field.
            powers=20,
            width=width,
            foreign=6,
        )
        for name, width, arguments in (
            ("attitude", 9, {}),
            ("attitude-6", 6, {"mag": False, "frame": "ned"}),
        )
    },
    "attitude-learning": Stream(
        kind=zr.Attitude,
        make=lambda arguments: zr.Attitude(**{"learn_magnetometer": True, **arguments}),
        settings=partial(attitude_settings, 9),
        examples={"attitude-learning": {"rate": RATE, "learn_magnetometer": True}},
        properties=ATTITUDE,
        answer=0,
        sound=sound_learning_attitude,
        units={},
        records=lambda: st.one_of(imu_records(9), wide_records(records(), 9)),
        ordinary=lambda: imu_records(9),
        powers=20,
        width=9,
        foreign=6,
    ),
    "attitude-named": Stream(
        kind=zr.Attitude,
        make=lambda arguments: zr.Attitude(**arguments),
        settings=named_attitude_settings,
        examples={
            f"attitude-{method}": {"rate": RATE, "method": method}
            for method in ("complementary", "mahony", "madgwick", "ekf", "ukf")
        },
        properties=ATTITUDE,
        answer=0,
        sound=sound_named_attitude,
        units={},
        records=lambda: st.one_of(imu_records(9), wide_records(records(), 9)),
        ordinary=lambda: imu_records(9),
        powers=20,
        width=9,
        foreign=6,
    ),
    "tilt": Stream(
        kind=zr.Tilt,
        make=lambda arguments: zr.Tilt(**arguments),
        settings=tilt_settings,
        examples={
            "tilt": {"rate": RATE},
            "tilt-kalman": {"rate": RATE, "method": "kalman", "q_bias": 1e-5},
        },
        properties=dict.fromkeys(("angle", "angle_sigma", "bias", "bias_sigma"), 1)
        | {"samples_seen": 0},
        answer=1,
        sound=sound_tilt,
        units=dict.fromkeys(("q_angle", "q_bias", "r_measure", "p_start"), 2),
        records=lambda: wide_records(records(), 2),
        ordinary=lambda: wide_records(ordinary_records(), 2),
        width=2,
    ),
    "position": Stream(
        kind=zr.PositionFilter,
        make=lambda arguments: zr.PositionFilter(**arguments),
        settings=position_settings,
        examples={
            f"position-{method}": {"rate": 1.0, "method": method} for method in POSITION_METHODS
        },
        properties=dict.fromkeys(("position", "sigma", "velocity", "receiver_error"), 1)
        | dict.fromkeys(("missing", "held", "samples_seen"), 0),
        answer=1,
        sound=sound_position,
        units={
            **dict.fromkeys(("sigma", "step", "error_sigma", "speed_sigma", "acceleration"), 1),
            "process_noise": 2,
        },
        records=lambda: wide_records(records(), 6),
        ordinary=lambda: wide_records(ordinary_records(), 6),
        width=6,
        # Strength and rest.
        foreign=2,
    ),
    "temperature": Stream(
        kind=zr.TemperatureFilter,
        make=lambda arguments: zr.TemperatureFilter(**arguments),
        settings=temperature_settings,
        examples={
            "temperature": {"rate": RATE},
            "temperature-sloping": {"rate": RATE, "reference": 0.0, "slope": 0.1, "walk": 0.01},
        },
        properties=dict.fromkeys(("bias", "bias_sigma", "slope", "slope_sigma"), 1)
        | {"at_rest": 0, "samples_seen": 0},
        answer=1,
        sound=sound_temperature,
        units={"slope": 1, "slope_sigma": 1, "walk": 1, **LIMITS},
        records=lambda: st.one_of(
            wide_records(moving_records(), 2), warm_records(), wide_records(records(), 2)
        ),
        ordinary=warm_records,
        powers=100,
        width=2,
        foreign=1,
    ),
    **{
        name: Stream(
            kind=zr.GyroArray,
            make=alone(zr.GyroArray),
            settings=partial(array_settings, sensors, axes),
            examples={name: {"rate": RATE, "sensors": sensors, "axes": axes, **arguments}},
            properties={"bias": 1}
            | dict.fromkeys(("weights", "health", "at_rest"), 0)
            | {"samples_seen": 0},
            answer=1,
            sound=sound_array,
            units={"limit": 1, **LIMITS},
            records=lambda width=sensors * axes: st.one_of(
                wide_records(moving_records(), width), wide_records(records(), width)
            ),
            ordinary=lambda width=sensors * axes: wide_records(ordinary_records(), width),
            side_by_side=False,
            width=sensors * axes,
        )
        for name, sensors, axes, arguments in (
            ("array", 4, 3, {}),
            ("array-1", 3, 1, {"limit": 25.0}),
            ("array-centralised", 2, 3, {"method": "centralised"}),
        )
    },
    "linear": Stream(
        kind=zr.LinearKalman,
        make=lambda arguments: zr.LinearKalman(**arguments),
        settings=linear_settings,
        examples={"linear": {**TRACKING, "R": np.eye(2), "H": np.eye(2)}, "linear-9": model(9, 2)},
        # Of measurements in another unit: what they measure and how well is told in it.
        properties=dict.fromkeys(("state", "covariance", "nis"), 0) | {"innovation": 1},
        answer=0,
        sound=sound_linear,
        units={"H": 1, "R": 2},
        records=lambda: wide_records(records(), 2),
        ordinary=lambda: wide_records(ordinary_records(), 2),
        powers=30,
        width=2,
        told=False,
    ),
    "foot": Stream(
        kind=zr.FootFilter,
        make=lambda arguments: zr.FootFilter(**arguments),
        settings=foot_settings,
        examples={"foot": {"rate": RATE}, "foot-level": {"rate": RATE, "floor": "level"}},
        properties=dict.fromkeys(
            (
                "position",
                "velocity",
                "quaternion",
                "gyro_bias",
                "accel_bias",
                "sigma",
                "standing",
                "at_rest",
                "bound",
                "stance_count",
                "rejection_count",
                "fastest",
                "samples_seen",
                "delay",
            ),
            0,
        ),
        answer=0,
        sound=sound_foot,
        units={},
        records=lambda: st.one_of(foot_records(), wide_records(records(), 6)),
        ordinary=foot_records,
        # The units of everything are known.
        powers=0,
        width=6,
    ),
    "navigation": Stream(
        kind=zr.NavigationFilter,
        make=alone(zr.NavigationFilter),
        settings=navigation_settings,
        examples={
            "navigation": {"start": LEVEL},
            "navigation-wheeled": {
                "start": LEVEL,
                "vehicle": "wheeled",
                "antenna": (0.4, -0.3, -1.2),
                "antenna_sigma": 0.1,
            },
        },
        properties=dict.fromkeys(
            (
                *NAVIGATED,
                "covariance",
                "antenna",
                "antenna_sigma",
                "nis",
                "learned_sigma",
                "time",
                "samples_seen",
                "height_reference",
                "height_reference_sigma",
                "compass_offset",
                "compass_offset_sigma",
            ),
            0,
        ),
        answer=0,
        sound=sound_navigation,
        units={},
        records=lambda: st.one_of(driven_records(), wide_records(records(), 14)),
        ordinary=driven_records,
        # The units of everything are known.
        powers=0,
        side_by_side=False,
        width=14,
        told=False,
    ),
}
STREAMS["navigation-aided"] = replace(
    STREAMS["navigation"],
    examples={
        "navigation-aided": {
            "start": replace(LEVEL, heading_known=False),
            "antenna": (0.4, -0.3, -1.2),
            "antenna_sigma": 0.1,
            "limits": {"position": 3.0, "heading": 0.05},
        }
    },
    records=lambda: st.one_of(aided_records(), wide_records(records(), 18)),
    ordinary=aided_records,
    width=18,
)
STREAMS["navigation bank"] = replace(
    STREAMS["navigation"],
    kind=zr.navigation.NavigationBank,
    make=alone(zr.navigation.NavigationBank),
    examples={
        "navigation-bank": {"start": LEVEL},
        "navigation-bank-wheeled": STREAMS["navigation"].examples["navigation-wheeled"],
    },
    properties={**STREAMS["navigation"].properties, "weights": 0, "noise_factors": 0},
)
PROPERTIES = {stream.kind: list(stream.properties) for stream in STREAMS.values()}
EXAMPLES = {
    name: (stream, arguments)
    for stream in STREAMS.values()
    for name, arguments in stream.examples.items()
}


def example(name, channels=None):
    """A new filter of EXAMPLES, every channel alike."""
    stream, arguments = EXAMPLES[name]
    if channels is not None and "start" in arguments:
        repeated = {
            key: np.stack([np.asarray(value)] * channels)
            for key, value in arguments["start"].items()
        }
        arguments = {**arguments, "start": repeated}
    return stream.make({**arguments, "channels": channels})


def assert_same_answers(got, expected):
    if expected is None:
        assert got is None
    else:
        assert_same_bits(got, expected)
