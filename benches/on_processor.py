"""Run a bench with processor time instead of clock time, for a machine with other work.

    python benches/on_processor.py benches/ratios.py [ARGUMENTS]

Only rows with one thread are valid, because the times of all threads are added.
"""

import runpy
import sys
import time
from pathlib import Path


def main() -> None:
    script = Path(sys.argv[1])
    sys.argv = sys.argv[1:]
    sys.path.insert(0, str(script.parent))
    time.perf_counter = time.process_time
    runpy.run_path(str(script), run_name="__main__")


if __name__ == "__main__":
    main()
