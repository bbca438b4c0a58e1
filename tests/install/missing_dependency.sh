#!/usr/bin/env bash
# Configuring without a package must fail with words that name the Debian package to install.
# Usage: missing_dependency.sh
set -euo pipefail
source=$(cd "$(dirname "$0")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

fails_with() {  # debian package, then what hides it
  local package=$1
  shift
  if env "${environment[@]}" cmake -S "$source" -B "$work/build" "$@" >"$work/log" 2>&1; then
    echo "configured without $package"
    exit 1
  fi
  tr -s '\n ' ' ' <"$work/log" | grep -q "apt-get install $package" || { cat "$work/log"; exit 1; }
}

environment=(LC_ALL=C)
fails_with libceres-dev -DCMAKE_DISABLE_FIND_PACKAGE_Ceres=ON
fails_with libopencv-dev -DCMAKE_DISABLE_FIND_PACKAGE_Ceres=OFF -DCMAKE_DISABLE_FIND_PACKAGE_OpenCV=ON
environment+=(PKG_CONFIG_LIBDIR=/nonexistent)
fails_with libapriltag-dev -DCMAKE_DISABLE_FIND_PACKAGE_OpenCV=OFF
echo "missing packages are named"
