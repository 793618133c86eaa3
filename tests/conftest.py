"""Hypothesis profiles (HYPOTHESIS_PROFILE=deep), what runs nightly alone, and signals of programs.

A test marked ``slow`` runs with ``--slow`` alone. Of the cases of a test marked ``every(k)`` one in
``k`` runs without it; where there are several parameters, so many at least that each value of each
is tried.
"""

import os
import signal
from collections import defaultdict

import pytest
from hypothesis import HealthCheck, settings

from zerorate.cli import run

# Programs that tests start compile the package once, not each anew, whatever they inherit.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# What is printed is as wide as without a terminal, wherever tests run.
os.environ["COLUMNS"] = "100"

# What `nohup` or a script's `&` ignores, programs would ignore as well; what is caught is theirs
# again. The tests themselves go on, as was asked for.
for number in (signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", None)):
    if number is not None and signal.getsignal(number) is signal.SIG_IGN:
        signal.signal(number, lambda *_: None)

# The filters are fast and the records long: it is drawing them that takes the time.
COMMON = {"deadline": None, "suppress_health_check": [HealthCheck.too_slow]}
settings.register_profile("default", max_examples=10, derandomize=True, **COMMON)
settings.register_profile("deep", max_examples=1000, **COMMON)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "default"))


def pytest_addoption(parser):
    parser.addoption("--slow", action="store_true", help="run what is left for the night, too")


def pytest_configure(config):
    config.addinivalue_line("markers", "slow: takes minutes; run with --slow")
    config.addinivalue_line("markers", "every(k): of its cases one in k, all with --slow")


def pytest_collection_modifyitems(config, items):
    if config.getoption("--slow"):
        return
    left = set(left_for_the_night(items))
    config.hook.pytest_deselected(items=[*left])
    items[:] = [item for item in items if item not in left]


def left_for_the_night(items):
    """Yield what is slow, and of what is marked so the cases that say the least that is new."""
    tests = defaultdict(list)
    for item in items:
        if item.get_closest_marker("slow"):
            yield item
        elif item.get_closest_marker("every"):
            tests[item.nodeid.partition("[")[0]].append(item)
    for cases in tests.values():
        (step,) = cases[0].get_closest_marker("every").args
        chosen = set(covering(cases) if len(cases[0].callspec.params) > 1 else cases[::step])
        # Those that are not enough are joined by others, from all over the list.
        others = [case for case in cases if case not in chosen]
        lacking = -(-len(cases) // step) - len(chosen)
        if lacking > 0:
            chosen.update(others[:: len(others) // lacking][:lacking])
        yield from (case for case in cases if case not in chosen)


def covering(cases):
    """Return few cases that have each value of each parameter: those first that bring the most."""
    untried = {case: values(case) for case in cases}
    chosen = []
    while untried:
        case = max(untried, key=lambda case: len(untried[case]))
        tried = untried.pop(case)
        chosen.append(case)
        untried = {other: left - tried for other, left in untried.items() if left - tried}
    return chosen


def values(case):
    """Return each parameter of a case with its value."""
    return {(name, repr(value)) for name, value in case.callspec.params.items()}


@pytest.fixture
def call(capsys):
    """Run ``zerorate`` with these arguments; return its code, stdout and stderr."""

    def call(*arguments):
        code = run([str(argument) for argument in arguments])
        return code, *capsys.readouterr()

    return call
