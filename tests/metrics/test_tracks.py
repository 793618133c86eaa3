"""Errors of tracks against what evo prints, and what no pair of tracks can be compared by."""

import numpy as np
import pytest

import zerorate as zr
from support.evo_values import both, track
from zerorate.record import LogError

# What `python tests/support/evo_values.py` prints with evo 1.38.1: rmse, mean, median, std, min,
# max.
ATE = {
    "rigid": (
        (
            0.0598143932373,
            0.0579737374274,
            0.0602476172921,
            0.0147243813805,
            0.0144600692752,
            0.0873350271285,
        ),
        (
            2.34859230908,
            2.21345174672,
            2.40873909164,
            0.785186092089,
            0.0415656687224,
            3.37897760284,
        ),
    ),
    "similar": (
        (
            0.0598140121886,
            0.057972663988,
            0.0603400425874,
            0.0147270595937,
            0.0145570482726,
            0.0874019071984,
        ),
        (
            2.34859230908,
            2.21345174672,
            2.40873909164,
            0.785186092089,
            0.0415656687224,
            3.37897760284,
        ),
    ),
    "origin": (
        (0.0775662603003, 0.0729425394933, 0.0695971368092, 0.0263801188255, 0.0, 0.132575272967),
        (2.34785478757, 2.21325310132, 2.40940687260, 0.783538648072, 0.0, 3.33596338525),
    ),
    "none": (
        (2.75538108416, 2.71439816499, 2.73494701437, 0.473463325740, 1.87647771165, 3.45882948495),
        (17.4479718749, 17.3313069337, 17.4095331996, 2.01432929759, 14.3549848170, 20.1149563415),
    ),
}
RPE = {
    (10, "poses", False): (
        34,
        (
            0.103013808988,
            0.0976952810542,
            0.0951569438348,
            0.0326722650266,
            0.0179594498722,
            0.162953003892,
        ),
        (3.18165591239, 2.91952655131, 3.02205153770, 1.26463396328, 0.299978961883, 4.59171695877),
    ),
    (10, "poses", True): (
        333,
        (
            0.104850118897,
            0.100260443349,
            0.103027369135,
            0.0306820946503,
            0.00437510553099,
            0.183203522151,
        ),
        (3.15761544526, 2.90239026364, 3.07979123879, 1.24365029557, 0.146571447409, 4.59657376499),
    ),
    (2.0, "m", False): (
        14,
        (
            0.126656955661,
            0.118081875886,
            0.114059609778,
            0.0458110794969,
            0.0495393167339,
            0.217605112674,
        ),
        (4.02354745621, 3.79260007815, 3.48127941328, 1.34354708871, 1.90714727339, 5.91442564843),
    ),
    (2.0, "m", True): (
        327,
        (
            0.106270090433,
            0.0988093360853,
            0.100432884444,
            0.0391158180677,
            0.0102166360217,
            0.203744247913,
        ),
        (3.73543972016, 3.45620451737, 3.26420606889, 1.41709570498, 0.298986719159, 5.95255279167),
    ),
}
# Twelve digits are written down; the least error of "origin" is rounding.
CLOSE = {"rel": 1e-10, "abs": 1e-13}


@pytest.mark.parametrize("align", ATE)
def test_ate_is_that_of_evo(align):
    found = zr.metrics.ate(*both(), align=align)
    assert found.metres.of == 343
    for printed, statistics in zip(ATE[align], (found.metres, found.degrees), strict=True):
        assert statistics[:6] == pytest.approx(printed, **CLOSE)


@pytest.mark.parametrize("step", RPE)
def test_rpe_is_that_of_evo(step):
    delta, unit, every = step
    found = zr.metrics.rpe(*both(), delta=delta, unit=unit, every=every)
    count, *printed = RPE[step]
    assert found.metres.of == count
    for values, statistics in zip(printed, (found.metres, found.degrees), strict=True):
        assert statistics[:6] == pytest.approx(values, **CLOSE)


def test_a_turn_about_the_vertical_is_found():
    found = zr.metrics.ate(track(turn=0.7, shift=2.0), track(), align="yaw")
    assert found.metres.largest == pytest.approx(0.0, abs=1e-12)
    assert found.turn == pytest.approx([np.cos(-0.35), 0.0, 0.0, np.sin(-0.35)], abs=1e-12)
    steps = zr.metrics.rpe(track(shift=2.0), track(), delta=1.0, unit="s")
    assert steps.time[:3] == pytest.approx([1.0, 2.0, 3.0])
    assert steps.metres.largest == pytest.approx(0.0, abs=1e-12)


def test_what_cannot_be_compared_is_refused():
    one, other = track(), track()
    away = zr.record.Poses(one.time + 100.0, one.position, one.quaternion)
    with pytest.raises(ValueError, match=r"no poses are within 0\.01 s .* 100\.000 to 119\.950 s"):
        zr.metrics.ate(away, other)
    line = zr.record.Poses(one.time, one.time[:, None] * [1.0, 0.0, 0.0], one.quaternion)
    with pytest.raises(ValueError, match="lie on a line"):
        zr.metrics.ate(line, line)
    with pytest.raises(ValueError, match="align must be one of"):
        zr.metrics.ate(one, other, align="so")
    with pytest.raises(ValueError, match="no step of 1e\\+06 m"):
        zr.metrics.rpe(one, other, delta=1e6, unit="m")
    with pytest.raises(ValueError, match="whole number of poses"):
        zr.metrics.rpe(one, other, delta=1.5)


class TestPoses:
    def test_tum_there_and_back(self, tmp_path):
        poses = track(n=20)
        poses.to_tum(tmp_path / "a.tum")
        again = zr.io.read_poses(tmp_path / "a.tum")
        for name in ("time", "position", "quaternion"):
            np.testing.assert_allclose(getattr(again, name), getattr(poses, name), atol=1e-6)

    def test_euroc(self, tmp_path):
        path = tmp_path / "data.csv"
        path.write_text(
            "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x []\n"
            "1403636580838555648,4.68,-1.78,0.78,0.5,-0.1,-0.8,0.1,9,9,9\n"
            "1403636580843555328,4.68,-1.78,0.78,0.5,-0.1,-0.8,0.1,9,9,9\n"
        )
        poses = zr.io.read_poses(path)
        assert np.diff(poses.time) == pytest.approx(0.005, abs=1e-6)
        assert poses.quaternion[0] * np.sqrt(0.91) == pytest.approx([0.5, -0.1, -0.8, 0.1])

    def test_between_two(self):
        attitudes = [[1, 0, 0, 0], [0, 0, 0, 1], [0, 0, 0, 1]]
        turned = zr.record.Poses([0.0, 1.0, 3.0], np.eye(3), attitudes)
        found = turned.at(np.array([-1.0, 0.25, 1.0, 2.0]), max_gap=1.5)
        assert np.isnan(found.quaternion[[0, 3]]).all()
        half = np.pi / 8.0
        assert found.quaternion[1] == pytest.approx([np.cos(half), 0, 0, np.sin(half)])
        assert found.position[1] == pytest.approx([0.75, 0.25, 0.0])
        assert found.quaternion[2] == pytest.approx([0, 0, 0, 1])

    @pytest.mark.parametrize("text", ["", "a,b\n", "1 2 3\n", "1 2 3 4 5 6 7 x\n", "# only\n"])
    def test_what_is_none_is_refused(self, tmp_path, text):
        (tmp_path / "a.txt").write_text(text)
        with pytest.raises(LogError, match="expected TUM's text, 'time x y z qx qy qz qw'"):
            zr.io.read_poses(tmp_path / "a.txt")
