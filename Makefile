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

# The model that everything downstream is for: the one fitted from SWEEPS, unless MODEL names another.
FITTED := $(BUILD)/model.json
CHOSEN := $(if $(MODEL),$(MODEL),$(FITTED))
CHOICE := $(BUILD)/choice.txt
MODEL_FILE := $(filter-out table implied,$(CHOSEN))

# A folder among the sweeps stands for the files in it. find looks at them and not make: their names may be anything.
FOLDERS := $(foreach sweep,$(SWEEPS),$(if $(wildcard $(sweep)/.),$(sweep)))
SWEEP_FILES := $(filter-out $(FOLDERS),$(SWEEPS))
IN_FOLDERS := $(if $(FOLDERS),find -L $(FOLDERS) -maxdepth 1 -type f \
	\( -iname '*.csv' -o -iname '*.mat' -o -iname '*.uff' -o -iname '*.unv' -o -iname '*.58' \),:)

LIMITS := $(if $(LIMIT),--limit $(LIMIT))

NAMES := $(sort $(basename $(notdir $(wildcard paper_figures/thesis/figures/fig_*.py))))
DATA_NAMES := fig_2_09 fig_2_10 fig_2_11 fig_2_12 fig_2_13 fig_2_14 fig_4_01 fig_4_02 fig_4_03 fig_4_04 \
	fig_a_01 fig_a_02 fig_a_03 fig_a_04 fig_a_05 fig_a_06
FORMATS := pdf svg png txt
DESIGNS := $(addprefix $(BUILD)/,design_delay_free.json design_extended.json design_robust.json)
TABLES := additive_error f_gamma delay_free extended trade_off interpolation robustness limits_delay_free limits_extended \
	sampled campaign

# The files that each command runs, CODE-ROOM-COMMAND, and that each figure draws with, CODE-FIGURE.
SOURCES := $(shell find identification design experiments paper_figures data/thesis -name '*.py')
build/prerequisites.mk: tools/prerequisites.py $(SOURCES)
	@mkdir -p $(@D)
	@$(PYTHON) $< $@
ifneq (,$(filter-out help test lint bench study referee clean,$(or $(MAKECMDGOALS),help)))
-include build/prerequisites.mk
endif

.PHONY: help figures report refit claims test bench study referee lint clean
help: ## say what there is
	@grep -E '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12
	@echo
	@echo 'make figures MODEL=implied    redraw for the thesis'"'"'s own set (or table, or a model.json)'
	@echo 'make refit SWEEPS="a.csv b.mat folder" OUT=mine    from your own sweeps to mine/summary.pdf and mine/figures'
	@echo 'make refit ... FIT="--modes 1 --bound-order 3"    with options of python -m identification fit'
	@echo 'make refit ... LIMIT=5    under other saturation limits than the thesis'"'"'s'
	@echo 'make ... PLANTS=10000         as many plants drawn within W_a, 200 otherwise (Fig. A.6)'

figures: $(foreach format,$(FORMATS),$(NAMES:%=$(FIGURES)/%.$(format))) ## draw the thesis's figures and A.1 to A.7 into build/figures

report: $(REPORT) ## put verdicts, figures with data, ledger, fit, audits and hashes on one page, build/report/index.html

refit: ## fit SWEEPS="a.csv b.csv", design, simulate, draw and sum up for that plant into OUT
	+@$(MAKE) --no-print-directory REFIT=yes BUILD='$(OUT)' MODEL= SWEEPS='$(SWEEPS)' NAMES='$(DATA_NAMES)' \
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

# Remember what was asked for, so that another MODEL or other SWEEPS rebuild what depends on them.
ifeq (,$(filter grouped-target,$(.FEATURES)))
$(error GNU make 4.3 or newer is needed, found $(MAKE_VERSION))
endif
ifneq (,$(filter figures report $(BUILD)/%,$(MAKECMDGOALS)))
MISSING := $(filter-out $(FITTED) $(wildcard $(SWEEPS) $(MODEL_FILE)),$(SWEEPS) $(MODEL_FILE))
$(if $(MISSING),$(error $(MISSING): no such file; expected sweep files in SWEEPS, or table, implied or a model.json in MODEL))
$(if $(SWEEPS),,$(error SWEEPS is empty; expected one or more sweep files))
ifeq (,$(findstring n,$(filter-out -%,$(firstword $(MAKEFLAGS)))))
$(shell mkdir -p $(RESULTS) $(FIGURES); \
	asked() { printf '%s\n' '$(CHOSEN)' '$(SWEEPS)' '$(FIT)' '$(LIMIT)' '$(PLANTS)'; $(IN_FOLDERS) | sort; }; \
	asked | cmp -s - $(CHOICE) && [ -z "$$($(IN_FOLDERS)$(if $(FOLDERS), -newer $(CHOICE)))" ] || asked > $(CHOICE))
endif
endif

$(CHOICE): ;

