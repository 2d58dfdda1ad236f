PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PEERS := .venv-bench
PEER_LIST := experiments/bench/peers/requirements.txt
ROBOSUITE := .venv-robosuite
ROBOSUITE_LIST := experiments/hold/peers/requirements.txt
OTHER_DRAKES := 1.50.0 1.48.0 1.44.0 1.38.0 1.32.0
DRAKE := .venv-drake-

.PHONY: run teach test lint bench drift hold docs clean
run: $(VENV)/installed
	$(BIN)/python -m experiments.demo

teach: $(VENV)/installed
	$(BIN)/python -m experiments.teach

test: $(VENV)/installed
	$(BIN)/python -m pytest -n 2 --dist loadfile

lint: $(VENV)/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: $(VENV)/installed $(PEERS)/installed
	$(BIN)/python -m experiments.bench

drift: $(VENV)/installed $(OTHER_DRAKES:%=$(DRAKE)%/installed)
	$(BIN)/python -m experiments.transitions drift --pythons $(OTHER_DRAKES:%=$(DRAKE)%/bin/python)

hold: $(VENV)/installed $(ROBOSUITE)/installed
	$(BIN)/python -m experiments.hold --workers 2

docs: $(VENV)/installed
	rm -rf out/docs
	$(BIN)/python -m experiments.docs

$(VENV)/installed: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev,teach]'
	touch $@

$(PEERS)/installed: $(PEER_LIST)
	$(PYTHON) -m venv $(PEERS)
	$(PEERS)/bin/python -m pip install --quiet --disable-pip-version-check -r $(PEER_LIST)
	touch $@

$(ROBOSUITE)/installed: $(ROBOSUITE_LIST)
	$(PYTHON) -m venv $(ROBOSUITE)
	$(ROBOSUITE)/bin/python -m pip install --quiet --disable-pip-version-check -r $(ROBOSUITE_LIST)
	touch $@

$(DRAKE)%/installed: constraints.txt
	$(PYTHON) -m venv $(DRAKE)$*
	grep -vi -e '^drake==' -e '^mosek==' constraints.txt > $(DRAKE)$*/others.txt
	$(DRAKE)$*/bin/python -m pip install --quiet --disable-pip-version-check \
		-c $(DRAKE)$*/others.txt drake==$* numpy numba scipy tyro tqdm matplotlib pyyaml
	touch $@

clean:
	rm -rf $(VENV) $(PEERS) $(ROBOSUITE) $(DRAKE)* out
