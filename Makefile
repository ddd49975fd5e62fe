# `make demo` and `make test` start from nothing but Python 3.11 or newer and make.
PYTHON ?= $(shell for p in python3.13 python3.12 python3.11 python3; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
VENV ?= .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: demo test lint types docs bench validation clean

demo: $(READY)
	$(BIN)/tlpsim build -o build/fmus
	$(BIN)/tlpsim run scenarios/typical_tlp.toml -o build/demo.h5
	$(BIN)/tlpsim report build/demo.h5 -o build/demo.html

# Two tests at a time, with one thread of linear algebra each: more would wait for each other.
test: $(READY)
	OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 $(BIN)/python -m pytest --numprocesses 2

validation: $(READY)
	$(BIN)/python -m pytest -m validation

BENCHMARKS := chain filters bem bem_second_order physics drift platform_motion monolithic master coupling spectral results sweep

bench: $(READY)
	$(BIN)/pip install --quiet --editable '.[compare]'
	failed=; for name in $(BENCHMARKS); do $(BIN)/python benchmarks/$$name.py || failed="$$failed $$name"; done; \
	test -z "$$failed" || { echo "bounds missed:$$failed"; exit 1; }

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

# A mapped editable install cannot be followed by mypy: check a regular install of the same sources.
types: $(READY)
	rm -rf build
	$(BIN)/pip install --quiet --no-deps --target build/types .
	cd build/types && MYPYPATH=. $(abspath $(BIN))/mypy --config-file $(abspath pyproject.toml) -p tlpsim

# The site, in build/site: open build/site/index.html. That every block of code in it runs is among the tests.
docs: $(READY)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

$(READY): pyproject.toml
	@test -n "$(PYTHON)" || { echo "tlpsim needs Python 3.11 or newer on the PATH (or PYTHON=/path/to/python)"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --editable '.[dev]'
	touch $(READY)

clean:
	rm -rf build $(VENV) *.egg-info
	find . -name __pycache__ -prune -exec rm -rf {} +
