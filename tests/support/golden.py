"""Saved states of every streaming class, and what each went on to say.

Write those that are missing by ``python -m support.golden`` from tests/; a file that is there is
what somebody may have saved, and stays. Give another name to one of an older version and keep it:
it either loads and goes on as recorded, or is refused by both versions.
"""

import sys
from pathlib import Path

import numpy as np

from support.classes import EXAMPLES, example, state
from support.feeding import process
from support.records import mixed_record

GOLDEN = Path(__file__).parents[1] / "golden"
SEEN = 500


def saved(name):
    """Return the path of a state: the bytes of one of EXAMPLES after half a record."""
    return GOLDEN / f"{name}.bin"


def record(name):
    """Return what that filter has seen, and what it sees after being loaded."""
    z = mixed_record()
    z = np.stack([z, z[::-1]], axis=1) if channels(name) else z
    stream, _ = EXAMPLES[name.removesuffix("-2")]
    z = stream.wide(z)
    return z[:SEEN], z[SEEN:]


def channels(name):
    """Two for the examples whose names say so."""
    return 2 if name.endswith("-2") else None


NAMES = [
    f"{name}{suffix}"
    for name, (stream, _) in EXAMPLES.items()
    for suffix in ("", "-2")[: len(stream.channels)]
]


def new(name):
    return example(name.removesuffix("-2"), channels(name))


def recorded(path):
    """Return the arrays next to a saved state: what it was fed with, its answers and properties."""
    with np.load(path.with_suffix(".npz"), allow_pickle=False) as arrays:
        return dict(arrays)


def goes_on(f, z):
    """What is recorded of a filter that goes on with ``z``."""
    answers = process(f, z)
    told = {} if answers is None else {"answers": answers}
    return told | {f"property_{name}": value for name, value in state(f).items()}


def write(name):
    f = new(name)
    before, after = record(name)
    process(f, before)
    saved(name).write_bytes(f.to_bytes())
    np.savez_compressed(saved(name).with_suffix(".npz"), z=after, **goes_on(f, after))


def main():
    GOLDEN.mkdir(exist_ok=True)
    missing = [name for name in NAMES if not saved(name).exists()]
    for name in missing:
        write(name)
    print(f"{len(missing)} written, {len(NAMES) - len(missing)} were there", file=sys.stderr)


if __name__ == "__main__":
    main()
