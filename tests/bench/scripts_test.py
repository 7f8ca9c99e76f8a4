# SPDX-License-Identifier: MIT
"""bench/compare and bench/check_targets on small results."""

import json
import os
import subprocess
import sys
import tempfile
import unittest

BENCH = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "bench")


def row(system, scene, n, threads, ms, checksum="a", **more):
    return {"system": system, "scene": scene, "n": n, "threads": threads, "median_ms": ms, "min_ms": ms * 0.98,
            "max_ms": ms * 1.5, "pairs": 2 * n, "checksum": checksum, "stages": {}, **more}


class Scripts(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def run_script(self, name, *contents, options=()):
        paths = []
        for number, content in enumerate(contents):
            paths.append(os.path.join(self.folder.name, f"{number}.json"))
            with open(paths[-1], "w", encoding="utf-8") as file:
                file.write(content if isinstance(content, str) else json.dumps(content))
        result = subprocess.run([sys.executable, "-B", os.path.join(BENCH, name), *options, *paths],
                                capture_output=True, text=True, check=False)
        return result.returncode, result.stdout, result.stderr

    # compare

    def test_equal_results_pass(self):
        rows = [row("jostle", "uniform", 1000, 1, 0.5)]
        code, out, _ = self.run_script("compare", rows, rows)
        self.assertEqual(code, 0)
        self.assertIn("1 rows compared, 0 worse", out)

    def test_slower_beyond_the_spread(self):
        old, new = [row("jostle", "uniform", 1000, 1, 1.0)], [row("jostle", "uniform", 1000, 1, 1.2)]
        code, out, _ = self.run_script("compare", old, new)
        self.assertEqual(code, 1)
        self.assertIn("SLOWER     jostle uniform n=1000 threads=1: 1 -> 1.2 ms, 1.20x", out)
        self.assertEqual(self.run_script("compare", new, old)[0], 0)  # faster is fine

    def test_slower_within_the_spread(self):
        old, new = [row("jostle", "uniform", 1000, 1, 1.0)], [row("jostle", "uniform", 1000, 1, 1.2)]
        new[0]["min_ms"] = 0.9
        self.assertEqual(self.run_script("compare", old, new)[0], 0)

    def test_other_pairs_and_missing_rows_are_worse(self):
        old = [row("jostle", "uniform", 1000, 1, 1.0), row("jostle", "flat", 1000, 1, 1.0)]
        code, out, _ = self.run_script("compare", old, [row("jostle", "uniform", 1000, 1, 1.0, checksum="b")])
        self.assertEqual(code, 1)
        self.assertIn("DIFFERENT  jostle uniform", out)
        self.assertIn("MISSING    jostle flat", out)

    def test_other_systems_only_when_asked(self):
        old = [row("jostle", "uniform", 1000, 1, 1.0), row("embree", "uniform", 1000, 1, 1.0)]
        new = [row("jostle", "uniform", 1000, 1, 1.0), row("embree", "uniform", 1000, 1, 9.0)]
        self.assertEqual(self.run_script("compare", old, new)[0], 0)
        self.assertEqual(self.run_script("compare", old, new, options=["--system", "all"])[0], 1)

    def test_rows_of_another_kind_are_other_rows(self):
        old = [row("jostle", "uniform", 1000, 1, 1.0), row("jostle", "uniform", 1000, 1, 5.0, type="double")]
        new = [row("jostle", "uniform", 1000, 1, 1.0), row("jostle", "uniform", 1000, 1, 5.0, type="double")]
        self.assertIn("2 rows compared, 0 worse", self.run_script("compare", old, new)[1])

    def test_bad_files(self):
        good = [row("jostle", "uniform", 1000, 1, 1.0)]
        broken = [dict(good[0])]
        del broken[0]["median_ms"]
        for content, part in (("{", "not JSON"), ("{}", "array"), (broken, 'row 1 has no number "median_ms"')):
            code, _, err = self.run_script("compare", good, content)
            self.assertEqual(code, 2)
            self.assertIn("1.json", err)
            self.assertIn(part, err)
            self.assertEqual(err.count("\n"), 1)

    # check_targets

    def test_embree_divided_by_the_lead_of_others(self):
        # Lead at 1k uniform, one thread: 4; target: 4.
        rows = [row("embree", "uniform", 1000, 1, 4), row("jostle", "uniform", 1000, 1, 0.26)]
        code, out, _ = self.run_script("check_targets", rows, options=["--threads", "1"])
        self.assertEqual(code, 1)
        self.assertRegex(out, r"1000 uniform +1 +0\.26 +1 +embree / 4 +3\.8 +4 MISS")
        rows[1]["median_ms"] = 0.24
        code, out, _ = self.run_script("check_targets", rows, options=["--threads", "1"])
        self.assertEqual(code, 3)  # the rest wasn't measured
        self.assertRegex(out, r"4\.2 +4 pass")

    def test_a_faster_exact_peer_of_the_run_counts_and_a_wrong_one_doesn_t(self):
        rows = [row("embree", "uniform", 1000000, 2, 200), row("jostle", "uniform", 1000000, 2, 8),
                row("fcl", "uniform", 1000000, 1, 100), row("ode", "uniform", 1000000, 1, 50, checksum="b")]
        out = self.run_script("check_targets", rows, options=["--threads", "2"])[1]
        self.assertRegex(out, r"1000000 uniform +2 +8 +100 +fcl +12\.5 +19 MISS")

    def test_a_busy_machine_proves_nothing(self):
        rows = [row("embree", "uniform", 1000, 1, 3.2, frames=20, preempted=11),
                row("jostle", "uniform", 1000, 1, 0.1)]
        self.assertRegex(self.run_script("check_targets", rows)[1], r"pass \(busy\)")
        rows[0] = row("embree", "uniform", 1000, 1, 3.2, frames=20, preempted=2, cpu_ms=2)
        self.assertRegex(self.run_script("check_targets", rows)[1], r"pass \(busy\)")
        rows[0] = row("embree", "uniform", 1000, 1, 3.2, frames=20, preempted=2, cpu_ms=3.1)
        self.assertNotIn("busy", self.run_script("check_targets", rows)[1])

    def test_own_targets(self):
        rows = [row("jostle", "uniform", 1000000, 1, 20), row("jostle", "uniform", 1000000, 2, 11),
                row("floor", "uniform", 1000000, 1, 11, checksum="0"), row("floor", "uniform", 1000000, 2, 5, checksum="0"),
                row("jostle", "uniform", 1000000, 1, 23, type="double"),
                row("jostle", "uniform", 1000000, 1, 20, isa="avx512"), row("jostle", "uniform", 1000000, 1, 42, isa="sse4")]
        code, out, _ = self.run_script("check_targets", rows)
        self.assertEqual(code, 1)
        self.assertRegex(out, r"uniform 1M / floor, 1 threads +1\.818 +<= +2 pass")
        self.assertRegex(out, r"uniform 1M / floor, 2 threads +2\.200 +<= +2 MISS")
        self.assertRegex(out, r"uniform 1000000: 1 thread / 2 threads +1\.818 +>= +1\.8 pass")
        self.assertRegex(out, r"uniform 1000000: sse4 / avx512, 1 threads +2\.100 +<= +2 MISS")
        self.assertRegex(out, r"uniform 1000000: double / float, 1 threads +1\.150 +<= +1\.1 MISS")


if __name__ == "__main__":
    unittest.main()
