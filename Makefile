PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PEERS := .venv-bench
PEER_LIST := experiments/bench/peers/requirements.txt

.PHONY: run test lint bench docs clean
run: $(VENV)/installed
	$(BIN)/python -m experiments.demo

test: $(VENV)/installed
	$(BIN)/python -m pytest -n 2 --dist loadfile

lint: $(VENV)/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: $(VENV)/installed $(PEERS)/installed
	$(BIN)/python -m experiments.bench

docs: $(VENV)/installed
	rm -rf out/docs
	$(BIN)/python -m experiments.docs

$(VENV)/installed: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	touch $@

$(PEERS)/installed: $(PEER_LIST)
	$(PYTHON) -m venv $(PEERS)
	$(PEERS)/bin/python -m pip install --quiet --disable-pip-version-check -r $(PEER_LIST)
	touch $@

clean:
	rm -rf $(VENV) $(PEERS) out
