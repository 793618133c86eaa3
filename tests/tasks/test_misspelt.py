"""A misspelt argument of a task is answered with the one that is meant."""

import pytest

import zerorate as zr
from zerorate.tasks.navigate import NavigateOptions

DRIVE = zr.simulate_drive(50.0, 5.0, seed=1).recording()
NAMES = sorted(name for name in NavigateOptions.__optional_keys__ if len(name) > 4)


@pytest.mark.parametrize("name", NAMES)
def test_the_nearest_argument_is_named(name):
    wrong = name[:-2] + name[-1]
    with pytest.raises(TypeError, match=f"there is no argument '{wrong}': did you mean '{name}'"):
        zr.navigate(DRIVE, **{wrong: 1})


def test_all_arguments_are_named_if_none_is_near():
    with pytest.raises(TypeError, match="there is no argument 'zzz'; further ones are") as caught:
        zr.navigate(DRIVE, zzz=1)
    assert all(name in str(caught.value) for name in NAMES)
