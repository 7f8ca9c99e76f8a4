#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Finds calls from code with AVX to code with SSE while the upper halves of registers are in use.

Processors of Intel stall there and on the way back, unless vzeroupper comes before the call: see decision 5, and Intel
64 and IA-32 Architectures Optimization Reference Manual, "Mixing AVX code with SSE code". The functions of Highway's
namespaces N_AVX* are kernels, which use AVX; all others are taken to use SSE. Each kernel's flow of control is followed
in the disassembly, but for jumps through tables.

    transitions.py PROGRAM    prints the calls; exit status 1 if there are any, or no kernels
"""
import re
import subprocess
import sys

FUNCTION = re.compile(r"^[0-9a-f]+ <(.*)>:$")
INSTRUCTION = re.compile(r"^\s*([0-9a-f]+):\t(\S+)\s*(.*)$")
TARGET = re.compile(r"^([0-9a-f]+) <(.*)>")
WIDE = re.compile(r"%[yz]mm(\d|1[0-5])\b")  # the others have no halves that SSE knows of


def kernels(listing):
    """Yields the name of each kernel in lines of a disassembly, and its instructions: (address, mnemonic, operands)."""
    name, body = None, []
    for line in listing:
        if match := FUNCTION.match(line):
            if body:
                yield name, body
            name, body = match[1], []
        elif name and "N_AVX" in name and (match := INSTRUCTION.match(line)):
            body.append((int(match[1], 16), match[2], match[3]))
    if body:
        yield name, body


def transitions(body):
    """Returns the functions that a kernel calls, or ends with, while upper halves may be in use."""
    place = {address: k for k, (address, _, _) in enumerate(body)}
    seen = [set() for _ in body]  # whether they are in use before the instruction, on some way to it
    waiting = [(0, False)]
    found = {}
    while waiting:
        k, in_use = waiting.pop()
        while k < len(body) and in_use not in seen[k]:
            seen[k].add(in_use)
            _, mnemonic, operands = body[k]
            target = TARGET.match(operands)
            inside = place.get(int(target[1], 16)) if target else None
            if mnemonic.startswith(("call", "j")) and target and inside is None and in_use and "N_AVX" not in target[2]:
                found[k] = target[2]
            if mnemonic.startswith("j") and inside is not None:
                waiting.append((inside, in_use))
            if mnemonic.startswith(("jmp", "ret", "ud2")):
                break
            if mnemonic.startswith(("call", "vzero")):
                in_use = False
            elif WIDE.search(operands):
                in_use = True
            k += 1
    return [found[k] for k in sorted(found)]


def main():
    with subprocess.Popen(["objdump", "-d", "-C", "--no-show-raw-insn", sys.argv[1]], stdout=subprocess.PIPE,
                          text=True) as objdump:
        each = [(name, transitions(body)) for name, body in kernels(objdump.stdout)]
    for name, callees in each:
        for callee in callees:
            print(f"{name}\n    calls {callee}")
    calls = sum(len(callees) for _, callees in each)
    print(f"{len(each)} kernels, {calls} calls with upper halves in use")
    return 1 if calls or not each or objdump.returncode else 0


if __name__ == "__main__":
    sys.exit(main())
