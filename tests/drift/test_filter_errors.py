"""What the filters accept, and in which words they refuse the rest."""

import math
import threading
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pandas
import pytest

import zerorate as zr
from support.checks import assert_same_bits
from support.settings import METHODS, MOTIONS, RATE, random_start

Z = np.random.default_rng(10).standard_normal(300)
NAN, INF = math.nan, math.inf


def drift(**arguments):
    return zr.DriftFilter(**{"rate": RATE, "method": "fading", "output": "estimate", **arguments})


def auto(**arguments):
    return drift(method="auto", **arguments)


def holding(**arguments):
    return drift(motion="hold", output="compensated", **arguments)


FILTERS = {
    "drift": drift,
    "auto": auto,
    "holding": holding,
    "least-squares": zr.identification.RecursiveLeastSquares,
    "allan-noise": zr.noise.AllanNoise,
}
BY_KIND = pytest.mark.parametrize("kind", FILTERS)
MODELS = pytest.mark.parametrize("make", [drift, zr.identification.RecursiveLeastSquares])

OUT_OF_RANGE = [
    (drift, "rate", [0, -1, NAN, INF, -INF], "a positive number of samples a second"),
    (drift, "fading", [0, -0.1, 1.0001, NAN, INF], "above 0 and at most 1"),
    (drift, "forgetting_factor", [0, -0.1, 1.0001, NAN, INF], "above 0 and at most 1"),
    (drift, "adapt_for", [-0.1, NAN, INF], "zero or a positive number of seconds"),
    (drift, "process_noise", [-0.1, NAN, INF], "zero or a positive number"),
    (drift, "process_noise_memory", [-0.1, NAN, INF], "zero or a positive number"),
    (drift, "startup", [0, -0.1, NAN, INF], "a positive number of seconds"),
    (drift, "scale", [0, -0.1, NAN, INF], "a positive number"),
    (drift, "channels", [0, -1], "at least 1"),
    (drift, "method", ["KF", "", "median"], "'kf', 'akf', 'fading', 'robust' or 'auto'"),
    (drift, "motion", ["Hold", "", "none"], "'hold' or 'ignore'"),
    (drift, "output", ["Estimate", "", "bias"], "'compensated' or 'estimate'"),
    (auto, "rate", [0, -1, NAN, INF, -INF], "a positive number of samples a second"),
    (auto, "startup", [0, -0.1, NAN, INF], "a positive number of seconds"),
    (auto, "scale", [0, -0.1, NAN, INF], "a positive number"),
    (auto, "channels", [0, -1], "at least 1"),
    (drift, "noise", ["Allan", ""], "'allan' or 'hadamard'"),
    (
        zr.identification.RecursiveLeastSquares,
        "forgetting_factor",
        [0, 2, NAN],
        "above 0 and at most 1",
    ),
    (zr.identification.RecursiveLeastSquares, "startup", [-1, 0, 1], "at least two samples long"),
    (zr.identification.RecursiveLeastSquares, "scale", [0, -1, NAN, INF], "a positive number"),
    (zr.identification.RecursiveLeastSquares, "channels", [0, -1], "at least 1"),
    (zr.noise.AllanNoise, "fading", [0, -0.1, 1.0001, NAN, INF], "above 0 and at most 1"),
    (zr.noise.AllanNoise, "floor", [-1e-300, NAN, INF], "zero or a positive number"),
    (zr.noise.AllanNoise, "noise", ["hdev"], "'allan' or 'hadamard'"),
    (zr.noise.AllanNoise, "channels", [0, -1], "at least 1"),
]


@pytest.mark.parametrize(
    ("make", "name", "value", "words"),
    [(make, name, value, words) for make, name, values, words in OUT_OF_RANGE for value in values],
)
def test_values_out_of_range(make, name, value, words):
    with pytest.raises(ValueError, match=f"^{name} must be {words}.*, got ") as error:
        make(**{name: value})
    assert len(str(error.value)) < 100
    assert str(value).lower() in str(error.value).lower()


@MODELS
@pytest.mark.parametrize("order", [(0, 1), (4, 1), (2, 4), (2, -1), (-1, 0), (10**6, 0)])
def test_orders_out_of_range(make, order):
    words = r"order must be \(p, q\) with p from 1 to 3 and q from 0 to 3, got \("
    with pytest.raises(ValueError, match=words):
        make(order=order)


