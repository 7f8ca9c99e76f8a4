#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Every name of the 0.2 interface that is gone stands in docs/migrate/from-0.2.md.

    removed_names.py                     checks it against names-0.2.txt
    removed_names.py --list INCLUDE      prints the names that headers have
"""
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
PROJECT = HERE.parent.parent
sys.path.insert(0, str(HERE.parent / "c"))
import reach  # noqa: E402


def names(include):
    found = set()
    for header in sorted(include.glob("*.hpp")):
        if header.name in reach.NOT_READ:
            continue
        found.add(header.name)
        text = header.read_text()
        found.update(reach.functions(text))
        plain = re.sub(r"namespace detail \{.*?\n\} // namespace detail", "", text, flags=re.DOTALL)
        plain = reach.without_comments(plain)
        found.update(re.findall(r"^(?:struct|class|enum class|enum) +(\w+)", plain, re.MULTILINE))
        found.update(re.findall(r"^using (\w+) *=", plain, re.MULTILINE))
    in_c = (include / "jostle.h").read_text()
    found.update(re.findall(r"^JOSTLE_C_API[^;(]*?\b(jostle_\w+)\(", in_c, re.MULTILINE))
    found.update(re.findall(r"^\} (jostle_\w+);", in_c, re.MULTILINE))
    return found


def main():
    if sys.argv[1:2] == ["--list"]:
        print("\n".join(sorted(names(pathlib.Path(sys.argv[2])))))
        return
    page = (PROJECT / "docs" / "migrate" / "from-0.2.md").read_text()
    before = set((HERE / "names-0.2.txt").read_text().split())
    here = names(PROJECT / "include" / "jostle")
    members = {name.split("::")[-1] for name in here}
    gone = sorted(name for name in before - here
                  if not ("::" in name and name.split("::")[-1] in members and name.split("::")[0] in ("BoxIndex", "World")))
    says = lambda word: re.search(rf"\b{re.escape(word)}\b", page)
    missing = [name for name in gone if not says(name.split("::")[-1]) and
               not ("::" in name and name.split("::")[0] in gone and says(name.split("::")[0]))]  # with its class
    if missing:
        raise SystemExit("docs/migrate/from-0.2.md doesn't say what became of:\n  " + "\n  ".join(missing))
    print(f"{len(gone)} of {len(before)} names are gone, and the page has each of them")


main()
