#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""guide.py GUIDE INCLUDE SCRATCH CC LINKER ARGUMENT...: each block marked c of a page compiles as C99, is linked by
`LINKER ARGUMENT...`, runs, and prints what the page says of it: "It prints `...`."
"""
import pathlib
import re
import subprocess
import sys

guide, include, scratch, compiler, linker = pathlib.Path(sys.argv[1]), sys.argv[2], pathlib.Path(sys.argv[3]), *sys.argv[4:6]
scratch.mkdir(parents=True, exist_ok=True)
blocks = re.findall(r"^```c\n(.*?)^```\n+It prints `(.*?)`", guide.read_text(), re.MULTILINE | re.DOTALL)
if not blocks:
    sys.exit(f"{guide} has no program in C")
for number, (code, said) in enumerate(blocks):
    source = scratch / f"guide_{number}.c"
    source.write_text(code)
    program, object_file = source.with_suffix(""), source.with_suffix(".o")
    subprocess.run([compiler, "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-I", include, "-c", source, "-o",
                    object_file], check=True)
    subprocess.run([linker, object_file, "-o", program, *sys.argv[6:]], check=True)
    printed = subprocess.run([program], check=True, capture_output=True, text=True).stdout.strip()
    if printed != said:
        sys.exit(f"{guide} says that it prints {said!r}, and it prints {printed!r}")
print(f"{len(blocks)} programs")
