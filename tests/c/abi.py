#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""packaging/abi finds what would break programs that are compiled already, and lets pass what wouldn't."""

import pathlib
import re
import subprocess
import sys
import tempfile

PROJECT = pathlib.Path(__file__).resolve().parent.parent.parent
HEADER = (PROJECT / "include" / "jostle" / "jostle.h").read_text()


def check(include):
    return subprocess.run([PROJECT / "packaging" / "abi", "--check", "--include", include], capture_output=True, text=True)


def changed(pattern, by):
    text, count = re.subn(pattern, by, HEADER, count=1)
    assert count == 1, pattern
    return text


CHANGES = [
    # The header, and whether programs would notice.
    ("nothing", HEADER, False),
    ("a function more", changed(r"\nJOSTLE_C_API jostle_status jostle_version\(", r"\nvoid jostle_new(void);\g<0>"), False),
    ("a constant's value", changed(r"(JOSTLE_CALLBACK_FAILED = )102", r"\g<1>103"), True),
    ("a member's type", changed(r"int32_t callback_result;", "int64_t callback_result;"), True),
    ("a member more", changed(r"int32_t callback_result;", r"\g<0> int32_t more;"), True),
    ("another order of members", changed(r"(jostle_status status;.*\n)(.*int32_t callback_result;.*\n)", r"\2\1"), True),
    ("a type behind a name", changed(r"typedef int32_t jostle_space;", "typedef int64_t jostle_space;"), True),
]

failed = False
as_it_is = check(PROJECT / "include")
if as_it_is.returncode != 0:
    sys.exit(as_it_is.stderr)
for what, header, noticed in CHANGES:
    with tempfile.TemporaryDirectory() as folder:
        to = pathlib.Path(folder) / "jostle"
        to.mkdir()
        for file in (PROJECT / "include" / "jostle").glob("*.h*"):
            (to / file.name).write_text(file.read_text())
        (to / "jostle.h").write_text(header)
        said = check(folder)
    if (said.returncode == 1) != noticed or (noticed and "would misread" not in said.stderr):
        print(f"{what}: {'not noticed' if noticed else 'taken for a break'}\n{said.stderr}", file=sys.stderr)
        failed = True
print(f"{len(CHANGES)} headers compared")
sys.exit(failed)
