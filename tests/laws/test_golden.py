"""States saved by earlier versions: each goes on as it did, or is refused by both versions."""

import numpy as np
import pytest

from support.golden import GOLDEN, NAMES, goes_on, new, record, recorded, saved

# Logarithms and exponentials, which the self-tuning filter needs, may differ by a bit elsewhere.
TOLERANCE = 1e-12


@pytest.mark.parametrize("name", NAMES)
def test_a_saved_state_goes_on(name):
    """Of every streaming class; one without a golden file has none to show that it can."""
    f = type(new(name)).from_bytes(saved(name).read_bytes())
    expected = recorded(saved(name))
    told = goes_on(f, expected["z"])
    for key, value in told.items():
        if value.dtype.kind == "f":
            np.testing.assert_allclose(value, expected[key], rtol=TOLERANCE, atol=0.0, err_msg=key)
        else:
            np.testing.assert_array_equal(value, expected[key], err_msg=key)


@pytest.mark.parametrize("name", NAMES)
def test_today_saves_the_same_bytes(name):
    """As long as neither the layout nor the version of the type has changed."""
    f = new(name)
    f.process(record(name)[0])
    now, then = f.to_bytes(), saved(name).read_bytes()
    assert len(now) == len(then)
    # All before the content: signature, layout, tag, version, orders and length.
    assert now[:30] == then[:30]


def test_a_state_of_an_older_layout_is_refused():
    old = (GOLDEN / "fading-of-layout-2.bin").read_bytes()
    words = "checkpoint has layout version 2, this zerorate reads version 3"
    with pytest.raises(ValueError, match=words):
        type(new("fading")).from_bytes(old)


@pytest.mark.parametrize(("name", "holds"), [("fading", "drift"), ("auto", "drift-auto")])
def test_a_state_of_an_older_version_is_refused(name, holds):
    old = (GOLDEN / f"{name}-of-version-1.bin").read_bytes()
    with pytest.raises(
        ValueError, match=f"holds '{holds}' version 1.*, expected '{holds}' version 2"
    ):
        type(new(name)).from_bytes(old)
