#!/usr/bin/env python3
"""What photographs buy: the same virtual machine photographed in different ways, measured, held against the truth.

Prints the table of pose_extract/PHOTOGRAPHING.md: the true errors of the measured poses and the standard deviations that
`hexcal measure` states for them. One thing is changed per row.
Usage: tools/bench/photographing.py --hexcal build/release/hexcal [--width 1504] [--poses 8]
"""
import argparse
import csv
import json
import math
import pathlib
import subprocess
import tempfile

ROWS = [
    ("3 photographs at 0.7 m, 24 mm markers, 10 a grip", [], None),
    ("1 photograph a pose", ["--photos-per-pose", "1"], None),
    ("2 photographs", ["--photos-per-pose", "2"], None),
    ("4 photographs", ["--photos-per-pose", "4"], None),
    ("6 photographs", ["--photos-per-pose", "6"], None),
    ("5 markers a grip", [], "0-4"),
    ("3 markers a grip", [], "0-2"),
    ("12 mm markers", ["--marker-mm", "12"], None),
    ("at 0.5 m", ["--distance-mm", "500"], None),
    ("at 1.0 m", ["--distance-mm", "1000"], None),
    ("blur 1.5 to 2 px instead of 0.6 to 1", ["--blur-min-px", "1.5", "--blur-max-px", "2"], None),
    ("JPEG quality 60 instead of 92", ["--jpeg-quality", "60"], None),
]


def run(*command):
    result = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if result.returncode not in (0, 1):
        raise SystemExit(f"{' '.join(map(str, command))}\n{result.stderr}")
    return result.stdout


def keep_markers(campaign, ids):
    """Only these of the fixed markers, and as many of the moving ones."""
    first, last = ids.split("-")
    text = campaign.read_text()
    text = text.replace("ids: [0-9]", f"ids: [{ids}]").replace("ids: [100-109]", f"ids: [{100 + int(first)}-{100 + int(last)}]")
    campaign.write_text(text)


def rms(values):
    return math.sqrt(sum(value * value for value in values) / len(values))


def measured(folder, hexcal):
    """Poses that were measured, and rms over them of the true error and of the stated sigma (um, 0.001 deg)."""
    truth, results = folder / "truth" / "poses.csv", folder / "results" / "poses.csv"
    errors = json.loads(run(hexcal, "evaluate", "--targets", truth, "--before", results, "--json"))
    six = errors["tables"][0]["common_poses"]["rms_mm_deg"]
    rows = [row for row in csv.DictReader(line for line in results.open() if not line.startswith("#"))]
    good = [row for row in rows if row["status"] == "ok" and row["pose"] != "home"]
    # Home defines LG and has no error: the rms over the other poses.
    count = errors["tables"][0]["common_poses"]["poses"]
    factor = math.sqrt(count / max(1, count - 1))
    sigma = [rms([float(row[f"sigma_{axis}"]) for row in good for axis in axes]) if good else math.nan
             for axes in (("x_mm", "y_mm", "z_mm"), ("roll_deg", "pitch_deg", "yaw_deg"))]
    return len(good), [1000 * factor * rms(part) for part in (six[:3], six[3:])], [1000 * part for part in sigma]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--hexcal", type=pathlib.Path, required=True)
    parser.add_argument("--width", type=int, default=1504)
    parser.add_argument("--poses", type=int, default=8)
    options = parser.parse_args()
    print("| | poses | error, um | sigma, um | error, 0.001 deg | sigma, 0.001 deg |\n| --- | ---: | ---: | ---: | ---: | ---: |")
    for name, flags, ids in ROWS:
        with tempfile.TemporaryDirectory() as work:
            folder = pathlib.Path(work) / "campaign"
            run(options.hexcal, "simulate", "-o", folder, "--seed", 7, "--poses", options.poses, "--width", options.width,
                "--calibration-photos", 0, "--true-camera", *flags)
            if ids:
                keep_markers(folder / "campaign.yaml", ids)
            run(options.hexcal, "measure", folder)
            count, error, sigma = measured(folder, options.hexcal)
            print(f"| {name} | {count} of {options.poses} | {error[0]:.2f} | {sigma[0]:.2f} | {error[1]:.2f} | {sigma[1]:.2f} |",
                  flush=True)


if __name__ == "__main__":
    main()
