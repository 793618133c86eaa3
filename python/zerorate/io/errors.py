"""The exception of this package."""


class LogError(ValueError):
    """The content of a log is not what was expected; the message says what and where."""