# $(call attempt,COMMAND,FILES,INPUTS[,NAME]): run COMMAND, which writes FILES. In `make refit` nothing of other sweeps
# stays, nothing is done if one of INPUTS was refused, and if COMMAND refuses (exit status 2), NAME.refused.txt keeps
# its sentence for the summary.
attempt = $(if $(REFIT),@rm -f $(2) $(4:%=%.refused.txt); for input in $(3); do [ -e $$input ] || exit 0; done; echo '$(1)'; \
	$(if $(4),$(call keeping,$(1),$(4:%=%.refused.txt)),$(1)),$(1))
keeping = if $(1) 2> $(2); then cat $(2) >&2; rm $(2); elif [ $$? != 2 ]; then cat $(2) >&2; exit 1; fi
tables = $(addprefix $(RESULTS)/$(1),.csv _summary.csv)
drawing = $(foreach format,$(FORMATS),$(1:%=$(FIGURES)/%.$(format)))

$(FITTED): $(SWEEP_FILES) $(CODE-identification-fit) $(if $(MODEL),,$(CHOICE)) | $(READY)
	$(if $(REFIT),@rm -rf $@ $(SUMMARY) $(REPORT) $(call drawing,$(DATA_NAMES)) $(BUILD)/design_* $(TABLES:%=$(RESULTS)/%*))
	$(PY) -m identification fit $(SWEEPS) $(FIT) --output $@

# Chapter 2 and chapters 3 and 4, with the thesis's references and free parameters.
$(BUILD)/design_delay_free.json: $(MODEL_FILE) $(CHOICE) $(CODE-design-delay-free) | $(READY)
	$(call attempt,$(PY) -m design delay-free $(CHOSEN) --period 4 --epsilon 1e-4 --output $@,$@,,$(basename $@))

$(BUILD)/design_extended.json: $(MODEL_FILE) $(CHOICE) $(CODE-design-extended) | $(READY)
	$(call attempt,$(PY) -m design extended $(CHOSEN) --reference-omega 1.5 --a 4 --e 2 --f 1 --output $@,$@,,\
		$(basename $@))

# The same with a roll-off, so that W_a guarantees the loop's stability.
$(BUILD)/design_robust.json: $(MODEL_FILE) $(CHOICE) $(CODE-design-extended) | $(READY)
	$(call attempt,$(PY) -m design extended $(CHOSEN) --reference-omega 1.5 --a 4 --e 2 --f 1 --robust-level 0.9 --output $@,\
		$@,,$(basename $@))

$(call tables,pid) &: $(CODE-thesis-pid) | $(READY)
	$(PY) -m experiments thesis pid --output $(RESULTS)

$(call tables,additive_error) &: \
		$(MODEL_FILE) $(CHOICE) $(SWEEP_FILES) $(CODE-thesis-additive-error) | $(READY)
	$(PY) -m experiments thesis additive-error $(CHOSEN) $(SWEEPS) --output $(RESULTS)

$(call tables,f_gamma) &: $(BUILD)/design_extended.json $(CODE-thesis-f-gamma) | $(READY)
	$(call attempt,$(PY) -m experiments thesis f-gamma $< --output $(RESULTS),$(call tables,f_gamma),$<,\
		$(RESULTS)/f_gamma)

$(call tables,delay_free) &: \
		$(BUILD)/design_delay_free.json $(CODE-thesis-delay-free) | $(READY)
	$(call attempt,$(PY) -m experiments thesis delay-free $< $(LIMITS) --output $(RESULTS),$(call tables,delay_free),$<,\
		$(RESULTS)/delay_free)

$(call tables,extended) &: \
		$(BUILD)/design_extended.json $(CODE-thesis-extended) | $(READY)
	$(call attempt,$(PY) -m experiments thesis extended $< $(LIMITS) --output $(RESULTS),$(call tables,extended),$<,\
		$(RESULTS)/extended)

$(call tables,trade_off) &: $(BUILD)/design_extended.json $(CODE-thesis-trade-off) | $(READY)
	$(call attempt,$(PY) -m experiments thesis trade-off $< --output $(RESULTS),$(call tables,trade_off),$<,\
		$(RESULTS)/trade_off)

INTERPOLATION := $(call tables,interpolation) $(RESULTS)/interpolation_map.csv
$(INTERPOLATION) &: $(BUILD)/design_extended.json $(CODE-thesis-interpolation) | $(READY)
	$(call attempt,$(PY) -m experiments thesis interpolation $< --output $(RESULTS),$(INTERPOLATION),$<,\
		$(RESULTS)/interpolation)

ROBUSTNESS := $(BUILD)/design_extended.json $(BUILD)/design_robust.json
$(call tables,robustness) &: $(ROBUSTNESS) $(CODE-thesis-robustness) | $(READY)
	$(call attempt,$(PY) -m experiments thesis robustness $(ROBUSTNESS) --output $(RESULTS),$(call tables,robustness),$(ROBUSTNESS),\
		$(RESULTS)/robustness)

$(call tables,limits_delay_free) &: $(BUILD)/design_delay_free.json $(CODE-thesis-limits) | $(READY)
	$(call attempt,$(PY) -m experiments thesis limits $< --output $(RESULTS),$(call tables,limits_delay_free),$<,\
		$(RESULTS)/limits_delay_free)

