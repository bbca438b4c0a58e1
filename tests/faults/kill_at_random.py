#!/usr/bin/env python3
"""Kills a command at random moments and looks at what is left.

Every file it writes must be the whole old one or the whole new one, and a run that is left alone must give the clean
answer and leave no temporary file. The command is one of the table below, or stands behind `--`, with {lab} for the
campaign's copy.

  kill_at_random.py --hexcal build/release/hexcal --campaign samples/small_lab --command measure --kills 50
  kill_at_random.py --hexcal build/release/hexcal --campaign samples/small_lab --signal TERM -- detect {lab}/poses -o {lab}/o.txt
"""

import csv
import json
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from sample_lab import argument_parser, copy_without_photographs

# What is typed, and the commands that must have been there before.
MEASURED = [["measure", "{lab}"]]
IDENTIFIED = MEASURED + [["compensate", "{lab}"]]
COMMANDS = {
    "measure": (["measure", "{lab}", "--overlays"], []),
    "run": (["run", "{lab}"], []),
    "watch": (["watch", "{lab}", "--stop-after", "0.5"], []),
    "detect": (["detect", "{lab}/poses", "--camera", "{lab}/camera.yaml", "-o", "{lab}/out/observations.txt"], []),
    "camera": (["camera", "{lab}/calibration", "--template", "{lab}/sheet.yaml", "-o", "{lab}/out/camera.yaml",
                "--report", "{lab}/out/camera.html"], []),
    "compensate": (["compensate", "{lab}"], MEASURED),
    "evaluate": (["evaluate", "--targets", "{lab}/targets.csv", "--before", "{lab}/results/poses.csv"], MEASURED),
    "report": (["report", "{lab}", "--figures", "{lab}/figures"], IDENTIFIED),
    "plan": (["plan", "{lab}", "-n", "12", "--any-station", "-o", "{lab}/out/plan.csv"], []),
    "simulate": (["simulate", "-o", "{lab}/out", "--poses", "1", "--width", "600", "--calibration-photos", "2"], []),
    "export": (["export", "{lab}/camera.yaml", "--to", "opencv", "-o", "{lab}/out/camera.yml"], []),
    "template": (["template", "aprilgrid", "--columns", "8", "--rows", "6", "--tag-mm", "20", "--gap-mm", "6", "-o",
                  "{lab}/out/sheet.pdf"], []),
    "workspace": (["workspace", "--hexapod", "{lab}/hexapod.yaml", "--sample", "uniform", "-n", "20000", "-o",
                   "{lab}/out/poses.csv"], []),
    "legs": (["legs", "--hexapod", "{lab}/hexapod.yaml", "--poses", "{lab}/targets.csv", "-o", "{lab}/out/legs.csv"],
             []),
}
OLD = b"# what was there before\n"


def files_of(lab):
    """Content of every file beside the photographs and the cache."""
    return {str(file.relative_to(lab)): file.read_bytes() for file in lab.rglob("*")
            if file.is_file() and file.relative_to(lab).parts[0] not in ("poses", "calibration")
            and "cache" not in file.parts and file.name != ".lock"}


def is_whole(name, data):
    """For what `watch` writes again and again: complete by its own format."""
    if name.endswith(".json"):
        json.loads(data)
    elif name.endswith(".csv"):
        lines = [line for line in data.decode().splitlines() if not line.startswith("#")]
        return data.endswith(b"\n") and len({len(row) for row in csv.reader(lines)}) == 1
    return data.endswith(b"\n")


class Victim:
    """A copy of the campaign, and the command with what it leaves there when nobody disturbs it."""

    def __init__(self, args, folder):
        self.args = args
        self.rng = random.Random(args.seed)
        typed, before = (args.arguments, []) if args.arguments else COMMANDS[args.command]
        self.name = typed[0]
        self.lab, poses = copy_without_photographs(args.campaign, folder,
                                                   max(args.poses, 5) if before or self.name == "run" else args.poses)
        for pose in poses:
            shutil.copytree(args.campaign / "poses" / pose, self.lab / "poses" / pose)
        if self.name == "camera":
            shutil.copytree(args.campaign / "calibration", self.lab / "calibration")
        for command in before:
            self.run(command)
        self.command = typed
        self.before = files_of(self.lab)
        start = time.monotonic()
        self.run(typed)
        self.took = time.monotonic() - start
        self.new = files_of(self.lab)
        # Files it leaves alone are inputs; of the others there was something else before.
        self.old = {name: data + OLD if data != self.before.get(name) else data for name, data in self.new.items()}
        if self.name == "watch":  # it takes up what it finds
            self.old = self.before

    def typed(self, command):
        return [str(self.args.hexcal)] + [word.replace("{lab}", str(self.lab)) for word in command]

    def run(self, command):
        subprocess.run(self.typed(command), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def restore(self):
        for name in files_of(self.lab):
            if name not in self.old:
                (self.lab / name).unlink()
        shutil.rmtree(self.lab / "results" / "cache", ignore_errors=True)
        for name, data in self.old.items():
            (self.lab / name).write_bytes(data)

    def kill(self, i):
        """Starts the command and kills it; whether it lived so long, and what is wrong with the rest."""
        self.restore()
        run = subprocess.Popen(self.typed(self.command), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        start = time.monotonic()
        try:
            # Every third near the end, where the files are written.
            run.wait(self.rng.uniform(0.8, 1.05) * self.took if i % 3 == 0 else self.rng.uniform(0, self.took))
            killed = False
            self.took = time.monotonic() - start  # others have left the machine
        except subprocess.TimeoutExpired:
            killed = True
        number = getattr(signal, "SIG" + self.args.signal)
        run.send_signal(number)  # nothing if it has ended
        code = run.wait(timeout=60)
        problems = [f"it ended with {code}"] if code not in (0, 1, -number) else []
        for name, data in files_of(self.lab).items():
            if name.rsplit("/", 1)[-1].startswith("."):
                continue  # a temporary name; the next run takes it away
            if data in (self.old.get(name), self.new.get(name)):
                continue
            if self.name != "watch" or not is_whole(name, data):
                problems.append(f"{name} is neither the old file nor the new")
        return killed, [f"kill {i}: {problem}" for problem in problems]


def main():
    parser = argument_parser(__doc__)
    parser.add_argument("--command", default="measure", choices=sorted(COMMANDS))
    parser.add_argument("--signal", default="KILL", choices=["KILL", "TERM", "INT"])
    parser.add_argument("--poses", type=int, default=2, help="beside home")
    parser.add_argument("--kills", type=int, default=6)
    parser.add_argument("arguments", nargs="*", help="another command, behind --")
    args = parser.parse_args()

    with tempfile.TemporaryDirectory() as folder:
        victim = Victim(args, folder)
        problems = []
        killed = 0
        for i in range(3 * args.kills):
            if killed == args.kills:
                break
            lived, wrong = victim.kill(i)
            killed += lived
            problems += wrong
        victim.run(victim.command)
        last = files_of(victim.lab)
        if last != victim.new:
            different = sorted(name for name in set(last) | set(victim.new) if last.get(name) != victim.new.get(name))
            problems.append(f"the next run differs in {', '.join(different)}")
        if killed == 0:
            problems.append("no run lived long enough to be killed")
        if victim.new == victim.before and victim.name != "evaluate":
            problems.append("it writes nothing when left alone")
        print(f"{victim.name}: {killed} runs killed by SIG{args.signal} in their {victim.took:.1f} s: "
              + ("; ".join(problems) if problems else "no half-written file, and the next run gives the clean answer"))
        return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