@MODELS
@pytest.mark.parametrize("order", [2, "ab", (2,), (2, 1, 0), (2.5, 1), ("2", "1"), None, {2: 1}])
def test_orders_that_are_no_pair_of_integers(make, order):
    with pytest.raises((TypeError, ValueError), match="order") as error:
        make(order=order)
    assert "order must be" in str(error.value), "says nothing but a raw conversion error"


@MODELS
@pytest.mark.parametrize("order", [[2, 1], (np.int64(2), np.int64(1)), np.array([2, 1])])
def test_every_pair_of_integers_is_an_order(make, order):
    assert make(order=order).order == (2, 1)


@pytest.mark.parametrize("value", ["x", [1.0], 1j, {}])
@pytest.mark.parametrize(
    ("make", "name"),
    [
        *(
            (drift, name)
            for name in [
                "rate",
                "fading",
                "adapt_for",
                "forgetting_factor",
                "channels",
                "process_noise",
                "process_noise_memory",
                "startup",
                "scale",
            ]
        ),
        *(
            (zr.identification.RecursiveLeastSquares, n)
            for n in ["forgetting_factor", "startup", "scale"]
        ),
        *((zr.noise.AllanNoise, n) for n in ["fading", "floor", "channels"]),
    ],
)
def test_values_of_another_type(make, name, value):
    with pytest.raises(TypeError, match=name):
        make(**{name: value})


@pytest.mark.parametrize("name", ["method", "motion", "output", "noise"])
@pytest.mark.parametrize("value", [1, True, ["hold"], b"hold"])
def test_words_of_another_type(name, value):
    with pytest.raises(TypeError, match=name):
        drift(**{name: value})


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("motion", MOTIONS)
def test_only_the_self_tuning_filter_can_be_switched_on_again(method, motion):
    f = drift(method=method, motion=motion)
    f.process(Z)
    before = f.to_bytes()
    words = rf"power_on\(\) is for method 'auto', this is '{method}': make a new filter or reset"
    with pytest.raises(ValueError, match=words):
        f.power_on()
    assert f.to_bytes() == before


@pytest.mark.parametrize("method", [{}, {"method": "auto"}])
def test_the_self_tuning_filter_takes_no_start(method):
    start = random_start(np.random.default_rng(1), (2, 1))
    words = "method 'auto', the default, learns its own start: start 'kf'"
    with pytest.raises(ValueError, match=words):
        zr.DriftFilter.started(start, rate=RATE, **method)


def start_with(covariance):
    """A filter that is told how well its model is known."""
    start = random_start(np.random.default_rng(1), (1, 3)) | {"covariance": covariance}
    return zr.DriftFilter.started(start, rate=RATE, order=(1, 3), method="kf")


def test_a_start_whose_parameters_all_but_depend_on_each_other():
    """What rounding costs one pivot counts many times in the next: one in twenty was refused."""
    rng = np.random.default_rng(5)
    for _ in range(200):
        root, (last, other) = rng.standard_normal((5, 4)), 10.0 ** rng.uniform(-6.0, 0.0, 2)
        root[4] *= last
        root[3] = root[4] * rng.uniform(-2.0, 2.0) + root[3] * other
        covariance = root @ root.T
        start_with((covariance + covariance.T) / 2.0)


def test_a_start_that_is_no_covariance_is_refused():
    rng = np.random.default_rng(6)
    for least in (-1e-6, -1e-3, -1.0):
        axes, _ = np.linalg.qr(rng.standard_normal((5, 5)))
        covariance = axes @ np.diag([least, 1.0, 1.0, 2.0, 3.0]) @ axes.T
        with pytest.raises(ValueError, match="covariance must be symmetric positive semidefinite"):
            start_with((covariance + covariance.T) / 2.0)


@BY_KIND
@pytest.mark.parametrize("channels", [1.5, 2.0, "2"])
def test_channels_are_whole_numbers(kind, channels):
    with pytest.raises(TypeError, match="channels"):
        FILTERS[kind](channels=channels)


def test_unknown_and_missing_arguments():
    with pytest.raises(TypeError, match="unexpected keyword argument 'fadign'"):
        drift(fadign=0.9)
    with pytest.raises(TypeError, match="missing 1 required positional argument: 'rate'"):
        zr.DriftFilter()
    with pytest.raises(TypeError, match="positional"):
        zr.DriftFilter(RATE, (2, 1), "kf", 0.97, None, 1.0, None, 0.1)


