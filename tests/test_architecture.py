"""Data goes down one line: what stands to the left never imports what stands to the right."""

import ast
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path

import contourslam

PACKAGE = Path(contourslam.__file__).parent
ROOT = PACKAGE.parents[1]

# Each room may import the rooms before it. Adapters and shared ground stand at the ends.
GROUND = ("errors", "nearest", "display", "closing", "atomic", "settings_file", "config", "kernels", "geometry", "scan")
LINE = ("contour", "detectors", "landmarks", "matching", "slam", "maps", "localization", "graph", "joining", "replay")
ORDER = (
    *GROUND,
    *LINE,
    "live",
    "fleet",
    "recordings",
    "robot",
    "scene",
    "simulation",
    "evaluation",
    "experiments",
    "report",
    "view",
    "cli",
)
EXTRAS = {
    "rerun",
    "serial",
    "websockets",
    "cv2",
    "trimesh",
    "PIL",
    "picamera2",
    "gtsam",
    "mujoco",
    "shapely",
    "matplotlib",
    "mpl_toolkits",
    "evo",
    "scipy",
    "dask",
    "distributed",
    "fsspec",
    "pyarrow",
}
MAY_USE_EXTRAS = (
    "graph",
    "joining",
    "fleet",
    "robot",
    "scene",
    "simulation",
    "evaluation",
    "experiments",
    "report",
    "view",
)

MODULES = sorted(PACKAGE.rglob("*.py"))


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text())


@cache
def imported(path: Path) -> set[str]:
    """Names of the modules that a file imports; those under TYPE_CHECKING bind nothing."""
    nodes: list[ast.AST] = []

    def walk(node: ast.AST) -> None:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.dump(child.test):
                continue
            nodes.append(child)
            walk(child)

    walk(tree_of(path))
    names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    return names | {node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module}


def room(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


@cache
def called(path: Path) -> set[str]:
    """Names of the plain functions, and of the functions of plain modules, that a file calls."""
    functions = [node.func for node in ast.walk(tree_of(path)) if isinstance(node, ast.Call)]
    plain = {function.id for function in functions if isinstance(function, ast.Name)}
    dotted = {ast.unparse(function) for function in functions if isinstance(function, ast.Attribute)}
    return plain | dotted


def test_a_module_imports_only_what_stands_to_its_left() -> None:
    wrong = []
    for path in MODULES:
        if room(path) in ("__init__", "__main__"):
            continue
        allowed = ORDER[: ORDER.index(room(path)) + 1]
        used = {name.split(".")[1] for name in imported(path) if name.startswith("contourslam.")}
        wrong += [f"{path} imports {name}" for name in sorted(used - set(allowed))]
    assert wrong == []


def test_the_core_does_without_the_extras() -> None:
    used = {str(path): {name.split(".")[0] for name in imported(path)} & EXTRAS for path in MODULES}
    assert {path for path, extras in used.items() if extras and room(Path(path)) not in MAY_USE_EXTRAS} == set()


def test_only_the_command_line_prints_or_exits() -> None:
    wrong = {"print", "exit", "quit", "sys.exit", "os._exit"}
    assert [path for path in MODULES if room(path) not in ("cli", "__main__") and called(path) & wrong] == []


def test_no_kernel_calls_the_linear_algebra_for_which_numba_needs_scipy() -> None:
    """Compiled where SciPy is, such a kernel is taken from the cache where it is not, and ends the whole process."""
    wrong = []
    for path in MODULES:
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.FunctionDef) and any(ast.unparse(d) == "kernel" for d in node.decorator_list):
                names = [ast.unparse(n) for n in ast.walk(node) if isinstance(n, ast.Attribute)]
                matrix = [n for n in ast.walk(node) if isinstance(n, ast.BinOp) and isinstance(n.op, ast.MatMult)]
                if matrix or any(name.startswith(("np.linalg", "np.dot")) for name in names):
                    wrong.append(f"{path}: {node.name}")
    assert wrong == []


def test_nothing_unpickles_or_evaluates() -> None:
    wrong = {"pickle", "shelve", "marshal", "dill"}
    assert [path for path in MODULES if imported(path) & wrong or called(path) & {"eval", "exec"}] == []


def test_every_room_has_its_place_in_the_order() -> None:
    rooms = {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    modules = {path.stem for path in PACKAGE.glob("*.py")}
    assert rooms == set(ORDER) - modules


def test_importing_the_package_loads_no_library() -> None:
    code = "import sys; import contourslam; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"numpy", "numba", "tyro"} & set(done.stdout.split())


def test_a_run_needs_none_of_the_extras() -> None:
    blocked = ", ".join(f"{name!r}: None" for name in sorted(EXTRAS))
    needed = (
        "contourslam.slam, contourslam.recordings, contourslam.report.result_folder, contourslam.evaluation.metrics"
    )
    code = f"import sys; sys.modules.update({{{blocked}}}); import {needed}"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_version_is_the_same_everywhere() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["version"] == contourslam.__version__
    assert f"\nversion: {contourslam.__version__}\n" in (ROOT / "CITATION.cff").read_text()
