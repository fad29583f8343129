# make study NAME=stopband   run studies/stopband.yaml, results in outputs/stopband
# make report NAME=stopband  draw the report of outputs/stopband again
# make test                  install and run the tests, which take about two minutes on two cores
# make slow                  run the tests that take longer, and the other cases of these
# make oldest                run the tests with the oldest versions that pyproject.toml allows, in .venv-oldest
# make mutants               plant faults of meaning, one at a time, and say which test sees each
# make check                 ruff, mypy --strict
# make accuracy              run the hard cases, measure what accuracy costs in time, and print the tables of
#                            tests/README.md anew
# make tables              print the tables of studies/guide/reference.md and outputs/README.md, and the schema, anew
# make gallery              run every study, draw studies/figures and studies/guide/gallery.md anew, and compare the
#                            figures in the text with their runs (20 minutes)
# make docs                  build guide and API reference as HTML, outputs/docs/studies/guide/index.html
# make bench                 measure speed, ratios beside those of the last bench, JSON in outputs/bench
PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11; do \
  $$p -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
VENV := .venv
BIN := $(VENV)/bin
OLDEST := .venv-oldest
NAME ?= stopband
ARGS ?=
ONE_THREAD := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1
# Tests start hundreds of processes, which would each compile the package's source anew.
unexport PYTHONDONTWRITEBYTECODE
TESTS := $(ONE_THREAD) $(BIN)/python -m pytest -n logical --dist worksteal
KERNELS := sweep/base/machine_code.py $(shell grep -rl --include=*.py "machine_code import" sweep)

.PHONY: study report test slow oldest mutants accuracy check tables gallery docs bench clean
.DELETE_ON_ERROR:

study: $(VENV)/.ready
	$(BIN)/sweep run studies/$(NAME).yaml $(ARGS)

report: $(VENV)/.ready
	$(BIN)/sweep report outputs/$(NAME)

test: $(VENV)/.compiled
	$(TESTS) $(ARGS)

slow: $(VENV)/.compiled
	UNCHECKED_TYPES=1 $(TESTS) -m slow $(ARGS)

oldest: $(OLDEST)/.oldest
	@UNCHECKED_TYPES=1 $(MAKE) --no-print-directory test VENV=$(OLDEST)

mutants: $(VENV)/.compiled
	@$(ONE_THREAD) $(BIN)/python -m tests.mutants $(ARGS)

accuracy: $(VENV)/.ready-dev
	$(BIN)/python -m pytest tests/hard/test_hard_cases.py -m "slow or not slow" --hard-cases outputs/accuracy/hard_cases.json
	$(ONE_THREAD) $(BIN)/sweep accuracy studies/accuracy.yaml $(ARGS)
	$(BIN)/python -m tests.accuracy_tables outputs/accuracy

check: $(VENV)/.ready-dev
	$(BIN)/ruff check sweep tests
	$(BIN)/ruff format --check sweep tests
	$(BIN)/mypy

tables: $(VENV)/.ready-dev
	$(BIN)/python -m tests.printed

gallery: $(VENV)/.ready-dev
	$(BIN)/python -m tests.gallery $(ARGS)
	$(TESTS) -m gallery tests/test_documents.py tests/test_guide.py

docs: $(VENV)/.ready-docs
	$(BIN)/python -m sphinx -q -W --keep-going -c studies/guide . outputs/docs
	@echo "Documentation: outputs/docs/studies/guide/index.html"

bench: $(VENV)/.ready-dev
	$(ONE_THREAD) $(BIN)/python tests/bench_ratios.py
	$(ONE_THREAD) $(BIN)/python tests/bench.py $(ARGS)
	$(ONE_THREAD) $(BIN)/python tests/bench_search.py $(ARGS)

clean:
	rm -rf $(VENV) $(OLDEST) build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis

$(VENV)/bin/python:
	@test -n "$(PYTHON)" || { echo "make: Python 3.11 or newer with venv was not found; set PYTHON=/path/to/python3" >&2; exit 2; }
	$(PYTHON) -m venv $(VENV)

INSTALLING := @echo "Installing into $(VENV): once, which takes a minute or two."

$(VENV)/.ready: pyproject.toml | $(VENV)/bin/python
	$(INSTALLING)
	PYTHONWARNINGS=ignore $(BIN)/python -m pip install --quiet --disable-pip-version-check -e .
	@$(BIN)/python -m compileall -q sweep
	@touch $@

$(VENV)/.ready-dev: pyproject.toml | $(VENV)/bin/python
	$(INSTALLING)
	PYTHONWARNINGS=ignore $(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
	@touch $@ $(VENV)/.ready

# Made anew each time, as what is installed would not go down. uv alone picks the oldest versions, and serves nothing else.
$(OLDEST)/.oldest: pyproject.toml
	@echo "Installing into $(OLDEST): once, which takes a minute or two."
	$(PYTHON) -m venv --clear $(OLDEST)
	$(OLDEST)/bin/python -m pip install --quiet --disable-pip-version-check uv
	$(OLDEST)/bin/uv pip install --quiet --python $(OLDEST)/bin/python --resolution lowest-direct -e '.[dev]'
	@touch $(OLDEST)/.ready $(OLDEST)/.ready-dev $@

$(VENV)/.compiled: $(VENV)/.ready-dev tests/compile.py $(KERNELS)
	@echo "Compiling what the tests share: once, which takes half a minute."
	@$(ONE_THREAD) $(BIN)/python -m tests.compile
	@touch $@

$(VENV)/.ready-docs: pyproject.toml | $(VENV)/bin/python
	$(INSTALLING)
	PYTHONWARNINGS=ignore $(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[docs]'
	@touch $@ $(VENV)/.ready
