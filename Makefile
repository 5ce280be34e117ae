# Sweep files in, every figure of the thesis out. `make help` says what there is.

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help
MAKEFLAGS += --no-builtin-rules
$(if $(filter grouped-target,$(.FEATURES)),,$(error GNU make 4.3 or newer is needed, found $(MAKE_VERSION)))
# The matrices are small: threads of the matrix library cost more than they bring, and change the last digits.
export OPENBLAS_NUM_THREADS := 1

PYTHON ?= python3
BUILD ?= build
MODEL ?=
SWEEPS ?= $(sort $(wildcard data/elevation/*_frf.csv))
FIT ?=
OUT ?= build/refit
LIMIT ?=
SETS ?= 200
PLANTS ?= 200
CASES ?= 200
SEED ?= 1
REFIT :=

PY := .venv/bin/python
READY := .venv/.ready
BENCH_READY := .venv/.bench-ready
RESULTS := $(BUILD)/results
FIGURES := $(BUILD)/figures
SUMMARY := $(addprefix $(BUILD)/summary.,pdf svg png txt)
REPORT := $(BUILD)/report/index.html
csv = $(patsubst %,$(RESULTS)/%.csv,$(1))
drawn = $(foreach name,$(1),$(addprefix $(FIGURES)/$(name).,pdf svg png txt))

# The model that everything downstream is for: the one fitted from SWEEPS, unless MODEL names another.
FITTED := $(BUILD)/model.json
CHOSEN := $(or $(MODEL),$(FITTED))
MODEL_FILE := $(filter-out table implied,$(CHOSEN))
# The fit keeps the responses of its tests; what comes after reads these, and for another MODEL the sweeps themselves.
RESPONSES := $(BUILD)/responses.npz
TESTS = $(if $(MODEL),$(SWEEPS),$(RESPONSES))
CHOICE := $(BUILD)/choice.txt
of_model = $(filter-out pid% conditions%,$(1))

# CODE-ROOM-COMMAND and CODE-FIGURE, the files that each command and figure hangs on, and TABLES-FIGURE; the folders are
# newer when a file comes or goes
build/prerequisites.mk: tools/prerequisites.py $(shell find identification design experiments paper_figures \
		data/thesis -name '*.py' -o -type d -not -name __pycache__)
	@mkdir -p $(@D)
	@$(PYTHON) $< $@
ifneq (,$(filter-out help test lint bench study referee clean,$(or $(MAKECMDGOALS),help)))
-include build/prerequisites.mk
endif
NAMES := $(sort $(basename $(notdir $(wildcard paper_figures/thesis/figures/fig_*.py))))
OF_MODEL := $(strip $(foreach name,$(NAMES),$(if $(call of_model,$(TABLES-$(name))),$(name))))

.PHONY: help figures report refit claims test bench study referee lint clean
help: ## say what there is
	@grep -E '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12
	@echo
	@echo 'make figures MODEL=implied    redraw for the thesis'"'"'s own set (or table, or a model.json)'
	@echo 'make refit SWEEPS="a.csv b.mat folder" OUT=mine    from your own sweeps to mine/summary.pdf and mine/figures'
	@echo 'make refit ... FIT="--modes 1 --bound-order 3"    with options of python -m identification fit'
	@echo 'make refit ... LIMIT=5    under other saturation limits than the thesis'"'"'s'
	@echo 'make ... PLANTS=10000         as many plants drawn within W_a, 200 otherwise (Fig. A.6)'
figures: $(call drawn,$(NAMES)) ## draw the thesis's figures and A.1 to A.7 into build/figures
report: $(REPORT) ## put verdicts, figures with data, ledger, fit, audits and hashes on one page, build/report/index.html
refit: ## fit SWEEPS="a.csv b.csv", design, simulate, draw and sum up for that plant into OUT
	+@$(MAKE) --no-print-directory REFIT=yes BUILD='$(OUT)' MODEL= SWEEPS='$(SWEEPS)' NAMES='$(OF_MODEL)' \
		figures '$(OUT)/summary.pdf'
claims: $(BUILD)/claims.txt docs/equations.md ## recompute what the thesis claims and say what agrees: build/claims.csv and CLAIMS.md
	@cat $<
test: lint ## check style, types and everything else
	$(PY) -m pytest -q -n 2 --dist loadfile
bench: $(BENCH_READY) ## measure speed as ratios against peers, and the cost of a run (needs a C compiler)
	$(PY) -m pytest -q -s benchmarks --benchmark-only --benchmark-columns=median,iqr,rounds
	$(PY) benchmarks/closed_loop_cost.py --output $(BUILD)/bench
study: $(READY) ## fit hundreds of synthetic sets: success, distance from the Cramer-Rao bound, coverage, time
	$(PY) benchmarks/identification_study.py --sets $(SETS)
referee: $(READY) ## compare CASES random cases of SEED with independent numerics, all that is said of them
	$(PY) -m benchmarks.referee --cases $(CASES) --seed $(SEED)
lint: $(READY) ## check style and types
	.venv/bin/ruff check --quiet .
	.venv/bin/ruff format --quiet --check .
	.venv/bin/mypy
	.venv/bin/lint-imports --no-cache --no-logo
clean: ## remove what was built, but for .venv
	rm -rf build

$(READY): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed; set PYTHON=")'
	$(PYTHON) -m venv .venv
	$(PY) -m pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements.lock
	$(PY) -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --no-index --editable .
	@touch $@

# What `make bench` needs beyond that.
$(BENCH_READY): requirements-bench.lock $(READY)
	$(PY) -m pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements-bench.lock
	@touch $@

# Remember what was asked for, so that another MODEL or other SWEEPS rebuild what depends on them. A folder among SWEEPS
# stands for the files in it; find looks at them and not make: their names may be anything.
FOLDERS := $(foreach sweep,$(SWEEPS),$(if $(wildcard $(sweep)/.),$(sweep)))
SWEEP_FILES := $(filter-out $(FOLDERS),$(SWEEPS))
in_folders = $(if $(FOLDERS),$(shell find -L $(FOLDERS) -maxdepth 1 -type f \( -iname '*.csv' -o -iname '*.mat' \
	-o -iname '*.uff' -o -iname '*.unv' -o -iname '*.58' \) $(1) | sort))
ifneq (,$(filter figures report $(BUILD)/%,$(MAKECMDGOALS)))
MISSING := $(filter-out $(FITTED) $(wildcard $(SWEEPS) $(MODEL_FILE)),$(SWEEPS) $(MODEL_FILE))
$(if $(MISSING),$(error $(MISSING): no such file; expected sweep files in SWEEPS, or table, implied or a model.json in MODEL))
$(if $(SWEEPS),,$(error SWEEPS is empty; expected one or more sweep files))
ASKED := $(CHOSEN) of $(SWEEPS) with $(FIT), limits $(LIMIT), plants $(PLANTS), folders of $(call in_folders)
CHANGED := $(if $(wildcard $(CHOICE)),$(call in_folders,-newer $(CHOICE)))
ifeq (,$(findstring n,$(filter-out -%,$(firstword $(MAKEFLAGS)))))
$(shell mkdir -p $(RESULTS) $(FIGURES))
ifneq ($(ASKED)$(CHANGED),$(file <$(CHOICE)))
$(file >$(CHOICE),$(ASKED))
endif
endif
endif
$(CHOICE): ;

# $(call run,FILES,ROOM [GROUP],COMMAND ...) writes FILES. In `make refit` no FILES of other sweeps stay; and if COMMAND
# refuses, its sentence is kept for the summary beside the first of FILES, and only what hangs on it is not made.
define run
$(if $(REFIT),@rm -f $(1))
	$(strip $(PY) -m $(firstword $(2)) $(if $(REFIT),--refusal $(basename $(firstword $(1))).refused.txt) \
		$(word 2,$(2)) $(3))
endef
# $(call rule,FILES,ROOM [GROUP],COMMAND ...): FILES hang on the code of the command and on the files that it is given
define rule
$(1) &: $(filter $(filter-out $(1),$(INPUTS)),$(3)) $(if $(filter $(CHOSEN),$(3)),$(CHOICE)) \
		$(CODE-$(lastword $(2))-$(firstword $(3))) | $(READY)
	$(call run,$(1),$(2),$(3))
endef
design = $(eval $(call rule,$(1),design,$(2) --output $(1)))
tables = $(eval TABLES += $(1))$(eval \
	$(call rule,$(call csv,$(1)),$(or $(3),experiments thesis),$(2) --output $(RESULTS)))
INPUTS = $(MODEL_FILE) $(SWEEP_FILES) $(RESPONSES) $(DESIGNS) $(CAMPAIGN)
LIMITS := $(if $(LIMIT),--limit $(LIMIT))

$(FITTED) $(RESPONSES) &: $(SWEEP_FILES) $(CODE-identification-fit) $(if $(MODEL),,$(CHOICE)) | $(READY)
	$(if $(REFIT),@rm -rf $(FITTED) $(RESPONSES) $(SUMMARY) $(REPORT) $(call drawn,$(OF_MODEL)) $(BUILD)/design_* \
		$(patsubst %,$(RESULTS)/%*,$(call of_model,$(TABLES))))
	$(PY) -m identification fit $(SWEEPS) $(FIT) --output $(FITTED) --responses $(RESPONSES)

# With the thesis's references and free parameters; the last has a roll-off, so that W_a guarantees its stability.
DELAY_FREE := $(BUILD)/design_delay_free.json
EXTENDED := $(BUILD)/design_extended.json
ROBUST := $(BUILD)/design_robust.json
DESIGNS := $(DELAY_FREE) $(EXTENDED) $(ROBUST)
$(call design,$(DELAY_FREE),delay-free $(CHOSEN) --period 4 --epsilon 1e-4)
$(call design,$(EXTENDED),extended $(CHOSEN) --reference-omega 1.5 --a 4 --e 2 --f 1)
$(call design,$(ROBUST),extended $(CHOSEN) --reference-omega 1.5 --a 4 --e 2 --f 1 --robust-level 0.9)

$(call tables,pid pid_summary,pid)
$(call tables,conditions conditions_summary,conditions)
$(call tables,additive_error additive_error_summary,additive-error $(CHOSEN) $(TESTS))
$(call tables,f_gamma f_gamma_summary,f-gamma $(EXTENDED))
$(call tables,delay_free delay_free_summary,delay-free $(DELAY_FREE) $(LIMITS))
$(call tables,extended extended_summary,extended $(EXTENDED) $(LIMITS))
$(call tables,trade_off trade_off_summary,trade-off $(EXTENDED))
$(call tables,interpolation interpolation_map interpolation_summary,interpolation $(EXTENDED))
$(call tables,robustness robustness_summary,robustness $(EXTENDED) $(ROBUST))
$(call tables,limits_delay_free limits_delay_free_summary,limits $(DELAY_FREE))
$(call tables,limits_extended limits_extended_summary,limits $(EXTENDED))
$(call tables,sampled sampled_summary,sampled-rates $(EXTENDED) $(LIMITS))
CAMPAIGN := $(RESULTS)/campaign.parquet
$(CAMPAIGN): $(EXTENDED) $(CODE-thesis-campaign) | $(READY)
	@rm -rf $@.parts
	$(call run,$@,experiments thesis,campaign $< --plants $(PLANTS) --seed 1 $(LIMITS) --output $@)
$(call tables,campaign_distance campaign campaign_summary,campaign-tables $(CAMPAIGN),experiments)

$(BUILD)/claims.csv $(BUILD)/claims.txt CLAIMS.md &: $(CODE-thesis-claims) $(CODE-checks) | $(READY)
	@mkdir -p $(BUILD)
	$(PY) -m experiments thesis claims --output $(BUILD) --page CLAIMS.md > $(BUILD)/claims.txt
docs/equations.md: $(CODE-thesis-equations) | $(READY)
	@$(PY) -m experiments thesis equations --page $@

$(foreach name,$(NAMES),$(eval $(call drawn,$(name)): $(CODE-$(name)) $(call csv,$(TABLES-$(name)))))
$(call drawn,%): $(CODE-paper_figures-draw) | $(READY)
	$(call run,$(call drawn,$*),paper_figures,draw $* --results $(RESULTS) --output $(FIGURES))

$(SUMMARY) &: $(FITTED) $(RESPONSES) $(CHOICE) $(DESIGNS) $(call csv,$(call of_model,$(TABLES))) \
		$(CODE-paper_figures-summary) | $(READY)
	$(PY) -m paper_figures summary $(FITTED) $(RESPONSES) --build $(BUILD)

$(REPORT): $(filter %.svg %.txt,$(call drawn,$(NAMES))) $(BUILD)/claims.csv $(MODEL_FILE) $(CHOICE) $(filter $(SWEEP_FILES) $(RESPONSES),$(TESTS)) \
		$(DESIGNS) $(call csv,$(TABLES)) $(CODE-paper_figures-report) | $(READY)
	$(PY) -m paper_figures report $(CHOSEN) $(TESTS) --build $(BUILD)
