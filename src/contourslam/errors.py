"""The package's exceptions: one root, so that a caller can tell a known failure from a bug."""


class ContourslamError(Exception):
    """A known failure. Its message is one line that says what happened, where, and what to do next."""


class ConfigError(ContourslamError):
    """A configuration value is out of its range or of the wrong type."""


class ScanError(ContourslamError):
    """A scan cannot be used at all (its arrays disagree, or an angle or stamp is not finite)."""


class RecordingError(ContourslamError):
    """A recording or trajectory file is missing, corrupt, truncated or lacks a needed topic."""


class ResultError(ContourslamError):
    """A result folder is missing a file, or a result cannot be written."""


class MapError(ContourslamError):
    """A map file is missing, damaged or of a newer version, or a map lacks what it is needed for."""


class MissingExtraError(ContourslamError):
    """An optional library is not installed; the message names the extra to install."""


class MessageError(ContourslamError):
    """What a robot or the server of a fleet sent is damaged, foreign or of a newer version, or cannot be sent."""


class JournalError(ContourslamError):
    """The server of a fleet cannot keep what robots told it, or cannot read what it kept."""
