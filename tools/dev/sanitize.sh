#!/usr/bin/env bash
# Tests under AddressSanitizer and UndefinedBehaviorSanitizer (preset dev; by clang where it is installed, which compiles
# them several times faster than g++).
# Usage: tools/dev/sanitize.sh [LABEL...]   (default: every folder of tests/ whose tests are compiled)
set -euo pipefail
cd "$(dirname "$0")/../.."
labels=("$@")
[ ${#labels[@]} -gt 0 ] || labels=(geometry kinematics photogrammetry camera_calib pose_extract calibration io report synthetic cli
                                   end_to_end faults)
compiler=()
if [ ! -e build/dev/CMakeCache.txt ] && command -v clang++-14 >/dev/null; then
  compiler=(-DCMAKE_CXX_COMPILER=clang++-14)
fi
cmake --preset dev "${compiler[@]}" --log-level=WARNING
cmake --build --preset dev --target "${labels[@]/%/_tests}"
# OpenCV's and GLib's one-time allocations are none of ours.
export ASAN_OPTIONS=${ASAN_OPTIONS:-detect_leaks=0}
ctest --preset dev -j "$(nproc)" -L "^($(IFS='|'; echo "${labels[*]}"))\$"
