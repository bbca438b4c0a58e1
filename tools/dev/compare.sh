#!/usr/bin/env bash
# Times two commits against each other, stage by stage, in turns on the same campaign: medians of B / A with their spread.
# Usage: tools/dev/compare.sh COMMIT_A COMMIT_B [CAMPAIGN]   (default: samples/small_lab)
# HEXCAL_COMPARE_ROUNDS (default 5), HEXCAL_COMPARE_STAGES (of tools/bench/stages.py), HEXCAL_COMPARE_FOLDER (default
# build/compare: both builds stay there and the next comparison builds what changed).
set -euo pipefail
[ $# -ge 2 ] || { sed -n '2,6p' "$0"; exit 2; }
top=$(cd "$(dirname "$0")/../.." && pwd)
campaign=$(realpath "${3:-$top/samples/small_lab}")
folder=$(realpath -m "${HEXCAL_COMPARE_FOLDER:-$top/build/compare}")
mkdir -p "$folder"

build_targets() {
  (cd "$1" && cmake --preset release --log-level=WARNING >/dev/null &&
    cmake --build --preset release ${HEXCAL_COMPARE_JOBS:+-j "$HEXCAL_COMPARE_JOBS"} --target "${@:2}" >/dev/null)
}
# The programs of a commit, built as the release preset builds them, in a worktree of its own.
build() {
  local name=$1 commit tree=$folder/$1 targets=(hexcal)
  commit=$(git -C "$top" rev-parse --verify "$2^{commit}")
  if [ -d "$tree" ]; then
    git -C "$tree" checkout -q --detach "$commit"
  else
    git -C "$top" worktree add -q --detach "$tree" "$commit"
  fi
  if grep -q read_photographs "$tree/tools/bench/CMakeLists.txt"; then targets+=(read_photographs); fi
  build_targets "$tree" "${targets[@]}"
  echo "$name: $(git -C "$tree" log --oneline -1)"
}
build a "$1"
build b "$2"
build_targets "$top" read_photographs  # for cv::imread, where both commits are older than it
python3 "$top/tools/bench/stages.py" "$campaign" --hexcal "$folder/a/build/release/hexcal" --hexcal "$folder/b/build/release/hexcal" \
  --reader "$top/build/release/tools/bench/read_photographs" --rounds "${HEXCAL_COMPARE_ROUNDS:-5}" ${HEXCAL_COMPARE_STAGES:+--stages "$HEXCAL_COMPARE_STAGES"}
