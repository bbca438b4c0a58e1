#!/usr/bin/env bash
# Installs with apt what hexcal needs on Debian 12 and is not there yet. Needs root or sudo only then.
set -euo pipefail

packages=(
  # build
  g++ cmake ninja-build ccache pkg-config git python3 clang-format
  # libraries
  libopencv-dev libceres-dev libboost-dev libeigen3-dev libapriltag-dev libpcl-dev libfmt-dev libcli11-dev libyaml-cpp-dev
  nlohmann-json3-dev libexiv2-dev libraw-dev libheif-dev libcairo2-dev libtbb-dev libjpeg-dev libssl-dev libjs-three
  # Python module (left out where these are missing)
  pybind11-dev python3-dev python3-numpy
  # tests
  libgtest-dev libgmock-dev libbenchmark-dev valgrind liblensfun-dev liblensfun-data-v1 poppler-utils opencv-doc
)

missing=()
for package in "${packages[@]}"; do
  # The trailing line of dpkg-query is "install ok installed" for what is there.
  if [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)" != "installed" ]; then
    missing+=("$package")
  fi
done
if [ ${#missing[@]} -eq 0 ]; then
  exit 0
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "setup: need root or sudo to install: ${missing[*]}" >&2; exit 2; }
  as_root=(sudo)
fi
echo "setup: installing with apt: ${missing[*]}"
export DEBIAN_FRONTEND=noninteractive
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
echo "setup: done"
