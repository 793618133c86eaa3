"""Options of several commands: log, sensors, reference, written files."""

from pathlib import Path
from typing import Annotated, Final, Literal, TypeAlias

from zerorate.checks.preparation import Clipped
from zerorate.cli.parameters import Argument, Option
from zerorate.cli.reading import PANEL
from zerorate.tasks.saving import FIGURE_FORMATS, LOG_FORMATS

OUTPUT: Final = "Output"
"""Panel of help for the written files."""

EXPORT_PANEL: Final = "Exports for other programs"

RECORDING: Final = (
    "Recording, e.g. csv, parquet, ulg, mcap or bag. Also tsv, txt, npy, npz, arrow, feather, "
    "h5, mat, bin, log, tlog, mp4, bbl, or the folder of a ROS 2 bag."
)

LogArgument: TypeAlias = Annotated[Path, Argument(RECORDING)]

GyroName: TypeAlias = Annotated[
    str | None,
    Option(
        "Gyro to use, if the log has several: gyro, gyro_1. Numbers follow the order of the file.",
        panel=PANEL,
    ),
]
AccelName: TypeAlias = Annotated[
    str | None, Option("Accelerometer to use; default: that of the gyro's device.", panel=PANEL)
]
NoAccel: TypeAlias = Annotated[
    bool,
    Option(
        "Ignore the log's accelerometer. By default no bias is learned while the accelerometer "
        "shows motion.",
        panel=PANEL,
    ),
]
CalibrationOption: TypeAlias = Annotated[
    Path | None,
    Option(
        "Apply this calibration first (zerorate calibrate).",
        metavar="CAL",
        panel=PANEL,
    ),
]
Fix: TypeAlias = Annotated[
    bool,
    Option(
        "Correct a unit or axes that the motion contradicts. Only if the correct ones are "
        "certain; a note describes the correction.",
        panel=PANEL,
    ),
]
ClippedOption: TypeAlias = Annotated[
    Clipped,
    Option(
        "Treatment of clipped rates. auto: restored if nothing else explains them; restore: "
        "wherever the flanks predict a higher peak; leave: unchanged.",
        panel=PANEL,
    ),
]
ReferenceOffset: TypeAlias = Annotated[
    float,
    Option(
        "Seconds to add to the times of --reference.",
        metavar="S",
        shown="",
        panel=PANEL,
    ),
]

Output: TypeAlias = Annotated[
    str,
    Option(
        "Folder for the files, or the name of one of them. A missing folder is made.",
        "-o --output",
        metavar="PATH",
        panel=OUTPUT,
    ),
]
LogFormat: TypeAlias = Annotated[
    str | None,
    Option(
        "Log format; by default the suffix of -o, or parquet.",
        choices=LOG_FORMATS,
        panel=OUTPUT,
    ),
]
FigureFormat: TypeAlias = Annotated[
    str | None,
    Option(
        "Figure format; by default the suffix of -o, or png.",
        choices=FIGURE_FORMATS,
        panel=OUTPUT,
    ),
]
FigurePanels: TypeAlias = Annotated[
    Literal["usual", "all"],
    Option("Panels: usual (six at most) or all.", panel=OUTPUT),
]
NoFigure: TypeAlias = Annotated[bool, Option("Draw no figure.", panel=OUTPUT)]
Tum: TypeAlias = Annotated[
    bool, Option("Write the poses as a TUM trajectory, too (for evo).", panel=OUTPUT)
]
Force: TypeAlias = Annotated[bool, Option("Replace existing files.", panel=OUTPUT)]
Doubtful: TypeAlias = Annotated[
    bool,
    Option(
        "Export also doubtful numbers, with a warning in the file.",
        panel=EXPORT_PANEL,
    ),
]
