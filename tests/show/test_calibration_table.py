"""The table of a calibration: what is wrong comes first, and no number without its error."""

import re
from dataclasses import replace

import numpy as np
import pytest

from support.calibrations import COUNTS, INVALID, calibration
from zerorate.calibration.parameters import PARAMETERS
from zerorate.show.calibration_table import describe_verdict, format_calibration
from zerorate.show.tables import WIDTH

MADE = {
    "usual": calibration(rests=5),
    "bare": calibration(),
    "invalid": calibration(rests=3, **INVALID),
    "counts": calibration(units=COUNTS, scales=(1670.0, 7509.0), rests=4),
    "SI": calibration(units=(("m/s^2",) * 2, ("rad/s",) * 2), rests=4),
    "many": calibration(rests=300),
    "symmetric": calibration(rests=5).to_frame("symmetric"),
}


def row(text, label, nth=0):
    """Return the cells of a row by its label, the nth of those in the text."""
    lines = [line for line in text.splitlines() if line.startswith(f"  {label}")]
    return re.split(r"\s{2,}", lines[nth].strip())


@pytest.mark.parametrize("name", MADE)
def test_it_is_no_wider_than_others(name):
    text = str(MADE[name])
    assert text == format_calibration(MADE[name])
    assert max(map(len, text.splitlines())) <= WIDTH
    assert "nan" not in text.lower()


def test_whether_it_is_valid_comes_before_any_number():
    assert str(MADE["usual"]).splitlines()[0] == "Calibration: valid"
    lines = str(MADE["invalid"]).splitlines()
    assert lines[0] == "Calibration: NOT VALID"
    assert [line.removeprefix("- ") for line in lines[2:4]] == list(INVALID["problems"])
    assert "mean nothing" in str(MADE["invalid"])
    assert "mean nothing" not in str(MADE["usual"])
    assert describe_verdict(MADE["usual"]) == "the calibration is valid"
    assert describe_verdict(MADE["invalid"]).endswith("x axis is not identifiable (and 1 more)")


def test_numbers_are_in_the_units_of_people_with_their_errors():
    made = MADE["usual"]
    text = str(made)
    for label, unit, known in (
        ("scale error", "%", 100.0 * (np.array(made.accel.scale) - 1.0)),
        ("bias", "mg", 1e3 * np.array(made.accel.bias)),
    ):
        _, shown, *cells = row(text, label)
        assert shown == unit
        for cell, value in zip(cells, known, strict=True):
            number, error = (float(word) for word in cell.split(" ± "))
            assert abs(number - value) <= error
    assert row(text, "bias", 1)[1] == "deg/s"
    assert row(text, "gyro to accelerometer")[1] == "deg"
    assert row(text, "norm of gravity")[1:] == ["mg", "21.0", "0.310"]
    assert row(text, "gravity propagated")[1:] == ["deg", "1.20", "0.350"]


def test_the_unit_of_the_log_does_not_change_what_is_read():
    """But for the first lines of sensors, which name it."""
    si = MADE["usual"].in_units(gyro="rad/s", accel="m/s^2")
    texts = [re.sub(r"raw in \S+", "", str(one)) for one in (MADE["usual"], si)]
    assert texts[0] == texts[1]


def test_counts_show_their_scale():
    text = str(MADE["counts"])
    assert row(text, "scale")[:2] == ["scale", "raw per m/s^2"]
    assert row(text, "scale", 1)[:2] == ["scale", "raw per rad/s"]
    assert "Gyro, raw unit not known" in text


def test_what_the_record_does_not_determine_has_no_number():
    made = MADE["usual"]
    identifiable = made.identifiable.copy()
    unknown = ("gyro.matrix.yy", "accel.matrix.zx", "gyro.g_sensitivity.xy", "accel.bias.z")
    for name in unknown:
        identifiable[PARAMETERS.index(name)] = False
    text = str(replace(made, identifiable=identifiable))
    assert row(text, "scale error", 1)[3] == "not identifiable"
    assert row(text, "misalignment of z")[2] == "not identifiable"
    assert row(text, "g-sensitivity of x")[3] == "not identifiable"
    assert row(text, "bias")[4] == "not identifiable"


def test_what_was_not_used_and_why():
    text = str(MADE["usual"])
    assert "Made of 5 rests (4 used) and 4 turns (3 used)" in text
    assert row(text, "rest 3")[1:] == ["16.0 to 22.0 s", "not used", "its mean moved by 12 mg"]
    assert row(text, "turn 2")[2:] == ["not used", "31 samples of y are saturated"]
    odd = replace(MADE["many"], rests=[replace(r, reason="odd") for r in MADE["many"].rests])
    assert len(re.findall(r"(?m)^  rest \d+ .* odd$", str(odd))) <= 12
    assert "and 289 more" in str(odd)


def test_advice_and_notes_come_last():
    made = replace(MADE["usual"], advice=("hold -y up for five seconds",), notes=("g assumed",))
    assert str(made).endswith("Advice\n- hold -y up for five seconds\n\nNotes\n- g assumed")


def test_a_gyro_without_g_sensitivity_has_no_rows_of_it():
    values, covariance = MADE["bare"].values.copy(), MADE["bare"].covariance.copy()
    values[24:] = covariance[24:] = covariance[:, 24:] = 0.0
    assert "g-sensitivity" not in str(replace(MADE["bare"], values=values, covariance=covariance))


def test_a_mirrored_gyro_can_be_shown():
    values = MADE["bare"].values.copy()
    values[12:15] *= -1.0
    text = str(replace(MADE["bare"], values=values))
    assert row(text, "gyro to accelerometer")[2:] == ["not identifiable"] * 3


def test_an_axis_that_is_another_has_no_misalignment():
    made = calibration()
    values = made.values.copy()
    values[12:21] = values[12:21].reshape(3, 3)[[1, 0, 2]].ravel()
    text = format_calibration(replace(made, values=values)).partition("Gyro")[2]
    assert [row(text, f"misalignment of {axis}").count("-") for axis in "xyz"] == [2, 2, 0]
