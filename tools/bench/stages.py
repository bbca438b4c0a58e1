#!/usr/bin/env python3
"""What each stage of a campaign takes: wall and CPU seconds, their ratio to cv::imread of the same photographs, peak memory.

Every round runs cv::imread (colour) before and after the stages and each stage once, in a copy of the campaign whose
photographs are links; the table holds the medians over the rounds of ratios within a round. Ratios of CPU time can be
compared between machines and are hardly moved by what else runs; seconds, and the ratio of wall times on a busy machine,
can not. With --hexcal given twice the two programs take turns and the last column is the second's time over the first's.

Usage: tools/bench/stages.py CAMPAIGN --hexcal build/release/hexcal [--hexcal OTHER] [--rounds 3] [--threads 2]
                             [--stages decode,detect,...] [--baseline FILE | --write-baseline FILE] [--reader read_photographs]
Exit code 0, or 1 when a stage takes over 15 % more CPU or memory than the baseline's.
"""
import argparse
import datetime
import json
import os
import pathlib
import platform
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

STAGES = {
    "decode": "decode only: luminance, EXIF, SHA-256",
    "detect": "detect: decode, detection, refinement",
    "adjust": "measure --observations: adjustment alone",
    "measure": "measure, first time",
    "measure_again": "measure, second time, from the cache",
    "compensate": "compensate",
    "report": "report",
    "run": "run, first time",
    "run_again": "run, second time",
}
MORE_ALLOWED = 1.15
PHOTOGRAPHS = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".nef", ".dng")


class Cost:
    """Of one process with its threads."""

    def __init__(self, command, threads, accept=(0,)):
        allowed = sorted(os.sched_getaffinity(0))[:threads]
        with tempfile.TemporaryFile() as output:
            start = time.monotonic()
            child = subprocess.Popen([str(word) for word in command], stdout=subprocess.DEVNULL, stderr=output,
                                     preexec_fn=lambda: os.sched_setaffinity(0, allowed))
            _, status, usage = os.wait4(child.pid, 0)
            self.wall_s = time.monotonic() - start
            child.returncode = os.waitstatus_to_exitcode(status)
            if child.returncode not in accept:
                output.seek(0)
                raise SystemExit(f"{' '.join(map(str, command[:4]))} ...: exit code {child.returncode}\n{output.read().decode()}")
        self.cpu_s = usage.ru_utime + usage.ru_stime
        self.peak_mib = usage.ru_maxrss / 1024


def copy_campaign(source, target):
    """Its files without results; photographs as links."""
    def copy(file, to):
        if file.lower().endswith(PHOTOGRAPHS):
            os.symlink(os.path.abspath(file), to)
        else:
            shutil.copyfile(file, to)
    shutil.copytree(source, target, copy_function=copy,
                    ignore=lambda folder, names: [name for name in names if folder == str(source) and name in ("results", "calibration")])


class Runner:
    def __init__(self, hexcal, campaign, threads, work):
        self.hexcal, self.threads = hexcal, threads
        self.reader = hexcal.parent / "tools" / "bench" / "read_photographs"
        self.campaign = work / "campaign"
        copy_campaign(campaign, self.campaign)
        self.observations = work / "observations.txt"
        images = next(line.split(":")[1].strip() for line in (self.campaign / "campaign.yaml").read_text().splitlines()
                      if line.startswith("images:"))
        self.images = self.campaign / images
        self.photographs = sorted(path for path in self.images.glob("*/*") if path.suffix.lower() in PHOTOGRAPHS)

    def cost(self, *arguments):
        return Cost([self.hexcal, *arguments], self.threads, accept=(0, 1))

    def imread(self, reader):
        return Cost([reader, "imread", *self.photographs], self.threads)

    def run(self, stage):
        measure = ["measure", self.campaign, "--threads", self.threads]
        if stage == "decode":
            return Cost([self.reader, "hexcal", *self.photographs], self.threads)
        if stage == "detect":
            return self.cost("detect", self.images, "--camera", self.campaign / "camera.yaml", "-o", self.observations)
        if stage == "adjust":
            if not self.observations.exists():
                self.run("detect")
            return self.cost(*measure, "--observations", self.observations)
        if stage in ("measure", "run"):
            shutil.rmtree(self.campaign / "results", ignore_errors=True)
        elif not (self.campaign / "results" / "cache").exists():
            self.cost(*measure)
        if stage.startswith("measure"):
            return self.cost(*measure)
        return self.cost(stage.removesuffix("_again"), self.campaign)


def one_round(runners, stages, reader):
    """Per program and stage its cost, and the mean cost of imread."""
    first = runners[0].imread(reader)
    costs = [{} for _ in runners]
    for stage in stages:
        for number, runner in enumerate(runners):
            costs[number][stage] = runner.run(stage)
    last = runners[0].imread(reader)
    imread = {"wall_s": (first.wall_s + last.wall_s) / 2, "cpu_s": (first.cpu_s + last.cpu_s) / 2,
              "peak_mib": max(first.peak_mib, last.peak_mib)}
    return costs, imread


def median(values):
    return statistics.median(list(values))


