#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The C interface as JSON, for those who generate bindings.

    extras/describe.py --write   writes extras/jostle.json from include/jostle/jostle.h
    extras/describe.py --check   fails if that is out of date, or if a declaration breaks the header's rules

What is in it: constants, handles, types, structs with their members, callbacks, and functions with their
parameters. A parameter has a type as in C, and "in" or "out". The comment of each is its "doc".
"""

import argparse
import json
import pathlib
import re
import sys

PROJECT = pathlib.Path(__file__).resolve().parent.parent
HEADER = PROJECT / "include" / "jostle" / "jostle.h"
JSON = PROJECT / "extras" / "jostle.json"

TYPES = r"(?:const )?(?:unsigned )?\w+(?: ?\*(?: ?const ?\*)?\*?)?"


def statements(text):
    """The header's declarations, each with the comment before it."""
    doc, statement, depth, out = [], "", 0, []
    text = re.sub(r"^static inline .*?^}\n", "\n", text, flags=re.MULTILINE | re.DOTALL)  # nothing that other languages can call
    for line in text.splitlines():
        bare = line.strip()
        if not statement and bare.startswith("///"):
            doc.append(bare[3:].removeprefix(" "))
            continue
        if not statement and (not bare or bare.startswith(("//", "#", "/*"))):
            doc = []
            continue
        if bare in ('extern "C" {', "}") and depth == 0:
            continue
        statement += line + "\n"
        code = re.sub(r"//.*", "", line)
        depth += code.count("{") - code.count("}")
        if depth == 0 and code.rstrip().endswith(";"):
            out.append((doc, statement))
            doc, statement = [], ""
    if statement:
        raise SystemExit(f"{HEADER}: a declaration without an end: {statement[:80]}")
    return out


def plain(code):
    return " ".join(re.sub(r"//.*", "", code).replace("JOSTLE_C_API", "").split())


def split(parameters):
    """Parameters at commas, but not at those of a function pointer."""
    parts, depth = [""], 0
    for letter in parameters:
        depth += (letter == "(") - (letter == ")")
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts if part.strip() not in ("", "void")]


def parameter(text):
    pointer = re.fullmatch(r"(.*)\(\s*\*\s*(\w+)\s*\)\s*\((.*)\)", text)
    if pointer:
        return {"name": pointer[2], "type": "function", "returns": pointer[1].strip(),
                "parameters": [parameter(part) for part in split(pointer[3])], "direction": "in"}
    found = re.fullmatch(r"(.*?)\s*(\w+)(\[\d+\])?", text)
    kind = re.sub(r"\s*\*\s*", "*", found[1]).replace("*const*", "* const*").strip()
    entry = {"name": found[2], "type": kind}
    if found[3]:
        entry["length"] = int(found[3][1:-1])
    pointed = kind.count("*")
    entry["direction"] = "out" if pointed == 2 and "const*" not in kind or pointed == 1 and "const" not in kind else "in"
    return entry


def members(body):
    out = []
    for line in re.sub(r"\n\s{8,}", " ", body).splitlines():
        code, _, doc = line.partition("///<")
        code = code.split("//")[0].strip().rstrip(";")
        if not code:
            continue
        if "(" in code:
            entry = parameter(code)
            entry.pop("direction")
            out.append(entry)
        else:
            first, *others = [part.strip() for part in code.split(",")]
            entry = parameter(first)
            entry.pop("direction")
            out.append(entry)
            base = entry["type"].rstrip("*")
            for other in others:
                more = parameter(base + " " + other)
                more.pop("direction")
                out.append(more)
        if doc.strip():
            out[-1]["doc"] = doc.strip()
    return out


