"""`ArmaModel`: what follows from the numbers of a model."""

import dataclasses
import json
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter
from statsmodels.tsa.arima_process import ArmaProcess

from support.models import FU_HAN, SHAPES, arma_models, asymptotic_covariance, from_roots
from zerorate.identification import ArmaModel

EPS = np.finfo(float).eps


def with_errors(model, n, **more):
    """The model as if it had been estimated from n samples."""
    numbers = {
        "constant": 0.0,
        "sigma2": model.sigma2,
        "n": n,
        "log_likelihood": -1.0,
        "condition": 10.0,
        "method": "css",
    }
    covariance = asymptotic_covariance(model, n)
    return ArmaModel(phi=model.phi, theta=model.theta, covariance=covariance, **(numbers | more))


@pytest.mark.parametrize("poles", [[0.5], [0.999], [-0.3, 0.8], [0.9 + 0.2j], [0.2, 0.9 - 0.3j]])
def test_roots_are_those_the_model_was_made_of(poles):
    model = from_roots(poles, poles)
    expected = sorted({z for pole in poles for z in (1 / pole, np.conj(1 / pole))}, key=abs)
    for roots in (model.ar_roots, model.ma_roots):
        # Simple roots well apart: a few hundred units in the last place.
        np.testing.assert_allclose(sorted(roots, key=key), sorted(expected, key=key), rtol=1e-12)


def key(root):
    return round(abs(root), 9), round(np.imag(root), 9)


def test_a_last_coefficient_of_zero_makes_no_root():
    assert ArmaModel.of([0.5, 0.0], [0.0]).ar_roots.tolist() == [2.0]
    assert ArmaModel.of([0.5], [0.0]).ma_roots.size == 0


@pytest.mark.parametrize(
    ("phi", "theta", "stationary", "invertible"),
    [
        ([], [], True, True),
        ([0.999999], [-0.999999], True, True),
        ([1.0], [-1.0], False, False),
        ([1.2, -0.2], [2.0], False, False),
        ([1.2, -0.3], [0.5, 0.2], True, True),
        ([-1.01], [0.5, -0.6], False, False),
    ],
)
def test_stationary_and_invertible(phi, theta, stationary, invertible):
    model = ArmaModel.of(phi, theta)
    assert (model.stationary, model.invertible) == (stationary, invertible)


@given(arma_models())
def test_psi_weights_are_the_response_to_one_innovation(model):
    impulse = np.eye(1, 50)[0]
    expected = lfilter([1.0, *model.theta], [1.0, *-model.phi], impulse)
    # Fifty steps of the same recursion, summed in another order.
    np.testing.assert_allclose(model.psi_weights(50), expected, rtol=0.0, atol=1e-11)


@given(arma_models(largest=0.9))
def test_autocovariance_is_that_of_statsmodels(model):
    process = ArmaProcess([1.0, *-model.phi], [1.0, *model.theta])
    expected = process.acovf(12) * model.sigma2
    # Roots up to 0.9: neither side's equations lose more than four digits.
    np.testing.assert_allclose(model.autocovariance(11), expected, atol=1e-11 * expected[0])


@pytest.mark.parametrize("distance", [1e-2, 1e-6, 1e-10, 1e-14])
def test_autocovariance_close_to_a_unit_root_keeps_its_digits(distance):
    phi = 1.0 - distance
    rest = 1.0 - phi  # exact, and not quite the distance
    for theta in (0.0, -0.9):
        gamma = ArmaModel.of([phi], [theta], sigma2=2.0).autocovariance(1)
        # (1 + theta)^2 + 2 theta (phi - 1) instead of sums that would cancel.
        expected = 2.0 * ((1.0 + theta) ** 2 - 2.0 * theta * rest) / (rest * (1.0 + phi))
        # What is left of 1 + theta (phi + theta) + phi theta has lost (1 + theta)^-2.
        tolerance = 8 * EPS / (1.0 + theta) ** 2
        assert gamma[0] == pytest.approx(expected, rel=tolerance)
        assert gamma[1] == pytest.approx(phi * expected + 2.0 * theta, rel=tolerance)


def test_autocorrelation_of_a_first_order_model_decays_by_phi():
    rho = ArmaModel.of([0.8], [], sigma2=7.0).autocorrelation(20)
    # One product a lag.
    np.testing.assert_allclose(rho, 0.8 ** np.arange(21), rtol=21 * EPS)


