#!/usr/bin/env python3
"""What real prints, lenses and cameras cost: each effect alone and at double strength, and all of a preset together.

Every row renders a campaign (home and a few poses of three photographs, and the sheet) with `hexcal simulate
--camera-effects`, calibrates the camera under the same effect, measures, and holds poses and marker corners against the
truth. Columns: poses measured of all; rms of position (um) and orientation (0.001 deg); z, the rms of error over stated
sigma; corner error (px, rms) and its z; markers refused of those wholly in view; what camera and measure said.
Usage: tools/bench/camera_effects.py --hexcal build/release/hexcal [--width 3008] [--poses 4] [--photographs 10]
                                     [--only NAME] [--strengths 1,2] [--keep FOLDER]
"""
import argparse
import collections
import csv
import math
import pathlib
import subprocess
import tempfile

CURVE = [(0, 0), (0.012097, 0.007322), (0.072581, 0.130742), (0.310484, 0.729291), (0.611321, 0.951613), (1, 1)]
MATRIX = "[0.7013, -0.1408, -0.0635, -0.5268, 1.2902, 0.2640, -0.1470, 0.2801, 0.7379]"


def curve(strength):
    """The measured curve, or one twice as far from a straight line through black and white."""
    points = [(x, min(1.0, max(0.0, x + strength * (y - x)))) for x, y in CURVE]
    rising = [points[0]]
    for x, y in points[1:]:
        rising.append((x, max(y, rising[-1][1])))
    return "[" + ", ".join(f"{value:.6g}" for point in rising for value in point) + "]"


# Name: YAML of the effect at strength k. Sizes are those of the preset d3200 or of a careless day.
EFFECTS = {
    "ideal": lambda k: "",
    "ink spread 0.02 mm": lambda k: f"print: {{ink_spread_mm: {0.02 * k}}}",
    "sheet curls 0.5 mm": lambda k: f"print: {{sheet_curl_mm: {0.5 * k}}}",
    "stickers curl 0.05 mm": lambda k: f"print: {{sticker_curl_mm: {0.05 * k}}}",
    "gloss 0.2": lambda k: f"print: {{sticker_gloss: {0.2 * k}}}",
    "platform trembles 0.02 mm, 0.2 mrad": lambda k: f"platform: {{tremble_mm: {0.02 * k}, tremble_mrad: {0.2 * k}}}",
    "lateral colour": lambda k: f"lens: {{lateral_colour: {k}}}",
    "depth of field f/11": lambda k: f"lens: {{f_number: {11 / k}}}",
    "field curvature 0.05 mm": lambda k: f"lens: {{f_number: 11, field_curvature_mm: {0.05 * k}}}",
    "shake 1 px": lambda k: f"lens: {{shake_px: {k}}}",
    "rolling shutter 0.5 px": lambda k: f"lens: {{rolling_shutter_px: {0.5 * k}}}",
    "glare 2 %": lambda k: f"lens: {{veiling_glare: {0.02 * k}}}",
    "white clips (exposure 1.4)": lambda k: f"sensor: {{exposure: {1 + 0.4 * k}}}",
    "demosaicing, linear": lambda k: "sensor: {demosaicing: linear}" if k == 1 else None,
    "demosaicing, adaptive": lambda k: "sensor: {demosaicing: adaptive}" if k == 1 else None,
    "native colours and lateral colour": lambda k: f"lens: {{lateral_colour: {k}}}\nsensor: {{demosaicing: adaptive, "
                                                    f"colour_matrix: {MATRIX}}}",
    "dust and hot pixels": lambda k: f"sensor: {{dust_specks: {30 * k}, hot_pixels_per_mpx: {50 * k}}}",
    "picture profile": lambda k: f"sensor: {{exposure: 0.5}}\nprocessing: {{tone_curve: {curve(k)}}}",
    "noise reduction 0.5": lambda k: f"processing: {{noise_reduction: {0.5 * k}}}",
    "sharpening 0.8": lambda k: f"processing: {{sharpening: {0.8 * k}}}",
    "d3200, all together": lambda k: "preset: d3200" if k == 1 else None,
}


def run(*command):
    result = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if result.returncode not in (0, 1):
        raise RuntimeError(f"{' '.join(map(str, command))}\n{result.stderr.strip()}")
    return result.stdout + result.stderr


def rows(path):
    return list(csv.DictReader(line for line in path.open() if not line.startswith("#")))


def rms(values):
    return math.sqrt(sum(value * value for value in values) / len(values)) if values else math.nan


AXES = ["x_mm", "y_mm", "z_mm", "roll_deg", "pitch_deg", "yaw_deg"]


def pose_errors(folder):
    truth = {row["pose"]: row for row in rows(folder / "truth" / "poses.csv")}
    errors, scaled, statuses = [], [], collections.Counter()
    measured = rows(folder / "results" / "poses.csv")
    for row in measured:
        statuses[row["status"]] += 1
        if row["pose"] == "home" or not row["x_mm"]:
            continue  # home is zero by definition
        error = [float(row[axis]) - float(truth[row["pose"]][axis]) for axis in AXES]
        errors.append(error)
        scaled.append([e / float(row["sigma_" + axis]) for e, axis in zip(error, AXES)])
    return errors, scaled, statuses


