"""Figures; they need matplotlib, which is imported when a figure is drawn."""

from zerorate.show.plotting.allan import plot_allan, plot_characterisation
from zerorate.show.plotting.dynamic import plot_dynamic
from zerorate.show.plotting.figure import plot_replay, save_figure
from zerorate.show.plotting.identify import plot_identification

__all__ = [
    "plot_allan",
    "plot_characterisation",
    "plot_dynamic",
    "plot_identification",
    "plot_replay",
    "save_figure",
]
