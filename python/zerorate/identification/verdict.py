"""The outcome of a statistical test."""

from dataclasses import dataclass
from typing import Final, Literal

TWO_SIDED_95: Final = 1.959963984540054
"""Deviations of a normal distribution beyond which, on either side, lies one part in 20."""


@dataclass(frozen=True)
class Verdict:
    """A hypothesis, accepted or rejected at 5 %.

    Attributes
    ----------
    name : str
        Of the test.
    hypothesis : str
        What is tested, a short phrase.
    statistic : float
        What the test makes of the record.
    p_value : float
        Probability of a statistic at least as far out if the hypothesis holds.
    lower, upper : float
        The hypothesis is accepted for lower < statistic <= upper; infinite on the side where no
        statistic is too far.
    accepted : bool
        Whether it is.
    n : int
        Samples that were used.
    p_bound : {"", "<", ">"}
        Where the published table ends: the probability is less, or greater, than `p_value`.
    note : str
        What to beware of, a sentence, or nothing.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.identification import kpss
    >>> verdict = kpss(np.random.default_rng(1).standard_normal(10_000))
    >>> verdict.name, verdict.hypothesis, verdict.accepted, verdict.n
    ('KPSS', 'stationary', True, 10000)
    """

    name: str
    hypothesis: str
    statistic: float
    p_value: float
    lower: float
    upper: float
    accepted: bool
    n: int
    p_bound: Literal["", "<", ">"] = ""
    note: str = ""