@pytest.mark.parametrize("phi", [[1.0], [1.3, -0.3], [2.0]])
def test_a_walk_has_no_autocovariance(phi):
    with pytest.raises(ValueError, match="only a stationary model has an autocovariance"):
        ArmaModel.of(phi, []).autocovariance(3)


@given(arma_models(largest=0.95), st.sampled_from([0.5, 100.0, 8000.0]))
def test_the_spectrum_integrates_to_the_variance(model, rate):
    # The trapezoidal rule over a whole period has the error of gamma at its number of steps:
    # 0.95^4096 is nothing.
    f = np.linspace(0.0, rate / 2.0, 2049)
    variance = np.trapezoid(model.spectrum(f, rate), f)
    assert variance == pytest.approx(model.autocovariance(0)[0], rel=1e-10)


def test_spectrum_at_a_unit_root_is_infinite():
    assert ArmaModel.of([1.0], []).spectrum([0.0], 1.0).tolist() == [np.inf]


@pytest.mark.parametrize(
    ("f", "rate", "words"),
    [([-1.0], 10.0, "frequencies must lie from 0"), ([5.1], 10.0, "0 to rate / 2 = 5, got 5.1")]
    + [([1.0], rate, "rate must be a positive number") for rate in (0.0, -1.0, np.nan, np.inf)],
)
def test_spectrum_outside_its_range(f, rate, words):
    with pytest.raises(ValueError, match=words):
        ArmaModel.of([0.5], []).spectrum(f, rate)


@given(arma_models(), st.integers(0, 2**32))
def test_residuals_invert_the_model(model, seed):
    rng = np.random.default_rng(seed)
    a = rng.standard_normal(300)
    p = len(model.phi)
    z = lfilter([1.0, *model.theta], [1.0, *-model.phi], a) + 5.0
    shifted = ArmaModel.of(model.phi, model.theta, 5.0 * (1.0 - model.phi.sum()))
    found = shifted.residuals(z)
    assert np.isnan(found[:p]).all()
    expected = conditional(z - 5.0, model, slice(0, len(z)))
    size = np.abs(expected[p:]).max()
    np.testing.assert_allclose(found[p:], expected[p:], rtol=0.0, atol=1e-10 * size)


def conditional(y, model, part):
    """The textbook recursion over one stretch, everything zero before it."""
    y = y[part]
    a = np.zeros(len(y))
    for k in range(len(y)):
        a[k] = y[k] - sum(phi * y[k - 1 - i] for i, phi in enumerate(model.phi) if k - 1 - i >= 0)
        a[k] -= sum(t * a[k - 1 - j] for j, t in enumerate(model.theta) if k - 1 - j >= 0)
    return a


def test_residuals_start_anew_after_every_gap():
    model, rng = ArmaModel.of([0.9, -0.1], [0.4]), np.random.default_rng(2)
    z = rng.standard_normal(40)
    z[[11, 12, 13, 15, 30]] = [np.nan, np.inf, np.nan, -np.inf, np.nan]
    found = model.residuals(z)
    for first, last in [(0, 11), (14, 15), (16, 30), (31, 40)]:
        alone = model.residuals(z[first:last])
        # The centre is another one: the last bits of sums of some ten numbers differ.
        np.testing.assert_allclose(found[first:last], alone, rtol=0.0, atol=100 * EPS)
    assert np.isnan(found[~np.isfinite(z)]).all()
    assert np.isfinite(found).sum() == 40 - 5 - 2 - 1 - 2 - 2


def test_residuals_of_a_large_offset_lose_nothing():
    rng = np.random.default_rng(3)
    noise = 1e-4 * lfilter([1.0, -0.5], [1.0, -0.9], rng.standard_normal(1000))
    z = 1e7 + noise
    # What 1e7 + noise holds of the noise, and a constant that is exact for it.
    held = z - 1e7
    model = ArmaModel.of([0.9], [-0.5], constant=1e7 * (1.0 - 0.9))
    centred = ArmaModel.of([0.9], [-0.5]).residuals(held)
    # The constant itself is rounded to 1e6 EPS, and theta sums two of its errors.
    assert np.nanmax(np.abs(model.residuals(z) - centred)) <= 4e6 * EPS


