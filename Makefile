# make run: set up and run the main job.  make test: set up and run the tests.  VENV=... chooses the environment's folder.
VENV ?= .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
# one BLAS thread per test process: two of them share two cores
TEST_ENV := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1

.PHONY: run test test-slow bench lint clean

run: $(READY)
	$(BIN)/isethdr run

test: $(READY)
	$(TEST_ENV) $(BIN)/python -m pytest -n 2 --dist loadfile

test-slow: $(READY)
	$(BIN)/python -m pytest -m slow

bench: $(READY)
	for file in benchmarks/*.py; do $(BIN)/python $$file || exit 1; done

lint: $(READY)
	$(BIN)/python -m ruff check .

$(READY): pyproject.toml constraints.txt scripts/setup.sh scripts/llvm.sh
	VENV=$(VENV) sh scripts/setup.sh
	touch $@

clean:
	rm -rf $(VENV)
