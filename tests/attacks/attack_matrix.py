#!/usr/bin/env python3
"""Attacks every argument of every command of the built program, and says what got through.

The commands and their arguments come from `hexcal completion json`, so that a new one is attacked as soon as it is there;
a command without a good call in CALLS is a failure of its own.

  attack_matrix.py --hexcal build/release/hexcal --campaign samples/small_lab            all of it
  attack_matrix.py ... --share 300                                                       that many, spread over all
  attack_matrix.py ... --only "export.*camera.yaml"                                      those whose name matches
"""

import argparse
import collections
import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import attacks
from attack_lab import Lab

# A good call of each command, in a campaign that was measured. Paths that are written lie under out/.
CALLS = {
    "init": ["init", "out/new", "--marker-mm", "24"],
    "template": ["template", "aprilgrid", "-o", "out/sheet.pdf", "--tag-mm", "20", "--gap-mm", "6"],
    "camera": ["camera", "calibration", "--template", "sheet.yaml", "-o", "out/camera.yaml"],
    "simulate": ["simulate", "-o", "out/campaign", "--no-images", "--poses", "3"],
    "detect": ["detect", "poses/home", "--camera", "camera.yaml", "-o", "out/observations.txt"],
    "check": ["check", "."],
    "run": ["run", "."],
    "measure": ["measure", ".", "-o", "out/poses.csv"],
    "watch": ["watch", ".", "-o", "out/poses.csv", "--stop-after", "0.1"],
    "plan": ["plan", ".", "-n", "8", "--any-station", "-o", "out/plan.csv"],
    "compensate": ["compensate", ".", "-o", "out"],
    "evaluate": ["evaluate", "--targets", "targets.csv", "--before", "results/poses.csv"],
    "legs": ["legs", "--hexapod", "hexapod.yaml", "--poses", "targets.csv", "-o", "out/legs.csv"],
    "pose": ["pose", "--hexapod", "hexapod.yaml", "--legs", "legs.csv", "-o", "out/poses.csv"],
    "workspace": ["workspace", "--hexapod", "hexapod.yaml", "--poses", "targets.csv", "-o", "out/verdicts.csv"],
    "report": ["report", ".", "-o", "out/report.html"],
    "export": ["export", "camera.yaml", "--to", "opencv", "-o", "out/opencv.yml"],
    "completion": ["completion", "bash"],
}


def command_table(hexcal):
    answer = subprocess.run([hexcal, "completion", "json"], capture_output=True, timeout=60, check=True)
    return json.loads(answer.stdout)["commands"]


def with_value(call, option, value):
    """The call with another value of an option, or of its first positional argument; None for a flag."""
    if not option["value"]:
        return None
    if not option["names"]:
        return call[:1] + [value] + call[2:]
    for name in option["names"]:
        if name in call:
            at = call.index(name)
            return call[:at + 1] + [value] + call[at + 2:]
    return call + [option["names"][-1], value]


def all_attacks(commands):
    """Name and what to do of each."""
    for command in commands:
        call = CALLS[command["name"]]
        for option in command["options"]:
            label = option["names"][-1] if option["names"] else option["positional"]
            for name, value, prepare, process in attacks.values(option):
                arguments = with_value(call, option, value)
                if arguments is not None:
                    yield f"{command['name']} {label} {name}", arguments, prepare, process
        for name, arguments, prepare, process in attacks.of_call(call):
            yield f"{command['name']} {name}", arguments, prepare, process


def spread(found, share):
    """So many, each kind of attack and each command in turn, the same ones in every run."""
    groups = collections.defaultdict(list)
    for attack in sorted(found, key=lambda one: hashlib.sha256(one[0].encode()).digest()):
        groups[(attack[0].split()[0], attacks.kind_of(attack[0]))].append(attack)
    taken = []
    while len(taken) < share and groups:
        for group in sorted(groups):
            taken.append(groups[group].pop())
            if not groups[group]:
                del groups[group]
    return taken[:share]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hexcal", required=True, type=pathlib.Path)
    parser.add_argument("--campaign", required=True, type=pathlib.Path)
    parser.add_argument("--share", type=int)
    parser.add_argument("--only", default="")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--list", action="store_true")
    options = parser.parse_args()
    hexcal = options.hexcal.resolve()
    commands = command_table(hexcal)
    missing = sorted({command["name"] for command in commands} - CALLS.keys())
    if missing:
        sys.exit(f"attack_matrix.py: CALLS has no good call of {', '.join(missing)}")
    found = [attack for attack in all_attacks(commands) if re.search(options.only, attack[0])]
    if options.share is not None:
        found = spread(found, options.share)
    if options.list:
        print("\n".join(attack[0] for attack in found))
        return 0
    failures = []
    with tempfile.TemporaryDirectory() as folder:
        folders = [pathlib.Path(folder) / str(job) for job in range(options.jobs)]
        for path in folders:
            path.mkdir()
        first = Lab(hexcal, options.campaign.resolve(), folders[0])
        labs = [first] + [first.twin(path) for path in folders[1:]]
        for name, call in CALLS.items():
            if findings := first.call(call, must_succeed=True):
                failures.append((f"{name} without an attack", findings))

        def work(job):
            return [(name, findings) for name, arguments, prepare, process in found[job::options.jobs]
                    if (findings := labs[job].call(arguments, prepare, **process))]

        with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            for part in pool.map(work, range(options.jobs)):
                failures += part
    for name, findings in sorted(failures):
        print(f"{name}: {'; '.join(findings)}")
    print(f"{len(found)} attacks, {len(failures)} findings")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
