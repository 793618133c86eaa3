"""Values of options with more than one word or number.

Each function takes the option's flag and the typed text. A text that is not valid is a usage fault.
"""

import re
from collections.abc import Sequence

import numpy as np

from zerorate.cli.errors import UsageFault, require


def parse_words(flag: str, text: str, expected: str = "names") -> list[str]:
    """Return the nonempty words of a comma-separated list."""
    words = [word.strip() for word in text.split(",")]
    if not all(words):
        raise UsageFault(f"{flag} takes {expected} with commas between, got '{text}'")
    return words


def parse_columns(flag: str, text: str) -> list[str | int]:
    """Return the names and indices of a comma-separated list."""
    words = parse_words(flag, text, "names or indices")
    return [int(word) if re.fullmatch("-?[0-9]+", word) else word for word in words]


def parse_column(flag: str, text: str) -> str | int:
    """Return the name or index of one column."""
    columns = parse_columns(flag, text)
    if len(columns) != 1:
        raise UsageFault(f"{flag} takes one column, got '{text}'")
    return columns[0]


def parse_choices(flag: str, text: str, choices: Sequence[str]) -> list[str]:
    """Return the choices named in a comma-separated list, each once."""
    words = [word.strip() for word in text.split(",")]
    for word in words:
        if word not in choices:
            raise UsageFault(f"{flag} takes some of {', '.join(choices)}, got '{word}'")
    return list(dict.fromkeys(words))


def parse_numbers(flag: str, text: str, count: int, expected: str) -> list[float]:
    """Return `count` finite numbers from a comma-separated list."""
    try:
        numbers = [float(word) for word in parse_words(flag, text, expected)]
    except ValueError:
        numbers = []
    if len(numbers) != count or not np.isfinite(numbers).all():
        raise UsageFault(f"{flag} takes {expected} with commas between, got '{text}'")
    return numbers


def parse_fractions(flag: str, text: str, example: str) -> list[float]:
    """Return one or two numbers; each may be a fraction such as ``1/131``."""
    try:
        numbers = [_parse_fraction(word) for word in text.split(",")]
    except (ValueError, ZeroDivisionError):
        numbers = []
    if len(numbers) not in (1, 2):
        raise UsageFault(f"{flag} takes a number such as {example}, got '{text}'")
    return numbers


def _parse_fraction(text: str) -> float:
    number, _, divisor = text.partition("/")
    return float(number) / float(divisor) if divisor else float(number)


def parse_place(flag: str, text: str) -> list[float]:
    """Return a latitude and a longitude, deg."""
    return parse_numbers(flag, text, 2, "latitude and longitude, deg,")


def parse_place_of_field(flag: str, text: str) -> tuple[float, ...]:
    """Return a latitude and longitude, deg, for the model of the earth's field."""
    place = parse_place(flag, text)
    if abs(place[0]) > 90.0 or abs(place[1]) > 360.0:
        raise UsageFault(f"{flag} takes deg, latitude within 90 first, got '{text}'")
    require("pygeomag", "magnetic")
    return tuple(place)


def parse_order(flag: str, text: str) -> tuple[int, int]:
    """Return the two orders in a text such as ``2,1``."""
    p, _, q = (word.strip() for word in text.partition(","))
    if not (p + q).isdecimal() or not (p and q):
        raise UsageFault(f"{flag} takes two numbers p,q such as 2,1, got '{text}'")
    return int(p), int(q)


def parse_number_or_word(flag: str, text: str, word: str) -> float | None:
    """Return the number in a text; None for the given word."""
    if text == word:
        return None
    try:
        return float(text)
    except ValueError:
        raise UsageFault(f"{flag} takes a number or '{word}', got '{text}'") from None


def parse_pair_or_word(flag: str, text: str, words: Sequence[str]) -> tuple[float, float] | str:
    """Return the two numbers of a text such as ``4,0.75``, or an allowed word."""
    if text in words:
        return text
    try:
        first, second = map(float, text.split(","))
    except ValueError:
        listed = " or ".join(f"'{word}'" for word in words)
        raise UsageFault(
            f"{flag} takes two numbers with a comma between or {listed}, got '{text}'"
        ) from None
    return first, second
