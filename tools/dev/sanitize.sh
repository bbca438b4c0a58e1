#!/usr/bin/env bash
# Tests under AddressSanitizer and UndefinedBehaviorSanitizer (preset dev; by clang where it is installed, which compiles
# them several times faster than g++), or with --threads under ThreadSanitizer (preset threads, clang).
# Usage: tools/dev/sanitize.sh [--threads] [LABEL...]   (default: every folder of tests/ whose tests are compiled; with
#                                                        --threads those that use more than one thread)
# ThreadSanitizer must see how oneTBB passes work on: its library is built from Debian's source with the sanitizer.
set -euo pipefail
cd "$(dirname "$0")/../.."
preset=dev
labels=(geometry kinematics photogrammetry camera_calib pose_extract calibration io report synthetic cli end_to_end faults)
if [ "${1:-}" = --threads ]; then
  shift
  preset=threads
  labels=(kinematics photogrammetry calibration io synthetic cli faults)
fi
[ $# -eq 0 ] || labels=("$@")

options=()
if [ $preset = threads ]; then
  tbb=$PWD/build/threads-tbb
  if [ ! -e "$tbb/build/built" ]; then
    mkdir -p "$tbb"
    curl -fsSL -o "$tbb/tbb.tar.xz" https://deb.debian.org/debian/pool/main/o/onetbb/onetbb_2021.8.0.orig.tar.xz
    echo "7e9111b8bb59c8800bf6d0b06afe7b0891937443d2dae1ee1101c8e2ede6a7ef  $tbb/tbb.tar.xz" | sha256sum --check --quiet
    tar -C "$tbb" -xf "$tbb/tbb.tar.xz"
    cmake -G Ninja -S "$tbb/oneTBB-2021.8.0" -B "$tbb/build" --log-level=WARNING -DCMAKE_BUILD_TYPE=RelWithDebInfo \
      -DCMAKE_CXX_COMPILER=clang++-14 -DCMAKE_C_COMPILER=clang-14 -DTBB_TEST=OFF -DTBB_STRICT=OFF -DTBB_SANITIZE=thread
    cmake --build "$tbb/build" --target tbb
    touch "$tbb/build/built"
  fi
  # In the place of Debian's, for OpenCV too.
  LD_LIBRARY_PATH=$(dirname "$(find "$tbb/build" -name 'libtbb.so.12')")
  export LD_LIBRARY_PATH TSAN_OPTIONS="suppressions=$PWD/tools/dev/thread_suppressions.txt:${TSAN_OPTIONS:-}"
elif [ ! -e build/dev/CMakeCache.txt ] && command -v clang++-14 >/dev/null; then
  options+=(-DCMAKE_CXX_COMPILER=clang++-14)
fi
cmake --preset $preset "${options[@]}" --log-level=WARNING
cmake --build --preset $preset --target "${labels[@]/%/_tests}"
# OpenCV's and GLib's one-time allocations are none of ours.
export ASAN_OPTIONS=${ASAN_OPTIONS:-detect_leaks=0}
ctest --preset $preset -j "$(nproc)" -L "^($(IFS='|'; echo "${labels[*]}"))\$"
