"""``zerorate stream``: as a process that is asked line by line, and whole runs of it."""

import subprocess
import sys
import threading
from contextlib import suppress

import numpy as np

from support.inside import called

# Generous, since it only ends tests that would hang for ever.
HANGS = 120.0


def lines_of(z):
    """Return rows as the lines of a source, exactly."""
    return [",".join(map(repr, np.atleast_1d(row).tolist())) for row in z]


class Asked:
    """A running ``zerorate stream``; killed if the test does not end it."""

    def __init__(self, *options, stdin=subprocess.PIPE):
        command = [sys.executable, "-m", "zerorate", "stream", *map(str, options)]
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(command, stdin=stdin, stdout=pipe, stderr=pipe, text=True)
        self._watchdog = threading.Timer(HANGS, self.process.kill)

    def __enter__(self):
        self._watchdog.start()
        return self

    def __exit__(self, *_):
        self._watchdog.cancel()
        self.process.kill()
        for pipe in (self.process.stdin, self.process.stdout, self.process.stderr):
            # What was still to be sent to a process that was killed is nobody's loss.
            with suppress(BrokenPipeError):
                if pipe is not None:
                    pipe.close()
        self.process.wait()

    def send(self, line):
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()

    def ask(self, line):
        """Send one line and return its answer: hangs if the answer waits for more lines."""
        self.send(line)
        return self.process.stdout.readline().rstrip("\n")

    def end(self):
        """Close stdin; return the code, the answers not yet read, and stderr."""
        answers, errors = self.process.communicate()
        return self.process.returncode, answers.splitlines(), errors


def streamed(lines, *options):
    """Return code, answers and stderr of a whole run."""
    code, answers, errors = called("stream", *options, given=_text(lines))
    return code, answers.splitlines(), errors


def streamed_apart(lines, *options):
    """The same in a process of its own, for what one leaves to the next."""
    command = [sys.executable, "-m", "zerorate", "stream", *map(str, options)]
    done = subprocess.run(command, input=_text(lines), capture_output=True, text=True)
    return done.returncode, done.stdout.splitlines(), done.stderr


def _text(lines):
    return "".join(f"{line}\n" for line in lines)
