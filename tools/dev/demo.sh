#!/usr/bin/env bash
# The main job twice. First on the sample's bare photographs, as they come from a memory card: nothing is described by
# hand. Then the whole way on rendered photographs: a virtual Stewart platform with hidden errors is photographed, the
# camera is calibrated, the poses are measured, the machine is identified, and corrected commands for other poses are
# tried on the same machine. Ends with two tables, measured against true poses and errors before and after compensation,
# and with the names of the reports.
# Usage: tools/dev/demo.sh [FOLDER]   (default build/demo; an existing folder is replaced)
# HEXCAL_DEMO_POSES and HEXCAL_DEMO_WIDTH make the rendered campaign larger (24 and 3008: the figures of README.md).
# With HEXCAL=PROGRAM nothing is installed or built and that program is run.
set -euo pipefail
folder=${1:-build/demo}
poses=${HEXCAL_DEMO_POSES:-12}
width=${HEXCAL_DEMO_WIDTH:-1504}

step() { printf '\n== %s\n' "$*"; }

sample=$(realpath -m "$(dirname "$0")/../../samples/small_lab")
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
reports=$folder/round1/results/report.html
if [ -d "$sample" ]; then  # the program is also installed without it
  step "the sample's photographs in one heap, and the sheet.yaml that was printed with the camera's sheet"
  mkdir -p "$folder/card"
  cp "$sample"/poses/*/*.jpg "$sample"/calibration/*.jpg "$sample/sheet.yaml" "$folder/card"
  "$hexcal" init "$folder/card" --marker-mm 24
  "$hexcal" run "$folder/card"
  reports="$folder/card/results/report.html and $reports"
fi
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

step "done; to look at: $reports"
