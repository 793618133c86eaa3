"""What a DriftFilter says of itself, sample by sample; its laws are those of tests/laws, too."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from support.checks import assert_same_bits
from support.classes import STREAMS, assert_same_state, in_unit
from support.records import ordinary_records, records
from support.settings import (
    METHODS,
    ORDERS,
    OUTPUTS,
    RATE,
    answers,
    auto_settings,
    drift,
    drift_settings,
    traced,
    within_range,
)


@given(drift_settings(), records(), st.data())
def test_trace_is_process(arguments, z, data):
    cut = data.draw(st.integers(0, len(z)))
    batch, parts = drift(arguments), drift(arguments)
    expected = batch.process(z)
    first, trace = parts.process(z[:cut]), traced(parts, z[cut:])
    assert_same_bits(np.append(first, answers(arguments, trace, z[cut:])), expected)
    assert_same_state(parts, batch)


@given(drift_settings(), records(), st.data())
def test_what_a_replay_notes_is_what_a_trace_tells(arguments, z, data):
    cut = data.draw(st.integers(0, len(z)))
    f, noting = drift(arguments), drift(arguments)
    noting.process(z[:cut])
    traced(f, z[:cut])
    trace, rest = traced(f, z[cut:]), np.ascontiguousarray(z[cut:][None])
    bias, sigma = np.empty_like(rest), np.empty_like(rest)
    at_rest, stuck = np.empty(rest.shape, np.bool_), np.empty(rest.shape, np.bool_)
    noting._replay(rest, bias, (sigma, at_rest, stuck))
    for noted, name in ((bias, "bias"), (sigma, "bias_sigma")):
        assert_same_bits(noted[0], trace[name])
    np.testing.assert_array_equal(at_rest[0], trace["at_rest"])
    np.testing.assert_array_equal(stuck[0], trace["stuck"])
    assert_same_state(noting, f)


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


@given(drift_settings(), ordinary_records(), st.integers(-60, 60))
def test_a_power_of_two_scales_without_rounding(arguments, z, power):
    """Each sample's part of the trace."""
    a = 2.0**power
    stream = STREAMS["auto" if arguments["method"] == "auto" else "published"]
    plain = traced(drift(arguments), z)
    scaled = traced(drift(stream.in_unit(arguments, a)), z * a)
    for name, values in plain.items():
        power_of_unit = stream.properties.get(name, 0)
        assert_same_bits(scaled[name], in_unit(values, power_of_unit, a))


# Every sample is rounded in its new unit, by 1e-16 of an offset that may be fifty deviations, and
# least squares amplifies that: 1e-13 is seen.
UNIT_TOLERANCE = 1e-11


def mild_settings():
    """Settings that keep least squares well posed and G off the floor's rounding."""
    published = st.fixed_dictionaries(
        {
            "rate": st.just(RATE),
            "order": st.sampled_from(ORDERS),
            "method": st.sampled_from(METHODS),
            "process_noise": st.sampled_from([1e-8, 1e-4, 0.1, 1.0]),
            "forgetting_factor": st.sampled_from([0.99, 1.0]),
            "noise": st.sampled_from(["allan", "hadamard"]),
        }
    )
    return st.one_of(published, published, published, st.just({"rate": RATE, "method": "auto"}))


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


@given(drift_settings(3), st.data())
def test_channels_of_a_trace_do_not_mix(arguments, data):
    z = data.draw(records())
    z = np.stack([z, z[::-1], 2.0 * np.roll(np.clip(z, -1e300, 1e300), 7)], axis=-1)
    together = traced(drift(arguments), z)
    rows = drift(arguments)
    got = np.array([rows.update(row) for row in z])
    assert_same_bits(got, answers(arguments, together, z))
    for channel in range(3):
        alone = traced(drift(STREAMS["started"].one_of(arguments, channel)), z[:, channel].copy())
        for name, value in alone.items():
            assert_same_bits(together[name][:, channel].copy(), value)


@given(drift_settings(), records())
def test_the_compensated_rate_is_the_sample_minus_the_bias(arguments, z):
    arguments = {**arguments, "output": "compensated"}
    got = drift(arguments).process(z)
    assert_same_bits(got, answers(arguments, traced(drift(arguments), z), z))
    seen = np.isfinite(within_range(z, arguments.get("limit")))
    np.testing.assert_array_equal(np.isnan(got), ~seen)
    assert np.all(np.isfinite(got[seen]))


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
    assert (f.bias, f.status) == (0.0, twin.status)
    assert_same_bits(f.samples_seen, len(before))
    if f.ready:
        assert_same_bits(f.measurement_noise, noise)
    # As long as the new start-up lasts, the bias is that of a filter that has seen nothing.
    assert_same_bits(f.process(after[:9]), twin.process(after[:9]))


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
