#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""crate.py WHAT SOURCE SCRATCH CARGO COMPILER: the Rust crate as a stranger gets it.

package      packs the crate and unpacks it into a folder outside of the source, and builds it there
pairs_alone  without its features it builds and finds pairs
test         its tests, its documentation's, and those that must not compile
guide        the programs of docs/guide/rust.md and the examples print what they should
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile

what, source, scratch, cargo, compiler = sys.argv[1], *map(pathlib.Path, sys.argv[2:5]), sys.argv[5].strip()
crate = source / "extras" / "rust"
folder = scratch / "stranger"  # a workspace, so that the library is compiled once for the crate's tests and the programs
environment = {**os.environ, "CXX": compiler, "CARGO_HOME": str(scratch / "home"), "CARGO_TARGET_DIR": str(scratch / "target"),
               "CARGO_NET_OFFLINE": "true", "RUST_BACKTRACE": "0", "PATH": f"{cargo.parent}:{os.environ['PATH']}"}
version = re.search(r'^version = "(.*)"', (crate / "Cargo.toml").read_text(), re.MULTILINE)[1]


def run(*arguments, where=folder, **options):
    return subprocess.run([cargo, *arguments], cwd=where, env=environment, check=True, text=True, **options)


def package():
    header = (source / "include" / "jostle" / "version.hpp").read_text()
    numbers = [re.search(rf"define JOSTLE_VERSION_{part} (\d+)", header)[1] for part in ("MAJOR", "MINOR", "PATCH")]
    if version != ".".join(numbers):
        sys.exit(f"{crate}/Cargo.toml is of version {version}, the library of {'.'.join(numbers)}")
    run("package", "--no-verify", "--allow-dirty", where=crate)
    unpack(scratch / "target" / "package" / f"jostle-{version}.crate")
    for file in ("src/pairs/pair_finder.cpp", "include/jostle/jostle.h", "src/c_api/handles.hpp"):
        if (folder / "jostle" / "cpp" / file).read_text() != (source / file).read_text():
            sys.exit(f"the package has another {file}")
    (folder / "Cargo.toml").write_text('[workspace]\nmembers = ["jostle", "programs"]\n')
    programs = folder / "programs"
    (programs / "src" / "bin").mkdir(parents=True, exist_ok=True)
    (programs / "Cargo.toml").write_text('[package]\nname = "programs"\nversion = "0.1.0"\nedition = "2021"\n'
                                          '[dependencies]\njostle = { path = "../jostle" }\n')
    for number, text in enumerate(blocks()):
        (programs / "src" / "bin" / f"page_{number}.rs").write_text(text)
    run("build", "--package", "jostle")


def unpack(crate_file):
    """Unless it is there already, so that the library isn't compiled again."""
    before = folder / "unpacked.crate"
    if before.exists() and before.read_bytes() == crate_file.read_bytes():
        return
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    with tarfile.open(crate_file) as packed:
        links = [each.name for each in packed if not each.isfile()]
        if links:
            sys.exit(f"the package has links: {links[:3]}")
        packed.extractall(folder)
    (folder / f"jostle-{version}").rename(folder / "jostle")
    for path in (folder / "jostle").rglob("*"):
        path.touch()  # all files in a crate are of 2006, older than what cargo made of those before
    shutil.copy(crate_file, before)


def blocks():
    page = (source / "docs" / "guide" / "rust.md").read_text()
    return re.findall(r"^```rust\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)


def pairs_alone():
    run("test", "--package", "jostle", "--no-default-features", "--test", "pairs")


def test():
    said = run("test", "--package", "jostle", stderr=subprocess.PIPE).stderr
    environment["RUSTDOCFLAGS"] = "-D warnings"
    said += run("doc", "--package", "jostle", "--no-deps", stderr=subprocess.PIPE).stderr
    if re.search(r"^warning: (?!jostle is built without SIMD)", said, re.MULTILINE):
        sys.exit(f"there are warnings:\n{said}")


def guide():
    expected = {
        "page_0": "box 0 touches box 1\n",
        "page_1": "crate touches barrel\n",
        "page_2": "3: Id(0, generation 1) touches Id(1, generation 1)\nthe ray meets the door: true\n",
        "game_loop": "0: floor touches player\n4: floor touches crate\n5: player touches crate\n10: player leaves crate\n"
                     "the player sees the crate after 5.5\n",
        "vectors": 'frame 0: 0 pairs, the first None\nframe 1: 50000 pairs, the first Some(("body 0", "body 1"))\n'
                   'frame 2: 50000 pairs, the first Some(("body 0", "body 1"))\n',
    }
    if len(blocks()) != 3 or {file.stem for file in (crate / "examples").glob("*.rs")} != {"game_loop", "vectors"}:
        sys.exit("there are programs of which this test doesn't know what they print")
    for name, text in expected.items():
        kind = ["--package", "programs", "--bin"] if name.startswith("page") else ["--package", "jostle", "--example"]
        printed = run("run", "--quiet", *kind, name, capture_output=True).stdout
        if printed != text:
            sys.exit(f"{name} prints\n{printed}in place of\n{text}")


{"package": package, "pairs_alone": pairs_alone, "test": test, "guide": guide}[what]()
