"""A run's program is every source file of the package that it uses."""

import subprocess
import sys

from contourslam.experiments.sweep.versions import libraries, program, sources


def test_whatever_a_run_imports_is_in_its_version():
    code = (
        "import sys; import contourslam.graph, contourslam.experiments.sweep.work; "
        "print(*(name for name in sys.modules if name.split('.')[0] == 'contourslam'))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) <= set(sources())


def test_what_no_run_uses_is_not_in_its_version():
    assert not [
        name for name in sources() if name.split(".")[1:2] in (["cli"], ["report"], ["view"], ["robot_in_the_loop"])
    ]


def test_the_version_names_the_package_its_source_and_the_libraries():
    version, _, digests = program().partition("+")
    assert version.count(".") == 2
    assert list(map(len, digests.split("."))) == [12, 8]
    assert libraries()["numpy"] != "not installed"
