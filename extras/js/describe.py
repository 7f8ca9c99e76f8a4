#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Where the members of the C interface's structs lie in a WebAssembly module, for the JavaScript that fills them in.

    extras/js/describe.py --write   writes extras/js/src/structs.js from extras/jostle.json
    extras/js/describe.py --check   fails if that is out of date
    extras/js/describe.py --exports FILE   writes what the modules export, as emscripten's linker wants it: what the sources call;
                                             FILE-pairs, -surfaces and -bush have what those modules need
"""

import argparse
import json
import pathlib
import re
import sys
import textwrap

HERE = pathlib.Path(__file__).resolve().parent
STRUCTS = HERE / "src" / "structs.js"
SOURCES = sorted((HERE / "src").glob("*.js"))
OF_MODULES = {"pairs": ("core.js", "module.js", "pairs.js"), "surfaces": ("core.js", "module.js", "pairs.js", "surfaces.js"),
              "bush": ("core.js", "bush.js")}
SIZES = {"char": 1, "uint8_t": 1, "int32_t": 4, "uint32_t": 4, "float": 4, "int64_t": 8, "uint64_t": 8, "double": 8}


def layouts(described):
    """For each struct its size and alignment, and the offset of each member."""
    sizes = {name: (size, size) for name, size in SIZES.items()}
    sizes |= {each["name"]: sizes[each["is"]] for each in described["types"]}
    found = {}
    for struct in described["structs"]:
        at, widest, offsets = 0, 1, {}
        for member in struct["members"]:
            kind = member["type"]
            pointer = "*" in kind or kind == "function" or kind.endswith("_function")
            size, align = (4, 4) if pointer else sizes[kind]
            at = -(-at // align) * align
            offsets[member["name"]] = at
            at += size * member.get("length", 1)
            widest = max(widest, align)
        sizes[struct["name"]] = (-(-at // widest) * widest, widest)
        found[struct["name"]] = (sizes[struct["name"]][0], offsets)
    return found


def line(begin, members):
    """An object of JavaScript's, on one line if it has up to 110 columns."""
    if len(begin) + len(members) <= 110 - len(" = {  };"):
        return [f"{begin} = {{ {members} }};"]
    bound = members.replace(": ", ":\0") + ","  # what belongs together stays on a line
    lines = textwrap.wrap(bound, 110, initial_indent="  ", subsequent_indent="  ", break_on_hyphens=False)
    return [f"{begin} = {{", *(each.replace("\0", " ") for each in lines), "};"]


def structs(described):
    lines = ["// SPDX-License-Identifier: MIT", "// Written by extras/js/describe.py: sizes of structs, and offsets of their members.", ""]
    for name, (size, offsets) in layouts(described).items():
        members = ", ".join(f"{member}: {offset}" for member, offset in offsets.items())
        lines += line(f"export const {name}", f"sizeof: {size}, {members}")
    names = {kind: {} for kind in ("jostle_status", "jostle_end_reason", "jostle_shape_type", "jostle_query_kind")}
    for constant in described["constants"]:
        if constant["type"] in names:
            names[constant["type"]][constant["value"]] = constant["name"]
    lines.append("")
    for kind, prefix in (("jostle_status", "JOSTLE_"), ("jostle_end_reason", "JOSTLE_"), ("jostle_shape_type", "JOSTLE_SHAPE_"),
                         ("jostle_query_kind", "JOSTLE_")):
        each = ", ".join(f'{value}: "{name.removeprefix(prefix).lower()}"' for value, name in names[kind].items())
        lines += line(f"export const {kind}", each)
    return "\n".join(lines) + "\n"


def write_exports(described, sources, path):
    called = re.findall(r"\bjostle_\w+|_jostle_\w*free", "".join(file.read_text() for file in sources if file != STRUCTS))
    called = {name.removeprefix("_") for name in called}
    names = ["malloc", "free"] + [each["name"] for each in described["functions"] if each["name"] in called]
    pathlib.Path(path).write_text("".join(f"_{name}\n" for name in names))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--exports")
    given = parser.parse_args()
    described = json.loads((HERE.parent / "jostle.json").read_text())
    if given.exports:
        # What few want would make all modules larger.
        write_exports(described, [file for file in SOURCES if file.name != "surfaces.js"], given.exports)
        for module, names in OF_MODULES.items():
            write_exports(described, [file for file in SOURCES if file.name in names], f"{given.exports}-{module}")
    text = structs(described)
    if given.write:
        STRUCTS.write_text(text)
    if given.check and STRUCTS.read_text() != text:
        sys.exit(f"{STRUCTS} is out of date: extras/js/describe.py --write")


if __name__ == "__main__":
    main()
