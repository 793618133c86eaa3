"""The figure of a replay; it needs matplotlib, which is imported when a figure is drawn."""

from zerorate.plotting.figure import plot_replay, save_figure

__all__ = ["plot_replay", "save_figure"]
