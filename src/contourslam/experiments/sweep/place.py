"""A folder of files that are whole or not there, on any file system that fsspec knows."""

import secrets
from pathlib import Path

from contourslam.atomic import write_bytes
from contourslam.errors import ContourslamError, ResultError
from contourslam.experiments.sweep.files import is_local, open_place, protocols

_WHOLE = {"memory", "s3", "s3a", "gs", "gcs", "az", "abfs", "abfss", "adl", "oss", "oci"}
"""Stores that show an object only once it is whole; on others a file is moved into its place."""


class Place:
    """Files below one path or URL.

    Parameters
    ----------
    url : str

    Raises
    ------
    ConfigError, MissingExtraError
        If the kind of URL is unknown, or its library is not installed.
    """

    def __init__(self, url: str) -> None:
        self.url = url if "://" in url else str(Path(url).resolve())
        self._system, self._root = open_place(self.url)
        self._whole = bool(_WHOLE & protocols(self._system))

    def names(self, folder: str) -> list[str]:
        """Names of the files and folders in a folder, in alphabetical order."""
        self._system.invalidate_cache()
        try:
            found = self._system.ls(f"{self._root}/{folder}", detail=False)
        except FileNotFoundError:
            return []
        except OSError as error:
            raise self._unusable(error) from error
        return sorted(name for name in (str(path).rpartition("/")[2] for path in found) if not name.startswith("."))

    def below(self, folder: str) -> list[str]:
        """Paths of all files below a folder."""
        return [str(path) for path in self._system.find(f"{self._root}/{folder}")]

    def exists(self, name: str) -> bool:
        """Whether there is such a file."""
        return bool(self._system.exists(f"{self._root}/{name}"))

    def read(self, name: str) -> bytes | None:
        """Content of a file; None where there is none."""
        try:
            return bytes(self._system.cat_file(f"{self._root}/{name}"))
        except FileNotFoundError:
            return None
        except OSError as error:
            raise self._unusable(error) from error

    def write(self, name: str, content: bytes) -> None:
        """Write a file, whole or not at all.

        Raises
        ------
        ResultError
            If it cannot be written.
        """
        path = f"{self._root}/{name}"
        if is_local(self._system):
            write_bytes(Path(path), content)
            return
        try:
            if self._whole:
                self._system.pipe_file(path, content)
            else:
                folder, _, last = path.rpartition("/")
                self._system.makedirs(folder, exist_ok=True)
                beside = f"{folder}/.{secrets.token_hex(8)}.{last}"
                self._system.pipe_file(beside, content)
                self._system.mv(beside, path)
        except ContourslamError:
            raise
        except Exception as error:  # each store has errors of its own
            raise ResultError(f"{self.url}: {name} cannot be written ({error})") from error

    def remove(self, name: str) -> None:
        """Remove a file, where there is one."""
        try:
            self._system.rm_file(f"{self._root}/{name}")
        except FileNotFoundError:
            return
        except OSError as error:
            raise self._unusable(error) from error

    def remove_folder(self, name: str) -> None:
        """Remove a folder with all that is in it, where there is one."""
        if self.exists(name):
            self._system.rm(f"{self._root}/{name}", recursive=True)

    def _unusable(self, error: OSError) -> ResultError:
        return ResultError(f"{self.url}: cannot be used as the results' folder ({error.strerror or error})")
