"""Seeded search: every test here takes a generator of random numbers and does one case with it.

A run does a fixed number of cases of a fixed seed. `make fuzz MINUTES=60` goes on for that long
with a seed of its own, and a case that fails says how it is repeated:

    FUZZ_SEED=1 FUZZ_MINUTES=10 python -m pytest tests/fuzz      # another seed, ten minutes
    FUZZ_CASE=1-417 python -m pytest tests/fuzz -k checkpoints   # the 417th case of seed 1 alone
"""

import os
import time
from collections import Counter
from itertools import count

import numpy as np
import pytest


@pytest.fixture
def search(request, record_property):
    """Return what runs a case with one generator after another."""
    seed, alone = int(os.environ.get("FUZZ_SEED", "0")), os.environ.get("FUZZ_CASE")

    def run(case, cases):
        """Run ``case(rng)`` ``cases`` times, and on for as long as was asked."""
        if alone is not None:
            return case(np.random.default_rng(list(map(int, alone.split("-")))))
        end = time.monotonic() + seconds_of_each(request)
        for number in count():
            if number >= cases and time.monotonic() >= end:
                return record_property("cases", number)
            try:
                case(np.random.default_rng([seed, number]))
            except BaseException as error:
                error.add_note(f"FUZZ_CASE={seed}-{number} repeats this case")
                raise
        return None

    return run


def seconds_of_each(request):
    """Return the time of one search: the workers share all of them."""
    items = request.session.items
    searches = sum("search" in item.fixturenames for item in items if hasattr(item, "fixturenames"))
    workers = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    return 60.0 * float(os.environ.get("FUZZ_MINUTES", "0")) * workers / searches


def pytest_terminal_summary(terminalreporter):
    """Say how many cases held, search by search where time was asked for."""
    held = Counter()
    for report in terminalreporter.stats.get("passed", []):
        for name, cases in report.user_properties:
            if name == "cases":
                held[report.nodeid.split("::")[1].split("[")[0]] += cases
    if held and "FUZZ_MINUTES" in os.environ:
        for name, cases in held.items():
            terminalreporter.write_line(f"{cases:>12,} cases held  {name}")
