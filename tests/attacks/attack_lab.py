"""The campaign that is attacked, and the judge of one call.

A call has failed the attack if it ends by a signal or with another exit code than 0 to 2, takes too long, changes one of
the campaign's files (results/ and what lies under out/ are hexcal's), says a number that is none, lets a control
character through to the terminal or into a text file that it writes, or refuses without a line of words.
"""

import hashlib
import os
import pathlib
import re
import shutil
import signal
import stat
import subprocess
import time

PATIENCE_S = 60  # the slowest call of the table takes about 2 s on a machine with nothing else to do
NO_NUMBER = re.compile(rb"(?<![\w./-])[-+]?(?:nan|inf|infinity)(?![\w./-])", re.IGNORECASE)
NOT_FINITE = re.compile(rb"(?<=[,:\[ ])-?(?:nan|inf|infinity)(?=[,\]}\n])", re.IGNORECASE)
QUOTED = re.compile(rb"'[^'\n]*'|(?:found|Value) \S+")
CONTROL = re.compile(rb"[\x00-\x08\x0b-\x1f\x7f]")
TEXT_FILES = (".csv", ".json", ".yaml", ".yml", ".txt", ".html", ".svg", ".ply", ".pcd")


def state_of(folder):
    """Every file's kind and content below a folder but hexcal's own."""
    state = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        if name.parts[0] in ("results", "out"):
            continue
        kind = stat.S_IFMT(path.lstat().st_mode)
        content = hashlib.sha256(path.read_bytes()).hexdigest() if stat.S_ISREG(kind) else ""
        content = os.readlink(path) if stat.S_ISLNK(kind) else content
        state[str(name)] = (kind, content)
    return state


class Lab:
    """A copy of a campaign with results, restored after each call that changed it."""

    def __init__(self, hexcal, campaign, folder):
        self.hexcal = hexcal
        self.template = pathlib.Path(folder) / "template"
        self.path = pathlib.Path(folder) / "lab"
        self.template.mkdir()
        for name in ("camera.yaml", "campaign.yaml", "hexapod.yaml", "targets.csv", "legs.csv", "sheet.yaml",
                     "markers_nominal.csv"):
            shutil.copy(campaign / name, self.template)
        # A user's files: nothing in them says that hexcal wrote them.
        for name in ("hexapod.yaml", "legs.csv"):
            lines = (self.template / name).read_text().splitlines(keepends=True)
            (self.template / name).write_text("".join(line for line in lines if not line.startswith("#")))
        for name in ("poses", "calibration"):
            shutil.copytree(campaign / name, self.template / name)
        for folder in ("poses/home", "calibration"):  # known by name to the attacks
            sorted((self.template / folder).iterdir())[0].rename(self.template / folder / "first.jpg")
        subprocess.run([hexcal, "run", self.template], stdout=subprocess.DEVNULL, timeout=600, check=False)
        subprocess.run([hexcal, "export", self.template / "camera.yaml", "--to", "ros", "-o", self.template / "ros.yaml"],
                       stdout=subprocess.DEVNULL, timeout=60, check=True)
        self.shim = self.template.parent / "failing_read.so"
        subprocess.run(["cc", "-shared", "-fPIC", "-o", self.shim, pathlib.Path(__file__).parent / "failing_read.c"],
                       timeout=60, check=True)
        self.results = {str(path.relative_to(self.template)): path.read_bytes()
                        for path in sorted((self.template / "results").iterdir()) if path.is_file()}
        self.restore()
        self.clean = state_of(self.path)

    def twin(self, folder):
        """Another copy, for another process."""
        twin = object.__new__(Lab)
        twin.__dict__.update(self.__dict__)
        twin.path = folder / "lab"
        twin.restore()
        return twin

    def restore(self):
        shutil.rmtree(self.path, ignore_errors=True)
        shutil.copytree(self.template, self.path)

    def fresh_out(self):
        shutil.rmtree(self.path / "out", ignore_errors=True)
        (self.path / "out").mkdir()

    def call(self, arguments, prepare=None, must_succeed=False, goes_on=False, words=False, feed=None,
             failing_read=None, **popen):
        """Runs `hexcal arguments` in the lab; returns the findings. `goes_on`: what is wrong concerns a part only;
        `words`: nan may be a name; `feed`: a file of the lab that comes through a pipe; `failing_read`: number of the read
        that meets a broken disk, after which all is said or all is as without."""
        self.fresh_out()
        before = self.clean
        if prepare is not None:
            prepare(self.path)
            before = state_of(self.path)
        feeder = subprocess.Popen(["cat", str(self.path / feed)], stdout=subprocess.PIPE) if feed else None
        if failing_read is not None:
            popen["env"] = {**os.environ, "LD_PRELOAD": str(self.shim), "FAILING_READ": str(failing_read)}
        started = time.time()
        try:
            process = subprocess.Popen([str(self.hexcal), *arguments], cwd=self.path, start_new_session=True,
                                       stdin=feeder.stdout if feeder else subprocess.DEVNULL, stdout=subprocess.PIPE,
                                       stderr=subprocess.PIPE, **popen)
        except (OSError, ValueError, subprocess.SubprocessError):  # no system takes such an argument, or such a limit
            return []
        finally:
            if feeder:
                feeder.stdout.close()
        findings = []
        try:
            out, err = process.communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            out, err = process.communicate()
            findings.append(f"no end within {PATIENCE_S} s")
        else:
            findings += judged(process.returncode, out or b"", err or b"", words)
            findings += judged_files(self.path, started, words)
            if (must_succeed or goes_on) and process.returncode not in (0, 1):
                findings.append(f"exit code {process.returncode}: {err.decode(errors='replace')}")
            if failing_read is not None and process.returncode == 0:
                findings += [f"{name} is another one, without a word" for name, data in self.results.items()
                             if (self.path / name).read_bytes() != data]
        if feeder:
            feeder.wait()
        after = state_of(self.path)
        if after != before:
            changed = [name for name in sorted(before.keys() | after.keys()) if before.get(name) != after.get(name)]
            findings += [f"changed {name}" for name in changed if name in before]
        if prepare is not None or after != before or goes_on or failing_read:
            self.restore()
        return findings


def judged_files(lab, since, words):
    """Of what was written since."""
    findings = []
    for folder in ("out", "results"):
        for path in (lab / folder).rglob("*"):
            if path.suffix not in TEXT_FILES or path.is_symlink() or not path.is_file():
                continue
            if path.stat().st_mtime < since:
                continue
            text = path.read_bytes()
            if found := CONTROL.search(text):
                findings.append(f"control character {found.group()!r} in {path.relative_to(lab)}")
            if not words and path.suffix in (".csv", ".json") and (found := NOT_FINITE.search(text)):
                findings.append(f"{found.group().decode()} in {path.relative_to(lab)}")
    return findings


def judged(code, out, err, words=False):
    findings = []
    if code < 0:
        findings.append(f"signal {-code}")
    elif code > 2:
        findings.append(f"exit code {code}: {err[-300:].decode(errors='replace')}")
    if code == 2 and not err.strip():
        findings.append("refused without a word")
    for name, text in (("out", out), ("err", err)):
        if found := CONTROL.search(text):
            findings.append(f"control character {found.group()!r} on std{name}")
        text = QUOTED.sub(b"", text)  # what was found in the user's file
        if not words and (found := NO_NUMBER.search(text)):
            around = text[max(found.start() - 60, 0):found.end() + 20]
            findings.append(f"says {found.group().decode()} on std{name}: {around!r}")
    return findings
