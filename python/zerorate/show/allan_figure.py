"""Figures of deviation curves: one panel per axis, with bounds and fits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import ceil, floor
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from zerorate.faults import ArgumentError
from zerorate.noise import AllanResult, NoiseModel
from zerorate.noise.kinds import KINDS
from zerorate.noise.quantities import UNKNOWN, DisplayUnit, choose_display_unit
from zerorate.show.allan_terms import (
    DrawnTerm,
    draw_other_terms,
    fitted_curve,
    select_terms,
    write_list,
)
from zerorate.show.style import (
    BLACK,
    BLUE,
    FONT_PT,
    GREY_TEXT,
    INCHES_PER_MM,
    add_panel,
    new_figure,
    shorten_source,
    style_decades,
    style_panels,
    text_colour,
    write_caption,
    write_in_middle,
    write_title,
)
from zerorate.types import Floats

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.noise.characterise import Characterisation
    from zerorate.tasks.characterise import Characterised

Style = dict[str, Any]

_MAX_COLUMNS: Final = 4
"""Largest number of panels in a row."""

# Sizes in mm.
_SINGLE_PANEL_MM: Final = (110.0, 72.0)
_PANEL_MM: Final = (52.0, 50.0)
_LEFT, _RIGHT, _TOP = 15.0, 3.0, 6.0
_TITLE, _X_LABEL, _CAPTION = 5.0, 8.5, 5.5
_BETWEEN_COLUMNS: Final = 4.0
_LIST_LINE, _LIST_COLUMN, _KEY_LINE, _KEY_LETTER, _KEY_SAMPLE = 2.7, 50.0, 3.1, 1.05, 10.0

_MIN_FREEDOM: Final = 5.0
"""Degrees of freedom below which a deviation is very uncertain."""

_MARGIN_EXPONENT: Final = 0.06

_DEPTH_FACTOR: Final = 3.0
"""Largest ratio of the lowest deviation to a mark that extends the panel; several axes."""

_SINGLE_DEPTH_FACTOR: Final = 500.0
"""The same ratio for a single axis, with room for the marks of random walk and ramp."""

_MAX_BOUND_FACTOR: Final = 5.0
"""Largest ratio of an upper bound to its deviation that the scale includes."""

_SHADE_FACTOR: Final = 4.0
"""Ratio of the longest averaging times of panel and curve above which the rest is shaded."""


def plot_allan(
    result: AllanResult | Sequence[AllanResult],
    models: Sequence[NoiseModel] | NoiseModel | None = None,
    title: str = "",
) -> Figure:
    """Return a figure of deviation curves with bounds, and the models fitted to them.

    Angular rates are in deg/h or deg/s, accelerations in ug or m/s^2. The smallest deviation
    selects the unit.

    `result` has one panel per axis, four in a row. All results need the same kind of deviation and
    unit. `models` has one model per axis. The figure shows the model's deviation. Each identifiable
    term has a mark at the averaging time where IEEE Std 952 reads it. A triangle marks the bound of
    a term that is not identifiable. `title` is the title of the figure; default none.

    ValueError: if the number of models and axes differ, or results differ in kind or unit.
    """
    results = [result] if isinstance(result, AllanResult) else list(result)
    if len({(result_part.kind, result_part.unit) for result_part in results}) != 1:
        listed = (
            ", ".join(f"{result_part.kind} in {result_part.unit}" for result_part in results)
            or "none"
        )
        raise ArgumentError("results", f"must be of one kind and unit, got {listed}")
    axes = [axis for result_part in results for axis in result_part]
    listed_models: Sequence[NoiseModel | None] = (
        [models] if isinstance(models, NoiseModel) else models or [None] * len(axes)
    )
    if len(listed_models) != len(axes):
        raise ArgumentError("models", f"must be one an axis: {len(axes)}, got {len(listed_models)}")
    shown = choose_display_unit(*results)
    pairs = zip(axes, listed_models, strict=True)
    panels = [_Panel.of(axis, model, shown) for axis, model in pairs]
    rows = [panels[i : i + _MAX_COLUMNS] for i in range(0, len(panels), _MAX_COLUMNS)]
    return _draw_figure(rows, title)


def plot_characterised(result: Characterised) -> Figure:
    """Return the figure of all sensors of a recording."""
    return plot_characterisation(result.sensors)


def plot_characterisation(sensors: Sequence[Characterisation]) -> Figure:
    """Return a figure of all sensors of one log: gyros above, accelerometers below.

    It has one panel per axis, as in `plot_allan`, for the first four axes of each sensor. All
    panels of a sensor have the same unit.
    """
    rows = [list(_make_panels(sensor)) for sensor in sensors]
    meta = sensors[0].log.meta
    name = meta.get("sensor") or Path(meta.get("source", "")).name
    axes = max(map(len, rows))
    title = f"How noisy is it? {shorten_source(name, 24 if axes == 1 else 44)}"
    return _draw_figure([row[:_MAX_COLUMNS] for row in rows], title, axes)


def _make_panels(result: Characterisation) -> Iterator[_Panel]:
    shown = choose_display_unit(result.curve)
    for curve, axis, moved in zip(result.curve, result.axes, result.moved, strict=True):
        title = f"{axis.name} (moved?)" if moved else axis.name
        yield _Panel.of(replace(curve, names=(title,)), axis.model, shown)


class _Panel(NamedTuple):
    """Contents of a panel: the curve of an axis, its model if any, and the common unit."""

    curve: AllanResult
    model: NoiseModel | None
    shown: DisplayUnit
    terms: list[DrawnTerm]

    @classmethod
    def of(cls, curve: AllanResult, model: NoiseModel | None, shown: DisplayUnit) -> _Panel:
        """Return the panel of one axis."""
        curve = _select_positive(curve)
        drawn = model is not None and bool(np.any(curve.deviation > 0.0))
        terms = select_terms(model, curve, shown) if model is not None and drawn else []
        return cls(curve, model, shown, terms)

    @property
    def empty(self) -> bool:
        """True if there is no noise to draw."""
        return not np.any(self.curve.deviation > 0.0)

    @property
    def times(self) -> Floats:
        """Averaging times that the panel must show, including the times of the marks."""
        return np.concatenate((self.curve.taus, [term.read_at for term in self.terms]))

    def span(self, depth: float) -> tuple[float, float]:
        """Return the lowest and the highest deviation that the panel must show."""
        curve, factor = self.curve, self.shown.factor
        lowest = np.where(curve.lower > 0.0, curve.lower, np.inf)
        low = float(factor * np.fmin(curve.deviation, lowest).min())
        high = float(factor * np.fmin(curve.upper, _MAX_BOUND_FACTOR * curve.deviation).max())
        marks = [t.height for t in self.terms if t.identifiable and t.height > low / depth]
        return min([low, *marks]), high


def _select_positive(curve: AllanResult) -> AllanResult:
    """Return the positive part of a curve, for a logarithmic scale."""
    positive = curve.deviation > 0.0
    if positive.all() or not positive.any():
        return curve
    names = ("taus", "factors", "deviation", "lower", "upper", "edf", "exponent", "term_count")
    return replace(curve, **{name: getattr(curve, name)[positive] for name in names})


class _Window(NamedTuple):
    """Limits of logarithmic axes."""

    left: float
    right: float
    low: float
    high: float

    @classmethod
    def of(cls, row: list[_Panel]) -> _Window:
        """Return the limits shared by the panels of a row."""
        times = np.concatenate([panel.times for panel in row])
        depth = _DEPTH_FACTOR if len(row) > 1 else _SINGLE_DEPTH_FACTOR
        spans = [panel.span(depth) for panel in row if not panel.empty]
        low = min((span[0] for span in spans), default=0.1)
        high = max((span[1] for span in spans), default=1.0)
        margin = max(high / low, 10.0) ** _MARGIN_EXPONENT
        right = max(times.max(), 10.0 * times.min()) * 1.6
        return cls(times.min() / 1.6, right, low / margin, high * margin)

    def shows(self, term: DrawnTerm) -> bool:
        """Return True if the mark of a term is inside the limits."""
        return self.low < term.height < self.high


def _draw_figure(rows: list[list[_Panel]], title: str, axes_of_log: int = 0) -> Figure:
    """Return the figure: panels, each below its list of terms, then the key and the caption."""
    columns = max(map(len, rows))
    panel = _SINGLE_PANEL_MM if len(rows) == columns == 1 else _PANEL_MM
    list_columns = max(1, floor(panel[0] / _LIST_COLUMN))
    lists = [ceil(max(len(p.terms) for p in row) / list_columns) for row in rows]
    width = _LEFT + _RIGHT + columns * panel[0] + (columns - 1) * _BETWEEN_COLUMNS
    windows = [_Window.of(row) for row in rows]
    key = _make_key(rows, windows)
    key_columns = _count_key_columns(key, width)
    bottom = _CAPTION + _KEY_LINE * ceil(len(key) / key_columns)
    heights = [_TOP + _LIST_LINE * lines + panel[1] + _X_LABEL for lines in lists]
    height = bottom + sum(heights) + (_TITLE if title else 0.0)
    figure = new_figure(width, height)
    for i, (row, window) in enumerate(zip(rows, windows, strict=True)):
        low = bottom + sum(heights[i + 1 :]) + _X_LABEL
        lefts = [_LEFT + j * (panel[0] + _BETWEEN_COLUMNS) for j in range(len(row))]
        panels = [add_panel(figure, left, low, *panel) for left in lefts]
        _draw_row(panels, row, window, list_columns, lists[i])
    if title:
        write_title(figure, title)
    _write_key(figure, key, key_columns, (_CAPTION - 0.5) / height)
    write_caption(figure, _caption(rows, axes_of_log))
    return figure


def _draw_row(
    row: list[Axes], panels: list[_Panel], window: _Window, columns: int, lines: int
) -> None:
    for axes, panel in zip(row, panels, strict=True):
        _draw_panel(axes, panel, window)
        write_list(axes, panel.terms, columns, lines, _LIST_LINE)
        axes.set_title(panel.curve.names[0], pad=(_LIST_LINE * lines + 2.0) * INCHES_PER_MM * 72.0)
    first, shown = panels[0].curve, panels[0].shown
    unit = shown.unit.replace("ug", "µg").replace("^2", "²")
    if first.unit == UNKNOWN:
        unit = unit.replace(UNKNOWN, "unit of the samples", 1)
    row[0].set_ylabel(f"{KINDS[first.kind].title} [{unit}]")
    style_panels(row)
    for axes in row:
        style_decades(axes)
    for axes in row[1:]:
        axes.tick_params(which="both", labelleft=False)


def _caption(rows: list[list[_Panel]], axes_of_log: int) -> str:
    """Return the caption: length and rate of the records, and the shown part."""
    panels = [panel for row in rows for panel in row]
    records = dict.fromkeys((panel.curve.duration, panel.curve.rate) for panel in panels)
    lengths = [f"{duration:,.6g} s at {rate:.4g} Hz" for duration, rate in records]
    sentence = f"Recorded: {', '.join(lengths)}."
    shown = max(map(len, rows))
    if axes_of_log > shown:
        return f"{sentence} Shown are the first {shown} of {axes_of_log} axes."
    return sentence


def _draw_panel(axes: Axes, panel: _Panel, window: _Window) -> None:
    """Draw one axis."""
    curve = panel.curve
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("averaging time [s]")
    axes.set_xlim(window.left, window.right)
    axes.set_ylim(window.low, window.high)
    if panel.empty:
        write_in_middle(axes, "no noise")
        return
    factor = panel.shown.factor
    y, low, high = (factor * values for values in (curve.deviation, curve.lower, curve.upper))
    if np.isfinite(low).any():
        axes.fill_between(curve.taus, low, high, color=BLUE, alpha=0.22, lw=0.0)
    axes.plot(curve.taus, y, **_MEASURED_STYLE)
    if panel.model is not None:
        _draw_model(axes, panel, panel.model, window)
    edge = _last_certain_tau(curve)
    if edge is not None:
        axes.axvline(edge, **_EDGE_STYLE)
    if _is_record_short(panel, window):
        axes.axvspan(1.2 * curve.taus[-1], window.right, **_SHADE_STYLE)


_MEASURED_STYLE: Final[Style] = {"color": BLUE, "lw": 0.6, "marker": "o", "ms": 2.2, "mew": 0.0}
_MODEL_STYLE: Final[Style] = {"color": BLACK, "lw": 0.9, "ls": (0, (4, 2))}
_OTHER_STYLE: Final[Style] = {"color": BLACK, "lw": 0.5, "ls": ":"}
_TERM_STYLE: Final[Style] = {"lw": 0.7}
_BOUND_STYLE: Final[Style] = {"lw": 0.6, "ls": (0, (1, 2))}
_EDGE_STYLE: Final[Style] = {"color": "0.5", "lw": 0.6, "ls": ":"}
_SHADE_STYLE: Final[Style] = {"color": "0.93", "lw": 0.0}
_MARK_STYLE: Final[Style] = {"mew": 0.7, "ls": "none"}


def _draw_model(axes: Axes, panel: _Panel, model: NoiseModel, window: _Window) -> None:
    curve, shown = panel.curve, panel.shown
    axes.plot(curve.taus, fitted_curve(model, curve, shown), **_MODEL_STYLE)
    for line in draw_other_terms(model, curve, shown):
        axes.plot(curve.taus, line, **_OTHER_STYLE)
    for term in panel.terms:
        axes.plot(curve.taus, term.line, color=term.colour, **_line_style(term))
        if window.shows(term):
            axes.plot([term.read_at], [term.height], **_mark_style(term, term.colour))
        _write_letter(axes, term, panel.curve.taus, window)


def _line_style(term: DrawnTerm) -> Style:
    return _TERM_STYLE if term.identifiable else _BOUND_STYLE


def _write_letter(axes: Axes, term: DrawnTerm, taus: Floats, window: _Window) -> None:
    """Write the letter of a term at its mark, or where its line is highest inside the panel.

    The letters help readers who cannot distinguish the colours.
    """
    from matplotlib.patheffects import withStroke

    position = (term.read_at, term.height)
    if not window.shows(term):
        # Two lines rise and may end at the same height, so the letter K comes earlier.
        until = taus[-1] / (4.0 if term.symbol == "K" else 1.0)
        inside = np.flatnonzero((term.line < window.high) & (taus <= until))
        if not inside.size or term.line[inside].max() < window.low:
            return
        highest = inside[np.argmax(term.line[inside])]
        position = (taus[highest], term.line[highest])
    # A rising line is at the right of the curve, or is a bound above it: the letter goes outside.
    walk = term.symbol == "K" and not window.shows(term)
    below = np.ptp(np.log(term.line)) < 1.0 or (walk and term.identifiable)
    left = position[0] >= taus[-1] or (walk and not term.identifiable)
    axes.annotate(
        term.symbol,
        position,
        (-2.5 if left else 2.5, -7.0 if below else 2.0),
        textcoords="offset points",
        ha="right" if left else "left",
        size=FONT_PT - 0.8,
        color=text_colour(term.colour),
        path_effects=[withStroke(linewidth=1.5, foreground="white")],
    )


def _mark_style(term: DrawnTerm, colour: str) -> Style:
    face = colour if term.inside else "white"
    if term.identifiable:
        return {"marker": "D", "ms": 3.0, "color": colour, "mfc": face, **_MARK_STYLE}
    return {"marker": "v", "ms": 3.6, "color": colour, "mfc": face, **_MARK_STYLE}


def _last_certain_tau(curve: AllanResult) -> float | None:
    """Return the longest averaging time with enough degrees of freedom."""
    uncertain = np.flatnonzero(~(curve.edf >= _MIN_FREEDOM))
    if uncertain.size == 0 or uncertain[0] == 0:
        return None
    return float(np.sqrt(curve.taus[uncertain[0] - 1] * curve.taus[uncertain[0]]))


def _is_record_short(panel: _Panel, window: _Window) -> bool:
    return not panel.empty and bool(_SHADE_FACTOR * panel.curve.taus[-1] < window.right)


def _make_key(rows: list[list[_Panel]], windows: list[_Window]) -> list[tuple[Artist, str]]:
    """Return samples of the drawn lines, with their meanings."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    pairs = [(p, w) for row, w in zip(rows, windows, strict=True) for p in row if not p.empty]
    terms = [term for panel, _ in pairs for term in panel.terms]
    marks = [term for panel, window in pairs for term in panel.terms if window.shows(term)]
    key: list[tuple[Artist, str]] = []

    def add(label: str, style: Style) -> None:
        key.append((Line2D([], [], **{"color": GREY_TEXT, **style}), label))

    if pairs:
        add("measured", _MEASURED_STYLE)
    if any(np.isfinite(panel.curve.lower).any() for panel, _ in pairs):
        confidence = 100.0 * pairs[0][0].curve.confidence
        key.append((Patch(color=BLUE, alpha=0.22, lw=0.0), f"{confidence:.0f} % bounds"))
    if any(panel.model is not None for panel, _ in pairs):
        add("model", _MODEL_STYLE)
    if any(term.identifiable for term in terms):
        add("one term of the model", _TERM_STYLE)
    if any(not term.identifiable for term in terms):
        add("not identifiable: 95 % bound", _BOUND_STYLE)
    if any(panel.model is not None and _has_other_terms(panel.model) for panel, _ in pairs):
        add("Markov noise or sine", _OTHER_STYLE)
    labels = {
        (True, True): "read here (IEEE Std 952)",
        (True, False): "read here, outside the record",
        (False, True): "bound, read here",
        (False, False): "bound, read outside the record",
    }
    for mark in {(term.identifiable, term.inside): term for term in marks}.values():
        add(labels[mark.identifiable, mark.inside], _mark_style(mark, GREY_TEXT))
    if any(_last_certain_tau(panel.curve) is not None for panel, _ in pairs):
        add(f"right of it: below {_MIN_FREEDOM:g} degrees of freedom", _EDGE_STYLE)
    if any(_is_record_short(panel, window) for panel, window in pairs):
        key.append((Patch(**_SHADE_STYLE), "record too short"))
    return key


def _has_other_terms(model: NoiseModel) -> bool:
    return bool(model.markov or model.sinusoid)


def _count_key_columns(key: list[tuple[Artist, str]], width: float) -> int:
    """Return the number of key entries that fit next to each other into a width in mm."""
    longest = max((len(label) for _, label in key), default=1)
    return max(1, min(len(key), floor(width / (_KEY_LETTER * longest + _KEY_SAMPLE))))


def _write_key(figure: Figure, key: list[tuple[Artist, str]], columns: int, bottom: float) -> None:
    if not key:
        return
    handles, labels = zip(*key, strict=True)
    figure.legend(
        handles,
        labels,
        loc="lower center",
        bbox_to_anchor=(0.5, bottom),
        ncols=columns,
        fontsize=FONT_PT - 0.8,
        frameon=False,
        handlelength=2.2,
        labelspacing=0.25,
        borderpad=0.0,
        borderaxespad=0.0,
        columnspacing=1.5,
    )
