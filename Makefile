# Sweep files in, every figure of the thesis out. `make help` says what there is.

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help
MAKEFLAGS += --no-builtin-rules

PYTHON ?= python3
BUILD ?= build
MODEL ?=
SWEEPS ?= $(sort $(wildcard data/elevation/*_frf.csv))
OUT ?= build/refit
LIMIT ?=

PY := .venv/bin/python
READY := .venv/.ready
RESULTS := $(BUILD)/results
FIGURES := $(BUILD)/figures
THESIS := data/thesis/thesis.toml

# The model that everything downstream is for: the one fitted from SWEEPS, unless MODEL names another.
FITTED := $(BUILD)/model.json
CHOSEN := $(if $(MODEL),$(MODEL),$(FITTED))
CHOICE := $(BUILD)/choice.txt
MODEL_FILE := $(filter-out table implied,$(CHOSEN))

LIMITS := $(if $(LIMIT),--limit $(LIMIT))

NAMES := $(sort $(basename $(notdir $(wildcard paper_figures/fig_*.py))))
DATA_NAMES := fig_2_09 fig_2_10 fig_2_11 fig_2_12 fig_2_13 fig_2_14 fig_4_01 fig_4_02 fig_4_03 fig_4_04
FORMATS := pdf svg png txt

CONTRACT := $(addprefix identification/,files.py plant.py model.py thesis.py) $(THESIS)
READING := $(addprefix identification/,frequency_response.py sweep.py)
ENGINE := $(addprefix experiments/,__main__.py closed_loop.py taylor.py crossings.py loops.py scenarios.py metrics.py)
TRACKING := $(ENGINE) $(addprefix experiments/,tracking.py pade.py)

.PHONY: help figures refit claims test bench lint clean
help: ## say what there is
	@grep -E '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12
	@echo
	@echo 'make figures MODEL=implied    redraw for the thesis'"'"'s own set (or table, or a model.json)'
	@echo 'make refit SWEEPS="a.csv b.csv" OUT=mine    from your own sweep files to the figures of your plant'
	@echo 'make refit ... LIMIT=5    under other saturation limits than the thesis'"'"'s'

figures: $(foreach format,$(FORMATS),$(NAMES:%=$(FIGURES)/%.$(format))) ## draw every figure of the thesis into build/figures

refit: ## fit SWEEPS="a.csv b.csv", design, simulate and draw for that plant into OUT
	+@$(MAKE) --no-print-directory BUILD='$(OUT)' MODEL= SWEEPS='$(SWEEPS)' NAMES='$(DATA_NAMES)' figures

claims: $(BUILD)/claims.txt ## recompute the numbers that the thesis prints and say which agree
	@cat $<

test: lint ## check style, types and everything else
	$(PY) -m pytest -q -n 2 --dist loadfile

bench: $(READY) ## measure speed as ratios against peers
	$(PY) -m pytest -q -s benchmarks --benchmark-only --benchmark-columns=median,iqr,rounds

lint: $(READY) ## check style and types
	.venv/bin/ruff check --quiet .
	.venv/bin/ruff format --quiet --check .
	.venv/bin/mypy

clean: ## remove what was built, but for .venv
	rm -rf build

$(READY): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed; set PYTHON=")'
	$(PYTHON) -m venv .venv
	$(PY) -m pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements.lock
	$(PY) -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --no-index --editable .
	@touch $@

# Remember what was asked for, so that another MODEL or other SWEEPS rebuild what depends on them.
ifeq (,$(filter grouped-target,$(.FEATURES)))
$(error GNU make 4.3 or newer is needed, found $(MAKE_VERSION))
endif
ifneq (,$(filter figures $(BUILD)/%,$(MAKECMDGOALS)))
MISSING := $(filter-out $(FITTED) $(wildcard $(SWEEPS) $(MODEL_FILE)),$(SWEEPS) $(MODEL_FILE))
$(if $(MISSING),$(error $(MISSING): no such file; expected sweep files in SWEEPS, or table, implied or a model.json in MODEL))
$(if $(SWEEPS),,$(error SWEEPS is empty; expected one or more sweep files))
ifeq (,$(findstring n,$(filter-out -%,$(firstword $(MAKEFLAGS)))))
$(shell mkdir -p $(RESULTS) $(FIGURES); printf '%s\n' '$(CHOSEN)' '$(SWEEPS)' '$(LIMIT)' | cmp -s - $(CHOICE) || \
	printf '%s\n' '$(CHOSEN)' '$(SWEEPS)' '$(LIMIT)' > $(CHOICE))
endif
endif

$(FITTED): $(SWEEPS) $(wildcard identification/*.py) $(if $(MODEL),,$(CHOICE)) | $(READY)
	$(PY) -m identification fit $(SWEEPS) --output $@

# Chapter 2 and chapters 3 and 4, with the thesis's references and free parameters.
$(BUILD)/design_delay_free.json: $(MODEL_FILE) $(CHOICE) $(wildcard design/*.py) $(CONTRACT) | $(READY)
	$(PY) -m design delay-free $(CHOSEN) --period 4 --output $@

$(BUILD)/design_extended.json: $(MODEL_FILE) $(CHOICE) $(wildcard design/*.py) $(CONTRACT) | $(READY)
	$(PY) -m design extended $(CHOSEN) --reference-omega 1.5 --a 4 --e 2 --f 1 --output $@

$(RESULTS)/pid.csv $(RESULTS)/pid_summary.csv &: experiments/pid.py $(ENGINE) $(THESIS) | $(READY)
	$(PY) -m experiments pid --output $(RESULTS)

$(RESULTS)/additive_error.csv $(RESULTS)/additive_error_summary.csv &: \
		$(MODEL_FILE) $(CHOICE) $(SWEEPS) experiments/additive_error.py $(READING) $(CONTRACT) | $(READY)
	$(PY) -m experiments additive-error $(CHOSEN) $(SWEEPS) --output $(RESULTS)

$(RESULTS)/f_gamma.csv $(RESULTS)/f_gamma_summary.csv &: $(BUILD)/design_extended.json experiments/f_gamma.py | $(READY)
	$(PY) -m experiments f-gamma $< --output $(RESULTS)

$(RESULTS)/delay_free.csv $(RESULTS)/delay_free_summary.csv &: \
		$(BUILD)/design_delay_free.json experiments/delay_free.py $(TRACKING) | $(READY)
	$(PY) -m experiments delay-free $< $(LIMITS) --output $(RESULTS)

$(RESULTS)/extended.csv $(RESULTS)/extended_summary.csv &: \
		$(BUILD)/design_extended.json experiments/extended.py $(TRACKING) | $(READY)
	$(PY) -m experiments extended $< $(LIMITS) --output $(RESULTS)

$(BUILD)/claims.csv $(BUILD)/claims.txt &: data/thesis/claims.csv $(wildcard experiments/*.py design/*.py) $(CONTRACT) | $(READY)
	@mkdir -p $(BUILD)
	$(PY) -m experiments claims --output $(BUILD) > $(BUILD)/claims.txt

drawing = $(foreach format,$(FORMATS),$(1:%=$(FIGURES)/%.$(format)))

define feeds
$(call drawing,$(2)): $(1:%=$(RESULTS)/%.csv) $(1:%=$(RESULTS)/%_summary.csv)
endef
$(eval $(call feeds,pid,fig_2_02 fig_2_03 fig_2_04))
$(eval $(call feeds,additive_error,fig_2_09))
$(eval $(call feeds,f_gamma,fig_2_10 fig_2_11))
$(eval $(call feeds,delay_free,fig_2_12 fig_2_13 fig_2_14))
$(eval $(call feeds,extended,fig_4_01 fig_4_02 fig_4_03 fig_4_04))

$(call drawing,fig_2_02 fig_2_03 fig_2_04): $(addprefix paper_figures/,pid.py panels.py captions.py)
$(call drawing,fig_2_09 fig_2_10 fig_2_11 fig_2_12 fig_2_13 fig_2_14): $(addprefix paper_figures/,panels.py captions.py)
$(call drawing,fig_2_10 fig_2_11): paper_figures/f_gamma.py
$(call drawing,fig_4_01 fig_4_02 fig_4_03 fig_4_04): $(addprefix paper_figures/,extended.py panels.py captions.py)

DIAGRAMS := fig_2_01 fig_2_05 fig_2_06 fig_2_07 fig_2_08 fig_3_01 fig_3_02
$(call drawing,$(DIAGRAMS)): paper_figures/block_diagrams.py

STYLE := paper_figures/__main__.py paper_figures/style.py paper_figures/thesis.mplstyle
$(foreach format,$(FORMATS),$(FIGURES)/%.$(format)): paper_figures/%.py $(STYLE) | $(READY)
	$(PY) -m paper_figures draw $* --results $(RESULTS) --output $(FIGURES)
