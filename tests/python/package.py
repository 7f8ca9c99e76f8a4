#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""package.py build SOURCE BUILT SCRATCH   the source distribution, the wheel out of that, and a fresh venv that has it
package.py test SOURCE SCRATCH             the package's tests there
package.py memory SOURCE SCRATCH           those with bad input, callbacks and handles again, under valgrind
package.py faults SOURCE SCRATCH STARVE    all its calls, with each allocation of theirs failing in turn
package.py types SOURCE SCRATCH            mypy of the package, and of a program that uses it
package.py examples SOURCE SCRATCH         the examples in Python run, and so do the pages about Python

BUILT is a build folder of Jostle's, whose library goes into the wheel. STARVE is starve.cpp as a shared library.
"""
import doctest
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import xml.etree.ElementTree


def run(*command, **more):
    subprocess.run([str(part) for part in command], check=True, **more)


def venv_python(scratch):
    return scratch / "venv" / "bin" / "python"


def build(source, built, scratch):
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    run(sys.executable, "-m", "build", "--sdist", "--no-isolation", "--outdir", scratch, source)
    [sdist] = scratch.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        archive.extractall(scratch)
    unpacked = sdist.with_name(sdist.name.removesuffix(".tar.gz"))
    # All that a build of the library needs is in it; the build itself would take minutes.
    run("cmake", "-S", unpacked / "extras/python", "-B", scratch / "whole", "-G", "Ninja",
        f"-DPython3_EXECUTABLE={sys.executable}", stdout=subprocess.DEVNULL)
    asked = subprocess.run(["ninja", "-C", scratch / "whole", "-t", "inputs", "_core"], check=True, capture_output=True,
                           text=True).stdout
    # The chapter's algorithms, a library of their own, aren't for Python.
    wanted = sum(1 for file in (source / "src").rglob("*.cpp") if file.parent.name != "chapter")
    compiled = len(set(re.findall(r"/src/\S+\.cpp$", asked, re.MULTILINE)))
    if compiled != wanted:
        sys.exit(f"of {wanted} source files of the library the source distribution compiles {compiled}")
    run(sys.executable, "-m", "build", "--wheel", "--no-isolation", f"-Cbuilt={built}", "-Cquiet=1", "--outdir", scratch, unpacked)
    [wheel] = scratch.glob("*.whl")
    run(sys.executable, "-m", "venv", "--system-site-packages", scratch / "venv")
    run(venv_python(scratch), "-m", "pip", "install", "--quiet", "--no-index", "--no-deps", wheel)
    package = scratch / "venv" / "lib" / f"python{sys.version_info[0]}.{sys.version_info[1]}" / "site-packages" / "jostle"
    for library in package.glob("*.so*"):
        told = subprocess.run(["ldd", library], check=True, capture_output=True, text=True).stdout
        for name, path in re.findall(r"^\s*(\S+) => (\S+)", told, re.MULTILINE):
            if not (re.match(r"lib(c|m|stdc\+\+|gcc_s|pthread|dl|rt)\.so", name) or pathlib.Path(path).parent == package):
                sys.exit(f"{library.name} needs {name} of this system")
    # The unpacked source is no longer needed, nor is that which it was built from.
    run(venv_python(scratch), "-c", "import jostle; assert len(jostle.find_pairs([[0, 0, 1, 1], [1, 1, 2, 2]])) == 1",
        cwd=scratch)


# What goes through all functions, errors and callbacks, and doesn't take long: valgrind takes thirty times as long.
MEMORY_TESTS = "mistakes or wrong_offsets or raises or filters or asks or all_kinds or keeps_what or slots_of or pickled or lists_of or collected"


def is_ours(error):
    """Whether the compiled part of the package, or the library in it, is to blame for what valgrind found: whether it is among the
    callers. Python's own memory is left out so, and NumPy's. oneTBB's is as well: it allocates a mask of processors once, and in some
    runs it is unloaded before valgrind looks whether anything still points there; its frames then have no name."""
    frames = [frame.findtext("obj", "") for frame in error.find("stack")]
    allocated_by = next((frame for frame in frames if "vgpreload" not in frame), "")
    if error.findtext("kind").startswith("Leak_") and (not allocated_by or "libtbb" in allocated_by):
        return False
    return any("/jostle/" in frame for frame in frames)


def memory(source, scratch, environment):
    """Fails for memory that the package reads where it may not, or before it is written, or loses."""
    told = scratch / "valgrind.xml"
    run("valgrind", "--xml=yes", f"--xml-file={told}", "--leak-check=full", "--show-leak-kinds=definite,indirect",
        "--num-callers=40", venv_python(scratch), "-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", MEMORY_TESTS,
        source / "extras/python/tests", cwd=scratch, env={**environment, "PYTHONMALLOC": "malloc"})
    ours = 0
    for error in xml.etree.ElementTree.parse(told).iter("error"):
        if is_ours(error):
            ours += 1
            print(error.findtext("kind"), error.findtext("what") or error.findtext("xwhat/text"))
            for frame in error.find("stack"):
                print("   ", frame.findtext("fn") or frame.findtext("ip"), frame.findtext("obj", "").rpartition("/")[2])
    if ours:
        sys.exit(f"valgrind found {ours} mistakes")


def main():
    what, source = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    scratch = pathlib.Path(sys.argv[4 if what == "build" else 3]).resolve()
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1", "MPLBACKEND": "Agg"}
    if what == "build":
        build(source, pathlib.Path(sys.argv[3]).resolve(), scratch)
    elif what == "test":
        run(venv_python(scratch), "-m", "pytest", "-q", "-p", "no:cacheprovider", source / "extras/python/tests", cwd=scratch,
            env=environment)
    elif what == "memory":
        memory(source, scratch, environment)
    elif what == "faults":
        run(venv_python(scratch), "-X", "faulthandler", "-m", "pytest", "-q", "-p", "no:cacheprovider",
            source / "tests/python/test_faults.py", cwd=scratch,
            env={**environment, "LD_PRELOAD": str(pathlib.Path(sys.argv[4]).resolve())})
    elif what == "types":
        config = source / "pyproject.toml"
        run(sys.executable, "-m", "mypy", "--config-file", config, "--cache-dir", scratch / "mypy", source / "extras/python/jostle",
            cwd=scratch)
        run(sys.executable, "-m", "mypy", "--config-file", config, "--cache-dir", scratch / "mypy", "--python-executable",
            venv_python(scratch), source / "tests/python/typed_program.py", cwd=scratch)
    elif what == "examples":
        for example in sorted((source / "examples/python").glob("*.py")):
            run(venv_python(scratch), example, cwd=scratch, env=environment)
            print(example.name, "ran")
        for page in ("docs/guide/python.md", "docs/guide/surfaces.md", "docs/start/python.md", "docs/start/rectangles.md", "docs/start/detections.md"):
            text = (source / page).read_text()
            lines = "\n".join(line for block in re.findall(r"^```console\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
                              for line in block.splitlines() if not line.startswith("$"))
            told = doctest.DocTestParser().get_examples(lines + "\n")
            (scratch / "page.txt").write_text(lines + "\n")
            run(venv_python(scratch), "-m", "doctest", scratch / "page.txt", cwd=scratch, env=environment)
            print(len(told), "lines of", page, "ran")


main()
