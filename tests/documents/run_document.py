#!/usr/bin/env python3
"""Runs a document's commands as printed, in order, in a clean clone of the repository.

Blocks ```sh are run line by line (lines ending in a backslash continue), blocks ```python as one script. Each must end
with exit code 0, or 1 ("done, but some items failed") for hexcal. A block ```text right after one of them is a sample of
its output: its lines must occur there in this order, word by word, with numbers alike.
"""
import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile

FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def commands_of(language, body):
    if language == "python":
        return [body]
    return [line for line in body.replace("\\\n", " ").splitlines() if line and not line.startswith("#")]


def alike(wanted, found):
    """The same word, or numbers that differ by less than half of the larger one, or by rounding."""
    if wanted == found:
        return True
    try:
        a, b = (float(word.strip("%,;:()")) for word in (wanted, found))
    except ValueError:
        return False
    return abs(a - b) <= max(0.5 * max(abs(a), abs(b)), 2e-3)


def missing_line(sample, output):
    """The first line of the sample that the output does not have after the lines before it."""
    rest = iter(output.splitlines())
    for line in sample.splitlines():
        wanted = line.split()
        if not wanted or wanted == ["..."]:
            continue
        for candidate in rest:
            found = candidate.split()
            if len(found) == len(wanted) and all(map(alike, wanted, found)):
                break
        else:
            return line
    return None


def run(command, language, clone, environment):
    arguments = [environment["PYTHON"], "-c", command] if language == "python" else ["bash", "-c", command]
    result = subprocess.run(arguments, cwd=clone, env=environment, stdin=subprocess.DEVNULL, text=True,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    good = result.returncode == 0 or (result.returncode == 1 and command.startswith("hexcal"))
    return good, result.stdout


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("document", help="path in the repository")
    parser.add_argument("--source", required=True, help="repository to clone")
    parser.add_argument("--build", help="build folder whose program and Python module are used; else as printed")
    parser.add_argument("--python", default="", help="interpreter of the Python module; empty: leave its blocks out")
    parser.add_argument("--skip", action="append", default=[], help="command that is not run")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        clone = pathlib.Path(folder) / "hexcal"
        subprocess.run(["git", "clone", "-q", "--shared", options.source, clone], check=True)
        environment = dict(os.environ, PYTHON=options.python, HOME=folder)
        if options.build:
            build = pathlib.Path(options.build).resolve()
            environment["HEXCAL"] = str(build / "hexcal")
            environment["PATH"] = f"{build}:{environment['PATH']}"
            environment["PYTHONPATH"] = str(build / "tools" / "python")
        text = (clone / options.document).read_text(encoding="utf-8")
        output, ran = "", 0
        for language, body in FENCE.findall(text):
            if language == "python" and not options.python:
                output = None  # nothing to hold its sample against
                continue
            if language == "text" and output is not None:
                line = missing_line(body, output)
                if line is not None:
                    sys.exit(f"{options.document}: no line like this in the output:\n{line}\n--- output\n{output}")
            if language not in ("sh", "python"):
                continue
            output = ""
            for command in commands_of(language, body):
                if command in options.skip:
                    continue
                good, said = run(command, language, clone, environment)
                output += said
                if not good:
                    sys.exit(f"{options.document}: {command}\n{said}")
                ran += 1
    if ran == 0:
        sys.exit(f"{options.document}: no command was run")
    print(f"{options.document}: {ran} commands ran as printed")


if __name__ == "__main__":
    main()
