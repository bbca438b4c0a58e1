#!/usr/bin/env python3
"""Every key and column that a reader asks for stands in tools/io/FORMATS.md, in the section of its file.

Reads the readers' sources: calls such as map.number("key"), table.text(row, "column") and require_columns({...}). A section
of FORMATS.md names its readers in a comment `<!-- readers: a.cc b.cc -->`; its first column holds keys in backticks. Also
the other way round: a key that stands there must occur in one of the readers' sources.
"""
import pathlib
import re
import sys

KEY_CALL = re.compile(
    r"\b(?:number|number_or|integer|boolean_or|text|optional_text|choice|numbers|numbers_or_one|vector3|vectors3|texts|"
    r"rigid3|map|maps|has|is_map|is_sequence|optional_path|read_lengths|read_feature|read_frame|positive|not_negative|"
    r"size_mm|six_points|six|read_ids|count)"
    r"\(\s*(?:\w+\s*,\s*)?\"([A-Za-z_]\w*)\"")
COLUMN_CALL = re.compile(r"\b(?:text|number|optional_number|integer|has_column)\(\s*(?:\w+\s*,\s*)?\"([A-Za-z_]\w*)\"")
COLUMN_LIST = re.compile(r"require_columns\(\{([^}]*)\}\)")


def asked_keys(source):
    keys = set(KEY_CALL.findall(source)) | set(COLUMN_CALL.findall(source))
    for names in COLUMN_LIST.findall(source):
        keys |= set(re.findall(r'"(\w+)"', names))
    return keys


def sections(page):
    """(title, readers, keys in the first column) of every section that names readers."""
    for part in re.split(r"^## ", page, flags=re.MULTILINE)[1:]:
        readers = re.search(r"<!-- readers: (.*?) -->", part)
        if not readers:
            continue
        keys = set()
        for line in part.splitlines():
            if line.startswith("| `"):
                keys |= set(re.findall(r"`([A-Za-z_]\w*)`", line.split("|")[1]))
        yield part.splitlines()[0], readers.group(1).split(), keys


def main():
    root = pathlib.Path(sys.argv[1])
    page = (root / "tools/io/FORMATS.md").read_text(encoding="utf-8")
    wrong, documented, by_reader = [], 0, {}
    for title, readers, keys in sections(page):
        source = ""
        for reader in readers:
            path = root / reader if "/" in reader else root / "tools/io" / reader
            by_reader.setdefault(path, set()).update(keys)
            for part in (path, path.with_suffix(".h")):
                source += part.read_text(encoding="utf-8") if part.exists() else ""
        wrong += [f"{title}: key '{key}' is documented and not read" for key in sorted(keys)
                  if f'"{key}"' not in source]
        documented += len(keys)
    for path, keys in by_reader.items():
        wrong += [f"{path.name}: key '{key}' is read and not documented"
                  for key in sorted(asked_keys(path.read_text(encoding="utf-8")) - keys)]
    read = {path.name for path in by_reader}
    for path in sorted((root / "tools/io").glob("*.cc")):
        source = path.read_text(encoding="utf-8")
        if ("YamlMap::read(" in source or "CsvTable::read(" in source) and path.name not in read | {
                "csv_table.cc", "yaml_map.cc"}:
            wrong.append(f"{path.name} reads a file that no section of FORMATS.md names")
    if documented < 100:
        wrong.append(f"only {documented} keys found: the page or this check is broken")
    for line in wrong:
        print(line)
    print(f"formats: {documented} keys, {len(wrong)} wrong")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
