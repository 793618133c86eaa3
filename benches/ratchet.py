"""Compare the instruction counts of all hot paths with a tracked table: ``make ratchet``.

Unlike times, counts do not depend on the load of the machine. The bench ``instructions`` runs each
path on fixed inputs under valgrind's callgrind. callgrind does not know AVX-512, so the counted
code is the code for AVX2.

A path fails if it needs over 3 % more instructions than the table, or if it calls a vector
instruction as a function. The table is valid for one compiler. With another compiler the counts are
printed only. ``make ratchet-renew`` writes the table again.
"""

import csv
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / ".ci"))

from paths import remap  # noqa: E402

TABLE = ROOT / "benches/instructions.csv"
ALLOWED = 1.03
COUNTED = "instructions::counted"
OUTLINED = re.compile(r"core_arch::|core::core_arch|_mm\d+_")


def main():
    """Count, and compare with the table, or renew it."""
    counts, outlined = measured()
    compiler = told("rustc", "--version").strip()
    for name, functions in outlined.items():
        print(f"{name} calls vector instructions as functions: {', '.join(sorted(functions))}")
    if "--renew" in sys.argv[1:]:
        write(counts, compiler)
        print(f"{len(counts)} counts written to {TABLE.relative_to(ROOT)}")
        return bool(outlined)
    written, by = read()
    faults = list(compared(counts, written))
    print(*faults, sep="\n")
    if by != compiler:
        print(f"the table is of {by}, this is {compiler}: counts are not judged")
        return bool(outlined)
    print(f"{len(counts)} hot paths counted, {len(faults)} differ from the table")
    return bool(faults or outlined)


def compared(counts, written):
    """Yield a sentence for each path that is too slow, or not in both."""
    for name in sorted(counts.keys() | written.keys()):
        now, before = counts.get(name), written.get(name)
        if now is None or before is None:
            place = "the bench" if now is None else TABLE.name
            yield f"{name}: not in {place}; make ratchet-renew writes the table anew"
        elif now > ALLOWED * before:
            yield f"{name}: {now:,} instructions, {now / before - 1:+.1%} on {before:,}"


def measured():
    """Return the instructions of each path, and those that call outlined vector instructions."""
    with tempfile.TemporaryDirectory() as folder:
        names = told(
            "valgrind",
            "--tool=callgrind",
            "--quiet",
            f"--toggle-collect={COUNTED}",
            f"--dump-after={COUNTED}",
            f"--callgrind-out-file={folder}/counts",
            program(),
        ).splitlines()
        dumps = [Path(f"{folder}/counts.{k + 1}").read_text() for k in range(len(names))]
    counts = {name: total(dump) for name, dump in zip(names, dumps, strict=True)}
    outlined = {
        name: set(map(function, filter(OUTLINED.search, re.findall(r"^fn=.*", dump, re.M))))
        for name, dump in zip(names, dumps, strict=True)
    }
    return counts, {name: functions for name, functions in outlined.items() if functions}


def total(dump):
    """Return the instructions of a dump."""
    return int(re.search(r"^(?:totals|summary): (\d+)", dump, re.M)[1])


def function(line):
    """Return the name in a line of a dump, without its number."""
    return re.sub(r"^fn=\(\d+\) ?", "", line).split("'")[0]


def program():
    """Build the bench with the core of the wheel, and return its path.

    The module is not built with it, because cargo names it by the features of its dependencies.
    """
    remap()
    build = ["cargo", "bench", "--quiet", "--package", "zerorate-benches", "--no-default-features"]
    bench = ["--bench", "instructions", "--no-run", "--message-format=json"]
    lines = told(*build, "--package", "zerorate-py", *bench).splitlines()
    made = (json.loads(line).get("executable") for line in lines)
    return next(path for path in made if path)


def told(*command):
    """Return what a program prints."""
    return subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout


def write(counts, compiler):
    """Write the table."""
    with TABLE.open("w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerows([("path", compiler), *counts.items()])


def read():
    """Return the table, and the compiler for which it is valid."""
    with TABLE.open(newline="") as file:
        (_, compiler), *rows = csv.reader(file)
    return {name: int(count) for name, count in rows}, compiler


if __name__ == "__main__":
    sys.exit(main())
