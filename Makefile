# Two commands for a user: make demo, make test. Each sets up .venv by itself.
PYTHON ?= python3
BIN := .venv/bin
# of the tests: any number; the same for everyone, so that what is red is red for all
ORDER ?= 2015
PINNED := pyproject.toml constraints.txt build_scripts/setup_venv.py

.PHONY: demo test sources lint types bench docs fmus reproduce mutate clean

demo: .venv/ready
	$(BIN)/tsm-fmu demo --out out/demo

# small matrices: threads only cost; of two processors the third process takes what tests that wait leave; hundreds of
# processes start: sources are compiled once
test: sources lint types
	OPENBLAS_NUM_THREADS=1 PYTHONDONTWRITEBYTECODE= $(BIN)/pytest -n 3 --dist loadfile --no-loadscope-reorder --randomly-seed=$(ORDER)

sources: .venv/ready-test  # of tests and kernels, for all workers at once: in the background, while lint and types look
	@{ PYTHONDONTWRITEBYTECODE= $(BIN)/pytest --collect-only -qq; $(BIN)/python -m tsm_fmu.kernels.precompile; } >/dev/null 2>&1 &

lint: .venv/ready-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: .venv/ready-test
	$(BIN)/basedpyright

bench: .venv/ready-test
	$(BIN)/python -m benchmarks

docs: .venv/ready-test
	$(BIN)/sphinx-build -W -q -b html docs docs/_build
	@echo docs/_build/index.html

fmus: .venv/ready
	$(BIN)/python build_scripts/build_fmus.py

reproduce: .venv/ready
	$(BIN)/tsm-fmu reproduce --out out/reproduce

mutate: .venv/ready-mutation  # faults put into the files that differ from BASE: which of them do the tests not see?
	OPENBLAS_NUM_THREADS=1 $(BIN)/python build_scripts/mutate.py --base $(or $(BASE),main) --most $(or $(MOST),20) --seed $(or $(SEED),0) $(FILES)

.venv/ready: $(PINNED)
	$(PYTHON) build_scripts/setup_venv.py
	@touch $@
	@echo "setup: models and effects are compiled in the background, for the first diagnosis"
	@nice $(BIN)/python -m tsm_fmu.kernels.precompile >/dev/null 2>&1 &

.venv/ready-test: $(PINNED)
	$(PYTHON) build_scripts/setup_venv.py test
	@touch $@ .venv/ready

.venv/ready-mutation: $(PINNED)
	$(PYTHON) build_scripts/setup_venv.py test,mutation
	@touch $@ .venv/ready .venv/ready-test

clean:
	rm -rf out build docs/_build docs/models docs/effects fmus/dist .pytest_cache .ruff_cache
