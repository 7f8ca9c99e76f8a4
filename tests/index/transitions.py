#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Which kernels call code without AVX while the upper halves of AVX's registers hold something.

On Intel's processors every SSE instruction then waits for a register that it merges into, and a search takes
three times as long. Compilers put vzeroupper before such calls, but for g++ where it knows which registers the
callee uses (-fipa-ra).

    transitions.py OBJDUMP PROGRAM
"""

import re
import subprocess
import sys

kernel = re.compile(r"N_AVX\d")
wide = re.compile(r"%[yz]mm(?:\d|1[0-5])\b")
sse = re.compile(r"^(?:mov|com|ucom|add|sub|mul|div|min|max|cvt|p|xor|and|or|sqrt|unpck|shuf)\w*\s.*%xmm")
jump = re.compile(r"^(jmp|j\w+)\s+([0-9a-f]+) ")
called = re.compile(r"^(?:call|jmp)\s+[0-9a-f]+ <([^>+]*)>")


def functions(text: str) -> dict[str, list[tuple[int, str]]]:
    """By name, the instructions with their addresses."""
    found: dict[str, list[tuple[int, str]]] = {}
    body: list[tuple[int, str]] = []
    for line in text.splitlines():
        if line.endswith(">:"):
            body = found.setdefault(line[line.index("<") + 1 : -2], [])
        elif ":\t" in line:
            address, instruction = line.split(":\t", 1)
            body.append((int(address, 16), instruction.strip()))
    return found


def calls_while_dirty(body: list[tuple[int, str]]) -> set[str]:
    """Whom a function calls on some way to which there is a wide register and no vzeroupper behind it."""
    place = {address: k for k, (address, _) in enumerate(body)}
    seen: set[tuple[int, bool]] = set()
    ahead = [(0, False)]
    names: set[str] = set()
    while ahead:
        k, dirty = ahead.pop()
        if k >= len(body) or (k, dirty) in seen:
            continue
        seen.add((k, dirty))
        instruction = body[k][1]
        if instruction.startswith("vzero"):
            dirty = False
        elif wide.search(instruction):
            dirty = True
        if (name := called.match(instruction)) and dirty:
            names.add(name[1])
        if (to := jump.match(instruction)) and int(to[2], 16) in place:
            ahead.append((place[int(to[2], 16)], dirty))
        if not instruction.startswith(("jmp", "ret")):
            ahead.append((k + 1, dirty))
    return names


def main() -> int:
    text = subprocess.run(
        [sys.argv[1], "-d", "--no-show-raw-insn", sys.argv[2]], check=True, capture_output=True, text=True
    ).stdout
    all_of_them = functions(text)
    kernels = {name: body for name, body in all_of_them.items() if kernel.search(name)}
    slow = {name for name, body in all_of_them.items() if any(sse.match(each) for _, each in body)}
    faults = 0
    for name, body in kernels.items():
        for callee in sorted((calls_while_dirty(body) & slow) - kernels.keys()):
            print(f"{name} calls {callee} without vzeroupper")
            faults += 1
    print(f"{len(kernels)} kernels with AVX, {faults} such calls")
    return 1 if faults or not kernels else 0


if __name__ == "__main__":
    sys.exit(main())
