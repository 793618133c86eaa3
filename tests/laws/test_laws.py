"""The laws that hold for every filter, setting and record."""

import copy
import pickle
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import zerorate as zr
from support.strategies import (
    METHODS,
    MOTIONS,
    ORDERS,
    OUTPUTS,
    RATE,
    SIGNALS,
    answers,
    assert_covariance,
    assert_finite,
    assert_same_bits,
    assert_same_state,
    assert_semidefinite,
    auto_settings,
    drift,
    drift_settings,
    hostile_records,
    make,
    model_settings,
    noise_settings,
    of_channel,
    ordinary_records,
    recipes,
    records,
    state,
    traced,
)

EVERY = [
    *((zr.DriftFilter, {"rate": RATE, "order": o, "method": m}) for o in ORDERS for m in METHODS),
    *(
        (zr.DriftFilter, {"rate": RATE, "method": m, "motion": motion, "output": output})
        for m in [*METHODS, "auto"]
        for motion in MOTIONS
        for output in OUTPUTS
    ),
    *((zr.RecursiveLeastSquares, {"order": order}) for order in ORDERS),
    (zr.AllanNoise, {}),
    (zr.AllanNoise, {"noise": "hadamard", "fading": 1.0}),
]
BY_FILTER = pytest.mark.parametrize(
    "recipe", EVERY, ids=lambda r: "-".join([r[0].__name__, *map(str, r[1].values())])
)


def cuts(z):
    return st.integers(0, len(z))


