#!/bin/sh
# Builds the wheel, installs it into an empty environment, and uses it from another folder.
set -eu
project=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export PIP_CONSTRAINT="$project/constraints.txt" PIP_BUILD_CONSTRAINT="$project/constraints.txt"
"$project/.venv/bin/python" -m build --wheel --outdir "$work/dist" "$project" >"$work/build.log" 2>&1 || { cat "$work/build.log"; exit 1; }
"$project/.venv/bin/python" -m venv "$work/env"
"$work/env/bin/python" -m pip install --quiet "$work"/dist/*.whl
mkdir "$work/elsewhere"
cd "$work/elsewhere"
unset PYTHONPATH
"$work/env/bin/affordance" --version
"$work/env/bin/affordance" doctor
"$work/env/bin/affordance" weight --repeats 2 --out results
test -s results/report.html
"$work/env/bin/affordance" tutorials --out lessons --copy-only
test "$(ls lessons | wc -l)" -eq 9
"$work/env/bin/affordance" identify --demo
"$work/env/bin/affordance" rank --demo
"$work/env/bin/affordance" live --demo
"$work/env/bin/affordance" see --demo pictures
"$work/env/bin/affordance" see pictures/can.png --depth pictures/can_depth.png --camera pictures/camera.json
examples=$project/examples/experiments
"$work/env/bin/affordance" lift --objects "$examples/objects.yaml" --trials "$examples/counterbalanced.csv" --out lifted
# The examples of README and of the page of own objects, one file each.
awk '/^```python/ {n++; on = 1; next} /^```/ {on = 0} on {print > ("example_" n ".py")}' "$project/README.md" "$project/docs/objects.md"
for example in example_*.py; do
    "$work/env/bin/python" "$example"
done
echo "the wheel works from another folder"
