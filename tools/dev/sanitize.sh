#!/usr/bin/env bash
# The unit tests under AddressSanitizer and UndefinedBehaviorSanitizer (preset dev).
# Usage: tools/dev/sanitize.sh [LABEL...]   (default: the folders of tests/ that need no rendered photographs)
set -euo pipefail
cd "$(dirname "$0")/../.."
labels=("$@")
[ ${#labels[@]} -gt 0 ] || labels=(geometry kinematics calibration io report)
cmake --preset dev --log-level=WARNING
cmake --build --preset dev --target "${labels[@]/%/_tests}"
ctest --preset dev -j "$(nproc)" -L "^($(IFS='|'; echo "${labels[*]}"))\$"
