"""What a type checker says of the streaming classes is what they return: mypy reads this file."""

from typing import Any, TypeAlias, assert_type

import numpy as np
import numpy.typing as npt

import zerorate as zr

Floats: TypeAlias = npt.NDArray[np.float64]
Flags: TypeAlias = npt.NDArray[np.bool_]


def test_a_single_signal_gives_floats() -> None:
    f = zr.DriftFilter(200.0)
    assert isinstance(assert_type(f.update(0.5), float), float)
    assert isinstance(assert_type(f.bias, float), float)
    assert isinstance(assert_type(f.at_rest, bool), bool)
    assert assert_type(f.process([0.5]), Floats).shape == (1,)
    # A status that there is not would be an error of types.
    assert f.status == "starting"
    assert isinstance(assert_type(zr.WaveletDenoiser(100.0).update(0.0), float), float)


def test_channels_give_arrays() -> None:
    f = zr.DriftFilter(200.0, channels=3)
    assert assert_type(f.update((0.5, 0.4, 0.3)), Floats).shape == (3,)
    assert assert_type(f.at_rest, Flags).all()
    assert assert_type(f.copy(), zr.DriftFilter[Floats, Flags]).status == ["starting"] * 3
    detector = zr.RestDetector(100.0, channels=2)
    assert assert_type(detector.update([0.0, 1.0]), Flags).shape == (2,)


def test_a_tilt_is_a_float_or_an_array() -> None:
    assert isinstance(assert_type(zr.Tilt(100.0).update(0.1, None), float), float)
    kalman = zr.Tilt(100.0, method="kalman", channels=2)
    assert assert_type(kalman.bias, Floats).shape == (2,)


def test_an_annotation_need_not_say_which() -> None:
    def bias_of(f: zr.DriftFilter) -> float:
        return float(np.max(assert_type(f.bias, Any)))

    assert bias_of(zr.DriftFilter(200.0)) == bias_of(zr.DriftFilter(200.0, channels=3)) == 0.0


def test_an_attitude_of_one_body_and_of_several() -> None:
    sample = [0.0, 0.0, 9.81]
    one = zr.Attitude(100.0, bias=zr.DriftFilter(100.0, channels=3))
    assert assert_type(one.update(sample, sample), Floats).shape == (4,)
    assert isinstance(assert_type(one.heading, float), float)
    assert isinstance(assert_type(one.at_rest, bool), bool)
    assert one.status == "starting"
    several = zr.Attitude(100.0, frame="ned", channels=2)
    assert assert_type(several.process([[sample] * 2], [[sample] * 2]), Floats).shape == (1, 2, 4)
    assert assert_type(several.tilt_sigma, Floats).shape == (2,)
    assert assert_type(several.disturbed, Flags).shape == (2,)
    told = one.trace([sample], [sample])
    assert assert_type(told["gyro_matrix_sigma"], Floats).shape == (1, 3, 3)
    assert assert_type(told["at_rest"], Flags).shape == (1,)
    assert assert_type(one.copy(), zr.Attitude[float, bool]).method == "auto"


def test_a_log_is_samples_and_none_a_missing_one() -> None:
    log = zr.Log(np.arange(3) / 100.0, 100.0, np.zeros((3, 3)), ("x", "y", "z"), "rad/s")
    assert assert_type(zr.DriftFilter(100.0, channels=3).process(log), Floats).shape == (3, 3)
    assert assert_type(zr.Attitude(100.0).update(None, None), Floats).shape == (4,)
