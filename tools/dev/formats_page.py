#!/usr/bin/env python3
"""The manual page hexcal-formats(5) from tools/io/FORMATS.md, on standard output. usage: formats_page.py FORMATS.md VERSION"""
import pathlib
import re
import sys


def roff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    text = re.sub(r"`([^`]*)`", r"\\fB\1\\fR", text)
    return "\\&" + text if text[:1] in (".", "'") else text


def main():
    page = pathlib.Path(sys.argv[1]).read_text(encoding="utf-8")
    print(f'.TH HEXCAL\\-FORMATS 5 "" "hexcal {sys.argv[2]}" "hexcal"')
    print(".SH NAME\nhexcal\\-formats \\- every key and column of the files that hexcal reads\n.SH DESCRIPTION")
    heading = []
    for line in page.splitlines()[1:]:
        if line.startswith("## "):
            print(f".SH {roff(line[3:]).upper()}")
        elif line.startswith("| ---"):
            continue
        elif line.startswith("| ") and not line.startswith("| `"):
            heading = [cell.strip() for cell in line.strip("|").split("|")]
        elif line.startswith("| `"):
            cells = [cell.strip() for cell in line.strip("|").split("|")]
            print(f".TP\n{roff(cells[0])}")
            words = [cells[1]] if cells[1:] else []
            words += [f"{name}: {cell}" for name, cell in zip(heading[2:], cells[2:]) if cell]
            print(roff("; ".join(word for word in words if word)) or "\\&")
        elif line.startswith("<!--"):
            continue
        else:
            print(roff(line) if line else ".PP")
    print(".SH SEE ALSO\nhexcal(1)")


if __name__ == "__main__":
    main()
