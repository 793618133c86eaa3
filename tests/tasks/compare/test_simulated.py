"""Regret on simulated gyros: what is 1 by definition, what exceeds it, what is refused."""

from types import SimpleNamespace

import numpy as np
import pytest

from zerorate.metrics.averages import SHARED_GAINS
from zerorate.show.compare_simulated import format_regret
from zerorate.simulation import Contamination
from zerorate.simulation.models import MODELS
from zerorate.simulation.optimal_filter import optimum
from zerorate.tasks.compare import METHODS, methods
from zerorate.tasks.compare.methods import Estimate
from zerorate.tasks.compare.simulated import run, run_contaminated

SHORT = {"duration": 60.0, "score_from": 20.0}
NONE, WALK = MODELS[0], MODELS[2]
STRONG = next(model for model in MODELS if model.name == "strong walk")


def knows(model, sigmas=1.0):
    """The optimum of a model as a method, with its sigma times a factor."""

    def knowing(signal, rate):
        best = optimum(model, rate, len(signal))
        sigma = np.broadcast_to(np.sqrt(best.variance)[:, np.newaxis], signal.shape)
        return Estimate(best.filtered(signal)[0], sigmas * sigma)

    return knowing


def test_the_optimum_regrets_nothing():
    found = run([knows(WALK)], models=[WALK], seeds=3, **SHORT)
    assert found.regret.tolist() == [[1.0]]
    assert found.sigma.tolist() == [[0.0]]


def test_without_drift_the_mean_is_the_optimum_and_so_is_a_slow_average():
    found = run(["mean", "ema"], models=[NONE], seeds=2, **SHORT)
    # Rounding of 6000 steps. The least gain, 1e-6, is below 1/6000: a plain mean.
    assert found.regret[0] == pytest.approx([1.0, 1.0], rel=1e-9)
    assert SHARED_GAINS[0] < 1.0 / 6000.0


@pytest.mark.every(2)
@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_no_method_beats_the_optimum(model):
    names = ["raw", "mean", "ema", "kf", "akf", "fading"]
    found = run(names, models=[model], seeds=6, duration=90.0, score_from=30.0)
    # Four standard errors of the ratio for luck, and rounding where a method is the optimum.
    assert np.all(found.regret + 4.0 * found.sigma > 1.0 - 1e-9)


def test_every_method_but_those_for_motion_has_a_regret():
    names = [name for name in METHODS if not name.endswith("+hold")]
    found = run(names, models=[WALK], seeds=1, **SHORT)
    assert np.isfinite(found.regret).all()
    assert (found.regret > 0.5).all()


def test_contaminated_records_are_judged_by_the_true_drift():
    faults = [Contamination.parse(text) for text in ("share=0.05,size=100,one-sided", "stuck=5")]
    models = "zerorate.tasks.compare.simulated.MODELS"
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(models, (NONE,))
        clean, *faulty = run_contaminated(["ema", "mean", "raw"], faults, seeds=1, duration=600.0)
    assert clean.methods == ("ema", "mean", "raw")
    assert [one.methods for one in faulty] == [("mean", "raw")] * 2
    assert [one.contamination for one in faulty] == faults
    assert clean.contamination is None
    # 5 % of samples ten deg/s off: their mean, and the root of their mean square.
    moved = faulty[0].regret[0] * clean.optimum[0]
    assert moved == pytest.approx([0.5, 0.05**0.5 * 10.0], rel=0.1)
    assert np.array_equal(faulty[0].optimum, clean.optimum)


def test_raw_output_errs_by_its_white_noise():
    found = run(["raw"], models=[WALK], seeds=4, **SHORT)
    # 16 000 independent samples: the deviation is known to 1/sqrt(32 000), five times that.
    assert found.regret[0, 0] * found.optimum[0] == pytest.approx(0.1, rel=5.0 / 32_000**0.5)


def test_the_ratio_is_of_root_mean_squares_over_seeds():
    alone = [run([knows(NONE)], models=[WALK], seeds=seeds, **SHORT) for seeds in (1, 2)]
    one, both = (found.optimum[0] ** 2 for found in alone)
    regret = [found.regret[0, 0] ** 2 for found in alone]
    second = 2.0 * regret[1] * both - regret[0] * one
    weights = np.array([one, 2.0 * both - one])
    ratios = np.array([regret[0], second / weights[1]])
    assert regret[1] == pytest.approx(weights @ ratios / weights.sum(), rel=1e-12)  # rounding
    assert np.isnan(alone[0].sigma[0, 0])
    residual = weights * (ratios - regret[1])
    expected = residual.std(ddof=1) / np.sqrt(2.0) / both / (2.0 * np.sqrt(regret[1]))
    assert alone[1].sigma[0, 0] == pytest.approx(expected, rel=1e-9)  # rounding, differences