@pytest.mark.parametrize("factor", [2.0**-40, 2.0**30])
def test_a_power_of_two_scales_residuals_without_rounding(factor):
    z = 3.0 + np.random.default_rng(4).standard_normal(100)
    plain = ArmaModel.of([0.5], [0.3], 1.5).residuals(z)
    np.testing.assert_array_equal(
        ArmaModel.of([0.5], [0.3], 1.5 * factor).residuals(z * factor), plain * factor
    )


@pytest.mark.parametrize("z", [[], [np.nan], [[1.0, 2.0]]])
def test_residuals_of_no_record(z):
    with pytest.raises(ValueError, match=r"^z "):
        ArmaModel.of([0.5], []).residuals(z)


def test_modes_are_time_constants_of_the_sampled_process():
    rate, slow, fast = 200.0, 30.0, 0.1
    poles = [np.exp(-1.0 / (rate * T)) for T in (slow, fast)]
    modes = from_roots(poles, []).modes(rate)
    # The slow pole is 1 - 1.7e-4: four of its sixteen digits tell the time.
    assert [m.time_constant for m in modes] == pytest.approx([slow, fast], rel=1e-11)
    assert [(m.frequency, m.damping) for m in modes] == [(0.0, 1.0)] * 2


def test_modes_of_a_damped_oscillation():
    rate, natural, damping = 100.0, 2.0 * np.pi * 7.0, 0.05
    s = natural * (-damping + 1j * np.sqrt(1.0 - damping**2))
    (mode,) = from_roots([np.exp(s / rate)], []).modes(rate)
    # A pole well inside the unit circle, from two coefficients.
    assert mode.damping == pytest.approx(damping, rel=1e-12)
    assert mode.time_constant == pytest.approx(1.0 / (natural * damping), rel=1e-12)
    assert mode.frequency == pytest.approx(7.0 * np.sqrt(1.0 - damping**2), rel=1e-12)
    assert mode.root.imag > 0.0


def test_mean():
    assert ArmaModel.of([0.75], [], constant=0.5).mean == 2.0
    assert ArmaModel.of([1.0], []).mean == 0.0
    assert np.isnan(ArmaModel.of([1.0], [], constant=0.5).mean)


class TestNotes:
    def test_fu_han_is_close_to_a_walk_and_nearly_cancels(self):
        """Two minutes at 100 Hz, from which they printed four digits of it."""
        model = with_errors(FU_HAN, 12_000)
        text = " ".join(model.notes)
        assert "an AR root is within two standard errors of the unit circle" in text
        assert "the AR root 1.0067 and the MA root 1.0045 are closer" in text
        assert model.stationary

    def test_a_longer_record_would_tell_them_apart(self):
        assert with_errors(FU_HAN, 1_000_000).notes == ()

    def test_numbers_that_are_known_have_no_uncertain_roots(self):
        assert FU_HAN.notes == ()

    def test_an_ordinary_model_needs_none(self):
        assert with_errors(ArmaModel.of([0.9], [-0.3]), 5000).notes == ()

    def test_a_common_factor_is_found_among_other_roots(self):
        model = with_errors(from_roots([0.5, 0.9], [0.501]), 10_000)
        assert any("the AR root 2 and the MA root 1.996" in note for note in model.notes)

    def test_a_common_pair_of_complex_roots_is_told_once(self):
        model = with_errors(from_roots([0.5 + 0.5j], [0.5 + 0.501j]), 10_000)
        (note,) = [note for note in model.notes if "common factor" in note]
        assert "j" in note

    def test_the_rest(self):
        model = ArmaModel.of([1.0], [-2.0])
        assert model.notes == (
            "not stationary: an AR root lies on or inside the unit circle",
            "not invertible: an MA root lies on or inside the unit circle",
        )
        model = with_errors(ArmaModel.of([0.5], []), 100, condition=3e9, converged=False)
        assert model.notes[0].startswith("the search for the estimate did not converge")
        assert model.notes[1].startswith("the normal equations have condition 3e+09")

    def test_notes_of_the_estimate_come_first_and_none_twice(self):
        model = with_errors(ArmaModel.of([0.5], []), 100, condition=3e9, remarks=("beware",))
        assert model.notes[0] == "beware"
        assert ArmaModel.from_json(model.to_json()).notes == model.notes

    def test_a_covariance_that_is_not_known(self):
        numbers = ArmaModel.of([0.5], [0.4])
        for value in (np.nan, np.inf):
            model = ArmaModel(
                numbers.phi, numbers.theta, 0.0, 1.0, np.full((3, 3), value), 9, 0.0, 1.0, "css"
            )
            assert isinstance(model.notes, tuple)


