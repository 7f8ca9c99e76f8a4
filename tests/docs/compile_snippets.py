#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""compile_snippets.py SOURCE SCRATCH COMPILER...: every block marked cpp in README.md and docs/guide compiles.

A block with a main function stands alone. Any other is put into a function, after snippets_prelude.hpp, which
declares what a reader of the page would have at hand: boxes, shapes, an id.
"""
import pathlib
import subprocess
import sys

source, scratch, compilers = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]), sys.argv[3:]
prelude = source / "tests/docs/snippets_prelude.hpp"
scratch.mkdir(parents=True, exist_ok=True)

compiled = failed = 0
for page in [source / "README.md", *sorted((source / "docs/guide").glob("*.md"))]:
    block, first, inside = [], 0, False
    for number, line in enumerate(page.read_text().splitlines(), 1):
        if not inside:
            if line.strip() == "```cpp":
                block, first, inside = [], number + 1, True
            continue
        if line.strip() != "```":
            block.append(line)
            continue
        inside = False
        includes = [text for text in block if text.startswith("#include")]
        body = [text for text in block if not text.startswith("#include")]
        place = f'#line {first} "{page.relative_to(source)}"'
        if any("int main(" in text for text in block):
            text = [place, *block]
        else:
            text = [*includes, f'#include "{prelude}"', "void snippet()", "{", place, *body, "}"]
        file = scratch / f"{page.stem}_{first}.cpp"
        file.write_text("\n".join(text) + "\n")
        for compiler in compilers:
            result = subprocess.run([compiler, "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Werror",
                                     "-Wno-unused", f"-I{source / 'include'}", str(file)],
                                    capture_output=True, text=True, check=False)
            compiled += 1
            if result.returncode != 0:
                failed += 1
                print(f"{page.relative_to(source)}:{first}: doesn't compile with {compiler}:\n{result.stderr}")
    if inside:
        failed += 1
        print(f"{page.relative_to(source)}: a block of code has no end")

print(f"{compiled} compilations of snippets, {failed} failed")
sys.exit(failed != 0 or compiled == 0)
