"""States saved by earlier versions: each goes on as it did, or is refused by both versions."""

import numpy as np
import pytest

from support.feeding import process
from support.golden import GOLDEN, NAMES, goes_on, new, record, recorded, saved

# Logarithms and exponentials, which the self-tuning filter needs, may differ by a bit elsewhere.
TOLERANCE = 1e-12


@pytest.mark.parametrize("name", NAMES)
def test_a_saved_state_goes_on(name):
    """Of every streaming class; one without a golden file has none to show that it can."""
    f = type(new(name)).from_bytes(saved(name).read_bytes())
    expected = recorded(saved(name))
    told = goes_on(f, expected.pop("z"))
    # Properties that are younger than the file are not in it.
    for key in expected:
        value = told[key]
        if value.dtype.kind == "f":
            np.testing.assert_allclose(value, expected[key], rtol=TOLERANCE, atol=0.0, err_msg=key)
        else:
            np.testing.assert_array_equal(value, expected[key], err_msg=key)


@pytest.mark.parametrize("name", NAMES)
def test_today_saves_the_same_bytes(name):
    """As long as neither the layout nor the version of the type has changed."""
    f = new(name)
    process(f, record(name)[0])
    now, then = f.to_bytes(), saved(name).read_bytes()
    assert len(now) == len(then)
    # All before the content: signature, layout, tag, version, orders and length.
    assert now[:30] == then[:30]


def test_a_state_of_an_older_layout_is_refused():
    old = (GOLDEN / "fading-of-layout-2.bin").read_bytes()
    words = "checkpoint has layout version 2, this zerorate reads version 3"
    with pytest.raises(ValueError, match=words):
        type(new("fading")).from_bytes(old)


OLDER = [
    ("fading", "drift", 1, 2),
    ("auto", "drift-auto", 1, 5),
    ("auto", "drift-auto", 2, 5),
    ("auto", "drift-auto", 3, 5),
    ("auto", "drift-auto", 4, 5),
    ("holding", "drift-rest-gated", 2, 4),
    ("holding", "drift-rest-gated", 3, 4),
    ("robust-holding", "robust-gated", 3, 4),
    ("attitude", "attitude", 1, 6),
    ("attitude", "attitude", 2, 6),
    ("attitude", "attitude", 3, 6),
    ("attitude", "attitude", 4, 6),
    ("attitude", "attitude", 5, 6),
    ("attitude-learning", "attitude-iron", 1, 4),
    ("attitude-learning", "attitude-iron", 2, 4),
    ("attitude-learning", "attitude-iron", 3, 4),
    ("attitude-complementary", "att-complement", 2, 3),
    ("attitude-ekf", "att-ekf", 2, 3),
    ("attitude-madgwick", "att-madgwick", 2, 3),
    ("attitude-mahony", "att-mahony", 2, 3),
    ("attitude-ukf", "att-ukf", 2, 3),
    ("navigation", "navigation", 1, 7),
    ("navigation", "navigation", 2, 7),
    ("navigation", "navigation", 3, 7),
    ("navigation", "navigation", 4, 7),
    ("navigation", "navigation", 5, 7),
    ("navigation", "navigation", 6, 7),
    ("rest-detector", "rest-detector", 2, 4),
    ("rest-detector", "rest-detector", 3, 4),
    ("temperature", "temperature", 1, 2),
    ("foot", "foot", 1, 3),
    ("foot", "foot", 2, 3),
    ("array", "gyro-array", 1, 3),
    ("array", "gyro-array", 2, 3),
]


@pytest.mark.parametrize(("name", "holds", "then", "now"), OLDER)
def test_a_state_of_an_older_version_is_refused(name, holds, then, now):
    old = (GOLDEN / f"{name}-of-version-{then}.bin").read_bytes()
    words = f"holds '{holds}' version {then}.*, expected '{holds}' version {now}"
    with pytest.raises(ValueError, match=words):
        type(new(name)).from_bytes(old)
