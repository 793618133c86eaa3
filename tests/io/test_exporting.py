"""What exports say of their file stands in each docstring, in its place."""

import inspect

import pytest

from zerorate import Calibration, NoiseModel, TemperatureModel
from zerorate.identification.arma_model import ArmaModel

EXPORTS = [
    function
    for kind in (NoiseModel, Calibration, TemperatureModel, ArmaModel)
    for name, function in inspect.getmembers(kind, inspect.isfunction)
    if name.startswith("to_") and {"path", "force"} <= set(inspect.signature(function).parameters)
]


def section(text, name):
    """Return the lines of a section of a docstring."""
    _, _, rest = text.partition(f"\n\n{name}\n{'-' * len(name)}\n")
    return rest.partition("\n\n")[0].splitlines()


@pytest.mark.parametrize("export", EXPORTS, ids=lambda one: one.__qualname__)
def test_arguments_stand_in_their_order_and_the_fault_is_told(export):
    text = inspect.getdoc(export)
    told = [line.split(" : ")[0] for line in section(text, "Parameters") if not line[0].isspace()]
    assert told == list(inspect.signature(export).parameters)[1:]
    assert section(text, "Returns")
    assert "OSError" in section(text, "Raises")
