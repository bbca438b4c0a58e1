#!/usr/bin/env python3
"""Instructions that each hot kernel takes, counted by valgrind's callgrind and compared with counts.txt.

A count is the same on every machine, however busy, where a time is not: the kernels run on one thread, the compiler is
the one the table was made with, and the C library and OpenCV are kept from choosing code by the processor. A kernel that
takes over 5 % more or fewer instructions than the table says fails the test; where that is meant, --update rewrites it.

Usage: count_instructions.py --program hot_kernels [--update] [--skip REASON]
Exit code 0 as the table says, 1 not, 77 skipped (valgrind is missing, or REASON is not empty).
"""
import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

TABLE = pathlib.Path(__file__).with_name("counts.txt")
TOLERANCE_PERCENT = 5.0
# What glibc and OpenCV would choose by the processor, down to what every x86-64 has; memcpy's thresholds go by the caches.
# Left to themselves they moved the counts by 1 %, one kernel's by 7 % (rounding: an iteration more).
FEATURES = ["AVX512F", "AVX512VL", "AVX512BW", "AVX512CD", "AVX512DQ", "AVX2", "AVX", "FMA", "FMA4", "BMI1", "BMI2", "LZCNT", "MOVBE",
            "POPCNT", "SSSE3", "SSE4_1", "SSE4_2", "ERMS", "FSRM", "RTM", "XSAVE", "XSAVEC", "AVX_Fast_Unaligned_Load",
            "Fast_Unaligned_Copy", "Fast_Unaligned_Load", "Fast_Copy_Backward", "Slow_BSF", "Prefer_No_VZEROUPPER", "Prefer_ERMS",
            "Prefer_FSRM"]
CACHES = {"x86_data_cache_size": 0x8000, "x86_shared_cache_size": 0x100000, "x86_non_temporal_threshold": 0xC0000,
          "x86_rep_movsb_threshold": 0x800, "x86_rep_stosb_threshold": 0x800}
PLAIN_MACHINE = {
    "GLIBC_TUNABLES": ":".join(["glibc.cpu.hwcaps=" + ",".join("-" + name for name in FEATURES)]
                               + [f"glibc.cpu.{name}={value:#x}" for name, value in CACHES.items()]),
    "OPENCV_CPU_DISABLE": "SSE4.1,SSE4.2,POPCNT,AVX,FP16,FMA3,AVX2",
    "LC_ALL": "C.UTF-8",
}


def count(program):
    """Instructions by kernel, in the program's order: of the second call, when tables are filled."""
    environment = {"PATH": os.environ.get("PATH", ""), **PLAIN_MACHINE}
    names = subprocess.run([program], env=environment, check=True, capture_output=True, text=True).stdout.split()
    with tempfile.TemporaryDirectory() as folder:
        profile = pathlib.Path(folder) / "profile"
        subprocess.run(["valgrind", "--tool=callgrind", "--quiet", f"--callgrind-out-file={profile}", "--toggle-collect=hot_kernel_*",
                        *(f"--dump-after=hot_kernel_{name}" for name in names), program],
                       env=environment, check=True, stdout=subprocess.DEVNULL)
        counts = {}
        for number in range(1, 2 * len(names) + 1):
            lines = pathlib.Path(f"{profile}.{number}").read_text().splitlines()
            summary = next(line for line in lines if line.startswith("summary: "))
            kernel = next(line for line in lines if line.startswith("desc: Trigger: ")).rpartition("hot_kernel_")[2]
            counts[kernel] = int(summary.split()[1])
    return {name: counts[name] for name in names}


def read_table():
    rows = (line.split() for line in TABLE.read_text().splitlines() if line and not line.startswith("#"))
    return {kernel: int(instructions) for kernel, instructions in rows}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--program", type=pathlib.Path, required=True)
    parser.add_argument("--update", action="store_true")
    parser.add_argument("--skip", default="")
    options = parser.parse_args()
    reason = options.skip or ("" if shutil.which("valgrind") else "valgrind is missing")
    if reason:
        print(f"skipped: {reason}")
        return 77
    found = count(options.program.resolve())
    if options.update:
        lines = ["# kernel, instructions; tests/instructions/count_instructions.py --update"]
        lines += [f"{kernel} {instructions}" for kernel, instructions in found.items()]
        TABLE.write_text("\n".join(lines) + "\n")
        return 0
    wanted = read_table()
    failed = 0
    for kernel in list(wanted) + [name for name in found if name not in wanted]:
        if kernel not in found or kernel not in wanted:
            print(f"{kernel}: {'not run' if kernel not in found else 'not in ' + TABLE.name}")
            failed += 1
            continue
        percent = 100 * (found[kernel] / wanted[kernel] - 1)
        bad = abs(percent) > TOLERANCE_PERCENT
        failed += bad
        print(f"{kernel}: found {found[kernel]}, wanted {wanted[kernel]}, {percent:+.2f} %{'  <-- beyond 5 %' if bad else ''}")
    if failed:
        print(f"{failed} kernels differ; if that is meant: {pathlib.Path(__file__).name} --program {options.program} --update")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
