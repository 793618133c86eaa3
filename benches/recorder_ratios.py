"""Reading time of GoPro videos and blackbox logs, compared with telemetry-parser.

    python benches/recorder_ratios.py [SECONDS]

The writers of the tests make a video and a blackbox log of this length (default 60 s). Both are
read as recordings, and the core reads their samples alone. telemetry-parser reads the samples of
the video. It finds no samples in this blackbox log, because some optional fields are missing.
"""

import sys
import tempfile
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "tests"))

import numpy as np

import zerorate as zr
from dataflash_ratios import seconds
from support.blackboxes import write_blackbox
from support.gopros import write_gopro
from versions import print_versions
from zerorate._native import read_blackbox, read_gopro

RATE = 200
FRAMES_PER_SECOND = 2000


def video(path, duration):
    """Return a video with a gyro at 200 Hz and an accelerometer at 100 Hz."""
    rng = np.random.default_rng(1)
    gyro, accel = (rng.integers(-3000, 3000, (n * duration, 3)) for n in (RATE, RATE // 2))
    return write_gopro(path, gyro, accel)


def blackbox(path, duration):
    """Return a blackbox log at 2 kHz with random walks as values."""
    count = FRAMES_PER_SECOND * duration
    steps = np.random.default_rng(2).integers(-30, 31, (count, 14))
    return write_blackbox(path, 500 * np.arange(1, count + 1), np.cumsum(steps, axis=0) % 2000)


def main(duration=60):
    """Print the times, s, and their ratios."""
    print_versions("telemetry_parser")
    import telemetry_parser

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = video(folder / "a.mp4", duration)
        raw = np.fromfile(path, np.uint8)
        core = seconds(lambda: read_gopro(raw, [b"GYRO", b"ACCL"]))
        whole = seconds(lambda: zr.read_recording(path))
        peer = seconds(lambda: telemetry_parser.Parser(str(path)).telemetry())
        print(f"GoPro, {duration} s: core {1e3 * core:.2f} ms, recording {1e3 * whole:.1f} ms, ")
        print(f"  telemetry-parser {1e3 * peer:.1f} ms, {peer / core:.0f} times the core")
        path = blackbox(folder / "a.bbl", duration)
        raw = np.fromfile(path, np.uint8)
        core = seconds(lambda: read_blackbox(raw, ["gyroADC", "accSmooth"]))
        whole = seconds(lambda: zr.read_recording(path))
        rate = 1e-6 * FRAMES_PER_SECOND * duration / core
        print(f"blackbox, {duration} s: core {rate:.1f} M frames/s, recording {1e3 * whole:.0f} ms")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
