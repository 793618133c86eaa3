"""One sample gives the same bits in every type of number and sequence that `update` takes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import zerorate as zr
from support.classes import EXAMPLES, assert_same_answers, example
from support.feeding import NAVIGATORS, arguments_of, flat

ROWS = 4
TYPES = ("float32", "float64", "int16", "int32", "int64", "float16", "uint8", ">f4", "longdouble")
LAYOUTS = {
    "array": lambda row: row,
    "strided": lambda row: np.repeat(row, 2, axis=0)[::2],
    "reversed": lambda row: np.ascontiguousarray(row[::-1])[::-1],
    "unaligned": lambda row: unaligned(row),
    "masked": np.ma.masked_array,
    "list": lambda row: row.tolist(),
    "tuple": lambda row: tuple(row.tolist()),
    "numpy scalars": lambda row: list(row),
}
# Exact in every one of the types, and no multiple of another.
NUMBERS = st.integers(0, 99)


def unaligned(row):
    """Return the row one byte after an aligned address."""
    octets = np.empty(row.nbytes + 1, dtype=np.uint8)[1:]
    moved = octets.view(row.dtype).reshape(row.shape)
    moved[...] = row
    return moved


def update(f, sample, form):
    """Update the filter by one sample whose parts have this form."""
    if isinstance(f, NAVIGATORS):
        return f.update(0.02 * (1 + f.samples_seen), *map(form, np.split(sample[:6], 2)))
    if isinstance(f, zr.LinearKalman):
        f.predict()
        return flat(f.update(form(sample)))
    return flat(f.update(*map(form, arguments_of(f, sample))))


@pytest.mark.parametrize("channels", [None, 2])
@pytest.mark.parametrize("name", EXAMPLES)
@given(data=st.data())
def test_every_type_of_a_row_gives_the_same_bits(name, channels, data):
    stream, _ = EXAMPLES[name]
    if channels and not stream.side_by_side:
        channels = None
    expected, got = example(name, channels), example(name, channels)
    shape = (ROWS, *([channels] if channels else []))
    for sample in stream.wide(data.draw(arrays(np.float64, shape, elements=NUMBERS))):
        dtype = data.draw(st.sampled_from(TYPES))
        layout = LAYOUTS[data.draw(st.sampled_from(list(LAYOUTS)))]

        def form(part, dtype=dtype, layout=layout):
            part = np.asarray(part)
            if part.dtype == bool:
                return part
            # A scalar has no layout.
            return layout(part.astype(dtype)) if part.ndim else part.astype(dtype)[()]

        assert_same_answers(update(got, sample, form), update(expected, sample, np.asarray))
    assert got.to_bytes() == expected.to_bytes()


@pytest.mark.parametrize("row", [[True, 1.0, 2.0], [None, 1.0, 2.0], [np.float32("nan"), 1, 2]])
def test_numbers_that_are_rare_are_read_as_before(row):
    expected, got = zr.DriftFilter(100.0, channels=3), zr.DriftFilter(100.0, channels=3)
    numbers = [np.nan if value is None else float(value) for value in row]
    assert_same_answers(got.update(row), expected.update(np.array(numbers)))


@pytest.mark.parametrize(
    "row",
    [[1j, 1.0, 2.0], np.ones(3, complex), ["1", 2, 3], [10**400, 1, 2], [1.0, 2.0], np.ones(4)],
)
def test_what_is_no_row_of_numbers_is_refused(row):
    with pytest.raises((TypeError, ValueError, OverflowError)):
        zr.DriftFilter(100.0, channels=3).update(row)
