#!/bin/sh
# Runs the tests with the lowest versions that pyproject.toml allows, in an environment of their own; of Python, too, where
# the machine has it.
set -eu
project=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$project/.venv/bin/python" "$project/.ci/lowest.py" >"$work/lowest.txt"
python=$(AFFORDANCE_PYTHON=3.12 "$project/.ci/find_python.sh" 2>/dev/null) || python=$project/.venv/bin/python
"$python" -m venv "$work/env"
"$work/env/bin/python" --version
unset PIP_CONSTRAINT
"$work/env/bin/python" -m pip install --quiet --prefer-binary --constraint "$work/lowest.txt" --editable "$project[dev]"
"$work/env/bin/python" -m affordance doctor --install --tests
cd "$project"
PYTHONDONTWRITEBYTECODE='' "$work/env/bin/python" -m pytest -p no:cacheprovider -W default "$@" # old libraries warn of newer ones
