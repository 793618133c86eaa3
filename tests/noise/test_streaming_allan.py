"""StreamingAllan: against its twin, the deviations of the whole record, and the laws."""

import copy
import math
import pickle
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import oracle
import zerorate as zr
from support.checks import assert_same_bits
from support.classes import assert_same_state, state
from support.records import hostile_records, ordinary_records, records
from support.settings import RATE

OCTAVES = st.integers(1, 9)
# Of the largest deviation: samples on an offset of a hundred deviations are rounded to 1e-14 of
# one, and so are the phases of some hundred samples. A hundred times what is seen.
TOLERANCE = 1e-12


def fed(z, octaves=6, **arguments):
    allan = zr.StreamingAllan(RATE, octaves, **arguments)
    allan.process(z)
    return allan


def assert_close(got, expected):
    largest = np.nanmax(expected, initial=0.0)
    np.testing.assert_allclose(got, expected, rtol=0.0, atol=TOLERANCE * largest)


def batch_deviation(z, m, order):
    """Fully overlapping deviation of a whole record, from its phase with the mean removed."""
    phase = np.concatenate([[0.0], np.cumsum(z - z.mean())])
    for _ in range(order + 1):
        phase = phase[m:] - phase[:-m]
    return np.sqrt(np.mean(phase**2) / math.comb(2 * order, order)) / m


def batch_deviations(z, octaves, order):
    return [batch_deviation(z, 2**j, order) for j in range(octaves)]


@given(OCTAVES, ordinary_records())
def test_the_twin_agrees(octaves, z):
    allan, twin = fed(z, octaves), oracle.StreamingAllan(octaves)
    for sample in z:
        twin.observe(sample)
    for name, terms, (expected, n) in (
        ("deviation", "term_count", twin.deviation()),
        ("hadamard_deviation", "hadamard_term_count", twin.hadamard_deviation()),
    ):
        np.testing.assert_array_equal(getattr(allan, terms), n)
        assert_close(getattr(allan, name), expected)


@pytest.mark.parametrize("offset", [0.0, 1.0, -1e3])
def test_the_whole_record_agrees(offset):
    """Longer than the ring, which holds 2048 phases."""
    z = offset + np.random.default_rng(3).standard_normal(20_000)
    allan = fed(z, octaves=10)
    # The mean lies some two deviations off the first sample: rounding is as noise of
    # 6e-17 * 2e4 * 2 = 2e-12 deviations on each sample.
    for name, order in (("deviation", 1), ("hadamard_deviation", 2)):
        np.testing.assert_allclose(getattr(allan, name), batch_deviations(z, 10, order), rtol=1e-11)


def test_a_large_offset_costs_no_precision():
    rng = np.random.default_rng(4)
    # Multiples of what a float of 1e7 resolves, so that the offset itself rounds nothing.
    noise = np.round(1e-4 * rng.standard_normal(50_000) * 2.0**29) / 2.0**29
    allan = fed(1e7 + noise, octaves=12)
    for name, order in (("deviation", 1), ("hadamard_deviation", 2)):
        # Phases of multiples of 2^-29 are exact; the mean that the record's phase is taken off
        # rounds that to 1e-16 of some hundred deviations.
        np.testing.assert_allclose(
            getattr(allan, name), batch_deviations(noise, 12, order), rtol=1e-12
        )


def test_a_mean_far_off_the_first_sample_costs_nothing_to_be_seen():
    """Forty deviations, over a million samples."""
    z = 40.0 + np.random.default_rng(5).standard_normal(1_000_000)
    z[0] = 0.0
    allan = fed(z, octaves=10)
    # Rounding is as noise of at most 6e-17 * 1e6 * 40 = 3e-9 deviations on each sample. It does not
    # go with the samples' own, so of the 2000 averages of 512 samples a part of 1/√2000 is seen.
    for name, order in (("deviation", 1), ("hadamard_deviation", 2)):
        np.testing.assert_allclose(getattr(allan, name), batch_deviations(z, 10, order), rtol=1e-10)


def test_rounding_on_a_long_way_is_as_documented():
    """The phase of a steep ramp goes as far as that of 2.5e9 samples 40 deviations off."""
    n, step = 100_000, 20.0
    noise = np.round(np.random.default_rng(5).standard_normal(n) * 2.0**20) / 2.0**20
    allan = fed(step * np.arange(n) + noise, octaves=8)
    # 6e-17 * 1e11 = 6e-6 deviations on each sample, of 800 averages a part of 1/√800: 2e-7.
    expected = batch_deviations(noise, 8, 2)
    np.testing.assert_allclose(allan.hadamard_deviation, expected, rtol=2e-7)


