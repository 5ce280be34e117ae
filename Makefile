# Sweep files in, every figure of the thesis out. `make help` says what there is.

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help
MAKEFLAGS += --no-builtin-rules
# The matrices are small: threads of the matrix library cost more than they bring, and change the last digits.
export OPENBLAS_NUM_THREADS := 1

PYTHON ?= python3
BUILD ?= build
OUT ?= build/refit
ifeq ($(origin SWEEPS),undefined)
SWEEPS := $(sort $(wildcard data/elevation/*_frf.csv))
endif
SETS ?= 200
SEED ?= 1
TIMES ?= 5

PY := .venv/bin/python
READY := .venv/.ready
COMPILED = $(dir $(READY)).compiled
BENCH_READY := .venv/.bench-ready
AUDIT_READY := .venv/.audit-ready

# Values go to Python by the environment, as they were given: neither make nor the shell reads a name in them.
GIVEN := SWEEPS MODEL FIT AXIS LIMIT PLANTS JOBS ONLY FORCE BUILD OUT SETS CASES SEED TIMES
unexport $(GIVEN)
define hand
export ANTIWINDUP_$(1) := $$(value $(1))
endef
$(foreach name,$(filter-out BUILD OUT,$(GIVEN)),$(eval $(call hand,$(name))))
figures report: export ANTIWINDUP_OUTPUT := $(value BUILD)
refit: export ANTIWINDUP_OUTPUT := $(value OUT)

.PHONY: help figures report refit claims test suite bench bench-build docs study referee fuzz faults audit lint release-check clean
help: ## say what there is
	@grep -E '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12
	@echo
	@echo 'make figures MODEL=implied    redraw for the thesis'"'"'s own set (or table, or a model.json); ONLY=fig_2_01'
	@echo 'make refit SWEEPS="a.csv b.mat folder" OUT=mine    from your own sweeps to mine/summary.pdf and mine/figures'
	@echo 'make refit ... FIT="--modes 1 --bound-order 3"    with options of python -m identification fit'
	@echo 'make refit ... AXIS=axis.toml    for your axis: .venv/bin/antiwindup new axis.toml writes the file to fill in'
	@echo 'make refit ... LIMIT="-3 12"    the saturation limits alone; LIMIT=5 for +-5, with make figures too'
	@echo 'make ... PLANTS=10000    as many plants drawn within W_a, 200 otherwise (Fig. A.6); JOBS=1 one step at a time'
	@echo 'make ... FORCE=yes    replace files of yours that stand in the place of an output'
figures: $(COMPILED) ## draw the thesis's figures and A.1 to A.9 into build/figures
	@$(PY) -m antiwindup.from_make figures
report: $(COMPILED) ## put verdicts, figures with data, ledger, fit, audits and hashes on one page, build/report/index.html
	@$(PY) -m antiwindup.from_make report
refit: $(COMPILED) ## fit SWEEPS="a.csv b.csv", design, simulate, draw and sum up for that plant into OUT
	@$(PY) -m antiwindup.from_make refit
docs: $(READY) ## build the documentation site: build/docs/html/index.html
	$(PY) -m sphinx --quiet --fail-on-warning --keep-going -d build/docs/doctrees docs build/docs/html
claims: $(READY) ## recompute what the thesis claims and say what agrees: build/claims/claims.csv, docs/thesis/claims.md, docs/thesis/equations.md
	@mkdir -p build/claims
	@$(PY) -m experiments thesis claims --output build/claims --page docs/thesis/claims.md
	@$(PY) -m experiments thesis equations --page docs/thesis/equations.md
test: $(READY) ## check style, types and everything else
	@$(MAKE) --no-print-directory --jobs=2 lint suite
suite: $(READY) ## run the tests alone
	$(PY) -m pytest -q -n 2 --dist loadfile
bench: $(BENCH_READY) ## measure speed against peers (needs a C compiler), the memory of large inputs, and how large work scales
	$(PY) -m pytest -q -s benchmarks --benchmark-only --benchmark-columns=median,iqr,rounds
	$(PY) benchmarks/closed_loop_cost.py --output build/bench
	$(PY) benchmarks/size_study.py
	$(PY) benchmarks/scaling_study.py
bench-build: $(COMPILED) ## measure, TIMES times each, what a user waits for: figures, report, refit, first page, --help, a first figure
	@mkdir -p build/bench
	$(PY) -m benchmarks.build_study --times="$$ANTIWINDUP_TIMES" --output=build/bench
study: $(READY) ## fit hundreds of synthetic sets: success, distance from the Cramer-Rao bound, coverage, time
	$(PY) benchmarks/identification_study.py --sets="$$ANTIWINDUP_SETS"
referee: $(READY) ## compare CASES (200) random cases of SEED with independent numerics, all that is said of them
	$(PY) -m benchmarks.referee --cases="$${ANTIWINDUP_CASES:-200}" --seed="$$ANTIWINDUP_SEED"
fuzz: $(READY) ## give the commands CASES (10000) damaged files, odd numbers and odd names of each kind, of SEED; faults: build/fuzz
	$(PY) -m benchmarks.fuzz --cheap --cases="$${ANTIWINDUP_CASES:-10000}" --seed="$$ANTIWINDUP_SEED" --keep=build/fuzz
	$(PY) -m benchmarks.fuzz --cases=100 --seed="$$ANTIWINDUP_SEED" --keep=build/fuzz
faults: $(READY) ## interrupt, kill, starve and double the commands TIMES times each with SEED
	$(PY) -m benchmarks.interrupts --times="$$ANTIWINDUP_TIMES" --seed="$$ANTIWINDUP_SEED"
	$(PY) -m benchmarks.faults --times="$$ANTIWINDUP_TIMES" --seed="$$ANTIWINDUP_SEED"
audit: $(AUDIT_READY) ## look the locked packages up in the database of known vulnerabilities (needs the network)
	.venv/bin/pip-audit --strict --disable-pip --requirement requirements.lock --requirement requirements-bench.lock
lint: $(READY) ## check style and types
	.venv/bin/ruff check --quiet .
	.venv/bin/ruff format --quiet --check .
	.venv/bin/mypy
	.venv/bin/lint-imports --no-cache --no-logo
release-check: $(READY) ## say whether this commit can be released: tree, versions, lint, suite, docs, wheel, links
	@echo '1 of 7: the tree is clean'
	@test -z "$$(git status --porcelain)" || { git status --short; exit 1; }
	@echo '2 of 7: version, changelog and citation agree'
	@$(PY) -m pytest -q tests/hygiene/test_release.py
	@echo '3 of 7: lint'
	@$(MAKE) --no-print-directory lint
	@echo '4 of 7: the suite'
	@$(MAKE) --no-print-directory suite
	@echo '5 of 7: the documentation builds without a warning'
	@$(MAKE) --no-print-directory docs
	@echo '6 of 7: the wheel builds, and works in a new environment (needs a package index)'
	@rm -rf build/release
	@$(PY) -m pip wheel --quiet --no-deps --no-build-isolation --no-index --wheel-dir build/release .
	@$(PYTHON) -m venv build/release/environment
	@build/release/environment/bin/python -m pip install --quiet --require-hashes --requirement requirements.lock
	@build/release/environment/bin/python -m pip install --quiet --no-deps --no-index build/release/*.whl
	@said=$$(cd build/release && environment/bin/antiwindup --version); \
	wanted="antiwindup, version $$(sed -n 's/^version = "\(.*\)"$$/\1/p' pyproject.toml)"; \
	test "$$said" = "$$wanted" || { echo "the wheel says: $$said; expected: $$wanted"; exit 1; }
	@cd build/release && environment/bin/antiwindup design extended implied --reference-hz 0.25 --output design.json
	@echo '7 of 7: the links to other sites work (needs the network)'
	@$(PY) -c 'from urllib.request import urlopen; urlopen("https://semver.org", timeout=20)' 2>/dev/null || \
	{ echo 'the links were not checked: https://semver.org does not answer, and this step needs the network'; exit 1; }
	@$(PY) -m sphinx --quiet -b linkcheck -d build/docs/doctrees docs build/docs/links
clean: ## remove what was built, but for .venv
	rm -rf build

$(READY): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed; set PYTHON=")'
	$(PYTHON) -m venv .venv
	$(PY) -m pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements.lock
	$(PY) -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --no-index --editable .
	@touch $@

# Compiled code is kept in the user's cache folder; here is what takes long to compile.
$(COMPILED): $(READY) $(shell grep -rsl --include=*.py @njit identification design experiments)
	@$(PY) -m antiwindup.compile_ahead
	@touch $@

# What `make bench` and `make audit` need beyond that.
$(BENCH_READY) $(AUDIT_READY): .venv/.%-ready: requirements-%.lock $(READY)
	$(PY) -m pip install --quiet --disable-pip-version-check --require-hashes --requirement $<
	@touch $@
