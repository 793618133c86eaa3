"""State-space forms: all the same process, one of them literally not."""

from itertools import product

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.linalg import solve_discrete_are, solve_discrete_lyapunov
from scipy.signal import ss2tf
from statsmodels.tsa.statespace.sarimax import SARIMAX

from support.models import FU_HAN, SHAPES, arma_models, from_roots
from zerorate.identification import ArmaModel, StateSpace

EXACT = ["harvey", "controllable", "observable", "fu-han"]
MINIMAL = EXACT[:3]
BY_FORM = pytest.mark.parametrize("form", EXACT)
NEAR_UNIT = [1.0 - 1e-3, 1.0 - 1e-5, 1.0 - 1e-7]


def of_shape(shape, largest=0.95):
    """A model of these orders with well separated roots."""
    p, q = shape
    poles = [[], [largest], [largest, -0.5], [0.3, 0.9 * np.exp(0.4j)]][p]
    zeros = [[], [0.6], [0.6, -0.2], [0.1, 0.7 * np.exp(1.5j)]][q]
    return from_roots(poles, zeros, constant=0.7, sigma2=2.0)


@given(arma_models(), st.sampled_from([0.0, 0.3]))
def test_every_form_has_the_autocovariance_of_the_model(model, R):
    expected = model.autocovariance(10)
    expected[0] += R
    for form in EXACT:
        found = model.to_state_space(form, R).autocovariance(10)
        # What is asked for; roots of up to 0.999 that come in threes lose some digits.
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-10 * expected[0])


@BY_FORM
def test_close_to_a_unit_root(form):
    for shape, largest in product(SHAPES, NEAR_UNIT):
        model = of_shape(shape, largest)
        expected = model.autocovariance(10)
        found = model.to_state_space(form).autocovariance(10)
        atol, case = 1e-10 * expected[0], f"{shape}, root {largest}"
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=atol, err_msg=case)


@BY_FORM
def test_covariance_is_scipys(form):
    for shape in SHAPES:
        space = of_shape(shape).to_state_space(form)
        moving = ~space.constants
        F, G = space.F[np.ix_(moving, moving)], space.G[moving]
        expected = solve_discrete_lyapunov(F, 2.0 * G @ G.T)
        found = space.covariance()[np.ix_(moving, moving)]
        # Eigenvalues of 0.95: scipy's bilinear transform loses two digits.
        atol = 1e-12 * np.abs(expected).max()
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=atol, err_msg=str(shape))
        assert not space.covariance()[~moving].any(), shape


def test_harvey_is_the_form_of_statsmodels():
    for p, q in SHAPES:
        model, theirs = of_shape((p, q)), SARIMAX(np.zeros(50), order=(p, 0, q))
        theirs.update([*model.phi, *model.theta, model.sigma2])
        space, case = model.to_state_space("harvey"), f"ARMA({p}, {q})"
        np.testing.assert_array_equal(space.F, theirs["transition"], err_msg=case)
        np.testing.assert_array_equal(space.G, theirs["selection"], err_msg=case)
        np.testing.assert_array_equal(space.H, theirs["design"][0], err_msg=case)


@BY_FORM
def test_impulse_response_and_transfer_are_those_of_the_model(form):
    f = np.array([0.0, 1.0, 7.3, 25.0])
    for shape in SHAPES:
        model = of_shape(shape)
        space = model.to_state_space(form)
        response, expected = space.impulse_response(30), model.psi_weights(30)
        # Thirty products of matrices of ones and coefficients below three.
        np.testing.assert_allclose(response, expected, atol=1e-12, err_msg=str(shape))
        density = 2.0 * model.sigma2 / 50.0 * np.abs(transfer_at(space, f)) ** 2
        expected = model.spectrum(f, 50.0)
        np.testing.assert_allclose(density, expected, rtol=1e-11, err_msg=str(shape))


