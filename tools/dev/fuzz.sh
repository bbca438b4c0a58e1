#!/usr/bin/env bash
# Fuzzes every target of tests/fuzz (libFuzzer with AddressSanitizer and UndefinedBehaviorSanitizer, preset fuzz).
# Usage: tools/dev/fuzz.sh [SECONDS] [TARGET...]   (default: 60 seconds each, all targets)
# Prints one line a target; exit 1 if anything was found. What was found, and the corpus that grows from run to run,
# lies in build/fuzz/work. Once it is fixed, an input goes to tests/data/fuzz/TARGET, which ctest replays.
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=60
if [[ ${1:-} =~ ^[0-9]+$ ]]; then seconds=$1; shift; fi
targets=("$@")
if [ ${#targets[@]} -eq 0 ]; then
  for source in tests/fuzz/*_fuzz.cc; do targets+=("$(basename "$source" .cc)"); done
fi

cmake --preset fuzz --log-level=WARNING
cmake --build --preset fuzz --target "${targets[@]}"

# The samples as seeds; the first byte names the reader where a target has several.
seed() {  # TARGET NAME PREFIX FILE [BYTES]
  mkdir -p "build/fuzz/work/$1/seeds"
  { printf '%s' "$3"; head -c "${5:-1000000}" "$4"; } > "build/fuzz/work/$1/seeds/$2"
}
for lab in samples/*/; do
  name=$(basename "$lab")
  seed campaign_fuzz "$name.campaign" c "$lab/campaign.yaml"
  seed campaign_fuzz "$name.hexapod" h "$lab/hexapod.yaml"
  seed campaign_fuzz "$name.camera" k "$lab/camera.yaml"
  seed campaign_fuzz "$name.sheet" s "$lab/sheet.yaml"
  seed observations_fuzz "$name.targets" p "$lab/targets.csv"
  seed observations_fuzz "$name.legs" l "$lab/legs.csv"
  photograph=$(find "$lab/poses" -name '*.jpg' | sort | head -1)
  seed exif_fuzz "$name.jpg" "" "$photograph" 4000
  seed image_fuzz "$name.jpg" i "$photograph" 8000
  seed csv_fuzz "$name.csv" "" "$lab/targets.csv"
  seed yaml_fuzz "$name.yaml" "" "$lab/campaign.yaml"
done

# Decoders ask for what a header claims; a refusal must not end the run.
export ASAN_OPTIONS=allocator_may_return_null=1 UBSAN_OPTIONS=print_stacktrace=1
findings=0
for target in "${targets[@]}"; do
  work=build/fuzz/work/$target
  mkdir -p "$work/corpus" "$work/seeds" "$work/found"
  status=0
  "build/fuzz/tests/fuzz/$target" "$work/corpus" "$work/seeds" "tests/data/fuzz/$target" \
    -max_total_time="$seconds" -timeout=25 -rss_limit_mb=2048 -max_len=16384 -print_final_stats=1 \
    -artifact_prefix="$work/found/" > "$work/log" 2>&1 || status=$?
  found=$(find "$work/found" -type f | wc -l)
  executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$work/log")
  coverage=$(grep -a -o 'cov: [0-9]*' "$work/log" | tail -1 | cut -d' ' -f2)
  printf '%-20s %6s s  %9s executions  %6s edges  %s findings%s\n' "$target" "$seconds" "${executions:-0}" \
    "${coverage:-0}" "$found" "$([ $status -eq 0 ] || echo "  (stopped, see $work/log)")"
  if [ "$found" -gt 0 ] || [ $status -ne 0 ]; then findings=1; fi
done
exit $findings
