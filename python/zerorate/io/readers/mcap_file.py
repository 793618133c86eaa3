"""MCAP files: connections as in `rosbags`, and messages as arrays of bytes.

The native module reads the file, in the separate process of `ros`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from zerorate._native import read_mcap

_Connection = Any
_ALL: Final = 2**63
_FORMATS: Final = {"ros2msg": "MSG", "ros2idl": "IDL", "omgidl": "IDL"}


class McapMessages(NamedTuple):
    """Messages in order of reception, as offsets of their bytes in ``raw``.

    ``lengths`` are the sizes of complete messages; ``raw`` may contain only parts of them.
    """

    channels: npt.NDArray[np.uint16]
    times: npt.NDArray[np.uint64]
    begins: npt.NDArray[np.uint64]
    lengths: npt.NDArray[np.uint64]
    raw: npt.NDArray[np.uint8]


class McapReader:
    """Reader of the connections and messages of a file.

    Raises
    ------
    ValueError
        If the file is truncated, damaged, or not of ROS 2.
    """

    def __init__(self, path: Path) -> None:
        self._raw = np.asarray(np.memmap(path, np.uint8, "r"))
        profile, channels, _ = read_mcap(self._raw, [], 0, [])
        if profile != "ros2":
            raise ValueError("Profile is not ros2")
        self.connections = [_make_connection(*channel) for channel in channels]

    def __enter__(self) -> Self:
        """Return the reader itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Do nothing: the mapping ends with the reader."""

    def read(
        self,
        connections: Sequence[_Connection],
        limit: int | None = None,
        kept: Sequence[tuple[int, int]] = (),
    ) -> McapMessages:
        """Return the messages of some connections, at most ``limit``, complete or in parts."""
        most = _ALL if limit is None else limit
        wanted = [connection.id for connection in connections]
        return McapMessages(*read_mcap(self._raw, wanted, most, kept)[2])

    def messages(
        self, connections: Sequence[_Connection]
    ) -> Iterator[tuple[_Connection, int, bytes]]:
        """Yield connection, time of reception, ns, and bytes of each message."""
        by_id = {connection.id: connection for connection in connections}
        channels, times, begins, lengths, raw = self.read(connections)
        ends = begins + lengths
        for row in zip(*(a.tolist() for a in (channels, times, begins, ends)), strict=True):
            channel, time, begin, end = row
            yield by_id[channel], time, raw[begin:end].tobytes()


def _make_connection(
    number: int, topic: str, encoding: str, name: str, form: str, text: bytes
) -> _Connection:
    from rosbags.interfaces import (
        Connection,
        ConnectionExtRosbag2,
        MessageDefinition,
        MessageDefinitionFormat,
    )

    definition = MessageDefinition(
        MessageDefinitionFormat[_FORMATS.get(form, "NONE")], text.decode("utf-8", "replace")
    )
    extra = ConnectionExtRosbag2(encoding, [])
    return Connection(number, topic, name, definition, "", 0, extra, None)
