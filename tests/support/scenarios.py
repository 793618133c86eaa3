"""The scenarios of navigation with aids that the evidence is measured on too."""

import importlib
import sys
from pathlib import Path

EXAMPLES = str(Path(__file__).parents[2] / "examples")


def scenarios():
    """Return the module ``examples/navigation_scenarios.py``."""
    sys.path.insert(0, EXAMPLES)
    try:
        return importlib.import_module("navigation_scenarios")
    finally:
        sys.path.remove(EXAMPLES)
