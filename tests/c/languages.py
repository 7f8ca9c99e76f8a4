#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""languages.py LANGUAGE EXAMPLES INCLUDE LIBRARY SCRATCH: the example in another language runs and prints what it should."""
import os
import pathlib
import re
import subprocess
import sys

language, examples, include, library, scratch = sys.argv[1], *map(pathlib.Path, sys.argv[2:6])
scratch.mkdir(parents=True, exist_ok=True)
folder = library.parent
environment = {**os.environ, "LD_LIBRARY_PATH": str(folder)}
expected = {
    "luajit": "near: 10 at 2.000\nnear: 9 at 2.500\nnear: 11 at 2.500\nray: 0 at 3\nbox 7\n",
    "go": "999 pairs, 999 contacts\n0 and 1 overlap by 0.10\n",
}[language]
if language == "luajit":
    source = examples / "nearest.lua"
    command = ["luajit", source, library, include]
else:
    source, program = examples / "contacts.go", scratch / "contacts"
    environment |= {"CGO_CFLAGS": f"-I{include}", "CGO_LDFLAGS": f"-L{folder} -ljostle", "GOFLAGS": "-mod=mod",
                    "GO111MODULE": "off", "GOCACHE": str(scratch / "cache"), "HOME": str(scratch)}
    subprocess.run(["go", "build", "-o", program, source], check=True, env=environment)
    command = [program]
lines = len(source.read_text().splitlines())
if lines > 80:
    sys.exit(f"{source} has {lines} lines: an example is to be read at a glance")
printed = subprocess.run(command, check=True, capture_output=True, text=True, env=environment).stdout
if printed != expected:
    sys.exit(f"{source} prints\n{printed}in place of\n{expected}")
