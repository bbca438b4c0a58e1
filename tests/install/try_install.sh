#!/usr/bin/env bash
# Installs the build to a temporary prefix and uses it from there as others would: the program, its manual and
# completions, and the libraries from a project of their own.
# Usage: try_install.sh BUILD_FOLDER
set -euo pipefail
build=$(cd "$1" && pwd)
here=$(cd "$(dirname "$0")" && pwd)
source=$(cd "$here/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cmake --install "$build" --prefix "$work/prefix" >"$work/log" || { cat "$work/log"; exit 1; }
wanted=$(sed -n 's/^project(hexcal VERSION \([0-9.]*\).*/\1/p' "$source/CMakeLists.txt")
found=$("$work/prefix/bin/hexcal" --version)
[ "$found" = "hexcal $wanted" ] || { echo "found '$found', wanted 'hexcal $wanted'"; exit 1; }
grep -q "^## $wanted" "$source/CHANGELOG.md" || { echo "CHANGELOG.md: no section '## $wanted'"; exit 1; }
for file in share/man/man1/hexcal.1 share/bash-completion/completions/hexcal \
  share/zsh/vendor-completions/_hexcal share/fish/vendor_completions.d/hexcal.fish share/doc/hexcal/README.md; do
  [ -s "$work/prefix/$file" ] || { echo "$file was not installed"; exit 1; }
done
# Nothing installed may speak of the folders it was built in.
if grep -rlF -e "$source" "$work/prefix/lib" "$work/prefix/share" --include='*.cmake' --include='*.1'; then
  echo "these name the source folder"
  exit 1
fi
"$work/prefix/bin/hexcal" check "$source/samples/small_lab" >"$work/log" || { cat "$work/log"; exit 1; }

cmake -S "$here/consumer" -B "$work/consumer" -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$work/prefix" \
  >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }
cmake --build "$work/consumer" >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }
"$work/consumer/consumer" "$source/samples/small_lab/hexapod.yaml"
