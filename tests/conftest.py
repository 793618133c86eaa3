"""Hypothesis profiles (HYPOTHESIS_PROFILE=deep), the ``slow`` marker, and signals of programs."""

import os
import signal

from hypothesis import HealthCheck, settings

# Programs that tests start compile the package once, not each anew, whatever they inherit.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# What `nohup` or a script's `&` ignores, programs would ignore as well; what is caught is theirs
# again. The tests themselves go on, as was asked for.
for number in (signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", None)):
    if number is not None and signal.getsignal(number) is signal.SIG_IGN:
        signal.signal(number, lambda *_: None)

# The filters are fast and the records long: it is drawing them that takes the time.
COMMON = {"deadline": None, "suppress_health_check": [HealthCheck.too_slow]}
settings.register_profile("default", max_examples=25, derandomize=True, **COMMON)
settings.register_profile("deep", max_examples=1000, **COMMON)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "default"))


def pytest_addoption(parser):
    parser.addoption("--slow", action="store_true", help="run the tests marked slow, too")


def pytest_configure(config):
    config.addinivalue_line("markers", "slow: takes minutes; run with --slow")


def pytest_collection_modifyitems(config, items):
    if config.getoption("--slow"):
        return
    slow = [item for item in items if item.get_closest_marker("slow")]
    config.hook.pytest_deselected(items=slow)
    items[:] = [item for item in items if item not in slow]
