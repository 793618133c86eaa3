"""The command line inside this process, between pipes, as cheap as a call and as far as a process.

Of a process of its own it lacks the start and the end: those, signals and kills need one.
"""

import os
import sys
import tempfile
import threading
from contextlib import ExitStack, contextmanager, suppress

from zerorate.cli import run


def called(*arguments, given=""):
    """Return code, stdout and stderr of ``zerorate``, given a text as stdin."""
    return between_pipes(lambda: run([str(argument) for argument in arguments]), given)


def between_pipes(work, given=""):
    """Return what a function returns, and what it and the libraries it calls print on both."""
    with ExitStack() as stack:
        reader, writer = os.pipe()
        feeding = threading.Thread(target=_fed, args=(writer, given.encode()))
        feeding.start()
        # Before that the pipe is closed: what nobody has read ends the writing.
        stack.callback(feeding.join)
        stack.callback(os.close, reader)
        files = [stack.enter_context(tempfile.TemporaryFile()) for _ in range(2)]
        with _standing(reader, *(file.fileno() for file in files)):
            answer = work()
        return answer, *(_text(file) for file in files)


def _fed(writer, text):
    with suppress(BrokenPipeError), os.fdopen(writer, "wb") as pipe:
        pipe.write(text)


def _text(file):
    file.seek(0)
    return file.read().decode()


@contextmanager
def _standing(*descriptors):
    """Let these stand for stdin, stdout and stderr, below Python and in it."""
    names = ("stdin", "stdout", "stderr")
    before = [(os.dup(number), getattr(sys, name)) for number, name in enumerate(names)]
    for _, stream in before[1:]:
        stream.flush()
    for number, (name, one) in enumerate(zip(names, descriptors, strict=True)):
        os.dup2(one, number)
        mode = "w" if number else "r"
        setattr(sys, name, open(number, mode, encoding="utf-8", closefd=False))  # noqa: SIM115
    try:
        yield
    finally:
        for number, (name, (kept, stream)) in enumerate(zip(names, before, strict=True)):
            getattr(sys, name).close()
            setattr(sys, name, stream)
            os.dup2(kept, number)
            os.close(kept)
