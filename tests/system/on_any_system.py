#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs the command jostle as its users do, on whatever system it was built for, and sees that it does the same on all of them.

    on_any_system.py [--like NATIVE] COMMAND...

COMMAND is jostle, or `wine jostle.exe`. With --like, a jostle of this system does everything as well, and what the two
write, say and leave behind must be the same, byte for byte, but for times. Exit 1 if something isn't as it should be.
"""

import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import signal
import struct
import subprocess
import sys
import tempfile
import time

GOLDEN = pathlib.Path(__file__).resolve().parent.parent / "platforms" / "golden"
DATA = pathlib.Path(__file__).resolve().parent.parent.parent / "tool" / "data"
WITHOUT_TIMES = ("isa", "bytes", "preempted")  # of a row: what another system may have in another way, as times


def boxes(count, dim, seed=1):
    """Boxes on a lattice, so that many touch exactly."""
    state = seed
    result = []
    for _ in range(count):
        lo, hi = [], []
        for _ in range(dim):
            state = (state * 6364136223846793005 + 1442695040888963407) % 2**64
            lo.append((state >> 33) % 160 / 8 - 10)
            hi.append(lo[-1] + (state >> 50) % 24 / 8)
        result.append((lo, hi))
    return result


def brute_force(all_boxes):
    """The definition."""
    touch = lambda a, b: all(a[0][d] <= b[1][d] and b[0][d] <= a[1][d] for d in range(len(a[0])))
    return [(a, b) for a in range(len(all_boxes)) for b in range(a + 1, len(all_boxes)) if touch(all_boxes[a], all_boxes[b])]


def csv(all_boxes, end="\n", names=None):
    dim = len(all_boxes[0][0])
    head = [side + "_" + "xyz"[d] for side in ("lo", "hi") for d in range(dim)]
    rows = [(["id"] if names else []) + head]
    rows += [([names(i)] if names else []) + [repr(x) for x in lo + hi] for i, (lo, hi) in enumerate(all_boxes)]
    return "".join(",".join(row) + end for row in rows).encode()


def npy(all_boxes, kind):
    dim = len(all_boxes[0][0])
    header = f"{{'descr': '<{kind}', 'fortran_order': False, 'shape': ({len(all_boxes)}, 2, {dim}), }}"
    header += " " * ((64 - (11 + len(header)) % 64) % 64) + "\n"
    numbers = [x for lo, hi in all_boxes for x in lo + hi]
    return (b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode()
            + struct.pack(f"<{len(numbers)}{'f' if kind == 'f4' else 'd'}", *numbers))


THREE, TWO = boxes(400, 3), boxes(400, 2)
PAIRS_OF_THREE, PAIRS_OF_TWO = brute_force(THREE), brute_force(TWO)
AS_CSV = b"a,b\n" + b"".join(b"%d,%d\n" % pair for pair in PAIRS_OF_THREE)
FILES = {  # 26 ends a text on Windows, and 10 begins a line: both must come through where bytes are meant
    "boxes.csv": csv(THREE), "crlf.csv": csv(THREE, "\r\n"), "mark.csv": b"\xef\xbb\xbf" + csv(THREE),
    "named.csv": csv(TWO, names=lambda i: f'"Stück\x1a {i}"'), "kästen und mehr.csv": csv(THREE),
    "numbers.csv": csv(THREE, names=lambda i: str(10 * i + 26)),
    "three.npy": npy(THREE, "f4"), "two.npy": npy(TWO, "f8"), "cut.npy": npy(THREE, "f4")[:-1],
    "bad.csv": b"lo_x,lo_y,hi_x,hi_y\r\n0,0,1,1\r\n0,abc,1,1\r\n", "inverted.csv": b"lo_x,lo_y,hi_x,hi_y\n0,2,1,1\n",
    "empty.csv": b"", "old.csv": b"what was here before\n", "text.jrec": b"x" * 100, "cube.obj": b"v 0 0 0\n",
    "moving.jrec": (GOLDEN / "recorder.jrec").read_bytes(), "packed.jrec": (DATA / "tumble.jrec").read_bytes(),
}
SMALL = "-n 300 --frames 2 --threads 1,2 --json -"


def cases():
    """(arguments, exit status, more): more has stdin; out, which stdout is; file and bytes, what is written there; says, part of
    stderr."""
    yield "--version", 0, {}
    for command in ("", "pairs", "bench", "bench world", "bench programs", "chapter", "compare", "demo", "simulate", "replay", "distribute"):
        yield f"{command} --help", 0, {}
    for wrong in ("", "pear", "--speed 3", "pairs", "pairs boxes.csv --threads 0", "pairs boxes.csv --engine slow",
                  "pairs boxes.csv -o pairs.txt", "bench unifrom", "bench -n many", "bench --isa mmx", "simulate --record a.txt"):
        yield wrong, 2, {"says": "jostle: "}
    yield ["pairs", ""], 2, {"says": "is empty"}

    for name in ("boxes.csv", "crlf.csv", "mark.csv", "kästen und mehr.csv", "three.npy"):
        yield ["pairs", name], 0, {"out": AS_CSV}
    for more in ("--engine brute", "--engine chapter", "--threads 1", "--threads 7"):
        yield f"pairs crlf.csv {more}", 0, {"out": AS_CSV}
    yield "pairs -", 0, {"stdin": FILES["crlf.csv"], "out": AS_CSV}
    yield "pairs - -o -", 0, {"stdin": FILES["boxes.csv"], "out": AS_CSV}
    yield "pairs two.npy", 0, {"out": b"a,b\n" + b"".join(b"%d,%d\n" % pair for pair in PAIRS_OF_TWO)}
    yield "pairs named.csv", 0, {"out": "a,b\n".encode() + b"".join(
        "Stück\x1a {},Stück\x1a {}\n".format(*pair).encode() for pair in PAIRS_OF_TWO)}
    yield "pairs boxes.csv -o pairs.csv", 0, {"file": "pairs.csv", "bytes": AS_CSV}
    yield ["pairs", "boxes.csv", "-o", "Paare – alle.csv"], 0, {"file": "Paare – alle.csv", "bytes": AS_CSV}
    yield "pairs boxes.csv -o old.csv", 0, {"file": "old.csv", "bytes": AS_CSV}
    yield "pairs numbers.csv -o pairs.npy", 0, {"file": "pairs.npy"}
    yield "pairs numbers.csv -o pairs.jsonl", 0, {"file": "pairs.jsonl", "bytes": b"".join(
        b'{"a":%d,"b":%d}\n' % (10 * a + 26, 10 * b + 26) for a, b in PAIRS_OF_THREE)}
    yield "pairs named.csv -o pairs.jsonl", 0, {"file": "pairs.jsonl"}
    for name in ("boxes.csv", "three.npy", "two.npy"):
        yield f"pairs {name} --stats --threads 2", 0, {}
    yield "pairs moving.jrec --frame 2", 0, {}

    for wrong, says in (("bad.csv", 'bad.csv:3:2: lo_y is "abc"'), ("inverted.csv", "inverted.csv:2:2: lo_y = 2"),
                        ("empty.csv", "empty.csv:1:1: the file is empty"), ("none.csv", "none.csv: "), (".", "is a directory"),
                        ("cut.npy", "cut.npy: "), ("text.jrec", "text.jrec: is no recording"), ("boxes", "boxes: "),
                        ("moving.jrec --frame 3", "frames 0 to 2"), ("boxes.csv -o none/pairs.csv", "none/pairs.csv: "),
                        ("boxes.csv -o boxes.csv", "is the input itself"), ("named.csv -o old.npy", "old.npy: ")):
        yield f"pairs {wrong}", 2, {"says": says}
    yield "pairs bad.csv -o old.csv", 2, {"file": "old.csv", "bytes": FILES["old.csv"]}

    yield f"bench uniform resting {SMALL}", 0, {}
    yield f"bench uniform lattice {SMALL} --dim 2 --double --engine chapter", 0, {}
    yield "bench uniform -n 300 --frames 2 --threads 2 --json rows.json", 0, {"file": "rows.json"}
    yield f"bench world moving {SMALL}", 0, {}
    yield "bench queries -n 300 --repetitions 1 --threads 2 --json -", 0, {}
    yield f"bench contacts {SMALL}", 0, {}
    yield "bench responses -n 300 --frames 2 --threads 2 --json -", 0, {}
    yield "bench scenes -n 8 --boxes 16 --frames 2 --threads 2 --json -", 0, {}
    yield "compare moving.jrec --threads 2 --json rows.json", 0, {"file": "rows.json"}
    yield "simulate -n 200 --frames 30 --threads 2 --json -", 0, {}
    yield "simulate --scene boxes -n 100 --frames 10 --threads 2 --json rows.json --record fall.jrec", 0, {"file": "rows.json"}
    yield "demo --recording moving.jrec -n 1000 --frames 1 --threads 2", 0, {}
    yield "chapter -n 200 --json -", 0, {}


def words(arguments):
    return arguments.split() if isinstance(arguments, str) else arguments


def plain(value):
    """What JSON says, without times."""
    if isinstance(value, dict):
        return {key: plain(each) for key, each in value.items() if key not in WITHOUT_TIMES and not isinstance(each, float)}
    return [plain(each) for each in value] if isinstance(value, list) else value


def without_times(text):
    try:
        return json.dumps(plain(json.loads(text)))
    except ValueError:
        pass
    text = re.sub(rb"\d[\d,]*\.\d+", b"#", text)
    text = re.sub(rb"\d+(?= million boxes a second| times as long)", b"#", text)
    return re.sub(rb"(AVX-?512|AVX2|SSE4|avx3\w*|avx512|avx2|sse4|scalar)", b"#", re.sub(rb" +", b" ", text))


class Jostle:
    def __init__(self, command):
        self.command = [str(pathlib.Path(word).resolve()) if os.path.exists(word) else word for word in command]
        # Where names are no UTF-8 wine drops what isn't ASCII.
        self.environment = {**os.environ, "LC_ALL": "C.UTF-8", "WINEDEBUG": "-all"}

    def start(self, folder, arguments, **streams):
        return subprocess.Popen([*self.command, *arguments], cwd=folder, env=self.environment, **streams)

    def run(self, arguments, stdin=b""):
        """Exit status, stdout, stderr, and what is new in the folder or changed."""
        with tempfile.TemporaryDirectory(prefix="jostle-any-") as name:
            folder = pathlib.Path(name)
            for file, content in FILES.items():
                (folder / file).write_bytes(content)
            done = self.start(folder, arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            out, err = done.communicate(stdin, timeout=120)
            left = {file.name: file.read_bytes() for file in sorted(folder.iterdir())}
            return done.returncode, out, err, {file: content for file, content in left.items() if FILES.get(file) != content}

    def interrupted(self, how):
        """What is there while a long command writes, and after it was ended."""
        with tempfile.TemporaryDirectory(prefix="jostle-any-") as name:
            folder = pathlib.Path(name)
            (folder / "fall.jrec").write_bytes(b"before")
            long = self.start(folder, "simulate -n 50 --frames 1000000 --record fall.jrec".split(),
                              stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            until = time.monotonic() + 60
            while not (parts := list(folder.glob("fall.jrec.*.part"))) and time.monotonic() < until and long.poll() is None:
                time.sleep(0.05)
            os.kill(long.pid, how)
            long.wait(timeout=60)
            while list(folder.glob("*.part")) and time.monotonic() < until:
                time.sleep(0.05)  # wine's server removes it when it has seen the end
            return len(parts), {file.name: file.read_bytes() for file in folder.iterdir()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--like", metavar="NATIVE")
    parser.add_argument("command", nargs="+")
    given = parser.parse_args()
    under_test = Jostle(given.command)
    on_windows = given.command[-1].endswith(".exe")
    native = Jostle([given.like]) if given.like else None
    failed = []

    def expect(arguments, what, got, wanted):
        if got != wanted:
            failed.append(f"{arguments}: {what} is\n    {got!r:.2000}\nand should be\n    {wanted!r:.2000}")

    def try_case(case):
        arguments, status, more = case
        result = under_test.run(words(arguments), more.get("stdin", b""))
        expect(arguments, "the exit status", result[0], status)
        if status != 0:
            expect(arguments, "stdout", result[1], b"")
            expect(arguments, "how many lines stderr has", result[2].count(b"\n"), 1)
            if more.get("says", "").encode() not in result[2]:
                expect(arguments, "stderr", result[2].decode(), more["says"])
        else:
            expect(arguments, "stderr", result[2], b"")
        if "out" in more:
            expect(arguments, "stdout", result[1], more["out"])
        if "file" in more and status == 0:
            expect(arguments, "what is written", more["file"] in result[3], True)
            if "bytes" in more:
                expect(arguments, more["file"], result[3].get(more["file"]), more["bytes"])
        elif "--record" not in arguments:
            expect(arguments, "what is left behind", result[3], {})
        if native:
            same = native.run(words(arguments), more.get("stdin", b""))
            for what, got, wanted in zip(("stdout", "stderr"), result[1:3], same[1:3]):
                expect(arguments, what, without_times(got), without_times(wanted))
            expect(arguments, "what is written", sorted(result[3]), sorted(same[3]))
            for file in result[3]:
                if not file.endswith(".jrec"):  # which is compressed where there is zstd
                    expect(arguments, file, without_times(result[3][file]), without_times(same[3].get(file, b"")))

    def try_recording():
        """What one jostle records another reads."""
        with tempfile.TemporaryDirectory(prefix="jostle-any-") as name:
            answers = []
            for k, jostle in enumerate(filter(None, (under_test, native))):
                arguments = f"simulate --scene closed -n 100 --frames 60 --threads 2 --record {k}.jrec".split()
                expect(arguments, "the exit status",
                       jostle.start(name, arguments, stdout=subprocess.DEVNULL).wait(timeout=120), 0)
                reader = native or jostle
                answers.append(reader.start(name, ["pairs", f"{k}.jrec", "--frame", "59"], stdout=subprocess.PIPE)
                               .communicate(timeout=120)[0])
                expect("pairs of a recording", "how many lines", answers[k].count(b"\n") > 10, True)
            expect("pairs of a recording", "the answer", answers[0], answers[-1])

    def try_interruption(how):
        parts, left = under_test.interrupted(how)
        expect(f"simulate, ended by {how!r}", "the number of unfinished files meanwhile", parts, 1)
        expect(f"simulate, ended by {how!r}", "what is left", left, {"fall.jrec": b"before"})

    def try_missing_libraries():
        """What a build for Windows can't do it says."""
        for arguments, says in (("pairs cube.obj", b"cube.obj: is a mesh, and this build of jostle reads none"),
                                ("pairs cube.obj --parts -o p.csv", b"cube.obj: is a mesh, and this build of jostle reads none"),
                                ("pairs packed.jrec", b"packed.jrec: is compressed, which this program was built without"),
                                ("demo --recording packed.jrec", b"packed.jrec: is compressed"),
                                ("replay moving.jrec", b"built without cpp-httplib"), ("distribute", b"distribute: this build has no MPI"),
                                ("bench uniform -n 300 --report r.html", b"gnuplot, which isn't here")):
            status, _, err, left = under_test.run(arguments.split())
            expect(arguments, "the exit status", status, 2)
            expect(arguments, "what is left behind", left, {})
            if says not in err:
                expect(arguments, "stderr", err, says)

    work = [lambda case=case: try_case(case) for case in cases()] + [try_recording]
    if on_windows:
        work += [try_missing_libraries, lambda: try_interruption(signal.SIGKILL), lambda: try_interruption(signal.SIGINT)]
    else:
        work += [lambda how=how: try_interruption(how) for how in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for done in [pool.submit(each) for each in work]:
            done.result()
    print("\n".join(failed) if failed else f"{len(work)} runs: all as they should be")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
