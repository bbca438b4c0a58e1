"""What is tried: values of arguments, and what is done to a call as a whole.

An attack's name ends with "[KIND] what"; `prepare` changes the lab before the call.
"""

import os
import re
import resource

import damage

INPUTS = ["campaign.yaml", "camera.yaml", "hexapod.yaml", "targets.csv", "legs.csv", "sheet.yaml", "markers_nominal.csv",
          "ros.yaml", "poses/home/first.jpg", "calibration/first.jpg"]
# What a call on the campaign may read beside its arguments.
OF_CAMPAIGN = ["campaign.yaml", "camera.yaml", "hexapod.yaml", "targets.csv", "legs.csv", "markers_nominal.csv",
               "results/poses.csv", "results/poses_covariance.csv", "results/photos.csv", "results/markers.csv",
               "results/residuals.csv", "results/quality.json", "results/calibration.json",
               "results/cache/measurement.json"]
NUMBERS = ["1e308", "-1e308", "1e-300", "nan", "inf", "-inf", "-1", "0", "2147483647", "-2147483649",
           "99999999999999999999", "1e5", "abc", "", "0x10", "1,2"]
TEXTS = ["", " ", "-", "--", "nan", "..", "/dev/null", "/dev/zero", "/dev/full", "/proc/kmsg", "/proc/self/mem",
         "\x1b[31mred\x07", "no\nsuch", "x" * 300, "x" * 5000, "a/" * 2000, "%s%n", "\udcff\udcfe"]
NAMES = ["nan", " ", "home ", " p001", "#p", "p,1", 'p"1', "p\n1", "\x1b[31mred\x1b[0m", "\x9b31m", "-p", "p" * 250, "...",
         "\u202ep", "null", "1e308", "../p".replace("/", "\\")]


def kind_of(name):
    return re.search(r"\[(.*?)\]", name).group(1)


def input_values():
    """Names of the campaign's own files, straight and by detours: as an output they must not be overwritten."""
    for name in INPUTS:
        yield name, name, None
        yield f"./out/../{name}", f"./out/../{name}", None
        ending = os.path.splitext(name)[1]
        for how, make in (("link", os.symlink), ("hard link", os.link)):
            def prepare(lab, name=name, make=make, ending=ending):
                make(lab / name, lab / ("link" + ending))
            yield f"{how} to {name}", "link" + ending, prepare


def values(option):
    """What is given to an option: name, value, preparation, and how the process is started."""
    if option["value"] in ("FLOAT", "INT", "UINT"):
        for number in NUMBERS:
            yield f"[number] '{number}'", number, None, {}
        return
    for name, value, prepare in input_values():
        yield f"[input] {name}", value, prepare, {}
    for text in TEXTS:
        yield f"[text] {text[:20]!r} {len(text)}", text, None, {}
    for name in ("targets.csv", "camera.yaml", "poses/home/first.jpg"):
        yield f"[pipe] {name}", "/dev/stdin", None, {"feed": name}


def named_in(call):
    """The lab's files that a call may read."""
    found = [word for word in call if word in INPUTS or word == "results/poses.csv"]
    return found + (OF_CAMPAIGN if "." in call[1:2] else [])


def rename(lab, name):
    (lab / "poses" / "p001").rename(lab / "poses" / name)


def rename_photograph(lab, name):
    (lab / "poses" / "home" / "first.jpg").rename(lab / "poses" / "home" / (name[:240] + ".jpg"))


def spoil_exif(lab):
    for photograph in (lab / "poses").rglob("*.jpg"):
        data = photograph.read_bytes()
        photograph.write_bytes(data.replace(b"NIKON", b"NI\x1b[m").replace(b"Nikon", b"\x1b]0;x"))


def limit(what, most):
    return {"preexec_fn": lambda: resource.setrlimit(what, (most, most))}


def of_call(call):
    """Streams that are closed before the program starts: no file may take their place."""
    for closed in ((0,), (1,), (2,), (0, 1, 2)):
        def close(closed=closed):
            for stream in closed:
                os.close(stream)
        yield f"[streams] {closed} closed", call, None, {"preexec_fn": close}
    for what, most in ((resource.RLIMIT_STACK, 128 << 10), (resource.RLIMIT_STACK, 1 << 20),
                       (resource.RLIMIT_FSIZE, 0), (resource.RLIMIT_FSIZE, 3000), (resource.RLIMIT_FSIZE, 50000),
                       (resource.RLIMIT_AS, 300 << 20), (resource.RLIMIT_AS, 600 << 20), (resource.RLIMIT_AS, 1 << 30),
                       (resource.RLIMIT_NOFILE, 8), (resource.RLIMIT_NOFILE, 4)):
        yield f"[limit] {what} at {most}", call, None, limit(what, most)
    if call[0] in ("run", "measure", "report"):
        for at in (1, 2, 3, 5, 8, 13, 21, 34, 55, 89, 144):
            yield f"[broken disk] read {at}", call, None, {"failing_read": at}
    for file in named_in(call):
        if file.endswith(".jpg"):
            continue
        for how, spoil in damage.of_file(file):
            def prepare(lab, file=file, spoil=spoil):
                spoil(lab / file)
            yield f"[file] {file} {how}", call, prepare, {}
    if "." in call[1:2]:
        for name in NAMES:
            # Whoever writes results does so for the others; the names themselves may be said.
            more = {"goes_on": call[0] in ("measure", "run", "watch"), "words": name == "nan"}
            yield f"[name] pose {name[:20]!r}", call, lambda lab, name=name: rename(lab, name), more
            yield f"[name] photograph {name[:20]!r}", call, lambda lab, name=name: rename_photograph(lab, name), more
        yield "[name] EXIF", call, spoil_exif, {}
