#!/usr/bin/env python3
"""Which lines the tests run (preset coverage: clang 14, source-based), module by module, and which messages none produces.

Usage: tools/dev/coverage.py [LABEL...]   (default: every test; each run adds to what earlier runs have covered;
                                           --fresh starts anew, --report only reports)
Prints the table and every line that never ran and throws or holds words for a reader; build/coverage/uncovered.txt lists
all lines that never ran. Exit code 1 if a module is under 90 % of its lines, a message has no test, or a test failed.
"""
import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys

TOP = pathlib.Path(__file__).resolve().parents[2]
BUILD = TOP / "build" / "coverage"
PROFILES = BUILD / "profiles"
MODULES = ("kinematics", "photogrammetry", "camera_calib", "pose_extract", "calibration", "tools/io", "tools/report",
           "tools/synthetic", "tools/hexcal")
WANTED = 90.0
MESSAGE = re.compile(r'\bthrow\b|"[^"]*\w+ +[^"]*\w+[^"]*"')


def run_tests(labels):
    subprocess.run(["cmake", "--preset", "coverage", "--log-level=WARNING"], cwd=TOP, check=True)
    subprocess.run(["cmake", "--build", "--preset", "coverage"], cwd=TOP, check=True)
    PROFILES.mkdir(parents=True, exist_ok=True)
    PROFILES.chmod(0o777)  # some tests run the program as nobody
    # One file a program, into which the processes add their counts; four, that they seldom wait for each other.
    environment = dict(os.environ, LLVM_PROFILE_FILE=f"{PROFILES}/%4m.profraw")
    chosen = ["-L", f"^({'|'.join(labels)})$"] if labels else []
    return subprocess.run(["ctest", "--preset", "coverage", "-j", str(os.cpu_count()), *chosen], cwd=TOP, env=environment).returncode


def counts():
    """{file: {line: times run}} of the modules' own sources."""
    profile = BUILD / "tests.profdata"
    subprocess.run(["llvm-profdata-14", "merge", "-sparse", "-failure-mode=all", *sorted(map(str, PROFILES.glob("*.profraw"))), "-o", str(profile)],
                   check=True)
    programs = [BUILD / "hexcal", *sorted((BUILD / "tests").glob("*_tests")), *sorted((BUILD / "tests/fuzz").glob("*_fuzz")),
                BUILD / "tests/instructions/hot_kernels"]
    programs = [str(program) for program in programs if program.is_file()]
    objects = [word for program in programs[1:] for word in ("-object", program)]
    text = subprocess.run(["llvm-cov-14", "export", "-format=lcov", f"-instr-profile={profile}", programs[0], *objects],
                          check=True, capture_output=True, text=True).stdout
    files = {}
    for line in text.splitlines():
        if line.startswith("SF:"):
            name = os.path.relpath(line[3:], TOP)
            current = files.setdefault(name, {}) if name.startswith(MODULES) else {}
        elif line.startswith("DA:"):
            number, times = line[3:].split(",")[:2]
            current[int(number)] = max(current.get(int(number), 0), int(times))
    return files


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("labels", nargs="*")
    parser.add_argument("--fresh", action="store_true")
    parser.add_argument("--report", action="store_true")
    arguments = parser.parse_args()
    if arguments.fresh:
        shutil.rmtree(PROFILES, ignore_errors=True)
    failed = 0 if arguments.report else run_tests(arguments.labels)

    files = counts()
    low = False
    print(f"{'module':18} {'lines':>7} {'run':>7}")
    for module in MODULES:
        lines = [times for name, numbers in files.items() if name.startswith(module + "/") for times in numbers.values()]
        share = 100.0 * sum(times > 0 for times in lines) / max(1, len(lines))
        low = low or share < WANTED
        print(f"{module:18} {len(lines):7} {share:6.1f} %{'  under 90' if share < WANTED else ''}")

    messages = 0
    with open(BUILD / "uncovered.txt", "w") as uncovered:
        for name in sorted(files):
            text = (TOP / name).read_text().splitlines()
            for number in sorted(number for number, times in files[name].items() if times == 0):
                uncovered.write(f"{name}:{number}: {text[number - 1].strip()}\n")
                if MESSAGE.search(text[number - 1]):
                    messages += 1
                    print(f"no test: {name}:{number}: {text[number - 1].strip()}")
    print(f"{messages} lines of messages never ran")
    sys.exit(1 if failed or low or messages else 0)


if __name__ == "__main__":
    main()
