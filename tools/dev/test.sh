#!/usr/bin/env bash
# Set-up if needed, release build, every test; ends with the test runner's closing line.
set -euo pipefail
cd "$(dirname "$0")/../.."
tools/dev/setup.sh
cmake --preset release --log-level=WARNING
cmake --build --preset release
ctest --preset release -j "$(nproc)" "$@"
