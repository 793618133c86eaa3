"""`zerorate.allan`: what it takes, what it returns, and what it refuses."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import zerorate as zr
from zerorate.noise.kinds import KINDS
from zerorate.simulation import sequences

RATE = 50.0
NOISE = np.random.default_rng(1).standard_normal(2000)
ARRAYS = ("deviation", "lower", "upper", "edf", "exponent", "term_count")
BY_KIND = pytest.mark.parametrize("kind", KINDS)


def assert_equal(one, other):
    """Compare every array of two results, bit for bit."""
    np.testing.assert_array_equal(one.taus, other.taus)
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def log(data, **options):
    time = np.arange(len(data)) / RATE
    return zr.Log(time, RATE, data, ["gx", "gy", "gz"][: np.atleast_2d(data.T).shape[0]], **options)


@pytest.mark.parametrize("shape", [(2000,), (2000, 1), (1000, 2)])
@BY_KIND
def test_arrays_have_the_shape_of_the_record(kind, shape):
    r = zr.allan(NOISE.reshape(shape), RATE, kind)
    for name in ARRAYS:
        assert getattr(r, name).shape == (r.taus.size, *shape[1:])
    assert (r.kind, r.rate, r.n, r.duration) == (kind, RATE, shape[0], shape[0] / RATE)
    assert r.unit == "unit"


@BY_KIND
def test_an_axis_is_as_the_axis_alone(kind):
    z = NOISE.reshape(-1, 2) * [1.0, 3.0]
    r = zr.allan(z, RATE, kind, names=["x", "y"])
    assert [axis.names for axis in r] == [("x",), ("y",)]
    for i, axis in enumerate(r.axes):
        alone = zr.allan(z[:, i], RATE, kind)
        assert_equal(axis, alone)
        assert_equal(r.axis("xy"[i]), alone)
        assert_equal(r.axis(i), alone)


def test_unknown_axes_are_refused():
    r = zr.allan(NOISE.reshape(-1, 2), RATE, names=["x", "y"])
    for which in ["z", 2, -1]:
        with pytest.raises(ValueError, match=f"no axis {which!r}; there are x, y"):
            r.axis(which)


def test_a_log_brings_rate_unit_and_names():
    data = NOISE.reshape(-1, 2)
    r = zr.allan(log(data, unit="deg/s"))
    assert (r.rate, r.unit, r.names) == (RATE, "deg/s", ("gx", "gy"))
    assert_equal(r, zr.allan(data, RATE))
    assert zr.allan(log(data, unit="deg/s"), names=["a", "b"]).names == ("a", "b")
    assert zr.allan(log(data)).unit == "unit"
    with pytest.raises(ValueError, match=r"rate must be a positive finite number of Hz, got 0"):
        zr.allan(log(data), 0.0)
    with pytest.raises(ValueError, match=r"rate must be that of the log, .* Hz, got 25"):
        zr.allan(log(data), 25.0)
    with pytest.raises(ValueError, match="unit must be that of the samples, deg/s, got rad/s"):
        zr.allan(log(data, unit="deg/s"), unit="rad/s")


@pytest.mark.parametrize(
    "convert",
    [
        lambda z: z.astype(np.float32),
        lambda z: z.astype(np.int16),
        lambda z: z.tolist(),
        lambda z: np.repeat(z, 2)[::2],
        lambda z: z[::-1].copy()[::-1],
        lambda z: np.ma.masked_array(z, mask=False),
        lambda z: z.astype(object),
    ],
)
def test_any_array_like_is_read(convert):
    z = np.round(100.0 * NOISE)
    assert_equal(zr.allan(convert(z), RATE), zr.allan(z, RATE))


def test_what_is_missing_may_be_written_in_any_way():
    z = NOISE.copy()
    z[[50, 700, 701]] = np.nan
    missing = np.isnan(z)
    expected = zr.allan(z, RATE)
    for written in [
        [None if gap else float(value) for value, gap in zip(z, missing, strict=True)],
        np.ma.masked_array(np.nan_to_num(z), mask=missing),
        np.where(missing, np.inf, z),
        np.where(missing, -np.inf, z),
    ]:
        assert_equal(zr.allan(written, RATE), expected)
        assert zr.allan(written, RATE).notes == expected.notes
    assert expected.notes == ("3 of 2000 samples are missing",)


def test_gaps_take_the_terms_across_them():
    whole = zr.allan(NOISE, RATE)
    gappy = NOISE.copy()
    gappy[1000] = np.nan
    r = zr.allan(gappy, RATE)
    m = r.factors
    np.testing.assert_array_equal(r.term_count, 2 * np.maximum(1000 - 2 * m + 1, 0) - (m < 500))
    assert np.all(r.term_count < whole.term_count)
    assert np.isnan(r.deviation[r.term_count == 0]).all()
    assert np.isnan(r.edf[r.term_count == 0]).all()


def test_gaps_that_leave_nothing_are_said_and_where():
    z = NOISE.copy()
    z[99::100] = np.nan  # stretches of 99: two means of 32 samples fit, two of 64 do not
    r = zr.allan(z, RATE)
    assert np.isnan(r.deviation[r.factors >= 64]).all()
    assert r.notes[1:] == (f"gaps leave no term from {64 / RATE:g} s on: bridge= fills short ones",)
    assert len(zr.allan(z, RATE, bridge=1).notes) == 1


def test_short_gaps_are_bridged_in_a_straight_line():
    z = NOISE.copy()
    z[[100, 101, 102]] = np.nan
    z[1500:1504] = np.nan
    r = zr.allan(z, RATE, bridge=3)
    line = z.copy()
    line[99:104] = np.linspace(z[99], z[103], 5)
    np.testing.assert_array_equal(r.term_count, zr.allan(line, RATE).term_count)
    # A rounding of each of the three values filled in.
    np.testing.assert_allclose(r.deviation, zr.allan(line, RATE).deviation, rtol=1e-13)
    assert r.notes == ("7 of 2000 samples are missing; gaps of up to 3 are bridged",)
    assert_equal(zr.allan(NOISE, RATE, bridge=3), zr.allan(NOISE, RATE))


def test_names():
    both = NOISE.reshape(-1, 2)
    assert zr.allan(NOISE, RATE).names == ("",)
    assert zr.allan(NOISE, RATE, names="x").names == ("x",)
    assert zr.allan(both, RATE).names == ("axis 1", "axis 2")
    with pytest.raises(ValueError, match="names must have one entry an axis: 2, got 3"):
        zr.allan(both, RATE, names=["x", "y", "z"])


def test_grids_of_averaging_times():
    octave = zr.allan(NOISE, RATE)
    assert octave.factors.tolist() == [1, 2, 4, 8, 16, 32, 64, 128, 256, 512]
    np.testing.assert_array_equal(octave.taus, octave.factors / RATE)
    every = zr.allan(NOISE, RATE, taus="all")
    assert every.factors.tolist() == list(range(1, 1001))
    decade = zr.allan(NOISE, RATE, taus="decade").factors
    assert decade[[0, -1]].tolist() == [1, 1000]
    assert {1, 10, 100, 1000} <= set(decade.tolist())
    assert np.sum((decade >= 10) & (decade < 100)) == 10
    for r, taus in [(octave, octave.factors), (every, every.factors)]:
        assert_equal(r, zr.allan(NOISE, RATE, taus=taus / RATE))


def test_averaging_times_in_seconds_are_whole_samples():
    r = zr.allan(NOISE, RATE, taus=[1.0, 0.5, 0.5, 0.02])
    assert r.taus.tolist() == [0.02, 0.5, 1.0]
    assert r.notes == ()
    rounded = zr.allan(NOISE, RATE, taus=[0.5, 0.711, 1e-9])
    assert rounded.factors.tolist() == [1, 25, 36]
    assert rounded.notes == (
        "2 of 3 averaging times are no whole numbers of samples and were rounded, "
        "0.711 s to 0.72 s",
    )
    assert zr.allan(NOISE, RATE, taus=0.5).taus.tolist() == [0.5]


def test_theo1_has_its_own_averaging_times():
    r = zr.allan(NOISE, RATE, "theo1", taus=[0.15, 0.3])
    assert r.factors.tolist() == [10, 20]
    np.testing.assert_allclose(r.taus, [0.15, 0.3], rtol=1e-15)
    assert np.all(zr.allan(NOISE[:100], RATE, "theo1", taus="all").factors % 2 == 0)


@BY_KIND
def test_too_short_a_record_says_what_it_takes(kind):
    with pytest.raises(ValueError, match=f"{kind} needs ") as caught:
        zr.allan(NOISE[:1], RATE, kind)
    needed = int(str(caught.value).split("needs ")[1].split()[0])
    assert f"{needed} samples ({needed / RATE:g} s), got 1" in str(caught.value)
    assert zr.allan(NOISE[:needed], RATE, kind).term_count[0] > 0
    with pytest.raises(ValueError, match=f"{kind} needs {needed} samples .* got {needed - 1}"):
        zr.allan(NOISE[: needed - 1], RATE, kind)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        *(({"rate": rate}, "rate must be (a positive finite number of Hz, got|given in Hz)")
          for rate in (None, 0.0, -1.0, np.nan, np.inf, "100", True)),
        ({"kind": "adve"}, "unknown kind 'adve'; known: adev, oadev, .* pdev"),
        ({"unit": "furlong"}, "unknown unit 'furlong'"),
        ({"unit": "deg"}, "unit must be one of an angular rate or an acceleration, got 'deg'"),
        ({"taus": "octaves"}, "unknown grid of taus 'octaves'; known: octave, decade, all, or sec"),
        *(({"taus": taus}, "taus must be positive and finite averaging times in s")
          for taus in ([0.0], [1.0, -1.0], [np.nan], [np.inf], [], [[1.0]])),
        ({"taus": [1.0, 30.0]}, "tau 30 s is beyond this record: its oadev goes up to 20 s"),
        *(({"taus": [0.5, tau]}, "is beyond this record: its oadev goes up to 20 s")
          for tau in (9.3e16, 1e17, 1e19, 1e300, 1.7e308)),
        *(({"confidence": c}, "confidence must lie between 0 and 1") for c in (0.0, 1.0, 95.0)),
        ({"confidence": np.nan}, "confidence must lie between 0 and 1, got nan"),
        *(({"exponent": e}, "exponent must be a whole number from -4 to 2") for e in (3, -5, 0.5)),
        ({"bridge": -1}, "bridge must not be negative, got -1"),
        ({"threads": 0}, "threads must be at least 1, got 0"),
        ({"z": np.full(100, np.nan)}, "z holds no finite sample"),
        ({"z": []}, r"z must have shape \(n,\) or \(n, k\) with a sample, got \(0,\)"),
        ({"z": 1.0}, r"z must have shape .* got \(\)"),
        ({"z": np.zeros((5, 5, 5))}, r"z must have shape .* got \(5, 5, 5\)"),
        ({"z": [[1.0, None]] * 9}, "column 1 of z holds no finite sample"),
    ],
)  # fmt: skip
def test_wrong_arguments_are_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        zr.allan(**({"z": NOISE, "rate": RATE} | arguments))


@pytest.mark.parametrize("z", [["a", "b"], NOISE * 1j, np.zeros(9, "datetime64[s]")])
def test_wrong_types_are_refused(z):
    with pytest.raises(TypeError, match="z must hold real numbers, got dtype"):
        zr.allan(z, RATE)


@BY_KIND
def test_constants_have_no_deviation_and_no_fit(kind):
    r = zr.allan(np.full(500, 0.1), RATE, kind)
    np.testing.assert_array_equal(r.deviation, 0.0)
    assert r.notes == ("all samples are equal: the deviation is 0, and there is nothing to fit",)
    if kind not in ("theo1", "pdev"):
        np.testing.assert_array_equal(r.upper, 0.0)
        with pytest.raises(ValueError, match="constant: there is no noise to fit"):
            r.fit()


def test_constant_axes_are_named():
    z = np.column_stack((NOISE, np.where(np.arange(2000) == 7, np.nan, 5.0)))
    assert zr.allan(z, RATE, names=["x", "y"]).notes == (
        "y: 1 of 2000 samples are missing",
        "y: all samples are equal: the deviation is 0, and there is nothing to fit",
    )


@BY_KIND
def test_threads_change_no_bit(kind):
    z = NOISE.reshape(-1, 2)
    one = zr.allan(z, RATE, kind, threads=1)
    for threads in [None, 2, 3]:
        assert_equal(zr.allan(z, RATE, kind, threads=threads), one)


def test_repr():
    r = zr.allan(NOISE.reshape(-1, 2), RATE, unit="deg/s", names=["x", "y"])
    assert repr(r) == ("AllanResult(oadev in deg/s at 9 averaging times, 0.02 to 5.12 s: x, y)")
    assert "oadev in the unit of the samples at" in repr(zr.allan(NOISE, RATE))


SIMULATED = {
    0: np.copy,
    -1: sequences.flicker,
    -2: sequences.walk,
    2: np.diff,
}  # fmt: skip


@pytest.mark.parametrize("exponent", SIMULATED)
@pytest.mark.parametrize("kind", ["adev", "oadev", "mdev", "ohdev", "totdev"])
def test_the_noise_type_is_found(kind, exponent):
    z = SIMULATED[exponent](np.random.default_rng(9).standard_normal(20_000))
    r = zr.allan(z, RATE, kind)
    # From 30 averages on the lag-1 autocorrelation tells the type (SP 1065, section 5.5.3), most
    # of the time; flicker made at points is that of averages after a few samples.
    told = (r.factors * 50 <= r.n) & (r.factors >= 4)
    assert np.mean(r.exponent[told] == exponent) >= 0.8
    np.testing.assert_array_equal(zr.allan(z, RATE, kind, exponent=-1).exponent, -1)


SAMPLES = st.one_of(
    st.floats(-1e300, 1e300),
    st.sampled_from([0.0, 1.0, -1.0, 5e-324, 1e-310, 1e300, -1e300, 0.1]),
)


@given(st.lists(SAMPLES, min_size=1, max_size=60), st.sampled_from(list(KINDS)))
def test_no_finite_record_is_too_hostile(z, kind):
    try:
        r = zr.allan(z, RATE, kind)
    except ValueError as error:
        assert "too short" in str(error)  # noqa: PT017
        return
    there = r.term_count > 0
    assert not np.isnan(r.deviation[there]).any()
    assert np.all(r.deviation[there] >= 0.0)
    if kind != "pdev":
        assert np.all(r.lower[there] <= r.deviation[there])
        assert np.all(r.deviation[there] <= r.upper[there])


@given(st.integers(100, 400), st.integers(0, 399), SAMPLES, st.floats(1e-300, 1e300))
def test_a_constant_with_a_step_is_fitted_or_refused(n, place, level, step):
    z = np.full(n, level)
    z[min(place, n - 1) :] += step
    r = zr.allan(z, RATE)
    try:
        fit = r.fit()
    except ValueError as error:
        assert "averaging times with a deviation" in str(error) or "constant" in str(error)  # noqa: PT017
        return
    assert all(np.isfinite(float(c)) for c in (fit.angle_random_walk, fit.rate_random_walk))
