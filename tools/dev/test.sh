#!/usr/bin/env bash
# Set-up if needed, release build, every test; ends with the test runner's closing line.
set -euo pipefail
cd "$(dirname "$0")/../.."
tools/dev/setup.sh
cmake --preset release >build-configure.log 2>&1 || { cat build-configure.log; exit 1; }
rm -f build-configure.log
cmake --build --preset release
ctest --preset release -j "$(nproc)" "$@"