@given(arma_models(), st.sampled_from([0.0, 1.0 / 3.0, np.nan, -np.inf]))
def test_json_and_pickle_lose_nothing(model, number):
    size = sum(model.order) + 1
    model = dataclasses.replace(
        model,
        covariance=np.full((size, size), number),
        log_likelihood=number,
        condition=np.inf,
        remarks=("é ±",),
    )
    for twin in (ArmaModel.from_json(model.to_json()), pickle.loads(pickle.dumps(model))):
        assert twin == model
        assert hash(twin) == hash(model)
        for name in ("phi", "theta", "covariance"):
            assert getattr(twin, name).tobytes() == getattr(model, name).tobytes()
            assert getattr(twin, name).shape == getattr(model, name).shape


def test_json_is_for_other_programs_too(tmp_path):
    model = ArmaModel.of([0.1], [0.2], 0.3, 0.4)
    model.to_json(tmp_path / "model.json")
    assert json.loads((tmp_path / "model.json").read_text())["theta"] == [0.2]
    assert ArmaModel.from_json(tmp_path / "model.json") == model
    with pytest.raises(FileExistsError):
        model.to_json(tmp_path / "model.json")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"format": "other"}, "its format is 'other'"),
        ({"version": 2}, "it is of version 2, and this zerorate reads version 1"),
        ({"phi": ["x"]}, "could not convert"),
        ({"sigma2": None}, "not supported|must be|real number"),
        ({"covariance": [[1.0]]}, "covariance must have shape"),
    ],
)
def test_json_of_something_else(change, words):
    content = json.loads(ArmaModel.of([0.5], []).to_json()) | change
    with pytest.raises(ValueError, match="the text is not a zerorate ARMA model in JSON") as error:
        ArmaModel.from_json(json.dumps(content))
    error.match(words)


@pytest.mark.parametrize("text", ["{", "{}", '{"format": "zerorate ARMA model", "version": 1}'])
def test_json_that_is_broken(text):
    with pytest.raises(ValueError, match="is not a zerorate ARMA model in JSON"):
        ArmaModel.from_json(text)


def test_models_are_equal_by_their_numbers():
    assert ArmaModel.of([0.5], []) == ArmaModel.of([0.5], [])
    assert ArmaModel.of([0.5], []) != ArmaModel.of([0.5 + EPS], [])
    assert ArmaModel.of([0.5], []) != ArmaModel.of([], [0.5])
    assert ArmaModel.of([0.5], []) != "a model"


def test_arrays_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        ArmaModel.of([0.5], []).phi[0] = 1.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"covariance": np.eye(2)}, r"covariance must have shape \(3, 3\), got \(2, 2\)"),
        ({"phi": [np.nan]}, "phi must be finite"),
        ({"constant": np.inf}, "constant must be finite"),
        ({"sigma2": -1.0}, "sigma2 must not be negative"),
    ],
)
def test_what_is_no_model(change, words):
    numbers = {"phi": [0.5], "theta": [0.1], "constant": 0.0, "sigma2": 1.0}
    more = {"n": 0, "log_likelihood": 0.0, "condition": 1.0, "method": "css"}
    with pytest.raises(ValueError, match=words):
        ArmaModel(**({"covariance": np.eye(3)} | numbers | more | change))


def test_the_table_is_aligned():
    model = with_errors(FU_HAN, 12_000)
    lines = str(model).splitlines()
    assert lines[0] == "ARMA(2, 1) by css, 12000 innovations"
    assert lines[1].startswith("phi_1     1.0202 ± 0.0")
    assert "t = " in lines[1]
    places = {
        line.index(digits) for line, digits in zip(lines[1:4], ("1.0", "-0.0", "-0.9"), strict=True)
    }
    assert len(places) == 1
    assert lines[5] == "sigma^2   1"
    assert all(line.startswith(("note: ", "  ")) for line in lines[6:])
    assert len(lines) > 6


def test_models_of_all_orders():
    for p, q in SHAPES:
        model = from_roots([0.5 - 0.1 * i for i in range(p)], [0.3 - 0.1 * j for j in range(q)])
        assert model.order == (p, q)
        # The reciprocal root of zero, the fourth, would be none.
        assert (len(model.ar_roots), len(model.ma_roots)) == (p, q)
        assert model.autocovariance(0).shape == (1,), (p, q)
        assert str(model), (p, q)
