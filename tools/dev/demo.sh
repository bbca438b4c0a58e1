#!/usr/bin/env bash
# The whole way on rendered photographs: a virtual Stewart platform with hidden errors is photographed, the camera is
# calibrated, the poses are measured, the machine is identified, and corrected commands for other poses are tried on the
# same machine. Ends with two tables: measured against true poses, and errors before and after compensation.
# Usage: tools/dev/demo.sh [FOLDER]   (default build/demo; an existing folder is replaced)
# With HEXCAL=PROGRAM nothing is installed or built and that program is run.
set -euo pipefail
folder=${1:-build/demo}
poses=${HEXCAL_DEMO_POSES:-24}
width=${HEXCAL_DEMO_WIDTH:-3008}

step() { printf '\n== %s\n' "$*"; }

hexcal=${HEXCAL:-}
if [ -z "$hexcal" ]; then
  cd "$(dirname "$0")/../.."
  tools/dev/setup.sh
  step "build"
  cmake --preset release --log-level=WARNING
  cmake --build --preset release --target hexcal
  hexcal=build/release/hexcal
fi

rm -rf "$folder"
step "photograph a virtual hexapod with hidden errors: home and $poses poses, 3 photographs each, and a template"
"$hexcal" simulate -o "$folder/round1" --poses "$poses" --width "$width" --lens profile --focal-mm 35 --seed 66
step "calibrate the camera"
"$hexcal" camera "$folder/round1/calibration" --template "$folder/round1/sheet.yaml" -o "$folder/round1/camera.yaml"
step "measure, compensate, report"
"$hexcal" run "$folder/round1"
step "correct the commands for $poses other poses, which were never photographed, and try them on the same machine"
"$hexcal" simulate -o "$folder/other" --poses "$poses" --seed 67 --no-images
"$hexcal" compensate "$folder/round1" --apply "$folder/other/targets.csv" -o "$folder/corrected"
"$hexcal" simulate -o "$folder/before" --from "$folder/round1" --targets "$folder/other/targets.csv" \
  --commands "$folder/other/legs.csv" --no-images
"$hexcal" simulate -o "$folder/after" --from "$folder/round1" --targets "$folder/other/targets.csv" \
  --commands "$folder/corrected/actuators.csv" --no-images

step "measured poses against the truth"
"$hexcal" evaluate --targets "$folder/round1/truth/poses.csv" --before "$folder/round1/results/poses.csv"
step "true errors of the machine at the other poses before and after compensation"
"$hexcal" evaluate --targets "$folder/other/targets.csv" --before "$folder/before/truth/poses.csv" \
  --after "$folder/after/truth/poses.csv"
