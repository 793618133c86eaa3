"""What the studies in `examples/` and `docs/evidence/results.md` rest on, on real recordings."""

import os
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from zerorate import identification, metrics
from zerorate.io import read_log
from zerorate.simulation.models import MODELS
from zerorate.tasks.compare.simulated import run as run_methods

EXAMPLES = Path(__file__).parents[3] / "examples"
AT_REST = ("adis16405_static_100hz_run1.parquet", "mpu6050_static_100hz.parquet")
SCRIPTS = (
    "published_tables.py",
    "process_noise_sweep.py",
    "offline_models.py",
    "robust_figures.py",
)
METHODS = ("kf", "akf", "fading")


def estimate(method, **options):
    """Return a filter of three axes whose output is the estimate."""
    return zr.DriftFilter(100.0, method=method, output="estimate", channels=3, **options)


@pytest.fixture(scope="module", params=AT_REST)
def at_rest(request):
    z = read_log(RECORDINGS / request.param, rate=100.0).data
    return z, {m: estimate(m).process(z) for m in METHODS}


@needs_recordings
@pytest.mark.parametrize("method", METHODS)
def test_every_method_is_quieter_than_raw(at_rest, method):
    z, filtered = at_rest
    assert np.all(metrics.reduction(z, filtered[method]) < 1.0)


@needs_recordings
@pytest.mark.parametrize("other", ["kf", "akf"])
def test_fading_is_quietest_from_an_ignorant_start(at_rest, other):
    z, filtered = at_rest
    fading = metrics.reduction(z, filtered["fading"])
    assert np.all(fading < metrics.reduction(z, filtered[other]))


@needs_recordings
@pytest.mark.parametrize("method", METHODS)
def test_the_mean_stays(at_rest, method):
    z, filtered = at_rest
    assert np.all(np.abs(metrics.mean_shift(z, filtered[method])) < 0.01)


@needs_recordings
def test_a_small_process_noise_is_better_and_fading_spoils_it_by_raising_it():
    z = read_log(RECORDINGS / AT_REST[0], rate=100.0).data
    banks = {m: estimate(m, process_noise=1e-4) for m in METHODS}
    error = {
        m: metrics.coasting_error(z, bank.process(z), 100.0, 10.0) for m, bank in banks.items()
    }
    assert np.all(error["fading"] > np.maximum(error["kf"], error["akf"]))
    ignorant = estimate("fading").process(z)
    assert np.all(error["fading"] < metrics.coasting_error(z, ignorant, 100.0, 10.0))
    raised = banks["fading"].process_noise[:, 0, 0] / banks["kf"].process_noise[:, 0, 0]
    assert np.all(raised > 4.0)


def run(script, *arguments):
    return subprocess.run(
        [sys.executable, EXAMPLES / script, *map(os.fspath, arguments)],
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, "PYTHONIOENCODING": "utf-8"},
        encoding="utf-8",
    )


@pytest.mark.every(2)
@pytest.mark.parametrize("script", SCRIPTS)
def test_scripts_explain_themselves(script):
    done = run(script, "--help")
    assert done.returncode == 0
    assert "--seconds" in done.stdout


def test_which_recordings_are_there(tmp_path):
    (tmp_path / AT_REST[1]).write_bytes(b"another")
    done = run("recordings.py", tmp_path)
    assert done.returncode == 1
    found = dict(line.split(maxsplit=1) for line in done.stdout.splitlines())
    assert found[AT_REST[0]] == "absent"
    assert found[AT_REST[1]].startswith("other bytes: sha256 ")


@pytest.mark.every(4)
@pytest.mark.parametrize("script", SCRIPTS)
def test_scripts_say_in_one_line_that_the_recordings_are_absent(script, tmp_path):
    done = run(script, tmp_path)
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1
    assert str(tmp_path) in done.stderr


@pytest.mark.slow
@needs_recordings
def test_the_tables_are_made():
    done = run("published_tables.py", RECORDINGS, "--seconds", "70", "--markdown")
    assert done.returncode == 0, done.stderr
    assert "fading" in done.stdout
    assert "nan" not in done.stdout


@pytest.mark.slow
@needs_recordings
def test_the_offline_tables_are_made():
    done = run("offline_models.py", RECORDINGS, "--seconds", "160", "--markdown")
    assert done.returncode == 0, done.stderr
    assert "AR(1) as it is" in done.stdout
    assert "nan" not in done.stdout


@needs_recordings
@pytest.mark.parametrize("axis", range(3))
def test_smoothed_white_noise_has_the_published_coefficient(axis):
    z = read_log(RECORDINGS / AT_REST[1], rate=100.0).data[:15_000, axis]
    plain, smooth = (identification.fit_ar(x, 1) for x in (z, identification.moving_average(z, 5)))
    assert abs(plain.phi[0]) < 3.0 * plain.standard_errors[0]
    # Bao & Yuan, z axis of another sensor, 15 000 samples.
    assert abs(smooth.phi[0] - 0.8023) < 3.0 * smooth.standard_errors[0]


@needs_recordings
def test_a_hump_hides_the_drift_from_the_criterion_but_not_from_us():
    z = read_log(RECORDINGS / AT_REST[0], rate=100.0).data[:, 2]
    whole, slow = identification.identify(z, 100.0), identification.identify(z, 100.0, decimate=100)
    assert whole.slow_ratio > 5.0
    # A hundred means tell a variance to a seventh: three of that.
    assert slow.slow_ratio == pytest.approx(1.0, abs=3.0 / 7.0)


@needs_recordings
@pytest.mark.parametrize(("name", "axis"), [(AT_REST[0], 1), (AT_REST[1], 1), (AT_REST[1], 2)])
def test_an_arma_2_1_of_a_drift_nearly_cancels(name, axis):
    model = identification.fit_arma(read_log(RECORDINGS / name, rate=100.0).data[:, axis], 2, 1)
    assert abs(1.0 - model.phi.sum()) < 1e-3
    assert -1.0 < model.theta[0] < -0.99


@pytest.mark.slow
@needs_recordings
def test_the_figure_is_made(tmp_path):
    figure = tmp_path / "sweep.png"
    done = run("process_noise_sweep.py", RECORDINGS, "--seconds", "30", "--figure", figure)
    assert done.returncode == 0, done.stderr
    assert figure.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
@needs_recordings
def test_the_figures_of_outliers_are_made(tmp_path):
    done = run("robust_figures.py", RECORDINGS, "--seconds", "150", "--figures", tmp_path)
    assert done.returncode == 0, done.stderr
    for name in ("robust_contamination.png", "robust_tick.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")


def test_the_committed_figure_is_small():
    figure = EXAMPLES.parent / "docs" / "figures" / "process_noise_sweep.png"
    assert figure.stat().st_size < 300_000


def test_a_start_that_is_best_for_each_gyro_is_no_worse_than_any(monkeypatch):
    monkeypatch.syspath_prepend(os.fspath(EXAMPLES))
    study = runpy.run_path(os.fspath(EXAMPLES / "tuned_process_noise.py"))
    few = [model for model in MODELS if model.name in ("walk", "strong walk")]
    methods = [
        study["started"](name, start) for name in study["METHODS"] for start in study["STARTS"]
    ]
    found = run_methods([*methods, "auto"], models=few, seeds=1, duration=60.0, score_from=20.0)
    *starts, best = (np.array(row[1:], dtype=float) for row in study["rows"](found))
    assert best.shape == (4,)
    assert (best <= np.min(starts, axis=0)).all()
