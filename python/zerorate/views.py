"""Tables, figures and pages of results, found by the class of the result.

The modules that show results register their functions here. Classes of results know nothing about
them.
"""

from __future__ import annotations

import os
from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import partial
from html import escape
from importlib import import_module
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final, NamedTuple

if TYPE_CHECKING:
    import numpy.typing as npt
    import pandas  # type: ignore[import-untyped]
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "FigureError",
    "OneArray",
    "Result",
    "Shown",
    "Tabular",
    "View",
    "add_registrar",
    "collect_figure_faults",
    "figure_of",
    "html_of",
    "is_undrawn",
    "page_of",
    "register",
    "report_figure_faults",
    "save_figure",
    "table_of",
]


class View(NamedTuple):
    """Functions for a result's table, figure and page, each as ``"module:name"``.

    `main` is the index of the figure's main panel.
    """

    table: str
    figure: str
    page: str = ""
    main: int = 0


_FIGURE_WIDTH_PX: Final = 380.0
"""Width of a figure in a notebook, pixels."""
_HEIGHT_WEIGHT: Final = 0.55
"""Factor on a figure's height that gives its width: tall figures are shown narrower."""
_TABLE_STYLE: Final = "line-height: 1.25; margin: 0; overflow-x: auto"
_FIGURE_STYLE: Final = "max-width: 100%; height: auto; background: white"
_ROW_STYLE: Final = "display: flex; flex-wrap: wrap; gap: 1.5em; align-items: flex-start"

_VIEWS: dict[str, View] = {}
_REGISTRARS: list[str] = []
_COLUMN_MAKERS: list[str] = []
_PANEL_DRAWERS: list[str] = []


def add_registrar(module: str) -> None:
    """Add a module that registers views; it is imported when the first view is requested."""
    _REGISTRARS.append(module)


def register(package: str, views: Mapping[str, View], columns: str, panels: str) -> None:
    """Register the views of a package's results, with ``"module.Class"`` as key.

    Nothing is imported before the first request for a view. `columns` names the function that turns
    a log or result into columns and metadata. `panels` names the function that draws panels of a
    figure into given axes. Both have the form ``"module:name"``.
    """
    _VIEWS.update({f"{package}.{name}": view for name, view in views.items()})
    _COLUMN_MAKERS[:] = [columns]
    _PANEL_DRAWERS[:] = [panels]


def table_of(result: object, *arguments: object) -> str:
    """Return the table of a result as text; TypeError if its class has none."""
    return str(_load_function(_view_of(result).table)(result, *arguments))


def figure_of(
    result: object, *arguments: object, ax: Axes | Sequence[Axes] | None = None
) -> Figure:
    """Return the figure of a result; if `ax` is given, the figure of these axes.

    Raises
    ------
    ImportError
        If matplotlib (extra ``plot``) is not installed.
    TypeError
        If the class of the result has no figure.
    """
    view = _view_of(result)
    draw = partial(_load_function(view.figure), result, *arguments)
    figure: Figure = (
        draw() if ax is None else _load_function(_PANEL_DRAWERS[0])(draw, ax, view.main)
    )
    return figure


def page_of(result: object, *arguments: object) -> str:
    """Return the page of a result as HTML; TypeError if its class has none."""
    return str(_load_function(_view_of(result).page)(result, *arguments))


def html_of(result: object) -> str:
    """Return the table of a result as HTML, with its small figure if matplotlib is installed."""
    table = f'<pre style="{_TABLE_STYLE}">{escape(table_of(result))}</pre>'
    try:
        return f'<div style="{_ROW_STYLE}">{table}{_image_of(result)}</div>'
    except ImportError:
        return f"<div>{table}</div>"
    except Exception as error:  # The table is shown even if the figure fails.
        return f"<div>{table}<p>The figure could not be drawn: {escape(str(error))}</p></div>"


def _image_of(result: object) -> str:
    """Return the figure of a result as an HTML image."""
    figure = figure_of(result)
    buffer = BytesIO()
    # The image has more pixels than shown, for screens of high resolution.
    width, height = figure.get_size_inches()
    scale = _FIGURE_WIDTH_PX / max(width, height * _HEIGHT_WEIGHT)
    figure.savefig(buffer, format="png", dpi=1.5 * scale)
    data = b64encode(buffer.getvalue()).decode("ascii")
    size = f'width="{width * scale:.0f}" style="{_FIGURE_STYLE}"'
    return f'<img src="data:image/png;base64,{data}" {size} alt="figure">'


