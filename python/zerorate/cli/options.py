"""Options of several commands: the log, the sensors in it, the reference, the files written."""

from pathlib import Path
from typing import Annotated, Final, Literal, TypeAlias

from zerorate.checks.preparation import Clipped
from zerorate.cli.parameters import Argument, Option
from zerorate.cli.reading import PANEL
from zerorate.tasks.saving import FIGURE_FORMATS, LOG_FORMATS

OUTPUT: Final = "Output"
"""The panel of help with the files that are written."""

RECORDING: Final = (
    "Recording: csv, tsv, txt, npy, npz, parquet, arrow, feather, h5, mat, bag, mcap, ulg, "
    "bin, log, tlog, mp4, bbl, or the folder of a ROS 2 bag."
)

LogArgument: TypeAlias = Annotated[Path, Argument(RECORDING)]

GyroName: TypeAlias = Annotated[
    str | None,
    Option(
        "Which gyro, where the log has several: gyro, gyro_1 and so on, in the order of the file.",
        panel=PANEL,
    ),
]
AccelName: TypeAlias = Annotated[
    str | None, Option("Which accelerometer; by default the one of the gyro.", panel=PANEL)
]
NoAccel: TypeAlias = Annotated[
    bool,
    Option(
        "Ignore the accelerometer of the log. By default no rate is taken "
        "for a bias while it shows motion.",
        panel=PANEL,
    ),
]
CalibrationOption: TypeAlias = Annotated[
    Path | None,
    Option(
        "Correct gyro and accelerometer by this calibration first (JSON of zerorate calibrate).",
        metavar="CAL",
        panel=PANEL,
    ),
]
Fix: TypeAlias = Annotated[
    bool,
    Option(
        "Put right a unit or axes of the gyro that the motion contradicts, where it is sure "
        "which are right; a note says what was done.",
        panel=PANEL,
    ),
]
ClippedOption: TypeAlias = Annotated[
    Clipped,
    Option(
        "Rates that the gyro clipped at its range: auto restores them from their flanks where "
        "nothing else explains them; restore where flanks promise more; or leave.",
        panel=PANEL,
    ),
]
ReferenceOffset: TypeAlias = Annotated[
    float,
    Option(
        "Added to the times of the file of --reference, where its clock has another zero than "
        "that of the log.",
        metavar="S",
        shown="",
        panel=PANEL,
    ),
]

Output: TypeAlias = Annotated[
    str,
    Option(
        "Folder for the files, or the name of one of them; a missing folder is made.",
        "-o --output",
        metavar="PATH",
        panel=OUTPUT,
    ),
]
LogFormat: TypeAlias = Annotated[
    str | None,
    Option(
        "File format of the filtered log; else the suffix of -o, or parquet.",
        choices=LOG_FORMATS,
        panel=OUTPUT,
    ),
]
FigureFormat: TypeAlias = Annotated[
    str | None,
    Option(
        "File format of the figure; else the suffix of -o, or png.",
        choices=FIGURE_FORMATS,
        panel=OUTPUT,
    ),
]
FigurePanels: TypeAlias = Annotated[
    Literal["usual", "all"],
    Option("Panels of the figure: the usual ones, six at most, or all.", panel=OUTPUT),
]
NoFigure: TypeAlias = Annotated[bool, Option("Draw no figure.", panel=OUTPUT)]
Tum: TypeAlias = Annotated[
    bool, Option("Write the poses as TUM's text, too, which evo reads.", panel=OUTPUT)
]
Force: TypeAlias = Annotated[bool, Option("Replace existing files.", panel=OUTPUT)]
ForceExports: TypeAlias = Annotated[
    bool,
    Option(
        "Replace existing files; and export numbers that the log does not bear out, with a "
        "warning in the file.",
        panel=OUTPUT,
    ),
]
