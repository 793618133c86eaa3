"""Sequence numbers of any counter: what is lost is bounded, and what is counted is what was."""

from itertools import chain

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.streams import lines_of
from zerorate.tasks.live import LineError, LineStream, Settings
from zerorate.tasks.live.sequence import SequenceCount

# The documented number of late samples in a row after which a source has begun anew.
RUN = 32
RATES = st.sampled_from([50.0, 255.0, 1000.0, 8000.0])
PERIODS = st.one_of(
    st.integers(2, 2000),
    st.sampled_from([16, 255, 256, 1000, 4096, 65_536]),
)


def steps(count, numbers):
    """Return what each number was taken for: samples lost before it, or None."""
    return [count.step(int(number)) for number in numbers]


def answered(found):
    return sum(one is not None for one in found)


@given(rate=RATES, period=PERIODS, lowest=st.sampled_from([0, 1, -7]), start=st.integers(0, 2000))
def test_any_period_is_learned_in_two_turns(rate, period, lowest, start):
    true = start % period + np.arange(4 * period + 200)
    count = SequenceCount(rate)
    found = steps(count, lowest + true % period)
    # The first turn may look like late samples, or like a source that began anew.
    assert len(true) - answered(found) < 2 * RUN
    assert found[2 * period + 2 * RUN :] == [0] * (len(true) - 2 * period - 2 * RUN)
    assert count.lost_count == 0
    assert count.restart_count <= 2


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("signed", [False, True])
@pytest.mark.parametrize("rate", [100.0, 255.0, 1000.0])
def test_a_counter_of_whole_bytes_is_known_at_its_first_wrap(bits, signed, rate):
    half = 1 << (bits - 1) if signed else 0
    numbers = (np.arange((2 << bits) + 1000) + half) % (1 << bits) - half
    count = SequenceCount(rate)
    assert steps(count, numbers) == [0] * len(numbers)
    assert (count.lost_count, count.late_count, count.restart_count) == (0, 0, 0)


