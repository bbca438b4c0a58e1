#!/usr/bin/env bash
# Every attack on every argument of every command of the built program (tests/attacks), which takes hours; with arguments
# for attack_matrix.py a part of them: tools/dev/attack.sh --only "export.*link"
set -euo pipefail
cd "$(dirname "$0")/../.."
exec python3 tests/attacks/attack_matrix.py --hexcal "${HEXCAL:-build/release/hexcal}" --campaign samples/small_lab "$@"