def transfer_at(space, f):
    """At frequencies where the states that never change are no pole."""
    if not space.constants.any():
        return space.transfer(f, 50.0)
    keep = ~space.constants
    moving = StateSpace(space.F[np.ix_(keep, keep)], space.G[keep], space.H[keep], space.sigma2)
    return moving.transfer(f, 50.0)


@pytest.mark.parametrize("form", MINIMAL)
def test_transfer_is_scipys(form):
    model = of_shape((3, 2))
    space = model.to_state_space(form)
    numerator, denominator = ss2tf(space.F, space.F @ space.G, space.H[None], space.H @ space.G)
    theta = np.concatenate(([1.0], model.theta, [0.0]))
    # scipy finds both polynomials from eigenvalues.
    np.testing.assert_allclose(numerator[0], theta, atol=1e-12)
    np.testing.assert_allclose(denominator, [1.0, *-model.phi], atol=1e-12)


@BY_FORM
@given(model=arma_models(largest=0.99))
def test_to_arma_returns_the_model(form, model):
    assume(apart(model))
    phi, theta, constant, sigma2 = model.to_state_space(form).to_arma()
    # Sums of some ten products of coefficients below three.
    np.testing.assert_allclose(padded(phi), padded(model.phi), rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(padded(theta), padded(model.theta), rtol=0.0, atol=1e-11)
    assert constant == pytest.approx(model.constant, rel=1e-9, abs=1e-12)
    assert sigma2 == model.sigma2


def padded(coefficients):
    return np.concatenate((coefficients, np.zeros(4)))[:4]


def apart(model):
    """No root of one polynomial is near one of the other."""
    poles, zeros = model.ar_roots, model.ma_roots
    return np.min(np.abs(np.subtract.outer(1.0 / poles, 1.0 / zeros)), initial=1.0) > 1e-3


@BY_FORM
def test_any_form_becomes_any_other(form):
    for start, shape in product(EXACT, SHAPES):
        model, case = of_shape(shape), f"from {start}, {shape}"
        direct = model.to_state_space(form, 0.25)
        found = model.to_state_space(start, 0.25).to(form)
        for name in ("F", "G", "H", "constant", "start"):
            got, wanted = getattr(found, name), getattr(direct, name)
            # One change of coordinates and back, of numbers below three.
            np.testing.assert_allclose(got, wanted, atol=1e-11, err_msg=f"{name}, {case}")
        assert (found.sigma2, found.R) == (direct.sigma2, direct.R), case
        assert found.offset == pytest.approx(direct.offset, rel=1e-11), case


@pytest.mark.parametrize("form", MINIMAL)
def test_transformation(form):
    for start, shape in product(MINIMAL, SHAPES):
        one, other = (of_shape(shape).to_state_space(name) for name in (start, form))
        T, case = one.transformation(other), f"from {start}, {shape}"
        # The observability matrices have conditions of a few hundred at most.
        np.testing.assert_allclose(other.F @ T, T @ one.F, atol=1e-11, err_msg=case)
        np.testing.assert_allclose(other.G, T @ one.G, atol=1e-11, err_msg=case)
        np.testing.assert_allclose(other.H @ T, one.H, atol=1e-11, err_msg=case)


def test_no_transformation():
    model = of_shape((2, 1))
    harvey = model.to_state_space()
    hidden = StateSpace(np.diag([0.5, 0.5]), [[1.0], [0.0]], [1.0, 0.0], 1.0)
    with pytest.raises(ValueError, match="the models have 2 and 4 states"):
        harvey.transformation(model.to_state_space("fu-han"))
    with pytest.raises(ValueError, match="states that no sample shows"):
        harvey.transformation(hidden)
    with pytest.raises(ValueError, match="not the same model"):
        harvey.transformation(of_shape((2, 1), 0.9).to_state_space())


def kalman(space, z):
    """Innovations and their variances from the stationary state; NaN is missing."""
    # The start holds the mean of the forms that keep the constant as a state.
    x, P = space.start, space.covariance()
    Q = space.sigma2 * space.G @ space.G.T
    innovations, variances = [], []
    for sample in z:
        S = space.H @ P @ space.H + space.R
        e = sample - space.H @ x - space.offset
        innovations.append(e)
        variances.append(S)
        if np.isfinite(sample):
            K = P @ space.H / S
            x = x + K * e
            P = P - np.outer(K, K) * S
        x = space.F @ x + space.constant
        P = space.F @ P @ space.F.T + Q
    return np.array(innovations), np.array(variances)


@pytest.mark.parametrize("R", [0.0, 0.4])
def test_every_form_has_the_same_innovations(R):
    for shape in SHAPES:
        model = of_shape(shape)
        z = model.mean + np.random.default_rng(5).standard_normal(200)
        z[[20, 21, 90]] = np.nan
        expected = kalman(model.to_state_space("harvey", R), z)
        for form in EXACT[1:]:
            found, case = kalman(model.to_state_space(form, R), z), f"{form}, {shape}"
            for got, wanted in zip(found, expected, strict=True):
                # Two hundred steps of a plain Kalman filter of a stable model.
                np.testing.assert_allclose(got, wanted, rtol=0.0, atol=1e-10, err_msg=case)


def test_innovations_are_those_of_statsmodels():
    model = of_shape((2, 1))
    z = np.random.default_rng(6).standard_normal(100)
    theirs = SARIMAX(z, order=(2, 0, 1)).smooth([*model.phi, *model.theta, model.sigma2])
    innovations, variances = kalman(of_shape((2, 1)).to_state_space(), z + model.mean)
    # statsmodels stops updating its variances at a relative change of 1e-19 of its own scale.
    np.testing.assert_allclose(innovations, theirs.forecasts_error[0], atol=1e-9)
    np.testing.assert_allclose(variances, theirs.forecasts_error_cov[0, 0], atol=1e-9)


@pytest.mark.parametrize("form", ["harvey", "observable", "controllable"])
def test_the_constant_of_a_walk_is_a_drive(form):
    model = ArmaModel.of([1.3, -0.3], [0.4], constant=0.5)
    space = model.to_state_space(form)
    assert space.offset == 0.0
    x, response = np.zeros(2), []
    for _ in range(30):
        x = space.F @ x + space.constant
        response.append(space.H @ x)
    # The differences end at c / (1 - 0.3) a sample; 0.3^28 is nothing.
    assert np.diff(response)[-1] == pytest.approx(0.5 / 0.7, rel=1e-12)
    assert space.to_arma().constant == pytest.approx(0.5, rel=1e-12)


def test_fu_han_literal_is_not_the_model():
    """B [a_k, a_(k-1)] with a white covariance forgets that a_(k-1) came twice."""
    exact = FU_HAN.autocovariance(0)[0]
    literal = FU_HAN.to_state_space("fu-han-literal").autocovariance(0)[0]
    # An AR(2) of innovation variance 1 + theta^2.
    white = ArmaModel.of(FU_HAN.phi, [], sigma2=1.0 + 0.9955**2).autocovariance(0)[0]
    assert literal == pytest.approx(white, rel=1e-11)
    assert exact == pytest.approx(1.0010, abs=5e-5)
    assert 157.0 < literal / exact < 158.0


def test_fu_han_literal_is_table_3():
    for phi in ([0.9], [1.2, -0.3]):
        space = ArmaModel.of(phi, [-0.5]).to_state_space("fu-han-literal")
        n = len(phi) + 1
        assert space.F[0].tolist() == [*phi, 1.0]
        assert space.F[-1].tolist() == [0.0] * len(phi) + [1.0]
        assert space.G.tolist() == [[1.0, -0.5]] + [[0.0, 0.0]] * (n - 1)
        assert space.H.tolist() == [1.0] + [0.0] * (n - 1)


@pytest.mark.parametrize("p", range(4))
def test_fu_han_literal_without_a_moving_average_is_exact(p):
    model = of_shape((p, 0))
    found = model.to_state_space("fu-han-literal").autocovariance(5)
    np.testing.assert_allclose(found, model.autocovariance(5), rtol=1e-11)


def test_fu_han_literal_has_no_other_form():
    with pytest.raises(ValueError, match="only a model of a single noise has forms, got 2"):
        FU_HAN.to_state_space("fu-han-literal").to("harvey")


@given(arma_models(largest=0.99, shapes=((1, 0), (2, 0), (3, 0), (1, 1), (2, 2))))
def test_innovations_form_is_the_steady_kalman_filter(model):
    space = model.to_state_space("harvey", 3.0 * model.sigma2)
    Q = model.sigma2 * space.G @ space.G.T
    P = solve_discrete_are(space.F.T, space.H[:, None], Q, [[space.R]])
    one = space.innovations_form()
    # Both solve for P to some digits less than the closed loop is away from a unit root.
    assert one.sigma2 == pytest.approx(space.H @ P @ space.H + space.R, rel=1e-9)
    assert one.R == 0.0
    found, expected = one.autocovariance(8), space.autocovariance(8)
    np.testing.assert_allclose(found, expected, atol=1e-9 * expected[0])


def test_a_drift_under_white_noise_is_an_arma_model():
    """AR(1) plus white noise is ARMA(1, 1) with R = -theta sigma2 / phi."""
    phi, theta, constant, sigma2 = (
        ArmaModel.of([0.9], [], 0.5, 0.25).to_state_space("fu-han", measurement_noise=0.5).to_arma()
    )
    assert phi == pytest.approx([0.9], rel=1e-12)
    assert -theta[0] * sigma2 / 0.9 == pytest.approx(0.5, rel=1e-11)
    moved = sigma2 * (1.0 + theta[0] ** 2)
    assert moved == pytest.approx(0.25 + 0.5 * (1.0 + 0.81), rel=1e-11)
    assert constant == pytest.approx(0.5, rel=1e-11)


def test_several_noises_need_measurement_noise():
    space = FU_HAN.to_state_space("fu-han-literal")
    with pytest.raises(ValueError, match="several noises need a measurement noise R above 0"):
        space.to_arma()


def test_common_factors_are_left_out():
    phi, theta, constant, _ = from_roots([0.9, 0.5], [0.5], 0.1).to_state_space().to_arma()
    assert phi == pytest.approx([0.9], rel=1e-12)
    assert theta.size == 0
    assert constant == pytest.approx(0.2, rel=1e-12)


@pytest.mark.parametrize("form", EXACT)
def test_a_walk_has_no_covariance(form):
    with pytest.raises(ValueError, match="only a stationary model has a covariance"):
        ArmaModel.of([1.0], [-0.5]).to_state_space(form).autocovariance(2)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"F": np.eye(3)[:2]}, r"F must have shape \(2, 2\), got \(2, 3\)"),
        ({"G": np.ones(2)}, r"G must have shape \(2, u\), got \(2,\)"),
        ({"H": np.ones(3)}, r"H must have shape \(2,\), got \(3,\)"),
        ({"constant": np.ones(1)}, r"constant must have shape \(2,\)"),
        ({"sigma2": -1.0}, "sigma2 must be zero or positive"),
        ({"R": np.nan}, "R must be zero or positive"),
    ],
)
def test_shapes_that_do_not_fit(change, words):
    parts = {"F": 0.5 * np.eye(2), "G": np.ones((2, 1)), "H": np.ones(2), "sigma2": 1.0}
    with pytest.raises(ValueError, match=words):
        StateSpace(**(parts | change))


def test_a_form_that_is_not_known():
    with pytest.raises(ValueError, match="form must be one of 'fu-han'"):
        FU_HAN.to_state_space("jordan")
    with pytest.raises(ValueError, match="lags must not be negative"):
        FU_HAN.to_state_space().autocovariance(-1)