def save_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure as PNG, SVG or PDF; the suffix of the path sets the format.

    An existing file is replaced.
    """
    if Path(path).suffix.lower() != ".png":
        figure.savefig(path)
        return
    # Stronger compression takes longer than drawing, and saves little space.
    figure.savefig(path, dpi=figure.dpi, pil_kwargs={"compress_level": 1})


def _view_of(result: object) -> View:
    _import_registrars()
    for base in type(result).__mro__:
        view = _VIEWS.get(f"{base.__module__}.{base.__qualname__}")
        if view is not None:
            return view
    raise TypeError(f"nothing is registered that shows a {type(result).__name__}")


def _import_registrars() -> None:
    while _REGISTRARS:
        import_module(_REGISTRARS.pop())


def _load_function(target: str) -> Any:  # noqa: ANN401
    module, _, name = target.partition(":")
    return getattr(import_module(module), name)


class FigureError(Exception):
    """Error for a figure that could not be drawn; all other files were written.

    Parameters
    ----------
    path : path
        File of the figure.
    error : Exception
        Error raised by the drawing.
    """

    def __init__(self, path: os.PathLike[str], error: Exception) -> None:
        """Build the message."""
        self.path = os.fspath(path)
        reason = " ".join(str(error).split()) or type(error).__name__
        super().__init__(f"{self.path} could not be drawn: {reason}; all other files were written")


_FIGURE_FAULTS: ContextVar[list[FigureError] | None] = ContextVar("figure_faults", default=None)


@contextmanager
def collect_figure_faults() -> Iterator[list[FigureError]]:
    """Collect the errors of figures within ``with``; the body continues without them."""
    faults: list[FigureError] = []
    token = _FIGURE_FAULTS.set(faults)
    try:
        yield faults
    finally:
        _FIGURE_FAULTS.reset(token)


def report_figure_faults(faults: Sequence[FigureError]) -> None:
    """Pass errors of figures to `collect_figure_faults`, or else raise the first error."""
    collected = _FIGURE_FAULTS.get()
    if collected is not None:
        collected.extend(faults)
    elif faults:
        raise faults[0]


def is_undrawn(path: str | os.PathLike[str]) -> bool:
    """Return True if `collect_figure_faults` has an error for the figure of this path."""
    return any(fault.path == os.fspath(path) for fault in _FIGURE_FAULTS.get() or ())


class Tabular:
    """A log or result that converts to a table for Arrow, pandas, polars and DuckDB."""

    __slots__ = ()

    def to_arrow(self) -> Any:  # noqa: ANN401
        """Return the columns as a ``pyarrow.Table``; ImportError without pyarrow (extra ``io``).

        A log gives one row per sample, with its time in ``time_s``. A result with samples gives the
        rows of its ``to_log()``. Any other result gives one row per axis, finding, parameter or
        averaging time. Empty cells are null.

        Examples
        --------
        >>> import zerorate as zr
        >>> log = zr.simulate_motion("hand", duration=2.0).recording()["gyro"]
        >>> log.to_arrow().column_names
        ['time_s', 'gyro_x_radps', 'gyro_y_radps', 'gyro_z_radps']
        """
        pyarrow = _load_function("zerorate.io.readers.arrow:import_pyarrow")("to_arrow()")
        columns, metadata = _columns_of(self)
        return pyarrow.table(columns).replace_schema_metadata(metadata or None)

    def to_pandas(self) -> pandas.DataFrame:
        """Return the rows of `to_arrow` as a data frame; ImportError without pandas."""
        import pandas

        return pandas.DataFrame(_columns_of(self)[0])

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        """Return the table of `to_arrow` as an Arrow capsule, for ``polars.from_arrow(x)``."""
        return self.to_arrow().__arrow_c_stream__(requested_schema)


def _columns_of(tabular: object) -> tuple[dict[str, Any], dict[str, str]]:
    parts: tuple[dict[str, Any], dict[str, str]]
    _import_registrars()
    parts = _load_function(_COLUMN_MAKERS[0])(tabular)
    return parts


class Shown(Tabular):
    """A log or result that has a table and a figure, and shows both in notebooks."""

    __slots__ = ()

    def table(self) -> str:
        """Return the table as text."""
        return table_of(self)

    def plot(self, *, ax: Axes | Sequence[Axes] | None = None) -> Figure:
        """Return the figure; ImportError without matplotlib (extra ``plot``).

        Parameters
        ----------
        ax : matplotlib Axes, or a sequence of them, optional
            Axes for the main panel; the figure of these axes is returned. Further axes get the
            following panels. Text is scaled to matplotlib's ``font.size``.
        """
        return figure_of(self, ax=ax)

    def _repr_html_(self) -> str:
        """Return the table and a small figure as HTML for a notebook."""
        return html_of(self)


class OneArray:
    """A log or result that ``numpy.asarray(x)`` converts to one array."""

    __slots__ = ()
    _array_field: ClassVar[str]

    def __array__(
        self, dtype: npt.DTypeLike | None = None, copy: bool | None = None
    ) -> npt.NDArray[Any]:
        """Return the array for ``numpy.asarray``; a copy only on request."""
        import numpy as np

        return np.array(getattr(self, self._array_field), dtype=dtype, copy=copy)


class Result(Shown):
    """A result of a task. Each has `table`, `plot`, `save`, `to_arrow` and a text (`str`)."""

    __slots__ = ()

    def save(
        self,
        output: str | os.PathLike[str] = ".",
        *,
        force: bool = False,
        figure: bool = True,
        format: str | None = None,
        figure_format: str | None = None,
        **choices: Any,  # noqa: ANN401
    ) -> list[Path]:
        """Write the files of this result, as its command does; on an error, no file.

        Parameters
        ----------
        output : str or path
            Folder for the files, or the name of one file. A missing folder is created.
        force : bool
            Replace existing files. Default False.
        figure : bool
            Draw the figure. Default True.
        format : str, optional
            File format of a log: parquet, csv, npz, mcap or gcsv. Default: the suffix of `output`,
            or parquet.
        figure_format : str, optional
            Format of figures: png, svg or pdf. Default: the suffix of `output`, or png.
        **choices
            Further options of the command, such as ``tum=True``.

        Returns
        -------
        list of Path
            Paths of the files; the log is first.

        Raises
        ------
        OSError
            If a file exists (without `force`) or cannot be written. No partial files remain.
        ValueError
            If `output` names a file of a wrong format.
        TypeError
            If results of this class cannot be saved.
        """
        paths: list[Path] = _load_function("zerorate.tasks.saving:save")(
            self,
            output,
            force=force,
            figure=figure,
            format=format,
            figure_format=figure_format,
            **choices,
        )
        return paths

    def __str__(self) -> str:
        """Return the table as text."""
        return self.table()
