"""A stream that is killed at any moment goes on from its checkpoint as if nothing had happened."""

import sys
import threading
from contextlib import suppress

import numpy as np
import pytest

from support.streams import Asked, lines_of, streamed_apart
from zerorate.cli import run
from zerorate.tasks.live import DriftColumn, LineStream, Settings

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals are those of POSIX")

N = 6000
KILLS = 4
BESIDE = (DriftColumn.bias, DriftColumn.bias_sigma)
# A checkpoint every fifth sample, so that many a kill meets one that is being written.
OPTIONS = ("--rate", "100", "--with", "bias,bias_sigma", "--every", "0.05")


def source(sequence):
    rng = np.random.default_rng(7)
    z = 0.5 + 0.1 * rng.standard_normal(N)
    z[rng.random(N) < 0.01] = np.nan
    lines = lines_of(z)
    return [f"{i},{line}" for i, line in enumerate(lines)] if sequence else lines


def feed(asked, lines):
    """Send lines as fast as they are taken, until there are no more or the process is gone."""
    with suppress(OSError, ValueError):
        asked.process.stdin.writelines(f"{line}\n" for line in lines)
        asked.process.stdin.close()


def answers_until(asked, lines, kill_after):
    """Return all answers of a process that is killed after so many, or ends by itself."""
    sender = threading.Thread(target=feed, args=(asked, lines))
    sender.start()
    answers = [asked.process.stdout.readline() for _ in range(min(kill_after, len(lines)))]
    if kill_after < len(lines):
        asked.process.kill()
    answers += asked.process.stdout.readlines()
    sender.join()
    # A line that was cut is no answer.
    return [answer.rstrip("\n") for answer in answers if answer.endswith("\n")]


@pytest.mark.every(4)
@pytest.mark.parametrize("sequence", [False, True])
@pytest.mark.parametrize("seed", [1, 2])
def test_killed_and_restarted(tmp_path, capsys, sequence, seed):
    checkpoint, lines, rng = tmp_path / "state", source(sequence), np.random.default_rng(seed)
    options = (*OPTIONS, *(["--sequence", "0"] if sequence else []), "--checkpoint", checkpoint)
    # However slow the disk is, there is something to go on with.
    _, output, _ = streamed_apart(lines[:100], *options)
    for kill_after in (*rng.integers(1, N // KILLS, KILLS), N):
        assert run(["stream", "--checkpoint", str(checkpoint), "--position"]) == 0
        begin = int(capsys.readouterr().out)
        # What was saved was answered before.
        assert 100 <= begin <= len(output)
        with Asked(*options) as asked:
            answers = answers_until(asked, lines[begin:], kill_after)
        output = output[:begin] + answers
    whole = LineStream(Settings(100.0, extra=BESIDE, sequence=0 if sequence else None))
    assert output == [whole.take(line) for line in lines]
    assert LineStream.from_bytes(checkpoint.read_bytes()).to_bytes() == whole.to_bytes()
