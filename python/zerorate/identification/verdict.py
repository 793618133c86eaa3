"""The outcome of a statistical test."""

from dataclasses import dataclass
from typing import Final, Literal

TWO_SIDED_95: Final = 1.959963984540054
"""Standard deviations of a normal distribution with 5 % outside, on both sides together."""


@dataclass(frozen=True)
class Verdict:
    """A hypothesis, accepted or rejected at 5 %.

    Attributes
    ----------
    name : str
        Of the test.
    hypothesis : str
        The tested hypothesis, a short phrase.
    statistic : float
        Statistic of the test.
    p_value : float
        Probability of a statistic at least as extreme if the hypothesis holds.
    lower, upper : float
        The hypothesis is accepted for lower < statistic <= upper; infinite on the side where no
        statistic is too far.
    accepted : bool
        True if the hypothesis is accepted.
    n : int
        Number of samples used.
    p_bound : {"", "<", ">"}
        Beyond the published table: the probability is less, or greater, than `p_value`.
    note : str
        A warning, or empty.

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
