"""Any samples: the laws of every streaming class."""

import numpy as np
import pytest

from support.classes import EXAMPLES, assert_same_answers, example, state
from support.feeding import joined, process
from support.wild import pieces, samples


@pytest.mark.every(3)
@pytest.mark.parametrize("name", EXAMPLES)
def test_any_samples(search, name):
    """Sound answers, the same bits in any batches, saved and loaded anywhere between."""
    stream, _ = EXAMPLES[name]

    def case(rng):
        z = stream.wide(samples(rng))
        whole, parted = example(name), example(name)
        answers, parts = process(whole, z), []
        stream.sound(whole, z, answers)
        for part in pieces(rng, z):
            parts.append(process(parted, part))
            if rng.random() < 0.3:
                parted = type(parted).from_bytes(parted.to_bytes())
        assert_same_answers(None if answers is None else joined(parts), answers)
        assert parted.to_bytes() == whole.to_bytes()

    search(case, 30)


@pytest.mark.parametrize("name", [name for name in EXAMPLES if EXAMPLES[name][0].side_by_side])
def test_any_samples_side_by_side(search, name):
    """Every channel is what it is alone."""

    stream, _ = EXAMPLES[name]

    def case(rng):
        channels = int(rng.integers(1, 10))
        columns = [samples(rng, 1500) for _ in range(channels)]
        z = np.full((max(map(len, columns)), channels), np.nan)
        for c, column in enumerate(columns):
            z[: len(column), c] = column
        z = stream.wide(z)
        together = example(name, channels)
        answers = process(together, z)
        c = int(rng.integers(channels))
        alone = example(name)
        expected = process(alone, z[:, c].copy())
        assert_same_answers(None if answers is None else answers[:, c].copy(), expected)
        axis, known = stream.channel_axis, state(together)
        for key, value in state(alone).items():
            whole = known[key]
            if whole.ndim > value.ndim:
                whole = np.take(whole, c, axis)
            assert_same_answers(whole, value.astype(whole.dtype))

    search(case, 12)