READ_ONLY = Z.copy()
READ_ONLY.flags.writeable = False
EQUAL_TO_Z = {
    "array": Z,
    "list": Z.tolist(),
    "tuple": tuple(Z.tolist()),
    "read-only": READ_ONLY,
    "strided": np.repeat(Z, 3)[::3],
    "reversed": Z[::-1].copy()[::-1],
    "big-endian": Z.astype(">f8"),
    "long-double": Z.astype(np.longdouble),
    "list-of-scalars": list(Z),
    "column-of-a-matrix": np.stack([Z, Z + 1.0], axis=1)[:, 0],
    "field-of-a-structure": np.array([(1, z) for z in Z], dtype=[("t", "i4"), ("z", "f8")])["z"],
    "unaligned": np.frombuffer(b"\0" + Z.tobytes(), dtype=np.uint8)[1:].view(np.float64),
    "subclass": Z.view(np.matrix).A1,
}


@BY_KIND
@pytest.mark.parametrize("way", EQUAL_TO_Z)
def test_every_kind_of_array_is_accepted(kind, way):
    z = EQUAL_TO_Z[way]
    assert_same_bits(FILTERS[kind]().process(z), FILTERS[kind]().process(Z))


@pytest.mark.parametrize("dtype", ["f2", "f4", "i1", "u1", "i4", "i8", "u8", "?", ">i2"])
@BY_KIND
def test_every_kind_of_number_is_accepted(kind, dtype):
    z = (100.0 * np.abs(Z)).astype(dtype)
    assert_same_bits(FILTERS[kind]().process(z), FILTERS[kind]().process(z.astype(np.float64)))


@BY_KIND
def test_memory_mapped_files_are_accepted(kind, tmp_path):
    np.save(tmp_path / "z.npy", Z)
    mapped = np.load(tmp_path / "z.npy", mmap_mode="r")
    assert_same_bits(FILTERS[kind]().process(mapped), FILTERS[kind]().process(Z))


@BY_KIND
def test_pandas_is_accepted(kind):
    expected = FILTERS[kind]().process(np.append(Z, [np.nan, 1.0]))
    series = pandas.Series([*Z, None, 1.0])
    assert_same_bits(FILTERS[kind]().process(series), expected)
    assert_same_bits(FILTERS[kind]().process(series.astype("Float64")), expected)
    frame = pandas.DataFrame({"x": Z, "y": Z[::-1]})
    rows = np.stack([Z, Z[::-1]], axis=1)
    together = FILTERS[kind](channels=2).process(frame)
    assert_same_bits(together, FILTERS[kind](channels=2).process(rows))


@BY_KIND
def test_fortran_order_is_accepted(kind):
    rows = np.stack([Z, Z[::-1], Z**2], axis=1)
    expected = FILTERS[kind](channels=3).process(rows)
    assert_same_bits(FILTERS[kind](channels=3).process(np.asfortranarray(rows)), expected)
    assert_same_bits(FILTERS[kind](channels=3).process(rows.T.copy().T), expected)


@BY_KIND
def test_a_masked_sample_is_missing_or_refused(kind):
    masked = np.ma.masked_array(Z, mask=np.arange(len(Z)) % 7 == 3)
    try:
        got = FILTERS[kind]().process(masked)
    except (TypeError, ValueError):
        return
    assert_same_bits(got, FILTERS[kind]().process(masked.filled(np.nan)))


@BY_KIND
def test_none_is_a_missing_sample(kind):
    f, twin = FILTERS[kind](), FILTERS[kind]()
    for sample in [1.0, None, 2.0, None, 0.5]:
        expected = twin.update(math.nan if sample is None else sample)
        assert_same_bits(f.update(sample), expected)


@BY_KIND
def test_none_in_a_batch_is_a_missing_sample(kind):
    # As the documentation says of samples; numpy, too, makes NaN of it for floats.
    expected = FILTERS[kind]().process([1.0, math.nan, 2.0])
    assert_same_bits(FILTERS[kind]().process([1.0, None, 2.0]), expected)


@BY_KIND
def test_none_in_a_row_is_a_missing_sample(kind):
    expected = FILTERS[kind](channels=2).update([1.0, math.nan])
    assert_same_bits(FILTERS[kind](channels=2).update([1.0, None]), expected)


ROW = np.array([0.5, NAN, -2.0])
ROWS = {
    "list": ROW.tolist(),
    "tuple": tuple(ROW.tolist()),
    "list with an integer": [0.5, None, -2],
    "list of NumPy's floats": list(ROW),
    "single precision": ROW.astype(np.float32),
    "big-endian": ROW.astype(">f8"),
    "strided": np.repeat(ROW, 2)[::2],
    "packed": np.array([(1, ROW)], dtype=[("id", "i1"), ("rates", "f8", 3)])["rates"][0],
    "masked": np.ma.MaskedArray([0.5, 7.0, -2.0], [False, True, False]),
    "series": pandas.Series(ROW),
}


