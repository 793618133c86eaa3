"""Methods of the user's own beside those of the package: called, checked, and told apart."""

from functools import partial

import numpy as np
import pytest

import zerorate as zr
from support.compared import RATE, noise, oriented, resting, turning
from zerorate.show.compare_simulated import format_regret
from zerorate.show.compare_tables import format_compare
from zerorate.simulation import Contamination
from zerorate.simulation.models import MODELS
from zerorate.tasks.compare import MethodError, OwnMethod, compare_methods, read_trial
from zerorate.tasks.compare.methods import resolve_methods
from zerorate.tasks.compare.simulated import run, run_contaminated

FAULT = "share=0.01,size=100"


def average(z, rate):
    """The running mean, missing samples left out."""
    return zr.metrics.running_mean(z)


def whole(z, rate):
    """The mean of the whole record, which nobody knows while it runs."""
    return np.full(z.shape, np.nanmean(z))


class Steps:
    """The running mean, sample by sample."""

    def __init__(self, rate):
        assert rate == RATE
        self.total, self.count = 0.0, 0

    def update(self, sample):
        self.total, self.count = self.total + sample, self.count + 1
        return self.total / self.count


@pytest.mark.every(3)
@pytest.mark.parametrize("method", [average, Steps, OwnMethod("mine", partial(average))])
@pytest.mark.parametrize("make", [resting, turning, oriented])
def test_an_own_method_has_the_measures_of_the_same_method_here(tmp_path, make, method):
    reference = {"reference": "encoder_deg"} if make is turning else {}
    (found,) = compare_methods(
        [read_trial(make(tmp_path / "a.csv"), **reference)], ["mean", method]
    )
    names = ("mean", found.methods[-1])
    ours, own = ([row for row in found.rows if row.method == name] for name in names)
    for expected, row in zip(ours, own, strict=True):
        assert row.causal
        measured = {name for name, value in row.values.items() if np.isfinite(value)}
        assert {"coasting_10", "compensated_rmse", "growth_10"} & measured
        for name in measured:
            # A mean by running sums of its own: rounding over 6000 samples.
            assert row.values[name] == pytest.approx(expected.values[name], rel=1e-9)


def test_on_contaminated_records_too(tmp_path):
    trial = read_trial(resting(tmp_path / "a.csv", axes=1))
    _, faulty = compare_methods([trial], ["mean", average], contaminate=FAULT)
    expected, found = (row.values["coasting_10_degradation"] for row in faulty.rows)
    assert found == pytest.approx(expected, rel=1e-9)


def test_what_looks_ahead_is_marked(tmp_path):
    trial = read_trial(resting(tmp_path / "a.csv"))
    (found,) = compare_methods([trial], [average, whole, "visushrink"])
    assert {row.method for row in found.rows if not row.causal} == {"whole", "visushrink"}
    text = " ".join(format_compare([found]).split())
    assert all(f" {name} " in text for name in ("average", "whole‡", "visushrink‡"))
    assert "whole: on the first half of a record alone it returned other values" in text
    assert "visushrink: given" not in text


def test_simulated_gyros_are_in_rad_per_second():
    seen = []

    def watching(z, rate):
        seen.append(z.std())
        return average(z, rate)

    methods = ["mean", *resolve_methods([watching, whole])]
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("zerorate.tasks.compare.simulated.MODELS", MODELS[:1])
        faults = [Contamination.parse(FAULT)]
        clean, faulty = run_contaminated(methods, faults, seeds=1, duration=300.0)
    # White noise of 0.1 deg/s, and a bias.
    assert np.degrees(seen[0]) == pytest.approx(0.1, rel=0.02)
    for one in (clean, faulty):
        # Degrees to radians and back: rounding.
        assert one.regret[0, 1] == pytest.approx(one.regret[0, 0], rel=1e-9)
        assert one.causal.tolist() == [True, True, False]
        assert "whole‡: on the first half" not in format_regret(one)
        assert " whole‡" in format_regret(one)


def test_what_it_may_do_and_must_not():
    z = noise(400, axes=1)[:, 0]
    kept = z.copy()
    changing = OwnMethod("changing", lambda samples, _: np.multiply(samples, 0, out=samples))
    assert not changing.run(z, RATE).any()
    np.testing.assert_array_equal(z, kept)
    assert OwnMethod("single", lambda x, _: np.float32(x)).run(z, RATE).dtype == np.float64

    z[5] = np.nan
    for answer, match in (
        (lambda x, _: x[1:], r"mine must return one number a sample, .* \(400,\), got \(399,\)"),
        (lambda x, _: None, r"mine must return one number a sample, .* got \(\)"),
        (lambda x, _: [x, 1.0], "mine must return one number a sample"),
        (lambda x, _: x + 1j, "mine must return real numbers, got type complex128"),
        (lambda x, _: x, "got nan for sample 5, where the sample is missing"),
        (lambda x, _: np.full(x.size, np.inf), "got inf for sample 0"),
        (lambda x: x, "mine failed: TypeError"),
        (lambda x, _: x["a"], r"mine failed: IndexError: .*test_own\.py, line \d+\)"),
    ):
        with pytest.raises(MethodError, match=match):
            OwnMethod("mine", answer).run(z, RATE)


@pytest.mark.parametrize(
    ("methods", "match"),
    [
        ([OwnMethod("kf", average)], "kf is a method of this package"),
        ([OwnMethod("optimum", average)], "optimum is a method of this package"),
        ([average, OwnMethod("average", whole)], "all different"),
        ([lambda z, rate: z], "a method's name is made of letters"),
    ],
)
def test_names_are_checked(methods, match):
    with pytest.raises(ValueError, match=match):
        compare_methods([], methods)


def test_a_failure_says_on_what(tmp_path):
    def picky(z, rate):
        if z.size < 4000:
            raise ValueError("too short\nfor me")
        return average(z, rate)

    path = resting(tmp_path / "a.csv", axes=1)
    place = r"a\.csv: its first half alone: picky failed: ValueError: too short for me"
    with pytest.raises(MethodError, match=place):
        compare_methods([read_trial(path)], [picky])
    with pytest.raises(MethodError, match=r"simulated gyro none: its first half alone: picky"):
        run(resolve_methods([picky]), models=MODELS[:1], seeds=1, duration=60.0, score_from=20.0)
