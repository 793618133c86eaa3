"""A batch of reports: a row a finding, an overview sorted by what needs a person first, trends."""

import re

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from zerorate.cli import run
from zerorate.show.overview_page import overview_page, summarise_logs
from zerorate.tasks.batch import batch

RATE, N = 100.0, 3000


def write(path, bias, start=0.0):
    random = np.random.default_rng(7)
    table = {"time_s": start + np.arange(N) / RATE}
    for i, axis in enumerate("xyz"):
        table[f"gyro_{axis}_dps"] = bias * (i == 0) + 0.05 * random.standard_normal(N)
        table[f"accel_{axis}_mps2"] = 9.80665 * (i == 2) + 0.02 * random.standard_normal(N)
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(pa.table(table), path)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """Return the result on three logs of a device, one of another, and one that is none."""
    folder = tmp_path_factory.mktemp("reports")
    for day, (name, bias) in enumerate((("c", 0.1), ("b", 0.2), ("a", 6.0))):
        write(folder / "logs" / "unit1" / f"{name}.parquet", bias, 1.7e9 + 86400.0 * day)
    write(folder / "logs" / "unit2" / "d.parquet", 3.5)
    (folder / "logs" / "unit2" / "e.parquet").write_bytes(b"PAR1")
    return batch(folder / "logs", folder / "out", command="report", workers=1)


def test_every_finding_is_a_row_of_the_summary(done):
    rows = pq.read_table(done.summary).to_pylist()
    (worst,) = [r for r in rows if r["log"] == "unit1/a.parquet" and r["kind"] == "gyro bias"]
    assert (worst["severity"], worst["unit"], worst["axis"]) == ("act", "deg/s", "gyro")
    assert worst["value"] == pytest.approx(6.0, abs=0.01)
    assert worst["began"] == pytest.approx(1.7e9 + 2 * 86400.0)
    assert [r["error"] is None for r in rows if r["log"] == "unit2/e.parquet"] == [False]


def test_what_needs_a_person_comes_first(done):
    logs = summarise_logs(done.outcomes)
    assert [one.outcome.name[-9] for one in logs] == list("eadbc")
    assert [one.device for one in logs[1:3]] == ["unit1", "unit2"]


def test_the_overview_links_pages_and_draws_trends_in_the_order_of_dates(done):
    page = overview_page(done)
    links = re.findall(r'href="(?!#|data:)([^"]*)"', page)
    assert len(links) == 4
    assert all((done.summary.parent / one).exists() for one in links)
    assert "1 could not be read; 1 with something to act on, 1 to look at, 2 within" in page
    trend = re.search(
        r'aria-label="gyro bias over 3 logs: gyro: ([\d.]+)[^,]*, at last ([\d.]+)', page
    )
    assert [float(one) for one in trend.groups()] == pytest.approx([0.1, 6.0], abs=0.02)
    assert not re.search(r"https?://|url\(|@import", page)


def test_the_command_writes_the_overview_and_skips_what_is_done(done, capsys):
    out = done.summary.parent
    logs = str(out.parent / "logs")
    assert run(["batch", logs, "--report", "-o", str(out), "--workers", "1"]) == 1
    text, _ = capsys.readouterr()
    assert "4 skipped, 1 failed" in text
    assert "unit1/a.parquet: 1 to act on" in text
    assert (out / "overview.html").read_text(encoding="utf-8") == overview_page(done)


def test_a_filter_option_is_refused(done, capsys):
    out = done.summary.parent
    assert run(["batch", str(out), "--report", "--format", "csv", "-o", str(out)]) == 2
    assert "--format has no effect with --command report" in capsys.readouterr().err