def test_known_by_hand():
    allan = fed([1.0, 2.0, 0.0, 1.0], octaves=3)
    np.testing.assert_array_equal(allan.taus, [0.01, 0.02, 0.04])
    np.testing.assert_array_equal(allan.term_count, [3, 1, 0])
    np.testing.assert_array_equal(allan.hadamard_term_count, [2, 0, 0])
    # One rounding of a root each.
    np.testing.assert_allclose(allan.deviation, [1.0, math.sqrt(0.5), np.nan], rtol=1e-15)
    np.testing.assert_allclose(allan.hadamard_deviation, [math.sqrt(1.5), np.nan, np.nan], 1e-15)


def test_a_ramp():
    """The averages of m samples of a ramp rise by m steps: D m / √2; Hadamard sees nothing."""
    allan = fed(0.25 * np.arange(5000.0), octaves=8)
    expected = 0.25 * 2.0 ** np.arange(8) / math.sqrt(2.0)
    np.testing.assert_allclose(allan.deviation, expected, rtol=1e-15)  # sums of exact numbers
    np.testing.assert_array_equal(allan.hadamard_deviation, np.zeros(8))


@given(OCTAVES, records(), st.data())
def test_split(octaves, z, data):
    cut = data.draw(st.integers(0, len(z)))
    whole, stream = fed(z, octaves), zr.StreamingAllan(RATE, octaves)
    parts = fed(z[:cut], octaves)
    parts.process(z[cut:])
    for sample in z.tolist():
        stream.update(sample)
    assert_same_state(parts, whole)
    assert_same_state(stream, whole)