def table(rounds, number):
    """Of one program: medians per stage."""
    rows = {}
    for stage in rounds[0][0][number]:
        costs = [(each[0][number][stage], each[1]) for each in rounds]
        rows[stage] = {
            "wall_s": median(cost.wall_s for cost, _ in costs),
            "cpu_s": median(cost.cpu_s for cost, _ in costs),
            "wall_ratio": median(cost.wall_s / imread["wall_s"] for cost, imread in costs),
            "cpu_ratio": median(cost.cpu_s / imread["cpu_s"] for cost, imread in costs),
            "peak_mib": max(cost.peak_mib for cost, _ in costs),
        }
    return rows


def print_table(rows, imread):
    print(f"{'stage':<46} {'wall s':>8} {'CPU s':>8} {'x imread wall':>14} {'x imread CPU':>13} {'peak MiB':>9}")
    print(f"{'cv::imread, colour':<46} {imread['wall_s']:8.2f} {imread['cpu_s']:8.2f} {1:14.2f} {1:13.2f} {imread['peak_mib']:9.0f}")
    for stage, row in rows.items():
        print(f"{STAGES[stage]:<46} {row['wall_s']:8.2f} {row['cpu_s']:8.2f} {row['wall_ratio']:14.2f} {row['cpu_ratio']:13.2f} "
              f"{row['peak_mib']:9.0f}")


def print_comparison(rounds):
    print(f"\n{'stage':<46} {'CPU, B / A: median':>18} {'least':>7} {'most':>7} {'wall, B / A':>12}")
    for stage in rounds[0][0][0]:
        cpu = [each[0][1][stage].cpu_s / each[0][0][stage].cpu_s for each in rounds]
        wall = [each[0][1][stage].wall_s / each[0][0][stage].wall_s for each in rounds]
        print(f"{STAGES[stage]:<46} {median(cpu):18.3f} {min(cpu):7.3f} {max(cpu):7.3f} {median(wall):12.3f}")


def processor():
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.machine()


def commit():
    here = pathlib.Path(__file__).parent
    return subprocess.run(["git", "-C", here, "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=True).stdout.strip()


def as_baseline(rows, options, photographs):
    stages = {stage: {key: round(row[key], 3 if "ratio" in key else 0) for key in ("cpu_ratio", "wall_ratio", "peak_mib")}
              for stage, row in rows.items()}
    return {"commit": commit(), "date": datetime.date.today().isoformat(), "machine": processor(), "threads": options.threads,
            "rounds": options.rounds, "photographs": photographs, "load_average": round(os.getloadavg()[0], 1), "stages": stages}


def compare_with_baseline(rows, baseline):
    """Number of stages that take more than they may."""
    worse = 0
    print(f"\nagainst {baseline['commit']} of {baseline['date']} ({baseline['photographs']} photographs, {baseline['machine']})")
    for stage, row in rows.items():
        known = baseline["stages"].get(stage)
        if not known:
            continue
        changes = {key: row[key] / known[key] for key in ("cpu_ratio", "peak_mib")}
        bad = any(change > MORE_ALLOWED for change in changes.values())
        worse += bad
        print(f"{STAGES[stage]:<46} CPU x {changes['cpu_ratio']:.2f}, memory x {changes['peak_mib']:.2f}{'  <-- more' if bad else ''}")
    return worse


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("campaign", type=pathlib.Path)
    parser.add_argument("--hexcal", type=pathlib.Path, action="append", required=True)
    parser.add_argument("--reader", type=pathlib.Path, help="read_photographs, where it does not lie with a hexcal")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--stages", default=",".join(STAGES))
    parser.add_argument("--baseline", type=pathlib.Path)
    parser.add_argument("--write-baseline", type=pathlib.Path)
    options = parser.parse_args()
    stages = [stage for stage in STAGES if stage in options.stages.split(",")]
    readers = [hexcal.resolve().parent / "tools" / "bench" / "read_photographs" for hexcal in options.hexcal]
    reader = next((path for path in [*readers, options.reader] if path and path.exists()), None)
    if reader is None:
        raise SystemExit("stages: build the target read_photographs first")
    if not all(path.exists() for path in readers):
        stages = [stage for stage in stages if stage != "decode"]
    with tempfile.TemporaryDirectory() as work:
        runners = []
        for number, hexcal in enumerate(options.hexcal):
            folder = pathlib.Path(work) / str(number)
            folder.mkdir()
            runners.append(Runner(hexcal.resolve(), options.campaign.resolve(), options.threads, folder))
        photographs = len(runners[0].photographs)
        rounds = []
        for number in range(options.rounds):
            rounds.append(one_round(runners, stages, reader))
            print(f"round {number + 1} of {options.rounds}, load average {os.getloadavg()[0]:.1f}", file=sys.stderr)
    imread = {key: median(each[1][key] for each in rounds) for key in ("wall_s", "cpu_s", "peak_mib")}
    tables = [table(rounds, number) for number in range(len(runners))]
    print(f"{photographs} photographs, {options.threads} threads, {options.rounds} rounds, load average {os.getloadavg()[0]:.1f}")
    for hexcal, rows in zip(options.hexcal, tables):
        print(f"\n{hexcal}" if len(tables) > 1 else "")
        print_table(rows, imread)
    if len(tables) == 2:
        print_comparison(rounds)
    if options.write_baseline:
        options.write_baseline.write_text(json.dumps(as_baseline(tables[-1], options, photographs), indent=2) + "\n")
    if options.baseline:
        return 1 if compare_with_baseline(tables[-1], json.loads(options.baseline.read_text())) else 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