def read_observations(path):
    """(photograph, id, status, corners, sigmas) of every marker in a file of `hexcal detect`."""
    photograph = None
    for record in csv.reader(line for line in path.open() if not line.startswith("#")):
        if record[0] == "photograph":
            photograph = record[1]
        elif record[0] == "marker":
            values = [float(value) for value in record[3:51]]  # the last field is the method
            variances = [values[12 + row * (row + 3) // 2] for row in range(8)]
            corners = [values[2 * k:2 * k + 2] for k in range(4)]
            sigmas = [[math.sqrt(max(variances[2 * k + axis], 1e-12)) for axis in range(2)] for k in range(4)]
            yield photograph, int(record[1]), record[2], corners, sigmas


def corner_errors(folder, observations):
    """Errors of refined corners, over their sigma too, and refused among the markers wholly in view."""
    truth = {}
    whole = set()
    for row in rows(folder / "truth" / "observations.csv"):
        if not row["photo"].startswith("poses/"):
            continue
        key = (row["photo"][len("poses/"):], int(row["id"]))
        truth[key + (int(row["corner"]),)] = (float(row["x_px"]), float(row["y_px"]))
        if float(row["visible_share"]) > 0.999 and float(row["incidence_deg"]) < 65:
            whole.add(key)
    errors, scaled, refused = [], [], collections.Counter()
    read = set()
    for photograph, marker, status, corners, sigmas in observations:
        key = (photograph, marker)
        if status != "ok":
            if key in whole:
                refused[status] += 1
            continue
        read.add(key)
        for corner in range(4):
            if key + (corner,) not in truth:
                continue
            for axis in range(2):
                error = corners[corner][axis] - truth[key + (corner,)][axis]
                errors.append(error)
                scaled.append(error / sigmas[corner][axis])
    unseen = len(whole - read) - sum(refused.values())
    if unseen > 0:
        refused["not found"] = unseen
    return errors, scaled, refused, len(whole)


def row_of(arguments, folder, effects):
    file = folder / "effects.yaml"
    file.write_text(effects + "\n")
    campaign = folder / "campaign"
    run(arguments.hexcal, "simulate", "-o", campaign, "--width", arguments.width, "--poses", arguments.poses,
        "--calibration-photos", arguments.photographs, "--machine-draws", 1, "--seed", arguments.seed,
        *(["--camera-effects", file] if effects else []))
    said = run(arguments.hexcal, "camera", campaign / "calibration", "--template", campaign / "sheet.yaml", "-o",
               campaign / "camera.yaml")
    verdict = next((line.strip() for line in said.splitlines() if "verdict" in line.lower()), "")
    run(arguments.hexcal, "measure", campaign)
    errors, scaled, statuses = pose_errors(campaign)
    observations = folder / "observations.txt"
    run(arguments.hexcal, "detect", campaign / "poses", "--camera", campaign / "camera.yaml", "-o", observations)
    corners, corners_scaled, refused, whole = corner_errors(campaign, read_observations(observations))
    return {
        "poses": f"{len(errors)}/{arguments.poses}",
        "um": 1e3 * rms([math.hypot(*error[:3]) for error in errors]),
        "mdeg": 1e3 * rms([math.hypot(*error[3:]) for error in errors]),
        "z": rms([value for six in scaled for value in six]),
        "px": rms(corners),
        "px_z": rms(corners_scaled),
        "refused": f"{sum(refused.values())}/{whole}",
        "said": "; ".join([verdict, *(f"{n} {word}" for word, n in sorted(statuses.items()) if word != "ok"),
                           *(f"{n} {word}" for word, n in sorted(refused.items()))]),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hexcal", required=True, type=pathlib.Path)
    parser.add_argument("--width", type=int, default=3008)
    parser.add_argument("--poses", type=int, default=4)
    parser.add_argument("--photographs", type=int, default=10, help="of the sheet")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", help="effects whose name holds this")
    parser.add_argument("--strengths", default="1,2")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the campaigns (default: thrown away)")
    arguments = parser.parse_args()
    print(f"{'effect':<38} {'k':>2} {'poses':>6} {'um':>8} {'mdeg':>8} {'z':>6} {'px':>8} {'z':>6} {'refused':>8}  said")
    for name, effects in EFFECTS.items():
        if arguments.only and arguments.only not in name:
            continue
        for strength in (int(word) for word in arguments.strengths.split(",")):
            text = effects(strength)
            if text is None or (name == "ideal" and strength > 1):
                continue
            with tempfile.TemporaryDirectory() as scratch:
                folder = pathlib.Path(scratch)
                if arguments.keep:
                    folder = arguments.keep / f"{name.split(',')[0].replace(' ', '_').replace('/', '')}_{strength}"
                    folder.mkdir(parents=True, exist_ok=True)
                try:
                    row = row_of(arguments, folder, text)
                except RuntimeError as error:
                    print(f"{name:<38} {strength:>2}  failed: {error}", flush=True)
                    continue
            print(f"{name:<38} {strength:>2} {row['poses']:>6} {row['um']:8.2f} {row['mdeg']:8.2f} {row['z']:6.2f} "
                  f"{row['px']:8.4f} {row['px_z']:6.2f} {row['refused']:>8}  {row['said']}", flush=True)


if __name__ == "__main__":
    main()