@BY_KIND
@pytest.mark.parametrize("way", ROWS)
def test_every_way_to_give_a_sample_of_three_channels(kind, way):
    f, twin = FILTERS[kind](channels=3), FILTERS[kind](channels=3)
    for _ in range(3):
        assert_same_bits(f.update(ROWS[way]), twin.update(ROW))


@BY_KIND
def test_the_answer_to_a_row_is_the_caller_s_own(kind):
    f, row = FILTERS[kind](channels=3), np.array([0.5, 1.0, -2.0])
    first = f.update(row)
    before = first.copy()
    f.update(np.zeros(3))
    assert_same_bits(first, before)
    assert_same_bits(row, np.array([0.5, 1.0, -2.0]))
    assert first.flags.writeable


@BY_KIND
@pytest.mark.parametrize(
    "number",
    [2, True, np.float32(2.0), np.int16(2), np.array(2.0), Decimal("2"), Fraction(2)],
    ids=lambda number: type(number).__name__,
)
def test_update_takes_every_number(kind, number):
    assert FILTERS[kind]().update(number) == FILTERS[kind]().update(float(number))


@BY_KIND
@pytest.mark.parametrize("z", ["1.0", 1j, [1.0], (), Z, object(), b"1", {}])
def test_update_refuses_what_is_no_number(kind, z):
    with pytest.raises(TypeError, match=r"update\(\) takes one number, got .*process\(\)"):
        FILTERS[kind]().update(z)


@BY_KIND
@pytest.mark.parametrize("shape", [(), (3, 1), (3, 2), (2, 3, 4)])
def test_a_batch_of_another_shape(kind, shape):
    words = rf"z must have shape \(n,\), got {'.'.join(str(shape))}".replace(".", ".?")
    with pytest.raises(ValueError, match=words):
        FILTERS[kind]().process(np.zeros(shape))


@BY_KIND
@pytest.mark.parametrize("shape", [(), (3,), (0,), (4, 2), (4, 4), (3, 4), (2, 4, 3)])
def test_a_batch_of_other_channels(kind, shape):
    with pytest.raises(ValueError, match=r"z must have shape \(n, 3\), got \("):
        FILTERS[kind](channels=3).process(np.zeros(shape))


@BY_KIND
@pytest.mark.parametrize("shape", [(), (2,), (4,), (1, 3), (3, 1)])
def test_a_row_of_other_channels(kind, shape):
    with pytest.raises(ValueError, match=r"z must have shape \(3,\), got \("):
        FILTERS[kind](channels=3).update(np.zeros(shape))


NO_NUMBERS = {
    "complex": np.array([1j, 2.0]),
    "strings": ["a", "b"],
    "numbers-as-strings": ["1.0", "2.0"],
    "text": "abc",
    "bytes": b"abc",
    "dates": np.array(["2020-01-01"], dtype="M8[D]"),
    "durations": np.array([1, 2], dtype="m8[s]"),
    "structure": np.zeros(3, dtype=[("t", "f8"), ("z", "f8")]),
    "objects": np.array([object(), 1.0]),
    "none": None,
    "mapping": {"z": 1.0},
    "generator": (z for z in [1.0]),
    "set": {1.0, 2.0},
}


@BY_KIND
@pytest.mark.parametrize("what", NO_NUMBERS)
def test_a_batch_of_no_numbers(kind, what):
    with pytest.raises(TypeError, match=r"z must hold real numbers, got .*numpy\.asarray"):
        FILTERS[kind]().process(NO_NUMBERS[what])


@BY_KIND
def test_a_ragged_batch(kind):
    with pytest.raises(ValueError, match="z must be a rectangular array of numbers, got list"):
        FILTERS[kind](channels=2).process([[1.0, 2.0], [3.0]])


@pytest.mark.parametrize("z", [np.zeros((3, 2)), np.array([1j]), "abc", [[1], [1, 2]]])
def test_a_trace_refuses_the_same(z):
    with pytest.raises((TypeError, ValueError), match=r"^z must "):
        drift().trace(z)


