"""How a table, a YAML or a JSON file is spoilt, by its own content: every way yields a name and a function of its path."""

import os
import re

NUMBER = re.compile(rb"(?<![\w.#-])-?\d+\.?\d*(?:e[-+]?\d+)?(?![\w.])")
EXTREMES = [b"1e308", b"1e-300", b"nan", b"-1e308", b"inf", b"1e200", b"", b"zero"]
NUMBERS_PER_FILE = 6


def content_lines(data):
    return [i for i, line in enumerate(data) if line.strip() and not line.startswith(b"#")]


def edit(change):
    def spoil(path):
        path.write_bytes(change(path.read_bytes()))
    return spoil


def lines(change):
    def of_data(data):
        all_lines = data.split(b"\n")
        return b"\n".join(change(all_lines, content_lines(all_lines)))
    return edit(of_data)


def columns(change):
    """Of each record the cells; photographs' names in the sample hold no comma."""
    def of_lines(all_lines, at):
        for i in at:
            all_lines[i] = b",".join(change(all_lines[i].split(b",")))
        return all_lines
    return lines(of_lines)


def at_line(which, change):
    def of_lines(all_lines, at):
        all_lines[at[which]] = change(all_lines[at[which]])
        return all_lines
    return lines(of_lines)


def number(share, extreme):
    """The number that stands at this share of all in the file."""
    def of_data(data):
        found = list(NUMBER.finditer(data))
        if not found:
            return data
        match = found[int(share * (len(found) - 1))]
        return data[:match.start()] + extreme + data[match.end():]
    return edit(of_data)


def all_numbers(extreme):
    return edit(lambda data: NUMBER.sub(extreme, data))


def in_its_place(make):
    def spoil(path):
        path.unlink()
        make(path)
    return spoil


def of_file(name):
    yield "empty", edit(lambda data: b"")
    yield "half", edit(lambda data: data[:len(data) // 2])
    yield "but its last byte", edit(lambda data: data[:-1])
    yield "bytes", edit(lambda data: bytes(range(256)) * 8)
    yield "zeros", edit(lambda data: b"\0" * len(data))
    yield "twice", edit(lambda data: data + data)
    yield "a long line", edit(lambda data: b"x" * (3 << 20))
    yield "CRLF", edit(lambda data: data.replace(b"\n", b"\r\n"))
    yield "UTF-16", edit(lambda data: data.decode("utf-8", "replace").encode("utf-16"))
    yield "missing", lambda path: path.unlink()
    yield "a folder", in_its_place(lambda path: path.mkdir())
    yield "a FIFO", in_its_place(os.mkfifo)
    yield "a link to itself", in_its_place(lambda path: path.symlink_to(path.name))
    yield "a link to /", in_its_place(lambda path: path.symlink_to("/"))
    yield "a link to /proc/kmsg", in_its_place(lambda path: path.symlink_to("/proc/kmsg"))
    yield "not readable", lambda path: path.chmod(0)
    yield "a control character", edit(lambda data: data.replace(b",", b"\x1b[31m,").replace(b": ", b": \x1b[31m"))
    for extreme in EXTREMES:
        yield f"all numbers {extreme.decode()}", all_numbers(extreme)
    for extreme in EXTREMES[:3]:
        for i in range(NUMBERS_PER_FILE):
            yield f"number {i} {extreme.decode()}", number(i / (NUMBERS_PER_FILE - 1), extreme)
    if name.endswith(".csv"):
        yield "an open quote", at_line(-1, lambda line: line.rpartition(b",")[0] + b',"1')
        yield "text behind a quote", at_line(-1, lambda line: line.rpartition(b",")[0] + b',"1"2')
        yield "a column twice", columns(lambda cells: cells + cells[-1:])
        yield "a row twice", lines(lambda all_lines, at: all_lines[:at[-1] + 1] + all_lines[at[-1]:])
        yield "no first column", columns(lambda cells: cells[1:])
        yield "no last column", columns(lambda cells: cells[:-1])
        yield "a cell more", at_line(-1, lambda line: line + b",1")
        yield "no row", lines(lambda all_lines, at: all_lines[:at[0] + 1])
    if name.endswith(".yaml"):
        yield "a second document", edit(lambda data: data + b"---\n" + data)
        yield "text behind its end", edit(lambda data: data + b"...\nmore: 1\n")
        yield "an alias to itself", edit(lambda data: data + b"self: &a [*a]\n")
        yield "a key twice", lines(lambda all_lines, at: all_lines[:at[-1] + 1] + all_lines[at[-1]:])
        yield "a key more", edit(lambda data: data + b"\nmore: 1\n")
        yield "deep", edit(lambda data: data + b"deep: " + b"[" * 5000 + b"\n")
        yield "tabs", edit(lambda data: data.replace(b"  ", b"\t"))