def test_coverage_is_the_share_within_sigma():
    shares = [
        run([knows(STRONG, sigmas)], models=[STRONG], seeds=8, **SHORT).coverage[0, 0]
        for sigmas in (0.0, 1.0, 1e3)
    ]
    assert shares[0] == 0.0
    assert shares[2] == 1.0
    # Errors forget in 1/gain = 3.3 s, so 8 records of 40 s hold some 8 * 40/6.6 = 48 independent
    # ones, and a share of 0.683 has the deviation sqrt(0.683 * 0.317/48) = 0.067: four of them.
    assert shares[1] == pytest.approx(0.683, abs=0.27)


def test_a_method_without_sigma_has_no_coverage():
    assert np.isnan(run(["raw"], models=[NONE], seeds=1, **SHORT).coverage).all()


def test_mean_and_worst_leave_out_the_transient_model():
    found = run(["raw"], models=[WALK, STRONG, MODELS[-1]], seeds=1, **SHORT)
    assert found.lasting_mask.tolist() == [True, True, False]
    assert found.mean[0] == found.regret[:2, 0].mean()
    assert found.worst[0] == found.regret[:2, 0].max()
    only = run(["raw"], models=[MODELS[-1]], seeds=1, **SHORT)
    assert np.isnan([only.mean[0], only.worst[0]]).all()


def test_the_self_tuning_filter_is_read_record_by_record_in_slabs(monkeypatch):
    class Counting:
        """Answers how many samples it has seen, half of that as sigma."""

        def __init__(self, rate, method):
            assert (rate, method) == (100.0, "auto")
            self.seen = 0

        def trace(self, z):
            count = self.seen + np.arange(1.0, len(z) + 1.0)
            self.seen += len(z)
            return SimpleNamespace(bias=count, bias_sigma=count / 2.0)

    monkeypatch.setattr(methods, "DriftFilter", Counting)
    drift, sigma, _ = methods.causal_method("auto")(np.zeros((25_000, 2)), 100.0)
    count = np.arange(1.0, 25_001.0)
    np.testing.assert_array_equal(drift, np.column_stack([count, count]))
    np.testing.assert_array_equal(sigma, drift / 2.0)


def test_progress_ends_at_the_whole():
    seen = []
    run(["raw"], models=[NONE, WALK], seeds=1, progress=lambda *step: seen.append(step), **SHORT)
    assert seen == [("none", 0.25), ("none", 0.5), ("walk", 0.75), ("walk", 1.0)]


def test_the_same_call_gives_the_same_numbers():
    first, again = (run(["ema", "fading"], models=[WALK], seeds=2, **SHORT) for _ in range(2))
    np.testing.assert_array_equal(first.regret, again.regret)


def test_the_table_sets_the_transient_model_and_coverage_apart():
    found = run([knows(WALK), "raw"], models=[WALK, MODELS[-1]], seeds=1, **SHORT)
    main, transient, coverage = format_regret(found).split("\n\n")
    assert [line.split()[0] for line in main.splitlines()[2:5]] == ["walk", "mean", "worst"]
    assert main.splitlines()[2].split()[2] == "1.00"
    assert transient.splitlines()[2].split()[0] == "warm-up"
    assert coverage.splitlines()[1].split() == ["model", "knowing"]


@pytest.mark.parametrize(
    ("chosen", "options", "message"),
    [
        (["raw", "median"], {}, "unknown method 'median'"),
        ([], {}, "at least one and all different"),
        (["raw", "raw"], {}, "at least one and all different"),
        (["raw"], {"seeds": 0}, "got 15 and 0"),
        (["raw"], {"models": []}, "got 0 and 12"),
        (["raw"], {"duration": 60.0}, "120.0 s and 60.0 s"),
        (["raw"], {"rate": np.nan}, "rate must be positive"),
        (["raw"], {"rate": 0.001, "duration": 121.0}, "no sample at 0.001 Hz"),
    ],
)
def test_what_means_nothing_is_refused(chosen, options, message):
    with pytest.raises(ValueError, match=message):
        run(chosen, **options)


def test_a_method_must_answer_a_drift_for_each_sample():
    def short(signal, rate):
        return signal[1:]

    with pytest.raises(ValueError, match=r"short must return .*\(6000, 1\), got \(5999, 1\)"):
        run([short], models=[NONE], seeds=1, **SHORT)