$(call tables,limits_extended) &: $(BUILD)/design_extended.json $(CODE-thesis-limits) | $(READY)
	$(call attempt,$(PY) -m experiments thesis limits $< --output $(RESULTS),$(call tables,limits_extended),$<,\
		$(RESULTS)/limits_extended)

$(call tables,sampled) &: $(BUILD)/design_extended.json $(CODE-thesis-sampled-rates) | $(READY)
	$(call attempt,$(PY) -m experiments thesis sampled-rates $< $(LIMITS) --output $(RESULTS),$(call tables,sampled),$<,\
		$(RESULTS)/sampled)

CAMPAIGN := $(RESULTS)/campaign.parquet
$(CAMPAIGN): $(BUILD)/design_extended.json $(CODE-thesis-campaign) | $(READY)
	@rm -rf $@.parts
	$(call attempt,$(PY) -m experiments thesis campaign $< --plants $(PLANTS) --seed 1 $(LIMITS) --output $@,$@,$<,\
		$(RESULTS)/campaign)

DISTRIBUTIONS := $(call tables,campaign) $(RESULTS)/campaign_distance.csv
$(DISTRIBUTIONS) &: $(CAMPAIGN) $(CODE-experiments-campaign-tables) | $(READY)
	$(call attempt,$(PY) -m experiments campaign-tables $< --output $(RESULTS),$(DISTRIBUTIONS),$<)

# What the thesis does not print: about its text, whatever the MODEL.
$(call tables,conditions) &: $(CODE-thesis-conditions) data/thesis/claims.csv | $(READY)
	$(PY) -m experiments thesis conditions --output $(RESULTS)

LEDGER := $(addprefix data/thesis/,claims.csv exceptions.csv coverage.json)
$(BUILD)/claims.csv $(BUILD)/claims.txt CLAIMS.md &: $(LEDGER) $(CODE-thesis-claims) $(CODE-checks) | $(READY)
	@mkdir -p $(BUILD)
	$(PY) -m experiments thesis claims --output $(BUILD) --page CLAIMS.md > $(BUILD)/claims.txt

docs/equations.md: data/thesis/equations.csv $(CODE-thesis-equations) | $(READY)
	@$(PY) -m experiments thesis equations --page $@

define feeds
$(call drawing,$(2)): $(call tables,$(1))
endef
$(eval $(call feeds,pid,fig_2_02 fig_2_03 fig_2_04))
$(eval $(call feeds,additive_error,fig_2_09))
$(eval $(call feeds,f_gamma,fig_2_10 fig_2_11))
$(eval $(call feeds,delay_free,fig_2_12 fig_2_13 fig_2_14))
$(eval $(call feeds,extended,fig_4_01 fig_4_02 fig_4_03 fig_4_04))
$(eval $(call feeds,trade_off,fig_a_01))
$(eval $(call feeds,interpolation,fig_a_02))
$(call drawing,fig_a_02): $(RESULTS)/interpolation_map.csv
$(eval $(call feeds,robustness,fig_a_03))
$(eval $(call feeds,limits_delay_free,fig_a_04))
$(eval $(call feeds,limits_extended,fig_a_04))
$(eval $(call feeds,sampled,fig_a_05))
$(eval $(call feeds,campaign,fig_a_06))
$(call drawing,fig_a_06): $(RESULTS)/campaign_distance.csv
$(eval $(call feeds,conditions,fig_a_07))

DIAGRAMS := fig_2_01 fig_2_05 fig_2_06 fig_2_07 fig_2_08 fig_3_01 fig_3_02

$(foreach name,$(NAMES),$(eval $(call drawing,$(name)): $(CODE-$(name))))

$(foreach format,$(FORMATS),$(FIGURES)/%.$(format)): $(CODE-paper_figures-draw) | $(READY)
	$(call attempt,$(PY) -m paper_figures draw $* --results $(RESULTS) --output $(FIGURES),$(call drawing,$*),\
		$(filter $(RESULTS)/%,$^))

$(SUMMARY) &: $(FITTED) $(CHOICE) $(SWEEP_FILES) $(DESIGNS) $(foreach table,$(TABLES),$(call tables,$(table))) \
		$(CODE-paper_figures-summary) | $(READY)
	$(PY) -m paper_figures summary $(FITTED) $(SWEEPS) --build $(BUILD)

$(REPORT): $(foreach format,svg txt,$(NAMES:%=$(FIGURES)/%.$(format))) $(BUILD)/claims.csv $(MODEL_FILE) $(CHOICE) $(SWEEP_FILES) \
		$(DESIGNS) $(foreach table,pid $(TABLES),$(call tables,$(table))) $(INTERPOLATION) $(DISTRIBUTIONS) requirements.lock \
		data/thesis/claims.csv $(CODE-paper_figures-report) | $(READY)
	$(PY) -m paper_figures report $(CHOSEN) $(SWEEPS) --build $(BUILD)
