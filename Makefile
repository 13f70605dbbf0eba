# Usage:
#   make run        set up .venv and run the main job
#   make test       set up .venv, check format and types, run the tests
#   make test-slow  run the long tests
#   make test-extras  install the extras that only few tests need, and run these tests
#   make bench      run the benchmarks
#   make experiments  make again all that the questions' pages claim, step by step
#   make lint       check format, lint rules, types and import contracts
#   make clean      remove .venv
# VENV=folder uses another folder than .venv.

VENV ?= .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

# Settings of the test processes:
# - One thread per process for linear algebra, because two processes share two cores.
# - The memory allocator keeps freed arrays below 32 MiB instead of returning them to the system.
#   This saves a tenth of the CPU time of tests with frames.
# - Python writes compiled modules, because many tests start isethdr in a new process.
TEST_ENV := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
TEST_ENV += MALLOC_MMAP_THRESHOLD_=33554432 MALLOC_TRIM_THRESHOLD_=1073741824
TEST_ENV += PYTHONDONTWRITEBYTECODE=

# Only these plugins of pytest are loaded. With all of them, pytest would also rewrite the
# assertions of the packages that contain the others, which takes three CPU seconds. The one that is
# left out searches for garbage five times at the end of each process.
TEST_PLUGINS := --disable-plugin-autoload -p xdist -p _hypothesis_pytestplugin
TEST_PLUGINS += -p no:unraisableexception

PYTEST := $(TEST_ENV) $(BIN)/python -m pytest $(TEST_PLUGINS)

.PHONY: run test test-slow test-extras quick-tests bench experiments lint docs clean

run: $(READY)
	$(BIN)/isethdr run

# the type checker takes one processor, so that the tests begin beside it
test: $(READY)
	$(MAKE) --no-print-directory -j 2 lint quick-tests

# Each process would take ten seconds to rewrite the assertions of all files, so that a failed one
# shows its values. The tests that fail are run a second time for this.
quick-tests: $(READY)
	$(PYTEST) -n 2 --dist loadfile --no-loadscope-reorder --assert=plain \
	    || { [ $$? = 1 ] && $(PYTEST) --last-failed --last-failed-no-failures none; false; }

test-slow: $(READY)
	$(PYTEST) -n 2 --dist loadfile -rs -m slow

# Tests of the extras test-cards (validators of exported records), test-s3 (a local S3 server),
# test-copier (the template of plugins), slurm and docs. Tests of a real cluster and of completion
# in other shells also need the Debian packages slurm-wlm, zsh and fish. The summary names each test
# that is skipped, and what it lacks.
TESTS_OF_EXTRAS := tests/workflows/export/test_cards.py
TESTS_OF_EXTRAS += tests/core/storage/test_object_home_server.py
TESTS_OF_EXTRAS += tests/workflows/test_slurm.py tests/workflows/dataset/test_cluster.py
TESTS_OF_EXTRAS += tests/workflows/test_sweeps.py::test_chunks_store_the_same
TESTS_OF_EXTRAS += tests/core/cli/test_completion.py tests/house/test_site.py
TESTS_OF_EXTRAS += tests/core/cli/test_plugin_template.py

test-extras: $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt \
	    -e '.[test-cards,test-s3,test-copier,slurm,docs]'
	$(PYTEST) -rs -m 'slow or not slow' $(TESTS_OF_EXTRAS)

bench: $(READY)
	for file in benchmarks/*.py; do $(BIN)/python $$file || exit 1; done

# Steps that are done are skipped, so an interrupted one is typed again. Networks are left out unless
# the extra train is installed.
experiments: $(READY)
	$(BIN)/isethdr experiments run

# The checks of continuous integration other than the tests. mypy and import-linter use caches.
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
	$(BIN)/python scripts/check_widths.py site

$(READY): pyproject.toml constraints.txt scripts/setup.sh scripts/llvm.sh
	VENV=$(VENV) sh scripts/setup.sh
	touch $@

clean:
	rm -rf $(VENV)
