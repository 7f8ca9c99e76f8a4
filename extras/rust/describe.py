#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The C interface as Rust declares it.

    extras/rust/describe.py --write   writes extras/rust/src/ffi.rs from extras/jostle.json
    extras/rust/describe.py --check   fails if that is out of date

A function is declared where the crate has it: build.rs says which source files of src/c_api/ are compiled, and for which
feature.
"""

import argparse
import json
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
PROJECT = HERE.parent.parent
FFI = HERE / "src" / "ffi.rs"

TYPES = {"void*": "*mut c_void", "void": "c_void", "char": "c_char", "float": "f32", "double": "f64", "uint8_t": "u8", "int32_t": "i32",
         "uint32_t": "u32", "int64_t": "i64", "uint64_t": "u64"}
KEYWORDS = {"type", "box", "move", "ref", "in"}

TOP = """\
// SPDX-License-Identifier: MIT
// Written by extras/rust/describe.py from extras/jostle.json.

//! The C interface as it is, `jostle.h`: for what the rest of the crate has no words for.
//!
//! Functions take pointers and return a status; what they want and what they promise is said in the header,
//! which comes with the crate (`cpp/include/jostle/jostle.h`).
#![allow(non_camel_case_types, missing_docs, clippy::all)]

use std::ffi::c_void;
use std::os::raw::c_char;
"""


def name_of(name):
    return f"r#{name}" if name in KEYWORDS else name


def rust(entry):
    """The type of a member or parameter."""
    kind = entry["type"]
    if kind == "function":
        return f"Option<{function_type(entry)}>"
    if kind.endswith("_function"):
        return kind
    if kind == "const jostle_shape* const*":
        return "*const *const jostle_shape"
    base = kind.replace("const", "").replace("*", "").strip()
    text = TYPES.get(base, base)
    inner = "*const " if kind.startswith("const ") else "*mut "
    stars = kind.count("*")
    if stars:
        text = "*mut " * (stars - 1) + inner + text
    return f"[{text}; {entry['length']}]" if "length" in entry else text


def parameters(entry):
    return ", ".join(f"{name_of(each['name'])}: {rust(each)}" for each in entry["parameters"])


def function_type(entry):
    returns = "" if entry["returns"] == "void" else f" -> {TYPES.get(entry['returns'], entry['returns'])}"
    return f'unsafe extern "C" fn({parameters(entry)}){returns}'


def comment(doc, indent=""):
    """Code and brackets would be links and tests of Rust's own."""
    return [f"{indent}/// {line}".rstrip() for line in doc.replace("[", "\\[").replace("<", "\\<").split("\n")] if doc else []


def feature_of_each_function():
    """What build.rs compiles for which feature, by the functions in it."""
    script = (HERE / "build.rs").read_text()
    features = {}
    for feature, files in re.findall(r'feature: "(\w*)",.*?c_api: &\[(.*?)\]', script, re.DOTALL):
        for file in re.findall(r'"(\w+)"', files):
            text = (PROJECT / "src" / "c_api" / f"{file}.cpp").read_text()
            for name in re.findall(r"^jostle_status (jostle_\w+)\(", text, re.MULTILINE):
                features[name] = feature
    return features


def generate(described):
    lines = TOP.splitlines()
    for kind in described["types"]:
        lines += ["", *comment(kind["doc"]), f"pub type {kind['name']} = {TYPES[kind['is']]};"]
        for constant in described["constants"]:
            if constant["type"] == kind["name"]:
                lines += comment(constant["doc"])
                lines.append(f"pub const {constant['name']}: {kind['name']} = {constant['value']};")
    for handle in described["handles"]:
        lines += ["", *comment(handle["doc"]), "#[repr(C)]", f"pub struct {handle['name']} {{",
                  "    _private: [u8; 0],", "}"]
    for callback in described["callbacks"]:
        lines += ["", *comment(callback["doc"]), f"pub type {callback['name']} = Option<{function_type(callback)}>;"]
    for struct in described["structs"]:
        lines += ["", *comment(struct["doc"]), "#[repr(C)]", "#[derive(Clone, Copy)]", f"pub struct {struct['name']} {{"]
        for member in struct["members"]:
            lines += comment(member.get("doc", ""), "    ")
            lines.append(f"    pub {name_of(member['name'])}: {rust(member)},")
        lines.append("}")
    features = feature_of_each_function()
    lines += ["", 'extern "C" {']
    for function in described["functions"]:
        if function["name"] not in features:
            continue
        feature = features[function["name"]]
        lines += comment(function["doc"], "    ")
        if feature:
            lines.append(f'    #[cfg(feature = "{feature}")]')
        lines.append(f"    pub fn {function['name']}({parameters(function)}) -> jostle_status;")
    return "\n".join([*lines, "}"]) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    choice = parser.add_mutually_exclusive_group(required=True)
    choice.add_argument("--write", action="store_true")
    choice.add_argument("--check", action="store_true")
    given = parser.parse_args()
    text = generate(json.loads((HERE.parent / "jostle.json").read_text()))
    if given.write:
        FFI.write_text(text)
    elif not FFI.exists() or FFI.read_text() != text:
        sys.exit(f"{FFI} is out of date: run extras/rust/describe.py --write")


if __name__ == "__main__":
    main()
