#!/usr/bin/env python3
"""Checks the arrows between the modules over their #include lines.

An arrow A -> B allows A to include B and whatever B may include. Also refuses file and folder names
that name no noun, private third-party headers in public headers of the modules, and types of one name in
two headers.
"""
import pathlib
import re
import sys

ARROWS = {
    "kinematics/geometry": [],
    "kinematics": ["kinematics/geometry"],
    "photogrammetry": ["kinematics/geometry"],
    "camera_calib": ["photogrammetry"],
    "pose_extract": ["camera_calib"],
    "calibration": ["kinematics"],
    "tools/io": ["pose_extract", "calibration"],
    "tools/synthetic": ["pose_extract", "calibration", "tools/io"],
    "tools/report": ["pose_extract", "calibration", "tools/io"],
    "tools/campaign": ["pose_extract", "calibration", "tools/io"],
    "tools/page": ["tools/campaign", "tools/report"],
    "tools/hexcal": ["tools/campaign", "tools/synthetic", "tools/report", "tools/page"],
    "tools/bench": ["tools/campaign", "tools/synthetic", "tools/report"],
    "tools/python": ["tools/campaign", "tools/synthetic", "tools/report"],
}
BANNED_NAMES = re.compile(r"(^|[_.-])(utils?|misc|common|helpers?)([_.-]|$)")
PRIVATE_HEADERS = re.compile(r"<(ceres|pcl|apriltag|exiv2|libraw|libheif)/")
TYPE = re.compile(r"^(?:struct|class|enum class)\s+(\w+)[^;{]*\{", re.MULTILINE)
INCLUDE = re.compile(r'^\s*#\s*include\s+(?:"([^"]+)"|(<[^>]+>))')


def module_of(path):
    fits = [m for m in ARROWS if path == m or path.startswith(m + "/")]
    return max(fits, key=len) if fits else None


def reachable(module, seen=None):
    seen = set() if seen is None else seen
    for target in ARROWS[module]:
        if target not in seen:
            seen.add(target)
            reachable(target, seen)
    return seen


def repeated_types(root, tops):
    """Types of one name in two headers: all live in one namespace, where that is undefined behaviour."""
    places = {}
    for top in sorted(tops - {"tests"}):
        for file in sorted((root / top).rglob("*.h")):
            for name in TYPE.findall(file.read_text()):
                places.setdefault(name, []).append(file.relative_to(root).as_posix())
    return [f"{' and '.join(files)}: both define {name}" for name, files in places.items() if len(files) > 1]


def main(root):
    errors = []
    tops = {m.split("/")[0] for m in ARROWS} | {"tests", "samples"}
    errors += repeated_types(root, tops)
    for top in sorted(tops):
        for file in sorted((root / top).rglob("*")):
            name = file.relative_to(root).as_posix()
            if "__pycache__" in name:
                continue
            if BANNED_NAMES.search(file.name.lower()):
                errors.append(f"{name}: name the file after the noun it holds")
            if file.suffix not in (".h", ".cc"):
                continue
            module = module_of(name)
            for number, line in enumerate(file.read_text().splitlines(), 1):
                match = INCLUDE.match(line)
                if not match or module is None:
                    continue
                if match[2]:
                    if file.suffix == ".h" and not name.startswith("tools/") and PRIVATE_HEADERS.match(match[2]):
                        errors.append(f"{name}:{number}: {match[2]} in a public header")
                    continue
                target = module_of(match[1])
                if target is None and not (root / match[1]).exists():
                    errors.append(f'{name}:{number}: "{match[1]}": includes are relative to the root')
                elif target is not None and target != module and target not in reachable(module):
                    errors.append(f"{name}:{number}: {module} may not include {target}")
    for error in errors:
        print(error)
    print(f"layers: {len(errors)} errors")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()))