COPIES = {
    "bytes": lambda f: type(f).from_bytes(f.to_bytes()),
    "pickle": lambda f: pickle.loads(pickle.dumps(f)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "method": lambda f: f.copy(),
}


@pytest.mark.parametrize("way", COPIES)
@given(octaves=OCTAVES, z=records(), channels=st.sampled_from([None, 2]), data=st.data())
def test_a_copy_goes_on_equal(way, octaves, z, channels, data):
    z = z if channels is None else np.stack([z, z[::-1]], axis=-1)
    cut = data.draw(st.integers(0, len(z)))
    allan = fed(z[:cut], octaves, channels=channels)
    twin = COPIES[way](allan)
    assert (twin.rate, twin.octaves, twin.channels) == (RATE, octaves, channels)
    assert repr(twin) == repr(allan)
    before = allan.to_bytes()
    twin.process(z[cut:])
    assert allan.to_bytes() == before
    allan.process(z[cut:])
    assert_same_state(twin, allan)


CONTINUE = """
import sys
import numpy as np
import zerorate as zr

folder = sys.argv[1]
with open(f"{folder}/state", "rb") as file:
    allan = zr.StreamingAllan.from_bytes(file.read())
allan.process(np.load(f"{folder}/rest.npy"))
with open(f"{folder}/state", "wb") as file:
    file.write(allan.to_bytes())
"""


def test_another_process_goes_on_equal(tmp_path):
    z = np.random.default_rng(6).standard_normal(1000)
    z[300] = np.nan
    allan = fed(z[:555])
    (tmp_path / "state").write_bytes(allan.to_bytes())
    np.save(tmp_path / "rest.npy", z[555:])
    subprocess.run([sys.executable, "-c", CONTINUE, str(tmp_path)], check=True)
    allan.process(z[555:])
    assert (tmp_path / "state").read_bytes() == allan.to_bytes()


@given(OCTAVES, records())
def test_reset_is_a_new_one(octaves, z):
    allan = fed(z, octaves)
    allan.reset()
    assert_same_state(allan, zr.StreamingAllan(RATE, octaves))


@given(OCTAVES, ordinary_records(), st.integers(-60, 60))
def test_a_power_of_two_scales_without_rounding(octaves, z, power):
    plain, scaled = state(fed(z, octaves)), state(fed(z * 2.0**power, octaves))
    for name in ("deviation", "hadamard_deviation"):
        assert_same_bits(scaled.pop(name), plain.pop(name) * 2.0**power)
    for name, value in plain.items():
        assert_same_bits(scaled[name], value)


@given(ordinary_records(), st.floats(1e-12, 1e12), st.sampled_from([-1.0, 1.0]))
def test_any_unit_scales_to_rounding(z, a, sign):
    plain, scaled = fed(z), fed(a * sign * z)
    for name in ("deviation", "hadamard_deviation"):
        assert_close(getattr(scaled, name), a * getattr(plain, name))


@given(st.lists(records(), min_size=1, max_size=4), st.integers(1, 6))
def test_channels_do_not_mix(columns, threads):
    rows = min(map(len, columns))
    z = np.stack([column[:rows] for column in columns], axis=-1)
    together = zr.StreamingAllan(RATE, 5, channels=len(columns))
    together.process(z, threads=threads)
    by_row = zr.StreamingAllan(RATE, 5, channels=len(columns))
    for row in z:
        by_row.update(row)
    assert_same_state(by_row, together)
    for c in range(len(columns)):
        alone = state(fed(z[:, c], octaves=5))
        assert alone.pop("samples_seen") == together.samples_seen
        for name, value in alone.items():
            assert_same_bits(getattr(together, name)[:, c].copy(), value)


@given(OCTAVES, st.one_of(hostile_records(), records()))
def test_nothing_finite_breaks_it(octaves, z):
    known = state(fed(z, octaves))
    for name, terms in (("deviation", "term_count"), ("hadamard_deviation", "hadamard_term_count")):
        seen = known[terms] > 0
        assert np.all(np.isfinite(known[name][seen]))
        assert np.all(known[name][seen] >= 0.0)
        assert np.all(np.isnan(known[name][~seen]))


@given(records(), st.sampled_from([np.nan, np.inf, -np.inf]))
def test_every_kind_of_missing_is_the_same(z, kind):
    assert_same_state(fed(np.where(np.isfinite(z), z, kind)), fed(z))


def test_a_gap_leaves_nothing_behind():
    """Not even the rounding of a huge sample before it."""
    z = np.random.default_rng(7).standard_normal(500)
    plain, after = fed(z), fed(np.concatenate([[1e300, np.nan], z]))
    for name in ("deviation", "hadamard_deviation", "term_count", "hadamard_term_count"):
        assert_same_bits(getattr(after, name), getattr(plain, name))


@pytest.mark.parametrize("octaves", [1, 16, 24])
def test_properties_have_their_full_shape(octaves):
    for channels, shape in ((None, (octaves,)), (1, (octaves, 1)), (3, (octaves, 3))):
        allan = zr.StreamingAllan(RATE, octaves, channels=channels)
        assert allan.taus.shape == (octaves,)
        for name in ("deviation", "hadamard_deviation"):
            assert getattr(allan, name).shape == shape
            assert getattr(allan, name).dtype == np.float64
            assert np.all(np.isnan(getattr(allan, name)))
        for name in ("term_count", "hadamard_term_count"):
            assert getattr(allan, name).shape == shape
            assert getattr(allan, name).dtype == np.int64
            assert not np.any(getattr(allan, name))


def test_none_is_a_missing_sample():
    allan = zr.StreamingAllan(RATE, 2)
    assert [allan.update(z) for z in (1.0, None, 2.0, 3.0)] == [None] * 4
    assert allan.samples_seen == 4
    assert allan.term_count.tolist() == [1, 0]


WRONG = [
    ({"rate": 0.0}, ValueError, "rate must be a positive number of samples a second, got 0.0"),
    ({"rate": math.nan}, ValueError, "rate must be a positive number of samples a second, got NaN"),
    ({"octaves": 0}, ValueError, "octaves must be from 1 to 24, got 0"),
    ({"octaves": 25}, ValueError, "octaves must be from 1 to 24, got 25"),
    ({"octaves": -3}, ValueError, "octaves must be from 1 to 24, got -3"),
    ({"octaves": 2.5}, TypeError, "octaves"),
    ({"channels": 0}, ValueError, "channels must be at least 1, got 0"),
]


@pytest.mark.parametrize(("arguments", "error", "words"), WRONG)
def test_wrong_arguments(arguments, error, words):
    with pytest.raises(error, match=words):
        zr.StreamingAllan(**{"rate": RATE, **arguments})


@pytest.mark.parametrize(
    ("z", "error", "words"),
    [
        (np.zeros((3, 2)), ValueError, r"z must have shape \(n,\), got \(3, 2\)"),
        (np.array([1j]), TypeError, "z must hold real numbers, got dtype complex128"),
        ([[1.0], [1.0, 2.0]], ValueError, "z must be a rectangular array of numbers"),
    ],
)
def test_a_wrong_batch_changes_nothing(z, error, words):
    allan = fed(np.arange(100.0))
    before = allan.to_bytes()
    with pytest.raises(error, match=words):
        allan.process(z)
    with pytest.raises(ValueError, match="threads must be at least 1, got 0"):
        allan.process([1.0], threads=0)
    with pytest.raises(TypeError, match=r"update\(\) takes one number"):
        allan.update([1.0])
    assert allan.to_bytes() == before


@pytest.mark.parametrize("name", ["rate", "octaves", "taus", "deviation", "term_count"])
def test_properties_are_read_only(name):
    with pytest.raises(AttributeError, match=name):
        setattr(fed([1.0]), name, 1.0)
