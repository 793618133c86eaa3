"""The outcome of a statistical test."""

from dataclasses import dataclass
from typing import Final, Literal

TWO_SIDED_95: Final = 1.959963984540054
"""Two-sided 95 % quantile of the standard normal distribution."""


@dataclass(frozen=True)
class Verdict:
    """Result of a test: the hypothesis is accepted, or rejected at 5 %.

    Attributes
    ----------
    name : str
        Name of the test.
    hypothesis : str
        Tested hypothesis, a short phrase.
    statistic : float
        Statistic of the test.
    p_value : float
        Probability of this or a more extreme statistic if the hypothesis is true.
    lower, upper : float
        The hypothesis is accepted for lower < statistic <= upper. If the test has only one limit,
        the other is infinite.
    accepted : bool
        True if the hypothesis is accepted.
    n : int
        Number of samples used.
    p_bound : {"", "<", ">"}
        "<": the probability is less than `p_value`. ">": it is greater. Empty if the statistic is
        inside the published table.
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
