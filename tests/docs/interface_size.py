#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Limits the size of the interface in include/jostle; and keeps std::ranges out of it.

    interface_size.py          prints the counts, and fails if one is above its limit
    interface_size.py --list   prints the names

To add to the interface, remove something, or raise a limit and say why. All names that programs may use count, except those in
namespaces `detail` and `narrow` and in chapter.hpp. Each overload of a function counts; operators, constructors, and the arithmetic
of vectors, poses and boxes don't.
"""
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "c"))
import reach  # noqa: E402

# Why not fewer types, and fewer functions in C, says decision 69.
# Of these, surface.hpp of 0.3 has 16 functions, 9 types and 2 aliases, and 11 functions in C.
LIMITS = {"functions": 280, "types": 106, "aliases": 58, "functions in C": 159}
ARITHMETIC = {"vec.hpp", "pose.hpp"}
ARITHMETIC_OF = {"Vec", "Pose", "Aabb"}


def without_details(text):
    """The declarations at the beginning of a line, without namespaces that aren't for programs."""
    out, closing = [], None
    for line in reach.without_comments(text.replace("} // namespace", "} namespace end")).splitlines():
        opened = re.match(r"namespace (detail|narrow) \{", line)
        if opened:
            closing = f"}} namespace end {opened[1]}"
        if closing is None:
            out.append(line)
        elif line.startswith(closing):
            closing = None
    return "\n".join(out)


def counted():
    found = {what: [] for what in LIMITS}
    for header in sorted(reach.HEADERS.glob("*.hpp")):
        if header.name in reach.NOT_READ:
            continue
        text = header.read_text()
        if header.name not in ARITHMETIC:
            found["functions"] += [name for name in reach.functions(text) if name.split("::")[0] not in ARITHMETIC_OF and
                                   not (header.name == "box.hpp" and "::" not in name and name != "box_view")]
        text = without_details(text)
        types = re.findall(r"^(?:struct|class|enum|enum class) +(\w+)(?:<[^;{]*>)?\s*(?:final\s*)?(?::[^;{]*)?\{", text, re.MULTILINE)
        found["types"] += sorted(set(types) - {"hash"})  # of std; the others may be specialised
        found["aliases"] += re.findall(r"^using (\w+) *=", text, re.MULTILINE)
    in_c = (reach.HEADERS / "jostle.h").read_text()
    found["functions in C"] = re.findall(r"^JOSTLE_C_API[^;(]*?\b(jostle_\w+)\(", in_c, re.MULTILINE)
    return found


def main():
    found, above = counted(), []
    for what, names in found.items():
        print(f"{len(names)} {what}, {LIMITS[what]} at most")
        if "--list" in sys.argv:
            print("  " + "\n  ".join(sorted(names)))
        if len(names) > LIMITS[what]:
            above.append(what)
    for header in reach.HEADERS.glob("*.hpp"):
        if re.search(r"<ranges>|std::ranges", header.read_text()):
            raise SystemExit(f"{header.name} names std::ranges: see CONTRIBUTING.md")
    if above:
        raise SystemExit(f"include/jostle has more {' and '.join(above)} than {HERE.name}/interface_size.py allows")


main()
