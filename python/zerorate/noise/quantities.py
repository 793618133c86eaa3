"""What each coefficient is called, and its units, for gyros and for accelerometers."""

from typing import Final, Literal, NamedTuple

__all__ = ["TERMS", "Quantity", "Term", "term_of"]

Quantity = Literal["angular rate", "acceleration"]


class Term(NamedTuple):
    """A coefficient of the model: its field, its name, its SI unit and the one it is shown in."""

    field: str
    name: str
    unit: str
    shown: str


TERMS: Final[dict[Quantity, tuple[Term, ...]]] = {
    "angular rate": (
        Term("quantization", "quantization", "rad", "arcsec"),
        Term("angle_random_walk", "angle random walk", "rad/s/sqrt(Hz)", "deg/sqrt(h)"),
        Term("bias_instability", "bias instability", "rad/s", "deg/h"),
        Term("rate_random_walk", "rate random walk", "rad/s^2/sqrt(Hz)", "deg/h/sqrt(h)"),
        Term("rate_ramp", "rate ramp", "rad/s^2", "deg/h^2"),
    ),
    "acceleration": (
        Term("quantization", "quantization", "m/s", "m/s"),
        Term("angle_random_walk", "velocity random walk", "m/s^2/sqrt(Hz)", "m/s/sqrt(h)"),
        Term("bias_instability", "bias instability", "m/s^2", "ug"),
        Term("rate_random_walk", "acceleration random walk", "m/s^3/sqrt(Hz)", "ug/sqrt(h)"),
        Term("rate_ramp", "acceleration ramp", "m/s^3", "ug/h"),
    ),
}


def term_of(quantity: Quantity, field: str) -> Term:
    """Return the term of a field of the model."""
    return next(term for term in TERMS[quantity] if term.field == field)
