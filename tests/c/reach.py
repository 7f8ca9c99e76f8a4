#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The C interface reaches all that the C++ interface has: reach.txt says how, and is complete.

    reach.py          checks it
    reach.py --list   writes the functions of the C++ interface
"""

import json
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
PROJECT = HERE.parent.parent
HEADERS = PROJECT / "include" / "jostle"
# Of the chapter that Jostle grew from, for study.
NOT_READ = {"chapter.hpp"}
NOT_NAMES = {"requires", "noexcept", "decltype", "sizeof", "explicit", "alignas", "static_assert", "if", "return",
             "defined", "__attribute__", "void"}


def without_comments(text):
    text = re.sub(r"//[^\n]*", "", text)
    text = re.sub(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", "", text, flags=re.MULTILINE)
    return text.replace("JOSTLE_NAMESPACE_BEGIN", "").replace("JOSTLE_NAMESPACE_END", "").replace("JOSTLE_API", "")


def without_brackets(text, opening, closing):
    """What isn't between such brackets."""
    out, depth = "", 0
    for letter in text:
        depth += letter == opening
        if depth == 0:
            out += letter
        depth -= letter == closing and depth > 0
    return out


def name_of(declaration):
    """The function that a declaration declares, or None."""
    text = re.sub(r"\[\[.*?\]\]", "", declaration)
    text = re.sub(r"->", " ", text)
    if "operator" in text or re.search(r"=\s*delete\b", text) or re.match(r"\s*(using|typedef|friend|static_assert|extern|concept)\b", text):
        return None
    text = re.sub(r"\btemplate\s*<", "<", text)
    text = without_brackets(text, "<", ">")
    text = re.sub(r"\brequires\s*\([^;{]*?\)\s*\n", " ", text)
    found = [name for name in re.findall(r"(~?\b[A-Za-z_]\w*)\s*\(", text.split("=")[0]) if name not in NOT_NAMES]
    return found[0] if found else None


def functions(text):
    """Names of functions, Class::name for members, of one header."""
    text = without_comments(text)
    scopes, statement, position, out = [], "", 0, []
    private = lambda: any(scope["access"] != "public" for scope in scopes)

    def end_of_body(at):
        depth = 0
        while True:
            depth += (text[at] == "{") - (text[at] == "}")
            at += 1
            if depth == 0:
                return at

    def record(declaration):
        name = name_of(declaration)
        classes = [scope["name"] for scope in scopes if scope["class"]]
        if not classes and name is not None and re.search(r"\)\s*->", declaration):
            return  # says what a class's arguments are deduced from
        if name is None or private() or (classes and name.lstrip("~") == classes[-1]) or name.startswith("~"):
            return
        out.append("::".join(classes + [name]))

    while position < len(text):
        letter = text[position]
        if letter == ":" and re.search(r"\b(public|private|protected)\s*$", statement):
            scopes[-1]["access"] = re.search(r"(\w+)\s*$", statement)[1]
            statement = ""
        elif letter == ";":
            record(statement)
            statement = ""
        elif letter == "{":
            inside = re.search(r"\b(?:class|struct|union)\s+([A-Za-z_]\w*)[^()]*$", without_brackets(statement, "<", ">"))
            space = re.search(r"\bnamespace\s+([\w:]+)\s*$", statement)
            if space:
                scopes.append({"name": space[1], "class": False,
                               "access": "private" if space[1] in ("detail", "narrow") else "public"})
            elif inside and not re.search(r"\benum\b", statement):
                scopes.append({"name": inside[1], "class": True,
                               "access": "private" if re.search(r"\bclass\s", without_brackets(statement, "<", ">"))
                               else "public"})
            else:
                body = end_of_body(position)
                # A member's initialiser or a default argument goes on; a function's body ends it.
                goes_on = re.match(r"\s*[;,)]", text[body:])
                if "enum" not in statement and not goes_on:
                    record(statement)
                position = body
                statement = statement + " " if goes_on else ""
                continue
            statement = ""
        elif letter == "}":
            if scopes:
                scopes.pop()
            statement = ""
        else:
            statement += letter
        position += 1
    return out


def interface():
    found = set()
    for header in sorted(HEADERS.glob("*.hpp")):
        if header.name not in NOT_READ:
            found.update(functions(header.read_text()))
    return found


def read_reach():
    """C++ name (or Class::*) -> C names or a reason; and the C names that have no C++ twin."""
    reach, only_in_c = {}, {}
    for number, line in enumerate((HERE / "reach.txt").read_text().splitlines(), 1):
        line = line.split("#")[0].strip()
        if not line:
            continue
        found = re.fullmatch(r"(\S+)\s+(->|--)\s+(.*)", line)
        if not found:
            raise SystemExit(f"reach.txt:{number}: not understood")
        into = only_in_c if found[1].startswith("jostle_") else reach
        if found[1] in into:
            raise SystemExit(f"reach.txt:{number}: {found[1]} stands there twice")
        into[found[1]] = found[3].split() if found[2] == "->" else found[3]
    return reach, only_in_c


def main():
    found = interface()
    if "--list" in sys.argv:
        print("\n".join(sorted(found)))
        return 0
    reach, only_in_c = read_reach()
    in_c = {function["name"] for function in json.loads((PROJECT / "extras" / "jostle.json").read_text())["functions"]}
    faults = []
    for name in sorted(found):
        if name not in reach and name.rpartition("::")[0] + "::*" not in reach:
            faults.append(f"{name} isn't reached from C: add it to jostle.h, or say in tests/c/reach.txt why not")
    for name, how in reach.items():
        if not (name in found or name.endswith("::*") and any(f.startswith(name[:-1]) for f in found)):
            faults.append(f"tests/c/reach.txt has {name}, which isn't in the C++ interface")
        if isinstance(how, list):
            faults += [f"tests/c/reach.txt has {function}, which isn't in jostle.h" for function in how
                       if function not in in_c]
    named = {function for how in reach.values() if isinstance(how, list) for function in how} | set(only_in_c)
    faults += [f"tests/c/reach.txt doesn't have {function}" for function in sorted(in_c - named)]
    faults += [f"tests/c/reach.txt has {function}, which isn't in jostle.h" for function in sorted(set(only_in_c) - in_c)]
    print("\n".join(faults) if faults else f"{len(found)} functions of C++ are reached by {len(in_c)} of C")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
