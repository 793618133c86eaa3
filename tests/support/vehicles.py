"""The simulated vehicles that the evidence of navigation is measured on too."""

import runpy
from pathlib import Path

simulate_vehicle = runpy.run_path(str(Path(__file__).parents[2] / "examples" / "vehicles.py"))[
    "simulate_vehicle"
]
