"""Deviation curve with its bounds, its axes and its fits."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
import numpy.typing as npt

from zerorate.noise.coefficient import Coefficient
from zerorate.noise.curve_fit import Curve, curve_fit, polynomial_fit
from zerorate.noise.fit import FittedModel, coefficient_of
from zerorate.noise.freedom import reflection_bias
from zerorate.noise.kinds import KINDS, Kind
from zerorate.noise.low_pass import Filtered, band_fields, process_of
from zerorate.noise.motion_check import Doubt
from zerorate.noise.processes import TERMS, check_frequencies, check_terms, check_times
from zerorate.noise.quantities import UNKNOWN, si_unit
from zerorate.noise.records import power_of_two

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

from zerorate.types import Floats, Integers
from zerorate.views import Result, figure_of

# More averaging times per octave add nearly no information.
_TAUS_PER_OCTAVE: Final = 4
_MIN_TAUS: Final = 5
_PLAIN_KINDS: Final = {"totdev": "oadev", "mtotdev": "mdev", "ttotdev": "mdev", "htotdev": "ohdev"}
_KINDS_WITHOUT_MODEL: Final = ("theo1", "pdev")


@dataclass(frozen=True, eq=False)
class AllanResult(Result):
    """Deviations of a record at a number of averaging times.

    Arrays "by axis" have shape (t,) for a record of one axis and (t, k) for k axes.

    Attributes
    ----------
    kind : str
        Kind of deviation.
    taus : ndarray, shape (t,)
        Averaging times in s.
    deviation : ndarray, by axis
        Deviation in `unit`, for time deviations in `unit` times s; NaN if gaps leave no term.
    lower, upper : ndarray, by axis
        Bounds of the true deviation, for the probability `confidence`.
    edf : ndarray, by axis
        Equivalent degrees of freedom of the squared deviation.
    exponent : ndarray of int, by axis
        Noise type: exponent alpha of the density of the rate, proportional to f^alpha. 2 is
        quantisation, 0 white noise (angle random walk), -1 flicker noise (bias instability), -2
        rate random walk.
    term_count : ndarray of int, by axis
        Number of terms in the mean of each deviation.
    factors : ndarray of int, shape (t,)
        Averaging times in samples. For Thêo1 these times are divided by 0.75.
    rate : float
        Samples per second, Hz.
    n : int
        Number of samples of the record, including missing samples.
    unit : str
        Unit of the record; ``"unit"`` if it is unknown.
    names : tuple of str
        One name per axis.
    confidence : float
        Probability that the true deviation lies between the bounds.
    notes : tuple of str
        Changes to the input and warnings, one sentence each.
    doubts : tuple of Doubt
        For each axis, the reason not to trust its noise: the sensor moved, or the record is shorter
        than 21 s. Exports of a doubtful axis raise an error.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> z = np.random.default_rng(1).standard_normal((20_000, 2))
    >>> r = zr.allan(z, rate=100.0, unit="deg/s")
    >>> r.deviation.shape == (len(r.taus), 2), r.axis(0).names, r.duration
    (True, ('axis 1',), 200.0)
    >>> r.exponent[2].tolist()  # white noise
    [0, 0]
    """

    kind: str
    taus: Floats
    deviation: Floats
    lower: Floats
    upper: Floats
    edf: Floats
    exponent: Integers
    term_count: Integers
    factors: Integers
    rate: float
    n: int
    unit: str
    names: tuple[str, ...]
    confidence: float
    notes: tuple[str, ...] = ()
    doubts: tuple[Doubt, ...] = ()

    def __repr__(self) -> str:
        """Return kind, averaging times, unit and names."""
        unit = "the unit of the samples" if self.unit == UNKNOWN else self.unit
        return (
            f"AllanResult({self.kind} in {unit} at {self.taus.size} averaging times, "
            f"{self.taus[0]:g} to {self.taus[-1]:g} s: {', '.join(self.names)})"
        )

    @property
    def duration(self) -> float:
        """Length of the record in s."""
        return self.n / self.rate

    @property
    def axes(self) -> tuple[AllanResult, ...]:
        """All axes as separate results, with arrays of shape (t,)."""
        return tuple(self.axis(i) for i in range(len(self.names)))

    def axis(self, which: int | str) -> AllanResult:
        """Return the result of one axis, by index or name.

        Raises
        ------
        ValueError
            If the record does not have this axis.
        """
        if which not in (*range(len(self.names)), *self.names):
            raise ValueError(f"there is no axis {which!r}; there are {', '.join(self.names)}")
        i = self.names.index(which) if isinstance(which, str) else which
        arrays = {
            name: getattr(self, name).reshape(self.taus.size, -1)[:, i]
            for name in ("deviation", "lower", "upper", "edf", "exponent", "term_count")
        }
        return replace(self, names=(self.names[i],), doubts=self.doubts[i : i + 1], **arrays)

    def fit(
        self,
        method: Literal["curve", "polynomial"] = "curve",
        *,
        terms: Sequence[str] = TERMS,
        markov: Sequence[float] | int = 0,
        sinusoid: Sequence[float] = (),
    ) -> FittedModel | tuple[FittedModel, ...]:
        """Estimate the noise coefficients.

        Parameters
        ----------
        method : {"curve", "polynomial"}
            "curve": non-negative least squares; variances and covariances of the deviations follow
            from the estimated noise. "polynomial": sigma^2 = sum of A_n tau^n, n from -2 to 2, for
            comparison with the literature.
        terms : sequence of str
            Names of the coefficients to estimate. Default: all five. Hadamard deviations do not
            show a ramp.
        markov : int or sequence of float
            Number of Markov terms to estimate, or their correlation times in s.
        sinusoid : sequence of float
            Frequencies of sines with unknown amplitudes, Hz.

        Returns
        -------
        FittedModel, or tuple of FittedModel
            A `NoiseModel` for each axis. Coefficients are in SI units if the unit of the samples is
            known, otherwise in the unit of the samples. Each coefficient has a standard error, a
            95 % upper bound, and a flag that is True if the record determines it. Coefficients that
            are not in `terms` are unknown.

        Raises
        ------
        ValueError
            If the record is constant or has too few averaging times. If this kind of deviation has
            no model. If an argument is not as described.

        Notes
        -----
        A coefficient is identifiable if its square exceeds twice the standard error of the square.
        If chance does not explain the residuals of the curve, `misfit` is the relative model error
        that explains them. Standard errors include `misfit`.

        A curve does not show a low-pass filter of the sensor. N and B from low-pass filtered
        samples are therefore wrong. Use `zerorate.characterise` or `zerorate.noise.whittle`, which
        detect the filter.
        """
        if len(self.names) > 1:
            models = (
                axis.fit(method, terms=terms, markov=markov, sinusoid=sinusoid)
                for axis in self.axes
            )
            return tuple(model for model in models if isinstance(model, FittedModel))
        factor, quantity = si_unit(self.unit)
        axis = self.axis(0)
        axis._check_fit()
        deviation = axis.rate_deviation
        # The scale keeps squares from overflow and underflow.
        scale = power_of_two(deviation[np.isfinite(deviation)])
        unit = factor * scale, quantity
        doubt = "".join(entry.why for entry in self.doubts)
        if method == "polynomial":
            used = axis._select_taus(_TAUS_PER_OCTAVE * 16)
            model = polynomial_fit(self.taus[used], deviation[used] / scale, unit)
            return replace(model, doubt=doubt)
        if method != "curve":
            raise ValueError(f"unknown method {method!r}; known: curve, polynomial")
        times, frequencies = check_times(markov), check_frequencies(sinusoid, self.rate)
        model = curve_fit(axis._make_curve(scale), check_terms(terms), times, frequencies, unit)
        return replace(model, doubt=doubt)

    def fit_behind(self, filtered: Filtered, markov: int = 0) -> FittedModel:
        """Estimate the noise coefficients of one axis with low-pass filtered samples.

        Parameters
        ----------
        filtered : Filtered
            Filter, estimated from the spectrum of the same record.
        markov : int
            Number of Markov terms to estimate.
        """
        factor, quantity = si_unit(self.unit)
        self._check_fit()
        deviation = self.rate_deviation
        scale = power_of_two(deviation[np.isfinite(deviation)])
        terms = tuple(term for term in TERMS if term != "quantization")
        curve, unit = self._make_curve(scale), (factor * scale, quantity)
        model = curve_fit(curve, terms, markov, (), unit, process_of(filtered))
        # No deviation contains the uncertainty of N that comes from the filter.
        white = coefficient_of(model, "angle_random_walk")
        share = 0.5 * filtered.white.sigma / filtered.white.value
        sigma = math.hypot(white.sigma, share * white.value)
        bound = max(white.upper_bound, white.value + 1.645 * sigma)
        return replace(
            model,
            angle_random_walk=Coefficient(white.value, sigma, white.identifiable, bound),
            doubt="".join(entry.why for entry in self.doubts),
            **band_fields(filtered, self.rate),
        )

    def plot(
        self,
        models: Sequence[FittedModel] | FittedModel | None = None,
        *,
        ax: Axes | Sequence[Axes] | None = None,
    ) -> Figure:
        """Return a figure of the curves, their bounds, and given models.

        A single `ax` shows the first axis of the sensor; several `ax` show one axis each.

        Raises
        ------
        ImportError
            If matplotlib (extra ``plot``) is not installed.
        """
        return figure_of(self, models, ax=ax)

    @property
    def rate_deviation(self) -> Floats:
        """Deviation of the rate, by axis; a time deviation is divided by tau / sqrt(3)."""
        if not KINDS[self.kind].time:
            return self.deviation
        rates: Floats = (self.deviation.T * np.sqrt(3.0) / self.taus).T
        return rates

    def __iter__(self) -> Iterator[AllanResult]:
        """Iterate over the axes."""
        return iter(self.axes)

    def _check_fit(self) -> None:
        where = f" of {self.names[0]}" if self.names[0] else ""
        if self.kind in _KINDS_WITHOUT_MODEL:
            raise ValueError(f"{self.kind} has no model to fit; use oadev, mdev, ohdev or totdev")
        if not np.any(self.deviation > 0.0):
            raise ValueError(f"the record{where} is constant: there is no noise to fit")
        count = self._select_taus(_TAUS_PER_OCTAVE).size
        if count < _MIN_TAUS:
            raise ValueError(
                f"a fit needs {_MIN_TAUS} averaging times with a deviation, the record{where} "
                f"has {count}: it must be longer or have fewer gaps"
            )

    def _select_taus(self, per_octave: int) -> npt.NDArray[np.intp]:
        """Return the indices of the averaging times for a fit."""
        usable = np.flatnonzero((self.deviation > 0.0) & np.isfinite(self.edf))
        indices: list[int] = []
        least, step = 0.0, 2.0 ** (0.999 / per_octave)
        for i in usable:
            if self.factors[i] >= least:
                indices.append(int(i))
                least = self.factors[i] * step
        return np.array(indices, dtype=np.intp)

    def _make_curve(self, scale: float) -> Curve:
        """Return the curve for a fit, without reflection, with deviations in units of `scale`."""
        used, kind = self._select_taus(_TAUS_PER_OCTAVE), KINDS[self.kind]
        m, edf = self.factors[used], self.edf[used]
        variance = (self.rate_deviation[used] / scale) ** 2
        if not kind.total:
            return Curve(kind, kind, self.rate, m, self.term_count[used], variance, edf)
        variance /= reflection_bias(kind, m, self.exponent[used], self.n)
        plain = KINDS[_PLAIN_KINDS[self.kind]]
        return Curve(kind, plain, self.rate, m, _count_plain_terms(plain, m, self.n), variance, edf)


def _count_plain_terms(kind: Kind, m: Integers, n: int) -> Integers:
    return np.maximum(n + 1 - (kind.order + int(kind.modified)) * m, 1)
