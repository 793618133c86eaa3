"""The files of a characterisation: curve, figure and configurations, all whole or none."""

import json
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from zerorate.cli.curve_files import write_curves
from zerorate.cli.faults import DataFault, as_usage, require, writing
from zerorate.cli.options import CurveFormat, Export, FigureFormat
from zerorate.cli.outputs import together
from zerorate.io import check_writable
from zerorate.noise import NoiseModel
from zerorate.noise.characterise import Characterisation
from zerorate.run.replay.workers import Progress

__all__ = ["AllanOutputs"]

_SUFFIX: Final = {
    Export.kalibr: "-kalibr.yaml",
    Export.vins: "-vins.yaml",
    Export.orbslam3: "-orbslam3.yaml",
    Export.px4: "-px4.params",
    Export.json: "-models.json",
}


@dataclass(frozen=True)
class AllanOutputs:
    """Where the files of a characterisation go; `figure` is None for none."""

    curve: Path
    form: CurveFormat
    figure: Path | None
    exports: dict[Export, Path]
    force: bool

    @classmethod
    def of(
        cls,
        folder: Path,
        stem: str,
        form: CurveFormat,
        figure_format: FigureFormat | None,
        exports: Sequence[Export],
        force: bool,
    ) -> "AllanOutputs":
        """Return the files, after checking that they can be written and drawn."""
        base = folder / f"{stem}-zerorate-allan"
        figure = None if figure_format is None else Path(f"{base}.{figure_format.value}")
        if figure is not None:
            require("matplotlib", "plot")
        paths = {export: Path(f"{base}{_SUFFIX[export]}") for export in exports}
        outputs = cls(Path(f"{base}.{form.value}"), form, figure, paths, force)
        with as_usage():
            for path in outputs.paths:
                check_writable(path, force)
        return outputs

    @property
    def paths(self) -> list[Path]:
        """The files to write."""
        figure = [] if self.figure is None else [self.figure]
        return [self.curve, *figure, *self.exports.values()]

    def write(self, found: Sequence[Characterisation], progress: Progress) -> None:
        """Write all files under other names; rename them when all are whole."""
        texts = [_text(export, found) for export in self.exports]
        with (
            writing(),
            together(self.paths, self.force) as temporary,
            ThreadPoolExecutor(1) as executor,
        ):
            curves = [one.curve for one in found]
            job = executor.submit(write_curves, curves, temporary[0], self.form)
            if self.figure is not None:
                progress("drawing", 0.0)
                _draw(found, temporary[1])
            progress("writing", 0.9)
            for text, path in zip(texts, temporary[len(temporary) - len(texts) :], strict=True):
                path.write_text(text, encoding="utf-8", newline="\n")
            job.result()


def _text(export: Export, found: Sequence[Characterisation]) -> str:
    if export is Export.json:
        return _models(found)
    gyro, accelerometer = (_worst(found, kind) for kind in ("angular rate", "acceleration"))
    if gyro is None:
        raise DataFault(f"--export {export} needs a model of a gyro, and this log gives none")
    rate = found[0].curve.rate
    if export is Export.kalibr:
        return gyro.to_kalibr(accelerometer=accelerometer, rate=rate)
    if export is Export.vins:
        return gyro.to_vins(accelerometer=accelerometer, rate=rate)
    if export is Export.orbslam3:
        return gyro.to_orbslam3(accelerometer=accelerometer, rate=rate)
    return gyro.to_px4(accelerometer=accelerometer)


def _worst(found: Sequence[Characterisation], quantity: str) -> NoiseModel | None:
    models = (one.worst for one in found)
    return next((m for m in models if m is not None and m.quantity == quantity), None)


def _models(found: Sequence[Characterisation]) -> str:
    models = {
        axis.name: None if axis.model is None else json.loads(axis.model.to_json())
        for one in found
        for axis in one.axes
    }
    return json.dumps({"axes": models}, indent=2) + "\n"


def _draw(found: Sequence[Characterisation], path: Path) -> None:
    from zerorate.show import plot_characterisation, save_figure

    save_figure(plot_characterisation(found), path)