def mixed_record(n=700):
    """One record of everything that a filter treats differently, the start-up included."""
    rng = np.random.default_rng(5)
    return np.concatenate([signal(rng, n // 5) for signal in SIGNALS.values()])


@BY_FILTER
def test_batch_is_sample_by_sample_for_every_filter(recipe):
    z = mixed_record()
    batch, stream = make(recipe), make(recipe)
    assert_same_bits(batch.process(z), np.array([stream.update(sample) for sample in z]))
    assert_same_state(batch, stream)


@given(recipes(), records(), st.data())
def test_split(recipe, z, data):
    cut = data.draw(cuts(z))
    whole, parts, stream = make(recipe), make(recipe), make(recipe)
    expected = whole.process(z)
    assert_same_bits(np.append(parts.process(z[:cut]), parts.process(z[cut:])), expected)
    assert_same_bits([stream.update(sample) for sample in z.tolist()], expected)
    assert_same_state(parts, whole)
    assert_same_state(stream, whole)


@given(drift_settings(), records(), st.data())
def test_trace_is_process(arguments, z, data):
    cut = data.draw(cuts(z))
    batch, parts = drift(arguments), drift(arguments)
    expected = batch.process(z)
    first, trace = parts.process(z[:cut]), traced(parts, z[cut:])
    assert_same_bits(np.append(first, answers(arguments, trace, z[cut:])), expected)
    assert_same_state(parts, batch)


@given(drift_settings(), records())
def test_trace_is_what_the_properties_tell(arguments, z):
    f, stream = drift(arguments), drift(arguments)
    trace = traced(f, z)
    # A tick in which motion began is taken back, its guarded steps with it.
    if trace["at_rest"].all():
        assert trace["guarded"].sum() == f.guard_count
    for k, sample in enumerate(z[:150].tolist()):
        stream.update(sample)
        for name, values in trace.items():
            if name not in ("missing", "guarded"):
                assert_same_bits(np.asarray(getattr(stream, name)), values[k])


COPIES = {
    "bytes": lambda f: type(f).from_bytes(f.to_bytes()),
    "pickle": lambda f: pickle.loads(pickle.dumps(f)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "method": lambda f: f.copy(),
}


@pytest.mark.parametrize("way", COPIES)
@given(recipe=st.one_of(recipes(), recipes(2)), z=records(), data=st.data())
def test_a_copy_goes_on_equal(way, recipe, z, data):
    if recipe[1]["channels"]:
        z = np.stack([z, z[::-1]], axis=-1)
    cut = data.draw(cuts(z))
    f = make(recipe)
    f.process(z[:cut])
    twin = COPIES[way](f)
    assert_same_state(twin, f)
    expected = f.process(z[cut:])
    assert_same_bits(twin.process(z[cut:]), expected)
    assert_same_state(twin, f)


@given(recipe=recipes(), z=records())
def test_a_copy_is_independent(recipe, z):
    f = make(recipe)
    f.process(z)
    before = f.to_bytes()
    twin = f.copy()
    twin.process(z)
    twin.reset()
    assert f.to_bytes() == before


@given(recipe=recipes(), z=records())
def test_reset_is_a_new_filter(recipe, z):
    f = make(recipe)
    f.process(z)
    f.reset()
    assert_same_state(f, make(recipe))


CONTINUE = """
import sys
import numpy as np
import zerorate as zr

kind, folder = sys.argv[1:]
with open(f"{folder}/state", "rb") as file:
    f = getattr(zr, kind).from_bytes(file.read())
np.save(f"{folder}/got.npy", f.process(np.load(f"{folder}/rest.npy")))
with open(f"{folder}/state", "wb") as file:
    file.write(f.to_bytes())
"""


@pytest.mark.parametrize("kind", [zr.DriftFilter, zr.RecursiveLeastSquares, zr.AllanNoise])
def test_another_process_goes_on_equal(kind, tmp_path):
    z = mixed_record()
    f = kind(rate=RATE) if kind is zr.DriftFilter else kind()
    f.process(z[:333])
    (tmp_path / "state").write_bytes(f.to_bytes())
    np.save(tmp_path / "rest.npy", z[333:])
    subprocess.run([sys.executable, "-c", CONTINUE, kind.__name__, str(tmp_path)], check=True)
    assert_same_bits(np.load(tmp_path / "got.npy"), f.process(z[333:]))
    assert (tmp_path / "state").read_bytes() == f.to_bytes()


# What becomes of each array when the unit of the samples is divided by a.
UNIT = {
    "estimate": 1,
    "innovation": 1,
    "innovation_variance": 2,
    "gain": 0,
    "measurement_noise": 2,
    "process_noise": 2,
    "covariance": 2,
    "bias": 1,
    "bias_sigma": 1,
}


def in_unit(arguments, a):
    known = arguments.get("scale")
    scaled = {**arguments, "scale": None if known is None else known * a}
    if "start" in arguments:
        scaled["start"] = start_in_unit(arguments["start"], a)
    return scaled


def start_in_unit(start, a):
    powers = dict.fromkeys(("offset", "scale"), 1) | dict.fromkeys(
        ("measurement_noise", "process_noise", "state_covariance"), 2
    )
    coefficients = start["coefficients"].copy()
    coefficients[..., -1] *= a
    return {**start, **{name: start[name] * a**n for name, n in powers.items()}} | {
        "coefficients": coefficients
    }


@given(drift_settings(), ordinary_records(), st.integers(-60, 60))
def test_a_power_of_two_scales_without_rounding(arguments, z, power):
    a = 2.0**power
    plain = traced(drift(arguments), z)
    scaled = traced(drift(in_unit(arguments, a)), z * a)
    for name, exponent in UNIT.items():
        assert_same_bits(scaled[name], plain[name] * a**exponent)
    # The walk of "auto" has a single coefficient, and that no unit.
    unit = a if "order" in arguments else 1.0
    assert_same_bits(scaled["coefficients"][:, :-1], plain["coefficients"][:, :-1])
    assert_same_bits(scaled["coefficients"][:, -1], plain["coefficients"][:, -1] * unit)
    for name in ("guarded", "at_rest"):
        assert_same_bits(scaled[name], plain[name])


@given(model_settings(), ordinary_records(), st.integers(-60, 60))
def test_a_power_of_two_scales_residuals_without_rounding(arguments, z, power):
    a = 2.0**power
    plain = zr.RecursiveLeastSquares(**arguments)
    scaled = zr.RecursiveLeastSquares(**in_unit(arguments, a))
    assert_same_bits(scaled.process(z * a), plain.process(z) * a)
    assert_same_bits(scaled.covariance, plain.covariance)


@given(noise_settings(), ordinary_records(), st.integers(-60, 60))
def test_a_power_of_two_scales_allan_noise_without_rounding(arguments, z, power):
    a = 2.0**power
    floor = arguments.pop("floor", 0.0)
    plain = zr.AllanNoise(floor=floor, **arguments)
    scaled = zr.AllanNoise(floor=floor * a**2, **arguments)
    assert_same_bits(scaled.process(z * a), plain.process(z) * a**2)


# Every sample is rounded in its new unit, by 1e-16 of an offset that may be fifty deviations, and
# least squares amplifies that: 1e-13 is seen.
UNIT_TOLERANCE = 1e-11


def mild_settings():
    """Settings that keep least squares well posed and G off the floor's rounding."""
    return st.fixed_dictionaries(
        {
            "rate": st.just(RATE),
            "order": st.sampled_from(ORDERS),
            "method": st.sampled_from([*METHODS, "auto"]),
            "process_noise": st.sampled_from([1e-8, 1e-4, 0.1, 1.0]),
            "forgetting_factor": st.sampled_from([0.99, 1.0]),
            "noise": st.sampled_from(["allan", "hadamard"]),
        }
    )


@given(mild_settings(), ordinary_records(), st.floats(1e-12, 1e12), st.sampled_from([-1.0, 1.0]))
def test_any_unit_scales_to_rounding(arguments, z, a, sign):
    a *= sign
    plain = traced(drift(arguments), z)
    scaled = traced(drift(arguments), z * a)
    deviation = np.std(z[np.isfinite(z)])
    for name in ("estimate", "innovation", "bias"):
        difference = np.abs(scaled[name] / a - plain[name])
        assert difference.max() <= UNIT_TOLERANCE * deviation, name


@given(mild_settings(), ordinary_records(), st.floats(-10.0, 10.0))
def test_an_offset_only_moves_the_estimate(arguments, z, deviations):
    deviation = np.std(z[np.isfinite(z)])
    offset = deviations * deviation
    plain = traced(drift(arguments), z)
    moved = traced(drift(arguments), z + offset)
    # In the start-up the answer before the first sample is zero, whatever the offset.
    first = np.flatnonzero(np.isfinite(z))[0]
    difference = np.abs(moved["estimate"] - offset - plain["estimate"])[first:]
    assert difference.max() <= UNIT_TOLERANCE * deviation


@given(st.integers(1, 5).flatmap(recipes), st.data(), st.integers(1, 8))
def test_channels_do_not_mix(recipe, data, threads):
    kind, arguments = recipe
    channels = arguments["channels"]
    columns = [data.draw(records()) for _ in range(channels)]
    rows = min(map(len, columns))
    z = np.stack([column[:rows] for column in columns], axis=-1)
    together = make(recipe)
    got = together.process(z, threads=threads)
    known = state(together)
    for channel in range(channels):
        alone = make((kind, of_channel(arguments, channel)))
        assert_same_bits(got[:, channel].copy(), alone.process(z[:, channel].copy()))
        for name, value in state(alone).items():
            whole = known[name] if name == "samples_seen" else known[name][channel]
            assert_same_bits(whole, value.astype(whole.dtype))


@given(drift_settings(3), st.data())
def test_channels_of_a_trace_do_not_mix(arguments, data):
    z = data.draw(records())
    z = np.stack([z, z[::-1], 2.0 * np.roll(np.clip(z, -1e300, 1e300), 7)], axis=-1)
    together = traced(drift(arguments), z)
    rows = drift(arguments)
    got = np.array([rows.update(row) for row in z])
    assert_same_bits(got, answers(arguments, together, z))
    for channel in range(3):
        alone = traced(drift(of_channel(arguments, channel)), z[:, channel].copy())
        for name, value in alone.items():
            assert_same_bits(together[name][:, channel].copy(), value)


@pytest.mark.parametrize("threads", [1, 2, 3, 7, 64])
def test_threads_do_not_matter_in_long_batches(threads):
    # More rows than the threads work on before they meet.
    z = np.random.default_rng(6).standard_normal((70_000, 4))
    expected = zr.DriftFilter(rate=RATE, channels=4).process(z)
    f = zr.DriftFilter(rate=RATE, channels=4)
    assert_same_bits(f.process(z, threads=threads), expected)


@given(drift_settings(), records())
def test_nothing_finite_breaks_a_drift_filter(arguments, z):
    f = drift(arguments)
    trace = traced(f, z)
    assert_finite(trace)
    assert_finite(state(f))
    assert_covariance(trace["process_noise"])
    assert_covariance(trace["covariance"])
    np.testing.assert_array_equal(trace["missing"], ~np.isfinite(z))
    for name in ("innovation_variance", "measurement_noise", "bias_sigma"):
        assert np.all(trace[name] >= 0.0)


@given(drift_settings(), records())
def test_the_compensated_rate_is_the_sample_minus_the_bias(arguments, z):
    arguments = {**arguments, "output": "compensated"}
    got = drift(arguments).process(z)
    assert_same_bits(got, answers(arguments, traced(drift(arguments), z), z))
    np.testing.assert_array_equal(np.isnan(got), ~np.isfinite(z))
    assert np.all(np.isfinite(got[np.isfinite(z)]))


@given(drift_settings(), records())
def test_the_output_changes_nothing_but_the_answers(arguments, z):
    plain, other = (drift({**arguments, "output": output}) for output in OUTPUTS)
    expected, got = traced(plain, z), traced(other, z)
    for name in expected:
        assert_same_bits(got[name], expected[name])


@given(auto_settings(), records())
def test_the_bias_of_auto_is_its_estimate(arguments, z):
    trace = traced(drift(arguments), z)
    assert_same_bits(trace["bias"], trace["estimate"])


@given(auto_settings(), records(), records())
def test_switching_on_again_forgets_the_drift_but_not_the_noise(arguments, before, after):
    """The drift is counted from the new samples alone, the weights of the walks are kept."""
    f, twin = drift(arguments), drift(arguments)
    f.process(before)
    noise = np.asarray(f.measurement_noise)
    f.power_on()
    assert (f.bias, f.status) == (0.0, "starting")
    assert_same_bits(f.samples_seen, len(before))
    if f.ready:
        assert_same_bits(f.measurement_noise, noise)
    # As long as the new start-up lasts, the bias is that of a filter that has seen nothing.
    assert_same_bits(f.process(after[:9]), twin.process(after[:9]))


@given(model_settings(), records())
def test_nothing_finite_breaks_least_squares(arguments, z):
    model = zr.RecursiveLeastSquares(**arguments)
    residuals = []
    for k, sample in enumerate(z.tolist()):
        residuals.append(model.update(sample))
        if k % 20 == 0:
            assert_semidefinite(model.covariance)
            assert_finite(state(model))
    assert_finite({"residuals": residuals, **state(model)})
    assert_semidefinite(model.covariance)


@given(noise_settings(), hostile_records())
def test_nothing_finite_breaks_allan_noise(arguments, z):
    noise = zr.AllanNoise(**arguments)
    variances = noise.process(z)
    assert_finite({"variances": variances, **state(noise)})
    assert np.all(variances >= arguments.get("floor", 0.0))


@given(drift_settings(), records(), st.sampled_from([np.nan, np.inf, -np.inf]))
def test_every_kind_of_missing_is_the_same(arguments, z, kind):
    expected = traced(drift(arguments), np.where(np.isfinite(z), z, np.nan))
    got = traced(drift(arguments), np.where(np.isfinite(z), z, kind))
    for name, values in expected.items():
        assert_same_bits(got[name], values)
    missing = got["missing"]
    assert np.all(got["innovation"][missing] == 0.0)
    assert np.all(got["gain"][missing] == 0.0)
    assert not np.any(got["guarded"][missing])
