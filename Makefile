# Everything that one does here. The first call of any target sets the machine up (.ci/setup); later ones find it done.

PORT ?= 8000
PYTHON ?=
BIN := .venv/bin
# `make lock UPGRADE=1` takes the newest versions; without it only what pyproject.toml changed moves.
LOCK := UV_CUSTOM_COMPILE_COMMAND="make lock" $(BIN)/uv pip compile pyproject.toml --quiet --generate-hashes \
	--no-emit-index-url --python-version 3.11 --python-platform linux $(if $(UPGRADE),--upgrade) --group build

.DEFAULT_GOAL := help
.PHONY: help setup demo serve test test-full check bench bless lock clean

help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## /{ printf "make %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: ## packages, command line and system libraries; quick when all is there
	@PYTHON=$(PYTHON) .ci/setup

demo: setup ## frames and a turntable over HTTP, into out/demo
	$(BIN)/python -m service.demo

serve: setup ## the service on loopback until stopped; PORT=8000
	$(BIN)/millpond serve --host 127.0.0.1 --port $(PORT)

test: setup ## the tests, but for the slow ones
	$(BIN)/pytest -q --ignore=tests/benchmarks -m "not slow"

test-full: setup ## every test
	$(BIN)/pytest -q --ignore=tests/benchmarks

check: setup ## format, lint, types, and which file may import which
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: setup ## the benchmarks: figures, no verdicts
	$(BIN)/pytest tests/benchmarks --benchmark-only

bless: setup ## draw the golden pictures anew; look at them before committing
	$(BIN)/pytest -q tests/golden --bless

lock: setup ## requirements*.txt from pyproject.toml; UPGRADE=1 takes the newest versions
	$(LOCK) --output-file requirements.txt
	$(LOCK) --group dev --constraint requirements.txt --output-file requirements-dev.txt

clean: ## what was made here: environment, caches, output
	rm -rf .venv out build *.egg-info .mypy_cache .ruff_cache .pytest_cache .import_linter_cache .hypothesis .benchmarks
	find renderer service tests -name __pycache__ -type d -prune -exec rm -rf {} +
