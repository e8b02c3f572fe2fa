"""A detector of one's own: a Python file or module that the experiment names, imported and nothing else."""

import ast
import hashlib
import importlib
import importlib.abc
import importlib.machinery
import importlib.util
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

from contourslam.detectors import DETECTORS, Detector
from contourslam.errors import ConfigError
from contourslam.nearest import perhaps, unreadable

Factory = Callable[[bool], Detector]


@dataclass(frozen=True, slots=True)
class OwnDetector:
    """Where a detector comes from.

    Attributes
    ----------
    name : str
        As the experiment calls it.
    place : str
        ``FILE.py:FACTORY`` or ``MODULE:FACTORY``; the factory is called with ``adapted``, as those of
        ``contourslam.detectors.DETECTORS`` are.
    digest : str
        SHA-256 of the file that it is in.
    source : bytes or None
        The file itself, so that workers elsewhere run the same; None for a module, which they must have installed.
    """

    name: str
    place: str
    digest: str
    source: bytes | None = field(default=None, repr=False)

    @property
    def factory(self) -> str:
        """What of the file makes the detector."""
        return self.place.rpartition(":")[2]


def find_detector(name: str, place: str, folder: Path) -> OwnDetector:
    """Look at a detector's file without running it.

    Parameters
    ----------
    name : str
    place : str
        ``FILE.py:FACTORY``, from `folder` on, or ``MODULE:FACTORY``.
    folder : Path
        The experiment's.

    Raises
    ------
    ConfigError
        If there is no such file, module or factory, or the file is not Python.
    """
    where, colon, factory = place.rpartition(":")
    if not colon or not factory.isidentifier():
        raise ConfigError(f"{place!r} must be FILE.py:FACTORY or MODULE:FACTORY")
    if name in DETECTORS:
        raise ConfigError(f"{name} is a detector of the package already; choose another name")
    is_file = where.endswith(".py")
    path = folder / where if is_file else _module_file(where)
    try:
        source = path.read_bytes()
    except OSError as error:
        raise ConfigError(unreadable(path, error)) from error
    try:
        there = _names(ast.parse(source))
    except (SyntaxError, ValueError) as error:
        raise ConfigError(f"{path}: is not Python ({error})") from error
    if factory not in there:
        raise ConfigError(f"{path}: has no {factory}{perhaps(factory, there)}")
    return OwnDetector(name, place, hashlib.sha256(source).hexdigest(), source if is_file else None)


def load_detector(detector: OwnDetector, *, adapted: bool) -> Detector:
    """Import a detector's file or module, once a process, and make the detector.

    Parameters
    ----------
    detector : OwnDetector
    adapted : bool
        What its factory is called with.

    Returns
    -------
    Detector

    Raises
    ------
    ConfigError
        If the module here is not the one that the experiment was planned with.
    Exception
        Whatever the file raises.
    """
    where = detector.place.rpartition(":")[0]
    title, source = f"contourslam_own_{detector.digest[:16]}", detector.source
    if source is None:
        path = _module_file(where)
        source = path.read_bytes()
        if hashlib.sha256(source).hexdigest() != detector.digest:
            raise ConfigError(f"{path} is not the same as where the sweep was started; install the same on all workers")
        # Not imported under its own name: a worker that lives long may have an older one under that.
        package = where if path.name == "__init__.py" else where.rpartition(".")[0]
        if package:
            importlib.import_module(package)
            title = f"{package}.{title}"
    if title not in sys.modules:
        loader = _Shipped(where, source)
        module = importlib.util.module_from_spec(importlib.machinery.ModuleSpec(title, loader, origin=where))
        sys.modules[title] = module  # dataclasses look their module up there
        try:
            loader.exec_module(module)
        except BaseException:
            del sys.modules[title]
            raise
    return cast(Factory, getattr(sys.modules[title], detector.factory))(adapted)


class _Shipped(importlib.abc.SourceLoader):
    """Imports a file from its content, which may lie on another machine."""

    def __init__(self, path: str, source: bytes) -> None:
        self._path, self._source = path, source

    def get_filename(self, fullname: str) -> str:
        return self._path

    def get_data(self, path: str | bytes) -> bytes:
        return self._source


def _module_file(module: str) -> Path:
    try:
        spec = importlib.util.find_spec(module)
    except (ImportError, ValueError):
        spec = None
    if spec is None or spec.origin is None or not spec.has_location:
        raise ConfigError(f"there is no Python module {module!r}; name a file as FILE.py:FACTORY")
    return Path(spec.origin)


def _names(tree: ast.Module) -> set[str]:
    """What a file defines at its top."""
    names = {node.name for node in tree.body if isinstance(node, ast.ClassDef | ast.FunctionDef)}
    targets = [target for node in tree.body if isinstance(node, ast.Assign) for target in node.targets]
    names |= {target.id for target in targets if isinstance(target, ast.Name)}
    return names | {
        alias.asname or alias.name for node in tree.body if isinstance(node, ast.ImportFrom) for alias in node.names
    }
