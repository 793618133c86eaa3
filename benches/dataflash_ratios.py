"""Reading speed of DataFlash logs, MB/s, compared with pymavlink.

    python benches/dataflash_ratios.py [MB] [LOG]

The log is given, or the writer of the tests makes it with this size (default 64 MB). It is indexed,
read as a recording, and read as one gyro. Times are the minimum of five rounds. pymavlink reads the
messages of the first MB once, as `mavlogdump` does.
"""

import sys
import tempfile
import time
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "tests"))

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

import zerorate as zr
from support.dataflash import KINDS, flight, write_dataflash, write_text
from versions import print_versions
from zerorate._native import dataflash_index
from zerorate.io.readers.dataflash import parse_binary

ROUNDS = 5
STEPS = 20_000
TIMED = {name.encode() for name in KINDS}
PIECE = 1 << 20


def seconds(work, rounds=ROUNDS):
    """Return the minimum time of some rounds, s."""
    taken = []
    for _ in range(rounds):
        begun = time.perf_counter()
        work()
        taken.append(time.perf_counter() - begun)
    return min(taken)


def written(folder, size):
    """Return a log of about this size with one flight after another, and a log as text."""
    rows = flight(STEPS)
    path = write_dataflash(folder / "piece.bin", rows)
    raw = np.fromfile(path, np.uint8)
    times = places(path)
    head = int(times.min())
    parts, piece = [raw[:head]], raw[head:]
    at = times.astype(np.int64) - head + 3
    for k in range(max(1, size // len(piece))):
        part = piece.copy()
        windows = sliding_window_view(part, 8, writeable=True)
        later = np.array([STEPS * 20_000 * k], np.uint64)
        stamps = windows[at].view(np.uint64) + later
        windows[at] = stamps.view(np.uint8)
        parts.append(part)
    log = folder / "log.bin"
    log.write_bytes(b"".join(part.tobytes() for part in parts))
    return log, write_text(folder / "log.log", rows)


def places(path):
    """Return the positions of the messages that have a time."""
    kinds, _, _ = dataflash_index(np.fromfile(path, np.uint8))
    return np.concatenate([kind[-1] for kind in kinds if kind[1] in TIMED])


def mavlink(path):
    """Read the messages of a log with pymavlink."""
    from pymavlink.DFReader import DFReader_binary

    reader = DFReader_binary(str(path))
    while reader.recv_msg() is not None:
        pass
    reader.close()


def rate(path, work, rounds=ROUNDS):
    return 1e-6 * path.stat().st_size / seconds(work, rounds)


def main():
    print_versions("pymavlink")
    megabytes = int(sys.argv[1]) if len(sys.argv) > 1 else 64
    with tempfile.TemporaryDirectory() as name:
        log, text = written(Path(name), megabytes << 20)
        log = Path(sys.argv[2]) if len(sys.argv) > 2 else log
        piece = Path(name) / "first.bin"
        piece.write_bytes(log.read_bytes()[:PIECE])
        print(f"{log.name}: {1e-6 * log.stat().st_size:.1f} MB")
        print(f"index                {rate(log, lambda: parse_binary(log)):8.1f} MB/s")
        ours = rate(log, lambda: zr.read_recording(log))
        print(f"read_recording       {ours:8.1f} MB/s")
        print(f"read_log             {rate(log, lambda: zr.read_log(log)):8.1f} MB/s")
        print(f"read_recording, text {rate(text, lambda: zr.read_recording(text), 2):8.1f} MB/s")
        theirs = rate(piece, lambda: mavlink(piece), 1)
        print(
            f"pymavlink            {theirs:8.2f} MB/s: read_recording is {ours / theirs:.0f} times"
        )


if __name__ == "__main__":
    main()
