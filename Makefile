# make run: set up and run the main job.  make test: set up and run the tests.  VENV=... chooses the environment's folder.
VENV ?= .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
# one BLAS thread per test process: two of them share two cores; memory of arrays below 32 MiB is kept once freed, for fresh pages
# take a tenth of the CPU time of tests with frames; compiled modules are kept, for tests start isethdr in many processes
TEST_ENV := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MALLOC_MMAP_THRESHOLD_=33554432 MALLOC_TRIM_THRESHOLD_=1073741824 PYTHONDONTWRITEBYTECODE=
# named, for pytest would rewrite the assertions of every other package that brings a plugin: three CPU seconds
TEST_PLUGINS := --disable-plugin-autoload -p xdist -p _hypothesis_pytestplugin

.PHONY: run test test-slow bench lint docs clean

run: $(READY)
	$(BIN)/isethdr run

test: lint
	$(TEST_ENV) $(BIN)/python -m pytest $(TEST_PLUGINS) -n 2 --dist loadfile --no-loadscope-reorder

test-slow: $(READY)
	$(BIN)/python -m pytest -m slow

bench: $(READY)
	for file in benchmarks/*.py; do $(BIN)/python $$file || exit 1; done

# all that continuous integration checks beside the tests; mypy and import-linter keep caches
lint: $(READY)
	$(BIN)/python -m ruff format --check --quiet .
	$(BIN)/python -m ruff check --quiet .
	$(BIN)/python -m mypy
	$(BIN)/lint-imports --no-logo

# the documentation as a site, in the folder site; nothing in it is loaded from a network
docs: $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[docs]'
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet
	$(BIN)/python scripts/check_site.py site

$(READY): pyproject.toml constraints.txt scripts/setup.sh scripts/llvm.sh
	VENV=$(VENV) sh scripts/setup.sh
	touch $@

clean:
	rm -rf $(VENV)
