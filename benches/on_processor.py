"""A bench by the processor's time, for a machine that does other work: ratios stay, waiting goes.

    python benches/on_processor.py benches/ratios.py [ARGUMENTS]

Rows of one thread alone mean something then: the times of all threads add up.
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
