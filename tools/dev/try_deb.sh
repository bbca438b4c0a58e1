#!/usr/bin/env bash
# Builds the Debian packages, installs `hexcal` (and `python3-hexcal`, where it was built) into a fresh Debian 12 that
# holds nothing else, and runs there the program, the demo and an import. Needs root and a Debian mirror.
# Usage: tools/dev/try_deb.sh [WORK_FOLDER]   (default build/deb; its chroot is made anew)
# HEXCAL_DEMO_POSES and HEXCAL_DEMO_WIDTH reach the demo.
set -euo pipefail
cd "$(dirname "$0")/../.."
work=$(realpath -m "${1:-build/deb}")
mirror=${HEXCAL_DEBIAN_MIRROR:-http://deb.debian.org/debian}
[ "$(id -u)" -eq 0 ] || { echo "try_deb: needs root, for debootstrap and chroot" >&2; exit 2; }
command -v debootstrap >/dev/null || { echo "try_deb: debootstrap is missing: apt-get install debootstrap" >&2; exit 2; }

cmake --preset release --log-level=WARNING -DHEXCAL_HARDENED=ON
cmake --build --preset release --target install_tests
rm -rf "$work"
mkdir -p "$work/packages"
(cd build/release && cpack -B "$work/packages" >/dev/null)
for package in "$work"/packages/*.deb; do
  dpkg-deb --show --showformat='${Package} ${Version}: ${Depends}\n' "$package"
done
tests/install/hardened.sh build/release/hexcal $(find build/release/tools/python -name '_hexcal*.so')

chroot=$work/chroot
debootstrap --variant=minbase bookworm "$chroot" "$mirror" >"$work/debootstrap.log"
shopt -s nullglob
cp "$work"/packages/hexcal_*.deb "$work"/packages/python3-hexcal_*.deb tools/dev/demo.sh "$chroot/root/"
inside() { chroot "$chroot" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 "$@"; }
inside apt-get update -qq
inside sh -c 'DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends /root/*hexcal_*.deb' \
  >"$work/install.log" 2>&1 || { tail "$work/install.log"; exit 1; }
echo "installed with $(grep -c '^Setting up' "$work/install.log") packages"
inside hexcal --version
inside HEXCAL=/usr/bin/hexcal HEXCAL_DEMO_POSES="${HEXCAL_DEMO_POSES:-8}" HEXCAL_DEMO_WIDTH="${HEXCAL_DEMO_WIDTH:-1504}" \
  bash /root/demo.sh /root/demo
python_package=("$chroot"/root/python3-hexcal_*.deb)
if [ ${#python_package[@]} -gt 0 ]; then
  inside python3 -c 'import hexcal; print("python:", hexcal.__version__, round(hexcal.range_magnitude([26.54, 16.67, 13.49]), 2), "mm")'
fi
inside sh -c "apt-get purge -y -qq '*hexcal*' >/dev/null"
left=$(find "$chroot/usr" -name '*hexcal*')
[ -z "$left" ] || { echo "try_deb: left behind after removal: $left" >&2; exit 1; }
