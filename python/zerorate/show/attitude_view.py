"""Attitude over time as a self-contained page: body, north, gravity and a time slider."""

from __future__ import annotations

import json
from collections.abc import Iterator
from html import escape
from importlib.resources import files
from typing import Any, Final

import numpy as np

from zerorate._native import __version__
from zerorate.attitude.estimate import AttitudeEstimate
from zerorate.geometry.rotations import about_z, product
from zerorate.metrics.orientation import heading_offset
from zerorate.show.report_document import document
from zerorate.show.style import shorten_source
from zerorate.types import Booleans, Floats, Integers

_MAX_FRAMES: Final = 3000
"""Largest number of frames in the page; 3000 frames need 100 kB to 300 kB."""
_DIGITS: Final = 5
_CONTROLS: Final = (
    '<canvas id="scene" tabindex="0" role="img" aria-label="The body, its axes x, y and z, the '
    'axes of the earth and gravity"></canvas>\n<div class="controls"><button type="button" '
    'id="play" aria-pressed="false">Play</button><input id="time" type="range" min="0" value="0" '
    'step="1" aria-label="Time"><output id="clock" for="time"></output></div>'
)


def attitude_view(estimate: AttitudeEstimate) -> str:
    """Return the page as HTML; it needs no other file and no network."""
    title = f"{shorten_source(estimate.source)}: attitude"
    return document(
        title, _make_body(estimate), style="attitude_view.css", script=_script(estimate)
    )


def _make_body(estimate: AttitudeEstimate) -> Iterator[str]:
    north = "north" if estimate.mag else "the heading at the start"
    sentences = [
        f"Box: the body, longest along x. Green arrow on the ground: {north}. Grey arrow: gravity.",
        "Drag the picture to change the view; arrow keys move the slider.",
    ]
    if estimate.reference is not None:
        sentences.append("Dashed box: the reference. Error: the angle between both.")
    yield _CONTROLS
    yield '<dl id="numbers"></dl>'
    yield f'<p class="about">{escape(" ".join(sentences))} zerorate {__version__}.</p>'


def _script(estimate: AttitudeEstimate) -> str:
    source = files("zerorate.show").joinpath("attitude_view.js").read_text(encoding="utf-8")
    content = json.dumps(_frames(estimate), separators=(",", ":"), allow_nan=False)
    # Escape the data, so that no text can end the script.
    return f"const VIEW = {content.replace('<', chr(92) + 'u003c')};\n{source}"


def _frames(estimate: AttitudeEstimate) -> dict[str, Any]:
    """Return the data of at most `_MAX_FRAMES` samples, including the first and the last."""
    count = min(estimate.n, _MAX_FRAMES)
    rows = np.unique(np.linspace(0, estimate.n - 1, count).round().astype(np.int64))
    columns = {
        "time": estimate.time[rows] - estimate.time[0],
        "q": estimate.quaternion[rows],
        "euler": np.degrees(estimate.euler[rows]),
        "tilt": np.degrees(estimate.tilt_sigma[rows]),
        "heading": np.degrees(estimate.heading_sigma[rows]),
    }
    if estimate.reference is not None:
        reference = _align_reference(estimate)[rows]
        products = np.abs((reference * estimate.quaternion[rows]).sum(axis=1))
        columns["reference"] = reference
        columns["error"] = np.degrees(2.0 * np.arccos(np.minimum(products, 1.0)))
    return {
        "frame": estimate.frame,
        "mag": estimate.mag,
        **{name: _as_list(values) for name, values in columns.items()},
        "rest": _bits(estimate.at_rest, rows),
        "disturbed": _bits(estimate.disturbed, rows),
    }


def _as_list(values: Floats) -> list[Any]:
    """Return rounded numbers for JSON; values that are not finite become null."""
    rounded = np.round(values, _DIGITS)
    finite: Booleans = np.asarray(np.isfinite(rounded).reshape(len(rounded), -1).all(axis=1))
    return [row if finite[i] else None for i, row in enumerate(rounded.tolist())]


def _bits(mask: Any, rows: Integers) -> str:  # noqa: ANN401
    return "".join("1" if one else "0" for one in mask[rows])


def _align_reference(estimate: AttitudeEstimate) -> Floats:
    """Return the reference, rotated about the vertical if the headings are aligned."""
    reference = estimate.reference
    assert reference is not None
    if estimate.compared_heading == "absolute":
        return reference
    known = np.flatnonzero(np.isfinite(reference).all(axis=1))
    used = known[:1] if estimate.compared_heading == "relative" else known
    if not used.size:
        return reference
    offset = heading_offset(estimate.quaternion[used], reference[used])
    return product(about_z(offset), reference)
