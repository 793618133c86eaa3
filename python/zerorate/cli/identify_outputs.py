"""The files of an identification: a page and its numbers, both whole or neither."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from zerorate.cli.faults import as_usage, require, writing
from zerorate.cli.outputs import together
from zerorate.identify.as_json import as_json
from zerorate.identify.identification import Identification
from zerorate.io import Log, check_writable
from zerorate.run.replay.workers import Progress
from zerorate.show.identify_page import identification_page
from zerorate.show.identify_tables import log_notes

__all__ = ["IdentifyOutputs"]


@dataclass(frozen=True)
class IdentifyOutputs:
    """Where the files of an identification go, and whether figures stand in the page."""

    page: Path
    numbers: Path
    figures: bool
    force: bool

    @classmethod
    def of(cls, folder: Path, stem: str, figures: bool, force: bool) -> "IdentifyOutputs":
        """Return the files, after checking that they can be written and drawn."""
        if figures:
            require("matplotlib", "plot")
        base = folder / f"{stem}-zerorate-identify"
        outputs = cls(Path(f"{base}.html"), Path(f"{base}.json"), figures, force)
        with as_usage():
            for path in outputs.paths:
                check_writable(path, force)
        return outputs

    @property
    def paths(self) -> list[Path]:
        """The files to write."""
        return [self.page, self.numbers]

    def write(self, log: Log, found: Sequence[Identification], progress: Progress) -> None:
        """Write both files under other names; rename them when they are whole."""
        source = Path(log.meta["source"]).name
        drawings = _drawn(found, progress) if self.figures else {}
        texts = (
            identification_page(found, source, drawings, log_notes(log)),
            as_json(found, source),
        )
        progress("writing", 0.95)
        with writing(), together(self.paths, self.force) as temporary:
            for path, text in zip(temporary, texts, strict=True):
                path.write_text(text, encoding="utf-8", newline="\n")


def _drawn(found: Sequence[Identification], progress: Progress) -> Mapping[str, bytes]:
    drawings = {}
    for i, one in enumerate(found):
        progress("drawing", i / len(found))
        drawings[one.name] = _svg(one)
    return drawings


def _svg(found: Identification) -> bytes:
    from matplotlib import rc_context

    buffer = BytesIO()
    # The same log gives the same bytes.
    with rc_context({"svg.hashsalt": found.name}):
        found.plot().savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()
