"""Numbers as people read them."""

import math

import pytest

from zerorate.numerals import format_or_dash, format_with_error, shorten


@pytest.mark.parametrize(
    ("value", "sigma", "text"),
    [
        (2.3083, 0.0451, "2.31 ± 0.05"),
        (33.42, 2.61, "33.4 ± 2.6"),
        (176.9, 40.2, "180 ± 40"),
        (1562.0, 147.0, "1560 ± 150"),
        (3e-5, 2e-6, "3e-05 ± 2e-06"),
        (0.5, 0.0, "0.5000"),
        (-0.002, 0.14, "0.00 ± 0.14"),
    ],
)
def test_a_number_ends_where_its_error_does(value, sigma, text):
    assert format_with_error(value, sigma) == text


@pytest.mark.parametrize(
    ("value", "text"), [(0.12345, "0.123"), (1e5, "100000"), (math.nan, "-"), (-math.inf, "-")]
)
def test_what_is_no_number_is_a_dash(value, text):
    assert format_or_dash(value) == text


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(170.2, 2, "170"), (100.0, 1, "100"), (5.0, 2, "5"), (0.0512, 2, "0.051"), (2e7, 3, "2e+07")],
)
def test_a_number_below_a_million_has_no_exponent(value, digits, text):
    assert shorten(value, digits) == text
