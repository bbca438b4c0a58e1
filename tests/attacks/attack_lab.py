"""The campaign that is attacked, and the judge of one call.

A call has failed the attack if it ends by a signal or with another exit code than 0 to 2, takes too long, changes one of
the campaign's files (results/ and what lies under out/ are hexcal's), says a number that is none, lets a control
character through to the terminal, or refuses without a line of words.
"""

import hashlib
import os
import pathlib
import re
import shutil
import signal
import stat
import subprocess

PATIENCE_S = 60  # the slowest call of the table takes about 2 s on a machine with nothing else to do
NO_NUMBER = re.compile(rb"(?<![\w./-])[-+]?(?:nan|inf|infinity)(?![\w./-])", re.IGNORECASE)
CONTROL = re.compile(rb"[\x00-\x08\x0b-\x1f\x7f]")


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
        self.restore()
        self.clean = state_of(self.path)

    def twin(self, folder):
        """Another copy, for another process."""
        twin = object.__new__(Lab)
        twin.hexcal, twin.template, twin.clean, twin.path = self.hexcal, self.template, self.clean, folder / "lab"
        twin.restore()
        return twin

    def restore(self):
        shutil.rmtree(self.path, ignore_errors=True)
        shutil.copytree(self.template, self.path)

    def fresh_out(self):
        shutil.rmtree(self.path / "out", ignore_errors=True)
        (self.path / "out").mkdir()

    def call(self, arguments, prepare=None, must_succeed=False, stdin=subprocess.DEVNULL, **popen):
        """Runs `hexcal arguments` in the lab; returns the findings."""
        self.fresh_out()
        before = self.clean
        if prepare is not None:
            prepare(self.path)
            before = state_of(self.path)
        stdout = popen.pop("stdout", subprocess.PIPE)
        process = subprocess.Popen([str(self.hexcal), *arguments], cwd=self.path, stdin=stdin, stdout=stdout,
                                   stderr=subprocess.PIPE, start_new_session=True, **popen)
        findings = []
        try:
            out, err = process.communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            out, err = process.communicate()
            findings.append(f"no end within {PATIENCE_S} s")
        else:
            findings += judged(process.returncode, out or b"", err or b"")
            if must_succeed and process.returncode not in (0, 1):
                findings.append(f"exit code {process.returncode}: {err.decode(errors='replace')}")
        after = state_of(self.path)
        if after != before:
            changed = [name for name in sorted(before.keys() | after.keys()) if before.get(name) != after.get(name)]
            findings += [f"changed {name}" for name in changed if name in before]
        if prepare is not None or after != before:
            self.restore()
        return findings


def judged(code, out, err):
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
        if found := NO_NUMBER.search(text):
            around = text[max(found.start() - 60, 0):found.end() + 20]
            findings.append(f"says {found.group().decode()} on std{name}: {around!r}")
    return findings
