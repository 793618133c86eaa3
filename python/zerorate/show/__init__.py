"""Views of results: figures, text tables and HTML pages.

Figures need matplotlib (extra ``plot``). It is imported when a figure is drawn, so functions that
draw raise ImportError without it. They do not use matplotlib's global state. Tables are lines
without a final line end.
"""

from typing import TYPE_CHECKING, Final

from zerorate.lazy import lazy_exports
from zerorate.views import save_figure

if TYPE_CHECKING:
    from zerorate.show.allan_figure import plot_allan, plot_characterisation
    from zerorate.show.allan_table import format_allan, format_allan_notes
    from zerorate.show.array_figure import plot_array
    from zerorate.show.array_table import (
        format_accelerometers,
        format_array,
        format_rotations,
    )
    from zerorate.show.attitude_figure import plot_attitude
    from zerorate.show.attitude_table import format_attitude
    from zerorate.show.calibration_figure import plot_calibration
    from zerorate.show.calibration_table import format_calibration
    from zerorate.show.compare_simulated import format_regret
    from zerorate.show.compare_tables import format_compare
    from zerorate.show.dynamic_figure import plot_dynamic
    from zerorate.show.identify_figure import plot_identification
    from zerorate.show.identify_page import identification_page
    from zerorate.show.identify_tables import format_identify
    from zerorate.show.navigation_figure import plot_outages, plot_track
    from zerorate.show.navigation_table import format_outages, format_track
    from zerorate.show.replay_figure import plot_replay
    from zerorate.show.replay_table import (
        format_bias,
        format_biases,
        format_learned,
        format_notes,
        format_replay,
        format_table,
    )
    from zerorate.show.tables import WIDTH

__all__ = [
    "WIDTH",
    "format_accelerometers",
    "format_allan",
    "format_allan_notes",
    "format_array",
    "format_attitude",
    "format_bias",
    "format_biases",
    "format_calibration",
    "format_compare",
    "format_identify",
    "format_learned",
    "format_notes",
    "format_outages",
    "format_regret",
    "format_replay",
    "format_rotations",
    "format_table",
    "format_track",
    "identification_page",
    "plot_allan",
    "plot_array",
    "plot_attitude",
    "plot_calibration",
    "plot_characterisation",
    "plot_dynamic",
    "plot_identification",
    "plot_outages",
    "plot_replay",
    "plot_track",
    "save_figure",
]

_LAZY_EXPORTS: Final = {
    "allan_figure": "plot_allan plot_characterisation",
    "allan_table": "format_allan format_allan_notes",
    "array_figure": "plot_array",
    "array_table": "format_accelerometers format_array format_rotations",
    "attitude_figure": "plot_attitude",
    "attitude_table": "format_attitude",
    "calibration_figure": "plot_calibration",
    "calibration_table": "format_calibration",
    "compare_simulated": "format_regret",
    "compare_tables": "format_compare",
    "dynamic_figure": "plot_dynamic",
    "identify_figure": "plot_identification",
    "identify_page": "identification_page",
    "identify_tables": "format_identify",
    "navigation_figure": "plot_outages plot_track",
    "navigation_table": "format_outages format_track",
    "replay_figure": "plot_replay",
    "replay_table": (
        "format_bias format_biases format_learned format_notes format_replay format_table"
    ),
    "tables": "WIDTH",
}
if not TYPE_CHECKING:
    __getattr__, __dir__ = lazy_exports(__name__, _LAZY_EXPORTS)
