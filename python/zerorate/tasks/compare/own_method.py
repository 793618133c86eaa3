"""Methods of the user: import, calls and checks."""

import re
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from zerorate.types import Floats

_NAME: Final = re.compile(r"[\w.-]+")
_SYNTAX_HINT: Final = "expected NAME=MODULE:FUNCTION, as in mine=my_filter:bias"

_MAX_RELATIVE_DIFFERENCE: Final = 1e-6
"""Largest difference of equal runs, relative to the largest sample; functions may use float32."""


class MethodError(RuntimeError):
    """Error for a method of the user that fails or does not return a bias for every sample."""


@dataclass(frozen=True)
class OwnMethod:
    """A method of the user with a name, to compare with methods of the package.

    Attributes
    ----------
    name : str
        Name in the tables: letters, digits, and ``_``, ``-``, ``.``.
    call : callable
        A function of the samples of one axis, shape (n,), and the sampling rate, Hz. Samples are in
        rad/s, or in the log's unit if it is no known rate; NaN marks missing samples. The function
        returns the bias after each sample, shape (n,), finite. Or a class: ``call(rate)`` makes an
        object for each axis, and the object's ``update(sample)`` returns the bias after this
        sample.

    Raises
    ------
    ValueError
        If the name has other characters, or a class has no ``update``.
    TypeError
        If `call` cannot be called.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.tasks.compare import OwnMethod
    >>> own = OwnMethod("running", lambda z, rate: np.cumsum(z) / np.arange(1, len(z) + 1))
    >>> z = np.array([1.0, 3.0, 5.0])
    >>> own.run(z, 100.0), own.is_causal(z, own.run(z, 100.0), 100.0)
    (array([1., 2., 3.]), True)
    """

    name: str
    call: Callable[..., Any]

    def __post_init__(self) -> None:
        """Raise an error if the object cannot be a method."""
        if not _NAME.fullmatch(self.name):
            raise ValueError(
                f"a method's name is made of letters, digits, _, - and ., got {self.name!r}; "
                "OwnMethod(name, function) gives a function another"
            )
        if not callable(self.call):
            kind = type(self.call).__name__
            raise TypeError(f"{self.name} must be a function or a class, got {kind}")
        if self._is_class and not callable(getattr(self.call, "update", None)):
            raise ValueError(f"{self.name}: the class {self.call.__name__} has no method update")

    @classmethod
    def parse(cls, text: str) -> "OwnMethod":
        """Return the method from a text ``NAME=MODULE:FUNCTION``; its module is imported.

        Raises
        ------
        ValueError
            If the text is not ``NAME=MODULE:FUNCTION``. If the module cannot be imported, or has no
            such function.
        """
        name, _, target = text.partition("=")
        module, _, attribute = target.partition(":")
        if not (name and module and attribute.isidentifier()):
            raise ValueError(f"{text!r} is no method, {_SYNTAX_HINT}")
        if module.endswith(".py"):
            raise ValueError(f"{text!r} names a file, expected {name}={module[:-3]}:{attribute}")
        loaded = _import_module(name, module)
        if not hasattr(loaded, attribute):
            raise ValueError(f"{name}: the module {module} has no {attribute!r}")
        try:
            return cls(name, getattr(loaded, attribute))
        except TypeError as error:
            raise ValueError(str(error)) from None

    def run(self, z: Floats, rate: float) -> Floats:
        """Return the bias after each sample of one axis, shape (n,).

        Raises
        ------
        MethodError
            If the method fails, or does not return a finite number for each sample.
        """
        # The method gets a copy, which it may change.
        output = self._call_method(z.copy(), rate)
        try:
            bias = np.asarray(output)
        except ValueError:
            raise MethodError(f"{self.name} must return one number a sample") from None
        self._check(bias, z)
        return bias.astype(np.float64)

    def is_causal(self, z: Floats, bias: Floats, rate: float) -> bool:
        """Return True if the output for the first half does not depend on the second half.

        A class is causal, because it processes one sample after the other.
        """
        if self._is_class:
            return True
        half = z.size // 2
        with prefix_errors("its first half alone"):
            alone = self.run(z[:half], rate)
        difference = np.abs(alone - bias[:half]).max(initial=0.0)
        largest = np.abs(z[np.isfinite(z)]).max(initial=0.0)
        return bool(difference <= _MAX_RELATIVE_DIFFERENCE * largest)

    @property
    def _is_class(self) -> bool:
        return isinstance(self.call, type)

    def _call_method(self, z: Floats, rate: float) -> Any:  # noqa: ANN401
        try:
            if not self._is_class:
                return self.call(z, rate)
            update = self.call(rate).update
            return [update(sample) for sample in z.tolist()]
        except Exception as error:
            raise MethodError(f"{self.name} failed: {_describe_error(error)}") from error

    def _check(self, bias: npt.NDArray[Any], z: Floats) -> None:
        if bias.shape != z.shape:
            raise MethodError(
                f"{self.name} must return one number a sample, an array of shape {z.shape}, got "
                f"{bias.shape}"
            )
        if bias.dtype.kind not in "fiu":
            raise MethodError(f"{self.name} must return real numbers, got type {bias.dtype}")
        wrong = np.flatnonzero(~np.isfinite(bias))
        if wrong.size:
            first = wrong[0]
            missing = "" if np.isfinite(z[first]) else ", where the sample is missing"
            raise MethodError(
                f"{self.name} must return finite numbers, got {bias[first]} for sample {first}"
                f"{missing}"
            )


@contextmanager
def prefix_errors(subject: str) -> Iterator[None]:
    """Add the name of the measured method to the text of a `MethodError`."""
    try:
        yield
    except MethodError as error:
        raise MethodError(f"{subject}: {error}") from error.__cause__


def _import_module(name: str, module: str) -> object:
    try:
        return import_module(module)
    except (Exception, SystemExit) as error:
        if isinstance(error, ModuleNotFoundError) and error.name == module:
            raise ValueError(
                f"{name}: there is no module {module!r}, neither in this folder nor installed"
            ) from None
        raise ValueError(
            f"{name}: {module} cannot be imported: {_describe_error(error)}"
        ) from error


def _describe_error(error: BaseException) -> str:
    """Return an error in one line, with its position in the user's file."""
    text = " ".join(f"{type(error).__name__}: {error}".split()).removesuffix(":")
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if _is_user_frame(frame)]
    if not frames:
        return text
    last = [frame for frame in frames if frame.filename == frames[0].filename][-1]
    return f"{text} ({last.filename}, line {last.lineno})"


def _is_user_frame(frame: traceback.FrameSummary) -> bool:
    ours = (__file__, import_module.__code__.co_filename)
    return frame.filename not in ours and not frame.filename.startswith("<frozen")
