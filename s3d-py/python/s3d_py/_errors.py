"""What calls raise. Every message says what is wrong, where, and what to do."""

from __future__ import annotations


class Error(Exception):
    """What all errors of this package are."""


class UsageError(Error, ValueError):
    """What is asked for cannot be: arguments out of range or that exclude each other, a folder in use."""


class InputError(Error, ValueError):
    """The input does not fit together: annotations, mesh, cameras."""


class TemporaryError(Error):
    """Something that may pass, such as a full disk. What was done is kept: the same call goes on."""


class CancelledError(Error):
    """A callback of `progress` returned False. What was done is kept: the same call goes on.

    Ctrl-C raises `KeyboardInterrupt` instead, and the same call goes on as well.
    """


class FileError(Error):
    """A file is wrong, or the system refuses it."""

    path: str | None
    """The file; a name in words for what came from memory."""
    line: int | None
    """The line in it, from 1; None for the file as a whole."""

    def __init__(self, message: str, *, path: str | None = None, line: int | None = None) -> None:
        super().__init__(message)
        self.path = path
        self.line = line

    def __str__(self) -> str:
        return str(self.args[0])


class FileAccessError(FileError, OSError):
    """The system refuses: permissions, a disk, a folder in place of a file. `errno` tells why."""

    def __init__(self, message: str, *, path: str | None = None, errno: int | None = None) -> None:
        super().__init__(message, path=path)
        self.errno, self.filename = errno, path


class MissingFileError(FileAccessError, FileNotFoundError):
    """There is no such file."""


class FormatError(FileError, ValueError):
    """The file does not hold what it should."""


class MeshError(FormatError):
    """The mesh of a file or of arrays cannot be used."""


class UnsupportedError(FileError):
    """The file uses something that is not read; the message names a way out."""
