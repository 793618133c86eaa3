"""Seeded search: every test here takes a generator of random numbers and does one case with it.

A run does a fixed number of cases of a fixed seed. `make fuzz MINUTES=60` goes on for that long
with a seed of its own, and a case that fails says how it is repeated:

    FUZZ_SEED=1 FUZZ_MINUTES=10 python -m pytest tests/fuzz      # another seed, ten minutes
    FUZZ_CASE=1-417 python -m pytest tests/fuzz -k checkpoints   # the 417th case of seed 1 alone
"""

import os
import time
from itertools import count

import numpy as np
import pytest


def pytest_collection_modifyitems(items):
    """Give each search an equal part of the time, known once all are collected."""
    searches = [item for item in items if "search" in getattr(item, "fixturenames", ())]
    for item in searches:
        item.user_properties.append(("part", 1.0 / len(searches)))


@pytest.fixture
def search(request):
    """Return what runs a case with one generator after another."""
    part = dict(request.node.user_properties)["part"]
    seconds = 60.0 * part * float(os.environ.get("FUZZ_MINUTES", "0"))
    seed = int(os.environ.get("FUZZ_SEED", "0"))
    alone = os.environ.get("FUZZ_CASE")

    def run(case, cases):
        """Run ``case(rng)`` ``cases`` times, or for as long as was asked."""
        if alone is not None:
            return case(generator(*map(int, alone.split("-"))))
        end = time.monotonic() + seconds
        for number in count():
            if number >= cases and time.monotonic() > end:
                print(f"{request.node.name}: {number} cases of seed {seed}")
                return None
            try:
                case(generator(seed, number))
            except BaseException as error:
                error.add_note(f"FUZZ_CASE={seed}-{number} repeats this case")
                raise
        return None

    return run


def generator(seed, number):
    return np.random.default_rng([seed, number])
