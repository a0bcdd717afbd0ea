# Everything sets itself up: Python 3.11 to 3.13, make and a C library are all that is needed.
#
#   make demo       mesh a STEP part, write STL, OBJ and a picture to demo/, print the quality table
#   make test       all tests, on OCP 7.9 (.venv) and the CAD tests on OCP 8 (.venv8)
#   make lint typecheck contracts docs      the other checks
#   make figures    pictures and tables of the documentation, from the examples
#   make clean      remove all that was made, the environments included

SHELL := /bin/bash
PYTHON ?= $(shell for p in python3 python3.12 python3.13 python3.11 python; do \
	"$$p" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 14))' >/dev/null 2>&1 && { echo "$$p"; break; }; done)
JOBS ?= 2

BIN := .venv/bin
BIN8 := .venv8/bin
PIP := -m pip install -qq --disable-pip-version-check --retries 8 --timeout 60
TESTS8 := $(wildcard tests/cad tests/examples tests/naming)
CHECKED := $(wildcard src tests cad_examples benchmarks docs)

# Compiled kernels lie inside the environment, so nothing outside this folder is touched or needed.
export FUBINI_CACHE_DIR := $(CURDIR)/.venv/kernels
export MPLBACKEND := Agg
export PYTHONNOUSERSITE := 1

.PHONY: demo test test7 test8 lint typecheck contracts docs figures clean

demo: .venv/.ready-demo
	$(BIN)/python cad_examples/bracket.py demo --step
	$(BIN)/fubini mesh demo/bracket.step -o demo/bracket.stl -o demo/bracket.obj --plot demo/bracket.png

test: test7 test8

test7: .venv/.ready-dev
	$(BIN)/python -m pytest -n $(JOBS) --dist loadfile --hypothesis-profile=ci

test8: .venv8/.ready
	$(if $(TESTS8),$(BIN8)/python -m pytest -n $(JOBS) --dist loadfile --hypothesis-profile=ci $(TESTS8))

lint: .venv/.ready-dev
	$(BIN)/ruff check $(CHECKED)

typecheck: .venv/.ready-dev
	$(BIN)/mypy

contracts: .venv/.ready-dev
	$(BIN)/lint-imports

docs: .venv/.ready-dev
	$(BIN)/sphinx-build -W --keep-going -q -b html docs docs/_build/html
	@echo "docs/_build/html/index.html"

figures: .venv/.ready-dev
	$(BIN)/python docs/figures.py

clean:
	rm -rf .venv .venv8 demo docs/_build build .mypy_cache .pytest_cache .ruff_cache .import_linter_cache .hypothesis

# An environment is made once, and again when the requirements change.
.venv/.ready-demo: pyproject.toml
	$(call environment,.venv,all)
	touch $@

.venv/.ready-dev: .venv/.ready-demo
	$(call environment,.venv,all$(comma)dev)
	touch $@

.venv8/.ready: pyproject.toml
	$(call environment,.venv8,build123d-ocp8$(comma)dxf$(comma)svg$(comma)plot$(comma)fem$(comma)test)
	touch $@

comma := ,
define environment
@test -n "$(PYTHON)" || { echo "make: no Python 3.11, 3.12 or 3.13 found; set PYTHON=/path/to/python" >&2; exit 1; }
@echo "setting up $(1) ..."
@test -x $(1)/bin/python || $(PYTHON) -m venv $(1) || { rm -rf $(1); echo "make: $(PYTHON) cannot make environments (on Debian: apt install python3-venv)" >&2; exit 1; }
@$(1)/bin/python $(PIP) -e '.[$(2)]'
endef