@BY_KIND
def test_a_refused_batch_changes_nothing(kind):
    f = FILTERS[kind]()
    f.process(Z)
    before = f.to_bytes()
    for z in (np.zeros((3, 2)), np.array([1j]), "abc"):
        with pytest.raises((TypeError, ValueError)):
            f.process(z)
    with pytest.raises(ValueError, match="out must be"):
        f.process(Z, out=np.zeros(3))
    with pytest.raises((TypeError, ValueError)):
        f.process(Z, threads=0)
    with pytest.raises(TypeError):
        f.update("x")
    assert f.to_bytes() == before


@BY_KIND
def test_an_empty_batch_changes_nothing(kind):
    f = FILTERS[kind]()
    f.process(Z)
    before = f.to_bytes()
    assert f.process([]).shape == (0,)
    assert f.process(np.empty(0)).dtype == np.float64
    assert f.to_bytes() == before
    assert FILTERS[kind](channels=3).process(np.empty((0, 3))).shape == (0, 3)


def test_an_empty_trace():
    trace = drift(channels=2, order=(3, 1)).trace(np.empty((0, 2)))
    assert len(trace) == 0
    assert trace.covariance.shape == (0, 2, 4, 4)
    assert trace.coefficients.shape == (0, 2, 5)
    assert trace.missing.dtype == bool


@BY_KIND
def test_out_is_filled_and_returned(kind):
    expected = FILTERS[kind]().process(Z)
    for out in (np.empty(len(Z)), np.empty(2 * len(Z))[::2], np.empty(len(Z))[::-1]):
        got = FILTERS[kind]().process(Z, out=out)
        assert got is out
        assert_same_bits(out.copy(), expected)


@BY_KIND
def test_out_may_be_a_field_of_a_structure(kind):
    """Its elements are twelve bytes apart."""
    table = np.zeros(len(Z), dtype=[("t", "i4"), ("z", "f8")])
    table["t"] = 7
    try:
        FILTERS[kind]().process(Z, out=table["z"])
    except (TypeError, ValueError):
        return
    assert_same_bits(table["z"].copy(), FILTERS[kind]().process(Z))
    assert np.all(table["t"] == 7)


@BY_KIND
def test_out_may_be_the_input(kind):
    z = Z.copy()
    FILTERS[kind]().process(z, out=z)
    assert_same_bits(z, FILTERS[kind]().process(Z))


@BY_KIND
def test_out_may_overlap_the_input(kind):
    buffer = np.append(Z, np.zeros(5))
    FILTERS[kind]().process(buffer[:-5], out=buffer[5:])
    assert_same_bits(buffer[5:].copy(), FILTERS[kind]().process(Z))


def test_out_in_fortran_order():
    rows = np.stack([Z, -Z], axis=1)
    out = np.empty(rows.shape, order="F")
    drift(channels=2).process(rows, out=out)
    assert_same_bits(np.ascontiguousarray(out), drift(channels=2).process(rows))


WRONG_OUT = {
    "float32": (np.empty(300, dtype="f4"), TypeError, "dtype float32"),
    "integer": (np.empty(300, dtype=int), TypeError, "dtype int64"),
    "big-endian": (np.empty(300, dtype=">f8"), TypeError, "dtype >f8"),
    "list": ([0.0] * 300, TypeError, "got list"),
    "text": ("out", TypeError, "got str"),
    "short": (np.empty(299), ValueError, r"got shape \(299,\)"),
    "long": (np.empty(301), ValueError, r"got shape \(301,\)"),
    "matrix": (np.empty((300, 1)), ValueError, r"got shape \(300, 1\)"),
    "read-only": (READ_ONLY, ValueError, "got a read-only one"),
}


@BY_KIND
@pytest.mark.parametrize("what", WRONG_OUT)
def test_a_wrong_out(kind, what):
    out, error, words = WRONG_OUT[what]
    expected = r"out must be a writeable float64 array of shape \(300,\), "
    with pytest.raises(error, match=expected + ".*" + words):
        FILTERS[kind]().process(Z, out=out)


@BY_KIND
@pytest.mark.parametrize("threads", [0, -1])
def test_threads_out_of_range(kind, threads):
    with pytest.raises(ValueError, match=f"threads must be at least 1, got {threads}"):
        FILTERS[kind]().process(Z, threads=threads)


@BY_KIND
@pytest.mark.parametrize("threads", [1.5, "2", [1]])
def test_threads_are_a_whole_number(kind, threads):
    with pytest.raises(TypeError, match="threads"):
        FILTERS[kind]().process(Z, threads=threads)


