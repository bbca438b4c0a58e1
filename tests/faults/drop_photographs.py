#!/usr/bin/env python3
"""Drops a campaign's photographs one by one, as people and programs copy them, while `hexcal watch` runs.

Random order, pauses, copies in pieces, copies under another name that is then changed, files renamed later and
written twice. Checks that every pose is announced once and that the last poses.csv is that of a fresh
`hexcal measure`, byte for byte apart from the header; prints how long each pose took after its last photograph.

  drop_photographs.py --hexcal build/release/hexcal --campaign samples/small_lab --poses 3
"""

import random
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

from sample_lab import argument_parser, copy_without_photographs


def drop(source, target, rng):
    """Copies one photograph in one of the ways it may arrive; returns where it lies and when it was complete."""
    data = source.read_bytes()
    way = rng.choice(["whole", "pieces", "renamed", "hidden", "stalled", "late"])
    if way == "whole":
        target.write_bytes(data)
    elif way in ("pieces", "stalled"):
        with open(target, "wb") as out:
            parts = 5
            for i in range(parts):
                out.write(data[len(data) * i // parts:len(data) * (i + 1) // parts])
                out.flush()
                time.sleep(0.8 if way == "stalled" and i == 2 else rng.uniform(0, 0.05))
    elif way == "renamed":
        first = target.with_name("copy of " + target.name)
        first.write_bytes(data)
        time.sleep(rng.uniform(0, 0.6))
        first.rename(target)
    elif way == "hidden":
        first = target.with_name("." + target.name + ".part")
        first.write_bytes(data)
        first.rename(target)
    else:  # a network folder that shows the size before the content
        with open(target, "wb") as out:
            out.truncate(len(data))
            out.flush()
            time.sleep(0.4)
            out.write(data)
    return time.monotonic(), way


class Reader(threading.Thread):
    """Lines of the watch with the time at which they came."""

    def __init__(self, stream):
        super().__init__(daemon=True)
        self.stream, self.lines = stream, []

    def run(self):
        for line in self.stream:
            self.lines.append((time.monotonic(), line.rstrip("\n")))


def without_header(path):
    return [line for line in path.read_text().splitlines() if not line.startswith("#")]


def main():
    parser = argument_parser(__doc__)
    parser.add_argument("--poses", type=int, default=1000, help="beside home")
    parser.add_argument("--pause-s", type=float, default=0.3, help="longest pause between two photographs")
    parser.add_argument("--pose-pause-s", type=float, default=0, help="pause after the last photograph of a pose")
    parser.add_argument("--limit-s", type=float, help="a pose may take this long after its last photograph")
    parser.add_argument("--prefix", default="", help="before the command of the watch, such as 'nice -n -10'")
    args = parser.parse_args()
    rng = random.Random(args.seed)

    with tempfile.TemporaryDirectory() as folder:
        lab, poses = copy_without_photographs(args.campaign, folder, args.poses)
        left = {pose: sorted((args.campaign / "poses" / pose).iterdir()) for pose in poses}
        watch = subprocess.Popen([*args.prefix.split(), args.hexcal, "watch", lab], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                 text=True)
        reader = Reader(watch.stdout)
        reader.start()

        queue = [(pose, file) for pose in poses for file in left[pose]]
        rng.shuffle(queue)
        complete = {}
        for pose, file in queue:
            target = lab / "poses" / pose / file.name
            target.parent.mkdir(parents=True, exist_ok=True)
            when, _ = drop(file, target, rng)
            left[pose].remove(file)
            if not left[pose]:
                complete[pose] = when
                time.sleep(args.pose_pause_s)
            elif rng.random() < 0.1:  # somebody tidies the names
                target.rename(target.with_name("renamed_" + target.name))
            time.sleep(rng.uniform(0, args.pause_s))

        def announced(pose):
            return [t for t, line in reader.lines if f" {pose}: " in line]

        deadline = time.monotonic() + 120
        while time.monotonic() < deadline and not all(announced(pose) for pose in poses):
            time.sleep(0.1)
        time.sleep(2.5)  # whatever is said twice is said by then
        watch.send_signal(signal.SIGINT)
        code = watch.wait(timeout=60)
        watched = lab / "results" / "poses.csv"
        problems = [] if code == 0 else [f"watch ended with {code}"]
        wait_from = complete["home"]  # no pose can be measured before home
        slowest = 0
        for pose in poses:
            times = announced(pose)
            if len(times) != 1:
                problems.append(f"{pose} was announced {len(times)} times")
                continue
            took = times[0] - max(complete[pose], wait_from)
            slowest = max(slowest, took)
            print(f"{pose}: {took:.2f} s after its last photograph")
        if args.limit_s and slowest > args.limit_s:
            problems.append(f"a pose took {slowest:.2f} s, wanted at most {args.limit_s} s")
        kept = without_header(watched)
        shutil.rmtree(lab / "results")
        subprocess.run([args.hexcal, "measure", lab], stdout=subprocess.DEVNULL, check=True)
        if kept != without_header(watched):
            problems.append("poses.csv differs from that of a fresh measure")
        print(f"{len(queue)} photographs, {len(poses)} poses, slowest {slowest:.2f} s: "
              + ("; ".join(problems) if problems else "the same as a fresh measure"))
        if problems:
            print("\n".join(line for _, line in reader.lines))
        return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
