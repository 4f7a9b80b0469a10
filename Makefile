# `make demo` and `make test` do all the set-up themselves; PYTHON=python3.12 chooses another interpreter.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

LOWEST := .venv-lowest
# What the lowest allowed versions are tried on: each library where it shows, and the compiled code of both roads.
LOWEST_TESTS := tests/test_jit.py::test_a_change_of_any_imported_source_is_seen tests/test_units.py \
	tests/catalog tests/study/test_load.py tests/study/test_validate.py tests/study/test_document.py \
	tests/drive/test_loop_design.py tests/drive/test_heat.py tests/dynamics/test_newton_euler.py \
	tests/solvers/test_integrate.py tests/spatial/test_rigid_body.py tests/sizing/judge/test_evaluate.py \
	tests/sizing/search/test_search.py tests/report/test_page.py tests/report/test_charts.py tests/report/test_plotting.py

# Set, what `make lock` wrote is installed, file by file: the same bytes again, on the platform it was written on.
LOCKED ?=
# Not compiled ahead: most of what the libraries bring is never imported, and Python compiles the rest when it is.
PIP := pip install --quiet --disable-pip-version-check --no-compile
INSTALL := $(BIN)/python -m $(PIP)
INSTALL_LOCKED := $(INSTALL) --require-hashes --requirement .ci/lock.txt && $(INSTALL) --no-deps --no-build-isolation --editable .

# A setting of many containers that would have Python compile what it imports at every start: half of a command's time.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo install test shuffled lowest audit fuzz mutants lock check bench page-check gallery docs clean

demo: $(VENV)/.installed
	$(BIN)/drivetrain demo

install: $(VENV)/.test-installed $(LOWEST)/.installed # `make -j2 install`: both at once

test: $(VENV)/.test-installed
	$(BIN)/python -m pytest --numprocesses auto --dist worksteal

shuffled: $(VENV)/.test-installed
	$(BIN)/python -m pytest --numprocesses auto --dist worksteal -p randomly

lowest: $(LOWEST)/.installed
	$(LOWEST)/bin/python -m pytest -o addopts="-q --import-mode=importlib" -o filterwarnings=default \
		--numprocesses auto --dist worksteal $(LOWEST_TESTS)

audit: $(VENV)/bin/python # known vulnerabilities of what is locked; needs a database that can be reached
	$(INSTALL) pip-audit
	$(BIN)/pip-audit --requirement .ci/lock.txt --disable-pip --require-hashes

SECONDS_EACH ?= 520
fuzz: $(VENV)/.test-installed # an hour in total: seven readers
	$(INSTALL) atheris
	for reader in study urdf mjcf sdf motion recording catalogue; do \
		$(BIN)/python tests/hard/fuzz_readers.py $$reader $(SECONDS_EACH); done

COUNT ?= 300
SEED ?= 0
mutants: $(VENV)/.test-installed # COUNT of each kind; hours, and it goes on where it was stopped
	mkdir -p build
	$(BIN)/python tests/hard/mutants.py plain build/plain.jsonl $(COUNT) $(SEED)
	$(BIN)/python tests/hard/mutants.py compiled build/compiled.jsonl $(COUNT) $(SEED)
	$(BIN)/python tests/hard/mutants.py rate build/plain.jsonl build/compiled.jsonl

lock: $(VENV)/bin/python
	$(BIN)/python .ci/lock.py > .ci/lock.new
	mv .ci/lock.new .ci/lock.txt

check: $(VENV)/.test-installed
	$(BIN)/ruff check .
	$(BIN)/mypy

bench: $(VENV)/.test-installed
	$(BIN)/python benchmarks/inverse_dynamics.py
	$(BIN)/python benchmarks/one_sample.py
	$(BIN)/python benchmarks/chapter.py
	$(BIN)/python benchmarks/selection.py
	$(BIN)/python benchmarks/simulation.py
	$(BIN)/python benchmarks/mujoco_motor.py

page-check: $(VENV)/.installed # reports of the gallery and a served page in a real browser; needs Chromium and its driver
	$(INSTALL) --editable ".[browser]"
	$(BIN)/python tests/browser/check_pages.py examples/desktop_arm/study.yaml reports/*/report.html

gallery: $(VENV)/.installed
	$(BIN)/python examples/gallery.py

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
		|| { echo "drivetrain needs Python 3.11 or newer; try: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/.installed: $(VENV)/bin/python pyproject.toml
	$(if $(LOCKED),$(INSTALL_LOCKED),$(INSTALL) --editable .)
	@touch $@

$(VENV)/.test-installed: $(VENV)/bin/python pyproject.toml
	$(if $(LOCKED),$(INSTALL_LOCKED),$(INSTALL) --editable ".[test]")
	@touch $@ $(VENV)/.installed

$(LOWEST)/.installed: pyproject.toml .ci/lowest.txt Makefile
	$(PYTHON) -m venv $(LOWEST)
	$(LOWEST)/bin/python -m $(PIP) --constraint .ci/lowest.txt \
		--editable ".[excel]" pytest pytest-xdist hypothesis sympy mpmath
	@touch $@

docs: $(VENV)/.installed
	$(INSTALL) --editable ".[docs]"
	$(BIN)/python -m sphinx --fail-on-warning --keep-going -q -b html docs docs/_build/html
	@echo "docs/_build/html/index.html"

clean:
	rm -rf $(VENV) $(LOWEST) .pytest_cache .mypy_cache .ruff_cache .hypothesis dist build docs/_build docs/rooms
