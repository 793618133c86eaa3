"""Law 2 by construction: whatever a constructor and samples make, a checkpoint takes."""

import copy
import os
import pickle
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from support.classes import STREAMS
from support.histories import blocks, take
from support.records import SEEDS

# A night's run draws more: ZERORATE_HISTORIES histories of every stream.
COUNT = int(os.environ.get("ZERORATE_HISTORIES", "60"))
COPIES = (
    lambda f: type(f).from_bytes(f.to_bytes()),
    lambda f: pickle.loads(pickle.dumps(f)),
    copy.copy,
)


@pytest.mark.parametrize("name", STREAMS)
@settings(max_examples=COUNT, deadline=None)
@given(data=st.data())
def test_a_state_that_samples_made_is_restored_and_continues_to_the_bit(name, data):
    stream = STREAMS[name]
    channels = data.draw(st.sampled_from(stream.channels))
    f = stream.make(data.draw(stream.settings(channels)))
    rng = np.random.default_rng(data.draw(SEEDS))
    width = stream.width * (channels or 1)
    for k, block in enumerate(blocks(rng, width)):
        z = block.reshape(len(block), *([channels] if channels else []), stream.width)
        z = z if stream.width > 1 else z[..., 0]
        seed = rng.integers(2**32)
        restored = COPIES[k % len(COPIES)](f)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for one in (f, restored):
                take(np.random.default_rng(seed), one, z)
        assert restored.to_bytes() == f.to_bytes()
    type(f).from_bytes(f.to_bytes())