def describe():
    described = {"header": "jostle/jostle.h", "constants": [], "types": [], "handles": [], "structs": [],
                 "callbacks": [], "functions": []}
    names = set()
    latest = None
    for doc, statement in statements(HEADER.read_text()):
        doc, code = "\n".join(doc), plain(statement)
        enum = re.fullmatch(r"enum \{ (.*) \};", code)
        opaque = re.fullmatch(r"typedef struct (\w+) (\w+);", code)
        struct = re.fullmatch(r"typedef struct (\w+) \{.*\} (\w+);", code)
        callback = re.fullmatch(r"typedef (\w+) \(\*\s*(\w+)\)\((.*)\);", code)
        number = re.fullmatch(r"typedef (\w+) (\w+);", code)
        function = re.fullmatch(r"(\w+) (\w+)\((.*)\);", code)
        if enum:
            for name, value, more in re.findall(r"(JOSTLE_\w+) = (-?\d+),?[ \t]*(?:///<)?[ \t]*(.*)", statement):
                described["constants"].append({"name": name, "value": int(value), "type": latest, "doc": more})
        elif opaque:
            described["handles"].append({"name": opaque[2], "doc": statement.partition("///<")[2].strip()})
        elif struct:
            body = statement[statement.index("{") + 1:statement.rindex("}")]
            fields = members(body)
            described["structs"].append({"name": struct[2], "doc": doc, "members": fields,
                                         "has_size": fields[0]["name"] == "struct_size"})
        elif callback:
            described["callbacks"].append({"name": callback[2], "doc": doc, "returns": callback[1],
                                           "parameters": [parameter(part) for part in split(callback[3])]})
        elif number:
            latest = number[2]
            described["types"].append({"name": number[2], "is": number[1], "doc": doc})
        elif function:
            described["functions"].append({"name": function[2], "doc": doc, "returns": function[1],
                                           "parameters": [parameter(part) for part in split(function[3])]})
        else:
            raise SystemExit(f"{HEADER}: not understood: {code[:200]}")
    handles = {handle["name"] for handle in described["handles"]}
    for kind in ("callbacks", "functions"):
        for entry in described[kind]:
            for part in entry["parameters"]:
                # A handle is given, whatever is done with what it stands for; so is a callback's context.
                if part["type"].rstrip("*") in handles and part["type"].count("*") == 1 or part["name"] in ("context", "handle"):
                    part["direction"] = "in"
    for kind in ("types", "handles", "structs", "callbacks", "functions"):
        for entry in described[kind]:
            if entry["name"] in names:
                raise SystemExit(f"{HEADER}: {entry['name']} stands there twice")
            names.add(entry["name"])
    return described


def faults(described):
    """Where the header breaks its own rules."""
    handles = {handle["name"] for handle in described["handles"]}
    known = {"void", "char", "float", "double", "int32_t", "int64_t", "uint8_t", "uint32_t", "uint64_t", "function"}
    known |= {entry["name"] for kind in ("types", "handles", "structs", "callbacks") for entry in described[kind]}
    for function in described["functions"]:
        name, parameters = function["name"], function["parameters"]
        if not name.startswith("jostle_"):
            yield f"{name} doesn't begin with jostle_"
        if function["returns"] != "jostle_status":
            yield f"{name} returns no jostle_status"
        if not parameters or parameters[-1]["name"] != "error" or parameters[-1]["type"] != "jostle_error*":
            yield f"the last parameter of {name} isn't jostle_error* error"
        owner = max((handle for handle in handles if name.startswith(handle + "_")), key=len, default=None)
        maker = any(p["name"] == "out" and p["type"] == f"{owner}**" for p in parameters)
        if owner and not maker and parameters[0]["type"].replace("const ", "").rstrip("*") != owner:
            yield f"the first parameter of {name} is no {owner}"
        directions = [p["direction"] for p in parameters if p["type"] != "jostle_results*"]
        if directions != sorted(directions):
            yield f"{name} has something to read after what it writes"
    for kind in ("structs", "callbacks", "functions"):
        for entry in described[kind]:
            for part in entry.get("members", []) + entry.get("parameters", []):
                base = part["type"].replace("const", "").replace("*", "").strip()
                if base not in known:
                    yield f"{entry['name']}::{part['name']} is of an unknown type: {base}"
    for callback in described["callbacks"]:
        if callback["parameters"][0]["name"] != "context":
            yield f"the first parameter of {callback['name']} isn't context"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    choice = parser.add_mutually_exclusive_group(required=True)
    choice.add_argument("--write", action="store_true")
    choice.add_argument("--check", action="store_true")
    given = parser.parse_args()
    described = describe()
    found = list(faults(described))
    text = json.dumps(described, indent=1) + "\n"
    if given.write:
        JSON.write_text(text)
    elif not JSON.exists() or JSON.read_text() != text:
        found.append("extras/jostle.json is out of date: run extras/describe.py --write")
    print("\n".join(found) if found else f"{len(described['functions'])} functions, "
          f"{len(described['structs'])} structs, {len(described['handles'])} handles")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