@BY_KIND
@pytest.mark.parametrize("threads", [1, 5, 10**6, 2**63])
def test_more_threads_than_channels(kind, threads):
    rows = np.stack([Z, -Z], axis=1)
    expected = FILTERS[kind](channels=2).process(rows)
    assert_same_bits(FILTERS[kind](channels=2).process(rows, threads=threads), expected)


IN_USE = "in use by another thread.*copy"


@pytest.mark.every(3)
@BY_KIND
def test_one_filter_serves_one_thread(kind):
    f, twin = FILTERS[kind](), FILTERS[kind]()
    long = np.random.default_rng(11).standard_normal(4_000_000)
    answers = []
    worker = threading.Thread(target=lambda: answers.append(f.process(long)))
    worker.start()
    refused = wait_until_refused(worker, lambda: f.to_bytes())
    busy = worker.is_alive()
    if refused and busy:
        with pytest.raises(RuntimeError, match=IN_USE):
            f.update(1.0)
    worker.join()
    assert refused, "the other thread was done before it was seen at work"
    # What was refused left no trace.
    assert_same_bits(answers[0], twin.process(long))
    assert f.update(0.5) == twin.update(0.5)


def wait_until_refused(worker, use):
    """Uses a filter until another thread does; answers whether it came to that."""
    while worker.is_alive():
        try:
            use()
        except RuntimeError:
            return True
    return False


@BY_KIND
def test_every_thread_with_a_filter_of_its_own(kind):
    expected = FILTERS[kind]().process(Z)
    answers = [None] * 8

    def work(place):
        answers[place] = FILTERS[kind]().process(Z)

    workers = [threading.Thread(target=work, args=(place,)) for place in range(len(answers))]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    for answer in answers:
        assert_same_bits(answer, expected)


@pytest.mark.parametrize(
    "name",
    [
        "estimate",
        "bias",
        "bias_sigma",
        "at_rest",
        "status",
        "gain",
        "covariance",
        "guard_count",
        "params",
        "rate",
        "order",
        "method",
    ],
)
def test_properties_are_read_only(name):
    with pytest.raises(AttributeError, match=name):
        setattr(drift(), name, 1.0)


@pytest.mark.parametrize("channels", [None, 2])
def test_changing_a_property_in_place_changes_no_filter(channels):
    f = drift(channels=channels)
    f.process(Z if channels is None else np.stack([Z, Z], axis=1))
    before = f.to_bytes()
    for name in ("gain", "covariance", "process_noise", "coefficients"):
        getattr(f, name)[:] = 7.0
    f.params["rate"] = 1.0
    assert f.to_bytes() == before
    assert f.params["rate"] == RATE


@pytest.mark.parametrize("channels", [None, 3])
def test_shapes_and_types_of_the_self_tuning_filter(channels):
    lead = () if channels is None else (channels,)
    f = auto(channels=channels)
    f.process(np.zeros((5, *lead)))
    shapes = {"gain": (1,), "covariance": (1, 1), "process_noise": (1, 1), "coefficients": (1,)}
    for name, shape in shapes.items():
        assert getattr(f, name).shape == lead + shape
        assert getattr(f, name).dtype == np.float64
    for name in ("bias", "bias_sigma", "at_rest", "ready", "guard_count"):
        assert np.shape(getattr(f, name)) == lead
    assert f.status == ("starting" if channels is None else ["starting"] * channels)
    trace = f.trace(np.zeros((7, *lead)))
    assert trace.gain.shape == (7, *lead, 1)
    assert trace.covariance.shape == (7, *lead, 1, 1)
    assert trace.bias.shape == trace.bias_sigma.shape == trace.at_rest.shape == (7, *lead)
    assert trace.at_rest.dtype == bool


@pytest.mark.parametrize("channels", [None, 3])
def test_shapes_and_types_of_the_answers(channels):
    lead = () if channels is None else (channels,)
    f = drift(channels=channels, order=(2, 3))
    f.process(np.zeros((5, *lead)))
    shapes = {"gain": (3,), "covariance": (3, 3), "process_noise": (3, 3), "coefficients": (6,)}
    for name, shape in shapes.items():
        assert getattr(f, name).shape == lead + shape
        assert getattr(f, name).dtype == np.float64
    for name in ("estimate", "innovation", "innovation_variance", "measurement_noise"):
        assert np.shape(getattr(f, name)) == lead
    answer = f.update(np.zeros(lead) if channels else 0.0)
    assert isinstance(answer, np.ndarray if channels else float)
    assert f.samples_seen == 6
    assert np.shape(f.ready) == np.shape(f.guard_count) == lead
