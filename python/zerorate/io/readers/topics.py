"""Topics of autopilots' logs: the choice between several topics with a gyro."""

from collections.abc import Mapping, Sequence

from zerorate.io.table import Table
from zerorate.record.log import LogError
from zerorate.record.names import looks_like_gyro


def has_gyro(table: Table) -> bool:
    """Return True if a column of the table has the name of a gyro."""
    return any(map(looks_like_gyro, table.names or ()))


def choose_topic(
    tables: Mapping[str, Table], candidates: Sequence[str], expected: str, topic: str | None
) -> str:
    """Return the requested topic, or the first candidate with a gyro.

    Raises
    ------
    LogError
        If the topic does not exist, or no candidate has a gyro; `expected` describes the search.
    """
    listed = ", ".join(sorted(tables)) or "none"
    if topic is not None:
        existing = next((n for n in (topic, topic.removesuffix("_0")) if n in tables), None)
        if existing is not None:
            return existing
        raise LogError(f"there is no topic '{topic}'; the log has: {listed}", "topic")
    gyro_topic = next((name for name in candidates if has_gyro(tables[name])), None)
    if gyro_topic is None:
        raise LogError(f"{expected}; the log has: {listed}")
    return gyro_topic
