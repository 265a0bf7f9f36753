#!/bin/sh
# Runs the tests with the lowest versions that pyproject.toml allows, in an environment of their own.
set -eu
project=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$project/.venv/bin/python" "$project/.ci/lowest.py" >"$work/lowest.txt"
"$project/.venv/bin/python" -m venv "$work/env"
unset PIP_CONSTRAINT
"$work/env/bin/python" -m pip install --quiet --prefer-binary --constraint "$work/lowest.txt" --editable "$project[dev]"
"$work/env/bin/python" -m affordance doctor --install --tests
cd "$project"
PYTHONDONTWRITEBYTECODE='' "$work/env/bin/python" -m pytest -p no:cacheprovider -W default "$@" # old libraries warn of newer ones
