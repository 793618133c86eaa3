"""Two calibrations next to each other: z, chi-squared, what has moved, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.stats

import zerorate as zr
from support.calibrations import calibration

FREE = [i for i in range(33) if i not in (1, 2, 5)]
BIAS_X = 9


def again(made, seed, **changes):
    """Return what another record of the same errors would have given."""
    draw = np.random.default_rng(seed).multivariate_normal(np.zeros(33), made.covariance)
    return replace(made, values=made.values + draw, **changes)


@pytest.fixture(scope="module")
def made():
    return calibration()


def test_z_is_the_difference_over_both_errors(made):
    other = replace(again(made, 1), covariance=4.0 * made.covariance)
    found = zr.compare_calibrations(made, other)
    variance = 5.0 * np.diagonal(made.covariance)[FREE]
    expected = (other.values - made.values)[FREE] / np.sqrt(variance)
    np.testing.assert_allclose([found.parameters[i].z for i in FREE], expected)
    row = found.parameters[BIAS_X]
    assert row.name == "accel.bias.x"
    assert (row.first, row.second) == (made.accel.bias[0], other.accel.bias[0])
    assert row.difference == pytest.approx(row.second - row.first)
    assert row.difference.sigma == pytest.approx(np.sqrt(5.0) * row.first.sigma)


def test_chi_squared_counts_covariances(made):
    other = again(made, 2)
    found = zr.compare_calibrations(made, other)
    difference = (other.values - made.values)[FREE]
    whole = 2.0 * made.covariance[np.ix_(FREE, FREE)]
    expected = difference @ np.linalg.solve(whole, difference)
    # The condition of 30 correlated parameters takes some digits.
    assert found.chi_squared == pytest.approx(expected, rel=1e-6)
    assert found.degrees_of_freedom == 30
    assert found.probability == pytest.approx(scipy.stats.chi2.sf(expected, 30), rel=1e-5)


@pytest.mark.slow
def test_by_chance_few_move(made):
    pairs = [(again(made, s), again(made, 1000 + s)) for s in range(100)]
    found = [zr.compare_calibrations(*pair) for pair in pairs]
    # 3000 differences, of which 0.27 % are beyond 3: 8, with a deviation of 3.
    assert sum(len(one.moved) for one in found) < 20
    below = np.mean([one.probability < 0.5 for one in found])
    assert below == pytest.approx(0.5, abs=0.2)


def test_what_has_moved_is_named_farthest_first(made):
    sigma = np.sqrt(np.diagonal(made.covariance))
    values = made.values.copy()
    values[[12, 21]] += np.array([10.0, -20.0]) * sigma[[12, 21]]
    found = zr.compare_calibrations(made, replace(made, values=values))
    assert [p.name for p in found.moved] == ["gyro.bias.x", "gyro.matrix.xx"]
    assert found.moved[0].z == pytest.approx(-20.0 / np.sqrt(2.0))
    assert found.probability < 1e-6
    assert found.notes[0].endswith("gyro.bias.x, gyro.matrix.xx")
    assert any("changes with temperature" in note for note in found.notes)


@pytest.mark.parametrize(("mg", "usual"), [(1.5, True), (-2.9, True), (20.0, False)])
def test_the_accelerometers_bias_moves_by_a_milli_g_from_session_to_session(made, mg, usual):
    values = made.values.copy()
    values[BIAS_X] += 1e-3 * mg
    covariance = np.diag(np.where(np.diagonal(made.covariance) > 0.0, 1e-10, 0.0))
    first = replace(made, covariance=covariance)
    found = zr.compare_calibrations(first, replace(first, values=values))
    assert [p.name for p in found.moved] == ["accel.bias.x"]
    assert (found.moved[0].reason == "as far as is usual between sessions") is usual
    assert any("changes by about 1 mg" in note for note in found.notes) is usual


def test_only_what_both_determine_counts(made):
    unknown = made.identifiable.copy()
    unknown[[0, 30]] = False
    first, second = replace(made, identifiable=unknown), again(made, 1)
    found = zr.compare_calibrations(first, second)
    assert found.degrees_of_freedom == 28
    assert np.isnan(found.parameters[0].z)
    assert found.parameters[0].reason == "not identifiable in the first"
    assert zr.compare_calibrations(second, first).parameters[0].reason.endswith("the second")
    assert zr.compare_calibrations(first, first).parameters[0].reason.endswith("either")
    assert found.parameters[1].reason == "fixed"
    assert "5 parameters do not count" in str(found)


def test_true_values_have_nothing_to_compare_with_each_other():
    truth = zr.simulation.simulate_session(4).truth
    found = zr.compare_calibrations(truth, truth)
    assert (found.moved, found.degrees_of_freedom) == ((), 0)
    assert np.isnan(found.probability)
    assert found.notes[0].startswith("no parameter can be compared")


def test_temperature_gravity_and_validity_are_named(made):
    second = again(made, 1, temperature=38.0, gravity=9.78, problems=("two rests are too few",))
    notes = zr.compare_calibrations(replace(made, temperature=21.0), second).notes
    assert any("+17.0 K warmer" in note for note in notes)
    assert any("9.78000 m/s^2" in note for note in notes)
    assert "the second calibration is not valid: two rests are too few" in notes


def test_the_table(made):
    text = str(zr.compare_calibrations(made, again(made, 1)))
    lines = text.split("\n")
    assert lines[0].split() == ["parameter", "first", "second", "difference", "z"]
    assert lines[1].startswith("accel.matrix.xx [%]")
    assert any(line.startswith("gyro.g_sensitivity.zz [deg/s/g]") for line in lines)
    assert max(map(len, lines)) <= 100
    counts = calibration(units=(("unit", "m/s^2"), ("unit", "rad/s")), scales=(1670.0, 7500.0))
    assert "gyro.bias.x [unit]" in str(zr.compare_calibrations(counts, counts))


def test_two_sensors_are_told_to_be_two(made):
    text = str(zr.compare_calibrations(made, calibration(2)))
    assert "- most parameters have changed: are sensor, mounting" in text
    assert text.partition("moved by more than")[2].partition("- most")[0].count(",") == 5
    assert max(map(len, text.split("\n"))) <= 100


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"accel_units": ("m/s^2", "m/s^2")}, "units of the accelerometer must be the same"),
        ({"gyro_units": ("unit", "rad/s")}, "got deg/s to deg/s and unit to rad/s: .* by in_units"),
        ({"frame": "z"}, "got 'x' and 'z': bring both into one by to_frame"),
    ],
)
def test_refusals(made, changes, message):
    with pytest.raises(ValueError, match=message):
        zr.compare_calibrations(made, replace(made, **changes))


def test_two_sessions_of_one_imu_agree():
    """Fits of two simulated records, the second with a gyro whose scale has moved by 0.3 %."""
    truth = zr.simulation.simulate_session(20, seed=1).truth
    matrix, bias = np.array(truth.gyro.matrix), np.radians(np.array(truth.gyro.bias))
    accel = zr.simulation.AccelErrors(
        matrix=np.array(truth.accel.matrix), bias=9.80665 * np.array(truth.accel.bias)
    )

    def fitted(seed, factor):
        gyro = zr.simulation.GyroErrors(
            matrix=matrix @ np.diag(factor), bias=bias, g_sensitivity=0.0
        )
        session = zr.simulation.simulate_session(20, seed=seed, gyro=gyro, accel=accel)
        return zr.calibration.calibrate(session.recording, g_sensitivity=False)

    first, same, other = fitted(2, [1, 1, 1]), fitted(3, [1, 1, 1]), fitted(3, [1.003, 1, 1])
    found = zr.compare_calibrations(first, same)
    assert found.probability > 1e-3
    assert len(found.moved) <= 1
    moved = zr.compare_calibrations(same, other).moved
    assert moved[0].name == "gyro.matrix.xx"
    assert moved[0].difference == pytest.approx(0.003 * matrix[0, 0], rel=0.05)
