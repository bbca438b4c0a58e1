#!/usr/bin/env python3
"""Kills `hexcal measure` or `hexcal run` (SIGKILL) at random moments and looks at what is left.

Every file of the results must be the whole old one or the whole new one, and a run that is left alone must give
the clean answer.

  kill_at_random.py --hexcal build/release/hexcal --campaign samples/small_lab --kills 50
"""

import pathlib
import random
import shutil
import subprocess
import sys
import tempfile
import time

from sample_lab import argument_parser, copy_without_photographs


def results(lab):
    folder = lab / "results"
    return {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*")
            if file.is_file() and "cache" not in file.parts and file.name != ".lock"}


def main():
    parser = argument_parser(__doc__)
    parser.add_argument("--command", default="measure", choices=["measure", "run"])
    parser.add_argument("--poses", type=int, default=2, help="beside home")
    parser.add_argument("--kills", type=int, default=6)
    args = parser.parse_args()
    rng = random.Random(args.seed)

    with tempfile.TemporaryDirectory() as folder:
        lab, poses = copy_without_photographs(args.campaign, folder, args.poses)
        for pose in poses:
            shutil.copytree(args.campaign / "poses" / pose, lab / "poses" / pose)
        command = [args.hexcal, args.command, lab]

        # Old results: those of the campaign without its last pose.
        aside = lab / "aside"
        (lab / "poses" / poses[-1]).rename(aside)
        subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        old = results(lab)
        aside.rename(lab / "poses" / poses[-1])
        shutil.rmtree(lab / "results")
        start = time.monotonic()
        subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        took = time.monotonic() - start
        new = results(lab)

        problems = []
        killed = 0
        for i in range(3 * args.kills):
            if killed == args.kills:
                break
            shutil.rmtree(lab / "results")
            for name, data in old.items():
                (lab / "results" / name).parent.mkdir(parents=True, exist_ok=True)
                (lab / "results" / name).write_bytes(data)
            run = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            # Every third near the end, where the files are written.
            time.sleep(rng.uniform(0.8, 1.05) * took if i % 3 == 0 else rng.uniform(0, took))
            killed += run.poll() is None
            run.kill()
            run.wait()
            for name, data in results(lab).items():
                if pathlib.Path(name).name.startswith("."):
                    continue  # a temporary name; the next run takes it away
                if data not in (old.get(name), new.get(name)):
                    problems.append(f"kill {i}: {name} is neither the old file nor the new")
        subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        last = results(lab)
        if last != new:
            different = sorted(name for name in set(last) | set(new) if last.get(name) != new.get(name))
            problems.append(f"the next run differs in {', '.join(different)}")
        if killed == 0:
            problems.append("no run lived long enough to be killed")
        print(f"{killed} runs killed in their {took:.1f} s: "
              + ("; ".join(problems) if problems else "no half-written file, and the next run gives the clean answer"))
        return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
