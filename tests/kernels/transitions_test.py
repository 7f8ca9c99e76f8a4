#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
import unittest

from transitions import kernels, transitions


def calls(*instructions):
    """The calls that are found in a kernel of these instructions, at addresses 10, 11, ..."""
    lines = ["0000000000000010 <void x::N_AVX2::kernel(int)>:"]
    lines += [f"  {0x10 + k:x}:\t{each}" for k, each in enumerate(instructions)]
    (_, body), = kernels(lines)
    return transitions(body)


USE, CLEAN, CALL = "vaddps %ymm1,%ymm2,%ymm3", "vzeroupper", "call   99 <helper>"


class Transitions(unittest.TestCase):
    def test_a_call_with_upper_halves_in_use(self):
        self.assertEqual(calls(USE, CALL, "ret"), ["helper"])
        self.assertEqual(calls("vpxor %zmm17,%zmm18,%zmm15", "jmp    99 <helper>"), ["helper"])

    def test_calls_without(self):
        self.assertEqual(calls(USE, CLEAN, CALL, "ret"), [])
        self.assertEqual(calls("vaddss %xmm1,%xmm2,%xmm3", CALL, "ret"), [])
        self.assertEqual(calls("vpxor %zmm16,%zmm20,%zmm31", CALL, "ret"), [])
        self.assertEqual(calls(USE, CLEAN, CALL, CALL, "ret"), [])
        self.assertEqual(calls(USE, "call   99 <y::N_AVX2::other>", "ret"), [])

    def test_what_lies_on_one_way_only(self):
        self.assertEqual(calls("je     13 <k>", USE, "nop", CALL, "ret"), ["helper"])
        self.assertEqual(calls(USE, "jmp    14 <k>", "nop", USE, CLEAN, CALL, "ret"), [])
        self.assertEqual(calls(USE, CLEAN, "jmp    14 <k>", USE, CALL, "ret"), [])

    def test_a_loop_that_comes_back_in_use(self):
        self.assertEqual(calls(CALL, USE, "jne    10 <k>", CLEAN, "ret"), ["helper"])

    def test_only_kernels_are_looked_at(self):
        self.assertEqual(list(kernels(["0000000000000010 <helper>:", f"  10:\t{USE}", f"  11:\t{CALL}"])), [])


unittest.main()
