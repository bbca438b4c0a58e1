#!/usr/bin/env bash
# The binaries that are installed are hardened as Debian's are: position independent, all symbols bound at the start and
# read-only then, the stack and copies of known size guarded.
# Usage: hardened.sh BINARY...
set -euo pipefail
fault() { echo "$1: $2" >&2; exit 1; }
for binary in "$@"; do
  readelf -hW "$binary" | grep -q 'Type: *DYN' || fault "$binary" "is not position independent"
  readelf -lW "$binary" | grep -q GNU_RELRO || fault "$binary" "has no part that is read-only after its start (relro)"
  readelf -dW "$binary" | grep -qE 'BIND_NOW|Flags:.*NOW' || fault "$binary" "binds its symbols late (no -z now)"
  readelf -lW "$binary" | grep GNU_STACK | grep -q 'RW ' || fault "$binary" "has a stack that can be executed"
  readelf --dyn-syms -W "$binary" | grep -q __stack_chk_fail || fault "$binary" "has no stack protector"
  readelf --dyn-syms -W "$binary" | grep -qE '__[a-z]+_chk\b' || fault "$binary" "checks no copy (FORTIFY_SOURCE)"
done
echo "$# hardened"
