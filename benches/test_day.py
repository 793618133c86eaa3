"""Test of the bench of a day, with half a minute."""

import day


def test_every_case_runs(capsys):
    day.main(["--rows", "3000", "--rounds", "1"])
    lines = capsys.readouterr().out.split("\n")
    assert len([line for line in lines if line.startswith("| `")]) == len(day.CASES)
    assert [line.split()[1] for line in lines[-6:-1]] == [
        "clock",
        "read",
        "filter",
        "measure",
        "write",
    ]
