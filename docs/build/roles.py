"""References in docstrings, such as a class's name in Sphinx's notation, become links of the reference."""

import re
from typing import Any

import griffe

_ROLE = re.compile(r":(?:class|func|meth|mod|attr|data|exc):`~?(?P<name>[\w.]+)`")


class Roles(griffe.Extension):
    """Writes each role as a cross-reference that mkdocstrings follows; without a target it fails a strict build."""

    def on_package(self, *, pkg: griffe.Module, **_: Any) -> None:
        """Walk all objects of a package when it has been loaded."""
        self._walk(pkg)

    def _walk(self, item: griffe.Object) -> None:
        if item.docstring is not None:
            text = _ROLE.sub(lambda role: _link(item, role["name"]), item.docstring.value)
            # Else the type of an array is taken for a tuple and a call, and printed as one.
            item.docstring.value = text.replace("ndarray, shape (", "ndarray of shape (")
        if item.is_module and item.exports and item.docstring is not None:
            # Each thing is shown once, where it is written; the package says what it is the short way to.
            aliases = {name: item.members[name] for name in sorted(map(str, item.exports))}
            targets = {name: alias.target_path for name, alias in aliases.items() if isinstance(alias, griffe.Alias)}
            own = {name: path for name, path in targets.items() if path.startswith("contourslam.")}
            ways = ", ".join(_to(item.package, path, name) for name, path in own.items())
            item.docstring.value += f"\n\n`from {item.path} import` {ways}" if ways else ""
            item.exports = None
        for member in item.members.values():
            if not member.is_alias:
                self._walk(member)  # type: ignore[arg-type]


def _link(item: griffe.Object, name: str) -> str:
    return _to(item.package, _path(item, name), name.removeprefix(".").rpartition(".")[2])


def _to(package: griffe.Module, path: str, text: str) -> str:
    while _is_bare_attribute(package, path):  # what has no docstring has no place of its own: where it belongs
        path = path.rpartition(".")[0]
    return f"[`{text}`][{path}]"


def _is_bare_attribute(package: griffe.Module, path: str) -> bool:
    try:
        found = package[path.removeprefix(f"{package.path}.")]
    except KeyError:
        return False
    return bool(found.is_attribute and not found.has_docstring)


def _path(item: griffe.Object, name: str) -> str:
    """Full name of what an object's docstring means by a name: its own, or one that a scope around it knows."""
    if name.startswith("."):
        module = item.module
        return f"{module.path if module.is_init_module else module.parent.path}{name}"  # type: ignore[union-attr]
    first, dot, rest = name.partition(".")
    scope: griffe.Object | None = item
    while scope is not None and first != "contourslam":
        if first in scope.members:
            found = scope.members[first]
            path = found.target_path if isinstance(found, griffe.Alias) else found.path
            return path + dot + rest
        scope = scope.parent  # type: ignore[assignment]
    return name
