#!/usr/bin/env bash
# The workflow with two jobs at a time gives the bytes of the single run, and the numbers of `hexcal measure` alone.
# Usage: try_workflow.sh HEXCAL   (77, skipped, without snakemake)
set -euo pipefail
hexcal=$(realpath "$1")
source=$(cd "$(dirname "$0")/../.." && pwd)
command -v snakemake >/dev/null || { echo "snakemake is not installed"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export HOME=$work  # snakemake keeps a cache there

for way in parts single photographs; do
  mkdir "$work/$way"
  cp -r "$source/samples/small_lab" "$work/$way/lab"
done
cd "$work/parts"
snakemake -s "$source/tools/workflow/Snakefile" --config campaign=lab hexcal="$hexcal" --cores 2 >"$work/log" 2>&1 ||
  { cat "$work/log"; exit 1; }
cd "$work/single"
"$hexcal" detect lab/poses --camera lab/camera.yaml -o observations.txt >/dev/null
"$hexcal" measure lab --observations observations.txt >/dev/null
cd "$work/photographs"
"$hexcal" measure lab >/dev/null

cmp "$work/parts/lab/workflow/observations.txt" "$work/single/observations.txt"
diff -r --exclude=cache "$work/parts/lab/results" "$work/single/lab/results"
diff <(grep -v '^#' "$work/parts/lab/results/poses.csv") <(grep -v '^#' "$work/photographs/lab/results/poses.csv")
echo "$(grep -c 'rule detect' "$work/log") detect jobs: same bytes as the single run"