@st.composite
def journeys(draw):
    """True numbers as they arrive: some lost, some bursts late by up to a quarter of the period."""
    rate, bits = draw(RATES), draw(st.sampled_from([4, 8, 10, 16]))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    most = min((1 << bits) // 4, int(rate))
    true = np.arange(draw(st.integers(10, 3000)))
    late = rng.random(len(true)) < draw(st.sampled_from([0.0, 0.01, 0.2]))
    arrival = true + np.where(late, rng.integers(0, most, len(true)), 0) + 0.5 * late
    kept = rng.random(len(true)) >= draw(st.sampled_from([0.0, 0.01, 0.3]))
    kept[0] = True
    return rate, bits, true[np.argsort(arrival, kind="stable")][kept[np.argsort(arrival)]]


@given(journeys())
def test_with_a_known_width_all_that_is_lost_is_counted(journey):
    rate, bits, true = journey
    count, plain = SequenceCount(rate, bits), SequenceCount(rate)
    found = steps(count, true % (1 << bits))
    # Unwrapped, the same numbers need no knowledge at all.
    if (
        not count.restart_count
        and np.diff(np.maximum.accumulate(true)).max(initial=0) < 1 << bits >> 1
    ):
        assert found == steps(plain, true)
        assert (count.lost_count, count.late_count) == (plain.lost_count, plain.late_count)


@given(
    rate=RATES,
    period=PERIODS,
    seed=st.integers(0, 2**32 - 1),
    loss=st.sampled_from([0.0, 0.01, 0.2]),
    late=st.sampled_from([0.0, 0.01, 0.1]),
    restarts=st.integers(0, 5),
    known=st.booleans(),
)
def test_each_event_costs_a_bounded_number_of_samples(
    rate, period, seed, loss, late, restarts, known
):
    rng = np.random.default_rng(seed)
    width = (period - 1).bit_length()
    bits = width if known and period == 1 << width else None
    runs = []
    for _ in range(restarts + 1):
        true = np.arange(rng.integers(1, 4000))
        behind = np.where(rng.random(len(true)) < late, rng.integers(0, 4, len(true)), 0)
        true = true[np.argsort(true + 1.5 * behind, kind="stable")]
        runs.append(true[rng.random(len(true)) >= loss] % period)
    numbers = np.concatenate(runs)
    count = SequenceCount(rate, bits)
    found = steps(count, numbers)
    # The sender goes on, so however it went before, only late samples are left out.
    turned = int(sum((np.diff(run) < -period // 2).sum() for run in runs))
    overtaken = int(sum((np.diff(run) <= 0).sum() for run in runs))
    events = restarts + overtaken + min(turned, 8)
    assert len(numbers) - answered(found) <= RUN * (events + 1)
    assert answered(found) + count.late_count == len(numbers)
    assert count.lost_count == sum(one for one in found if one is not None)


@given(st.lists(st.integers(-(2**70), 2**70) | st.integers(-300, 300), max_size=300), RATES)
def test_no_numbers_silence_a_stream(numbers, rate):
    count = SequenceCount(rate)
    found = steps(count, numbers)
    silent = max(
        (len(run) for run in "".join("x "[f is not None] for f in found).split()), default=0
    )
    assert silent < RUN
    assert all(0 <= one <= 3600 * rate for one in found if one is not None)


def test_a_wrap_that_was_none_is_forgotten():
    count = SequenceCount(1000.0)
    steps(count, [*range(256), *range(10)])
    assert count.wraps
    assert steps(count, range(10, 400)) == [0] * 390
    assert not count.wraps


def test_a_stuck_number_is_told_as_restarts():
    count = SequenceCount(100.0)
    found = steps(count, [5] * (1 + 3 * RUN))
    assert (count.restart_count, answered(found)) == (3, 4)


def test_a_number_before_the_wrap_may_come_late():
    count = SequenceCount(1000.0, 8)
    assert steps(count, [254, 0, 255, 1, 250, 2]) == [0, 1, None, 0, None, 0]
    assert (count.lost_count, count.late_count) == (1, 2)


def test_a_burst_that_is_overtaken_stays_late():
    numbers = [*range(100), *range(131, 160), *range(100, 131), *range(160, 300)]
    count = SequenceCount(1000.0)
    steps(count, numbers)
    assert (count.lost_count, count.late_count, count.restart_count) == (31, 31, 0)


@pytest.mark.parametrize("begin", [0, 1, 20, 99])
def test_a_restart_within_a_second_is_found(begin):
    count = SequenceCount(1000.0)
    found = steps(count, chain(range(100), range(begin, 400)))
    assert count.restart_count == (begin < 100 - RUN)
    assert len(found) - answered(found) < RUN


def test_signed_numbers_of_a_known_width():
    count = SequenceCount(1000.0, 8)
    assert steps(count, [-2, -1, 0, 127, -128]) == [0, 0, 0, 126, 0]
    assert count.next == -127


@pytest.mark.parametrize("number", [256, -129, 2**40])
def test_a_number_that_does_not_fit_is_garbled(number):
    some = LineStream(Settings(100.0, sequence=0, sequence_bits=8))
    some.take("7,0.5")
    with pytest.raises(LineError, match="is none of 8 bits"):
        some.take(f"{number},0.5")
    some.take("9,0.5")
    assert (some.sequence.lost_count, some.samples) == (1, 3)


@pytest.mark.parametrize(("before", "after"), [(254, 255), (255, 0)])
def test_the_position_wraps(before, after):
    some = LineStream(Settings(100.0, sequence=0, sequence_bits=8))
    some.take(f"{before},0.5")
    assert some.position == after


@pytest.mark.parametrize("settings", [{"sequence_bits": 8}, {"sequence": 0, "sequence_bits": 65}])
def test_widths_that_are_refused(settings):
    with pytest.raises(ValueError, match="sequence_bits"):
        Settings(100.0, **settings)


@given(st.data())
def test_saved_at_any_wrap_it_goes_on(data):
    period = data.draw(st.sampled_from([16, 100, 256]))
    bits = data.draw(st.sampled_from([None, 8])) if period == 256 else None
    settings = Settings(1000.0, sequence=0, sequence_bits=bits)
    rng = np.random.default_rng(1)
    kept = np.flatnonzero(rng.random(800) > 0.05)
    values = lines_of(rng.standard_normal(len(kept)))
    lines = [f"{n % period},{value}" for n, value in zip(kept, values, strict=True)]
    cut = data.draw(st.integers(1, len(lines)))
    whole, first = LineStream(settings), LineStream(settings)
    expected = [whole.take(line) for line in lines]
    answers = [first.take(line) for line in lines[:cut]]
    second = LineStream.from_bytes(first.to_bytes(), settings)
    assert answers + [second.take(line) for line in lines[cut:]] == expected
    assert second.to_bytes() == whole.to_bytes()
