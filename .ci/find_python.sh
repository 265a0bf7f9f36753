#!/bin/sh
# Prints the path of an interpreter fit for this project (Python 3.12 or newer with venv), or one line that says
# what is missing. With AFFORDANCE_PYTHON=3.12, say, only that version is fit. Candidates are run, not just looked up: a
# pyenv shim exists even for a version it cannot start.
wanted=${AFFORDANCE_PYTHON:-}
fit="import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 12) or '$wanted' not in ('', '%d.%d' % sys.version_info[:2])); "
for command in ${wanted:+"python$wanted"} python3.13 python3.12 python3; do
    # What a .python-version file (ours, or one further up) selects; then any version pyenv has of that name.
    for pyenv_version in "" "${command#python}"; do
        if [ -n "$pyenv_version" ]; then
            PYENV_VERSION=$pyenv_version
            export PYENV_VERSION
        fi
        if "$command" -c "$fit" >/dev/null 2>&1; then
            exec "$command" -c 'import sys; print(sys.executable)'
        fi
        unset PYENV_VERSION
    done
done
if command -v uv >/dev/null 2>&1; then
    if found=$(uv python find "${wanted:->=3.12}" 2>/dev/null || { uv python install -q "${wanted:-3.13}" && uv python find "${wanted:-3.13}"; }); then
        echo "$found"
        exit 0
    fi
fi
echo "No fit interpreter: Python ${wanted:-3.12 or newer} with its venv module is needed (or uv, which can fetch one)." >&2
exit 1
