"""The exceptions of this package. Every message says what is wrong, where, and what to do."""

from __future__ import annotations


class Error(Exception):
    """The base class of all errors of this package."""


class UsageError(Error, ValueError):
    """The call is not possible: arguments are out of range or exclude each other, or a folder is in use."""


class TooLargeError(UsageError, MemoryError):
    """The result of a call would not fit into memory."""


class InputError(Error, ValueError):
    """The input does not fit together: annotations, mesh, cameras."""


class TemporaryError(Error):
    """A cause that may pass, such as a full disk. Finished work is kept: the same call goes on from it."""


class CancelledError(Error):
    """A callback of `progress` returned False. Finished work is kept, and the same call goes on from it.

    Ctrl-C raises `KeyboardInterrupt` instead. The same call goes on then as well.
    """


class FileError(Error):
    """A file is wrong, or the system refuses it."""

    path: str | None
    """The file; a name in words for data in memory."""
    line: int | None
    """The line in the file, from 1; None for the file as a whole."""

    def __init__(self, message: str, *, path: str | None = None, line: int | None = None) -> None:
        super().__init__(message)
        self.path = path
        self.line = line

    def __str__(self) -> str:
        return str(self.args[0])


class FileAccessError(FileError, OSError):
    """The system refuses access: permissions, a disk, a folder in place of a file. `errno` tells why."""

    def __init__(self, message: str, *, path: str | None = None, errno: int | None = None) -> None:
        super().__init__(message, path=path)
        self.errno, self.filename = errno, path


class MissingFileError(FileAccessError, FileNotFoundError):
    """There is no such file."""


class NoDataSetError(UsageError, MissingFileError):
    """There is no data set in a folder."""


class FormatError(FileError, ValueError):
    """The file does not hold what it should."""


class MeshError(FormatError):
    """The mesh of a file or of arrays cannot be used."""


class UnsupportedError(FileError):
    """The file uses an unsupported feature. The message names a way out."""
