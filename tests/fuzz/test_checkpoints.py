"""Checkpoints of any content, with a checksum that fits: refused, or filters like any other."""

import numpy as np
import pytest

from support.checks import assert_finite, assert_semidefinite_to_rounding
from support.classes import EXAMPLES, example, state
from support.feeding import process
from support.wild import forged, samples

COVARIANCES = ("process_noise", "covariance")


def loaded(kind, saved):
    """Return the filter of a checkpoint, or what it is refused with."""
    try:
        return kind.from_bytes(saved)
    except ValueError as error:
        return str(error)


@pytest.mark.every(4)
@pytest.mark.parametrize("name", EXAMPLES)
def test_forged_checkpoints(search, name):
    stream = EXAMPLES[name][0]
    wide = stream.wide

    def case(rng):
        f = example(name)
        process(f, wide(samples(rng, int(rng.integers(1, 1500)))))
        saved = f.to_bytes()
        assert type(f).from_bytes(saved).to_bytes() == saved
        for _ in range(40):
            other = loaded(type(f), forged(rng, saved))
            if isinstance(other, str):
                assert other.startswith("checkpoint ")
                continue
            z = wide(rng.standard_normal(300))
            answers, known = process(other, z), state(other)
            if not set(COVARIANCES) <= set(known):
                stream.sound(other, z, answers)
                continue
            assert_finite({} if answers is None else {"answers": answers})
            assert_finite(known)
            for covariance in COVARIANCES:
                assert_semidefinite_to_rounding(known[covariance])

    search(case, 20)


@pytest.mark.parametrize("name", ["fading", "auto", "streaming-allan"])
def test_checkpoints_with_any_bytes(search, name):
    """Damage without a fitting checksum never passes."""

    def case(rng):
        f = example(name)
        f.process(samples(rng, 500))
        saved = bytearray(f.to_bytes())
        place, change = int(rng.integers(len(saved))), int(rng.integers(1, 256))
        saved[place] ^= change
        cut = bytes(saved[: rng.integers(len(saved) + 1)]) if rng.random() < 0.3 else bytes(saved)
        with pytest.raises(ValueError, match="checkpoint"):
            type(f).from_bytes(cut)

    search(case, 200)


def test_what_is_no_checkpoint_at_all(search):
    def case(rng):
        raw = rng.integers(0, 256, rng.integers(0, 200)).astype(np.uint8).tobytes()
        for name in ("kf", "auto", "rest-detector"):
            with pytest.raises(ValueError, match="checkpoint"):
                type(example(name)).from_bytes(raw)

    search(case, 100)
