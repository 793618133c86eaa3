"""What each deviation is made of: the facts that its errors and its model follow from."""

from dataclasses import dataclass
from typing import Final, Literal

__all__ = ["KINDS", "Kind", "KindName", "kind"]

KindName = Literal[
    "adev",
    "oadev",
    "mdev",
    "tdev",
    "hdev",
    "ohdev",
    "totdev",
    "mtotdev",
    "ttotdev",
    "htotdev",
    "theo1",
    "pdev",
]


@dataclass(frozen=True)
class Kind:
    """One deviation.

    Parameters
    ----------
    name : str
        As users write it.
    title : str
        As tables and figures write it.
    order : int
        Phase differences it takes: 2 of the Allan family, 3 of the Hadamard family.
    modified : bool
        Whether the phase is averaged over tau before it is differenced.
    overlapping : bool
        Whether every sample starts a term, not only every tau-th.
    total : bool
        Whether the record is extended by reflection.
    time : bool
        Whether the result is a time deviation, tau / sqrt(3) times that of the rate.
    """

    name: KindName
    title: str
    order: int = 2
    modified: bool = False
    overlapping: bool = True
    total: bool = False
    time: bool = False


KINDS: Final[dict[str, Kind]] = {
    kind.name: kind
    for kind in (
        Kind("adev", "Allan deviation", overlapping=False),
        Kind("oadev", "overlapping Allan deviation"),
        Kind("mdev", "modified Allan deviation", modified=True),
        Kind("tdev", "time deviation", modified=True, time=True),
        Kind("hdev", "Hadamard deviation", order=3, overlapping=False),
        Kind("ohdev", "overlapping Hadamard deviation", order=3),
        Kind("totdev", "total deviation", total=True),
        Kind("mtotdev", "modified total deviation", modified=True, total=True),
        Kind("ttotdev", "time total deviation", modified=True, total=True, time=True),
        Kind("htotdev", "Hadamard total deviation", order=3, total=True),
        Kind("theo1", "Thêo1 deviation", total=True),
        Kind("pdev", "parabolic deviation", modified=True),
    )
}


def kind(name: str) -> Kind:
    """Return the deviation of this name; ValueError lists the known ones."""
    if name not in KINDS:
        raise ValueError(f"unknown kind {name!r}; known: {', '.join(KINDS)}")
    return KINDS[name]
