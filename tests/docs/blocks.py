#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""blocks.py SOURCE SCRATCH TOOL COMPILER ARGUMENT...: every block of code in README.md, docs/start, docs/guide and docs/migrate is true.

cpp      with a main function: a program, compiled, linked with the ARGUMENTs and run; if a block of text is next,
         it prints that. Any other is put into a function, after snippets_prelude.hpp, which declares what a reader of
         the page would have at hand: boxes, shapes, an id.
console  what follows `$ jostle ...` and `$ cat ...` is what these print. Files that are shown by cat are there. Lines
         that begin with >>> are run by tests/python.
python   runs, by Debian's Python, as one program with those before it on the page.
bash     is well formed, and the command `jostle` has every subcommand and option that is named.
c        is run by tests/c.
js       is run by tests/js.
rust     is run by tests/rust.
cmake, text, json: shown as they are.

There are no others, and no blocks without a fence, which nothing would check.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys

source, scratch, tool, compiler = (pathlib.Path(argument).resolve() for argument in sys.argv[1:5])
arguments = sys.argv[5:]
prelude = source / "tests/docs/snippets_prelude.hpp"
flags = ["-std=c++20", "-Wall", "-Wextra", "-Werror", "-Wno-unused", f"-I{source / 'include'}"]
# Blocks that need another library's headers: where these are, what the compiler is told, what is at hand in addition.
# ./test docs installs them; elsewhere they may be missing.
others = {"bullet": (pathlib.Path("/usr/include/bullet"), ["-isystem", "/usr/include/bullet"], """\
    jostle::Executor& mine, btCollisionDispatcher& dispatcher, btSequentialImpulseConstraintSolver& solver,
    btDefaultCollisionConfiguration& configuration, btDiscreteDynamicsWorld& world,
    jostle::Recorder<3, btScalar>& recorder, std::vector<jostle::Aabb<3, btScalar>>& boxes"""),
          "fcl": (pathlib.Path("/usr/include/fcl"), ["-isystem", "/usr/include/eigen3"], ""),
          "mpi": (pathlib.Path("/usr/include/x86_64-linux-gnu/mpi/mpi.h"),
                  [f"-I{source / 'extras' / 'mpi' / 'include'}", "-isystem", "/usr/include/x86_64-linux-gnu/mpi"],
                  "int count, char** arguments, int provided, std::uint64_t id")}
known = {"cpp", "console", "python", "bash", "js", "c", "cmake", "text", "json", "csharp", "rust"}
run_elsewhere = {"c": {"docs/guide/c.md"}, ">>>": {"docs/guide/python.md", "docs/start/python.md", "docs/start/rectangles.md",
                                                           "docs/start/detections.md", "docs/guide/surfaces.md"},
                 "js": {"docs/guide/javascript.md", "docs/start/browser.md"}, "csharp": {"docs/guide/csharp.md"},
                 "rust": {"docs/guide/rust.md"}}
python = "/usr/bin/python3"
has_numpy = subprocess.run([python, "-c", "import numpy"], stderr=subprocess.DEVNULL, check=False).returncode == 0
problems, counts = [], {}


class Block:
    def __init__(self, page, language, line):
        self.page, self.language, self.line, self.lines, self.next_text = page, language, line, [], None

    def place(self):
        return f"{self.page}:{self.line}"


def count(what):
    counts[what] = counts.get(what, 0) + 1


def blocks_of(page):
    found, block, text_before = [], None, ""
    for number, line in enumerate((source / page).read_text().splitlines(), 1):
        fence = re.match(r" *```(\w*)$", line)
        if block is None and fence:
            block = Block(page, fence[1], number + 1)
            if fence[1] == "text" and found and found[-1].language == "cpp" and "prints" in text_before:
                found[-1].next_text = block
        elif block is not None and line.strip() == "```":
            found.append(block)
            block = None
            text_before = ""
        elif block is not None:
            block.lines.append(line)
        else:
            above = text_before.rstrip("\n").split("\n")[-1]
            if line.startswith("    ") and text_before.endswith("\n\n") and not re.match(r"-|\d+\.|\s", above):
                problems.append(f"{page}:{number}: a block of code without a fence")
            text_before += line + "\n"
    if block is not None:
        problems.append(f"{block.place()}: a block of code has no end")
    return found


def compile_snippets(name, snippets, more, at_hand=""):
    """All of a kind in one file, each in a function of its own; what they include stands first."""
    includes, functions = ({"#include <btBulletDynamicsCommon.h>": None} if name == "bullet" else {}), []
    for number, block in enumerate(snippets):
        includes |= {text: None for text in block.lines if text.startswith("#include")}
        body = ["" if text.startswith("#include") else text for text in block.lines]
        functions += [f"void snippet_{number}({at_hand})", "{{", f'#line {block.line} "{block.page}"', *body, "}}"]
    file = scratch / f"{name}.cpp"
    file.write_text("\n".join([*includes, f'#include "{prelude}"', *functions]) + "\n")
    result = subprocess.run([compiler, *flags, *more, "-fsyntax-only", file], capture_output=True, text=True, check=False)
    if result.returncode:
        problems.append(f"snippets don't compile:\n{result.stderr}")


def run_program(block):
    name = re.sub(r"\W", "_", block.place())
    file, program = scratch / f"{name}.cpp", scratch / name
    file.write_text("\n".join([f'#line {block.line} "{block.page}"', *block.lines]) + "\n")
    result = subprocess.run([compiler, *flags, file, *arguments, "-o", program], capture_output=True, text=True, check=False)
    if result.returncode:
        problems.append(f"{block.place()}: doesn't compile:\n{result.stderr}")
        return
    result = subprocess.run([program], cwd=scratch, capture_output=True, text=True, timeout=60, check=False)
    said = "\n".join(block.next_text.lines) if block.next_text else result.stdout.rstrip("\n")
    if result.returncode or result.stdout.rstrip("\n") != said:
        problems.append(f"{block.place()}: ends with {result.returncode} and prints\n{result.stdout}{result.stderr}")


def without_times(text):
    """Times, and how many threads there are, differ from run to run."""
    return re.sub(r'"ms":\{[^}]*\}|"threads":\d+', "", text)


def run_session(block, folder):
    commands = re.split(r"^\$ ", "\n".join(block.lines), flags=re.MULTILINE)[1:]
    for command in commands:
        line, _, said = command.partition("\n")
        said = said.strip("\n")
        shown = re.fullmatch(r"cat (\S+)", line)
        if shown:
            (folder / shown[1]).write_text(said + "\n")
        elif ".npy" in line and not has_numpy:
            print(f"NumPy is missing, so `{line}` isn't run; ./test docs installs it")
        elif line.startswith("jostle "):
            for model in re.findall(r"(\S+)\.obj", line):
                for file in pathlib.Path("/usr/share/assimp/models/OBJ").glob(f"{model}.*"):
                    shutil.copy(file, folder)
            environment = {**os.environ, "PATH": f"{tool.parent}:{os.environ['PATH']}"}
            result = subprocess.run(["bash", "-c", line], cwd=folder, env=environment, capture_output=True, text=True,
                                    timeout=60, check=False)
            told = (result.stdout + result.stderr).strip("\n")
            if without_times(told) != without_times(said):
                problems.append(f"{block.place()}: `{line}` prints\n{told}\nand not\n{said}")
            count("commands run")
        elif ">>>" not in command:
            problems.append(f"{block.place()}: nobody runs `{line}`")


def run_python(block, folder, before):
    """What earlier blocks did is done again: it has to be cheap."""
    program = "\n".join([*before, *block.lines])
    result = subprocess.run([python, "-c", program], cwd=folder, capture_output=True, text=True, timeout=60, check=False)
    if result.returncode:
        problems.append(f"{block.place()}: {result.stderr}")


def check_shell(block):
    text = "\n".join(block.lines)
    result = subprocess.run(["bash", "-n"], input=text, capture_output=True, text=True, check=False)
    if result.returncode:
        problems.append(f"{block.place()}: {result.stderr}")
    for line in block.lines:
        words = re.sub(r"#.*", "", line).split()
        if len(words) < 2 or words[0] not in ("./run", "jostle") or words[1] in ("docs", "web"):
            continue
        subcommand = [] if words[1].startswith("-") else [words[1]]
        if subcommand == ["bench"] and len(words) > 2 and words[2] in ("world", "questions", "contacts", "distances",
                                                                       "plane", "neighbors", "surfaces", "responses", "scenes", "programs"):
            subcommand.append(words[2])
        told = subprocess.run([tool, *subcommand, "--help"], capture_output=True, text=True, check=False)
        if told.returncode:
            problems.append(f"{block.place()}: there is no command `{line.strip()}`")
        for option in re.findall(r"(?<=\s)--?[a-z]+", " " + " ".join(words[1:])):
            if not re.search(rf"(?<![\w-]){option}\b", told.stdout):
                problems.append(f"{block.place()}: `{' '.join(words[:2])}` has no option {option}")
        count("commands looked up")


shutil.rmtree(scratch, ignore_errors=True)
scratch.mkdir(parents=True)
snippets = {"plain": [], **{name: [] for name in others}}
pages = ["README.md", *sorted(file.relative_to(source).as_posix() for folder in ("docs/start", "docs/guide", "docs/migrate")
                              for file in (source / folder).glob("*.md"))]
for page in pages:
    folder, programs = scratch / page.replace("/", "_"), []
    folder.mkdir()
    for block in blocks_of(page):
        count(f"blocks of {block.language or 'no language'}")
        text = "\n".join(block.lines)
        if block.language not in known:
            problems.append(f"{block.place()}: a block of {block.language or 'no language'}")
        elif block.language == "cpp" and "int main(" in text:
            run_program(block)
        elif block.language == "cpp":
            kind = "bullet" if re.search(r"\bbt[A-Z]", text) else "fcl" if "fcl::" in text else "mpi" if "mpi::" in text else "plain"
            snippets[kind].append(block)
        elif block.language == "console":
            if ">>>" in text and "$ jostle" not in text and page not in run_elsewhere[">>>"]:
                problems.append(f"{block.place()}: nobody runs this Python")
            elif page not in run_elsewhere[">>>"] | run_elsewhere["js"]:
                run_session(block, folder)
        elif block.language == "python" and has_numpy:
            run_python(block, folder, programs)
            programs += block.lines
        elif block.language == "bash":
            check_shell(block)
        elif block.language in ("c", "js", "csharp", "rust") and page not in run_elsewhere[block.language]:
            problems.append(f"{block.place()}: nobody runs this {block.language}")
compile_snippets("plain", snippets["plain"], [])
for name, (needed, more, at_hand) in others.items():
    if needed.exists():
        compile_snippets(name, snippets[name], [f"-I{source / 'extras' / name / 'include'}", *more], at_hand)
    else:
        print(f"{needed} is missing, so {len(snippets[name])} blocks aren't compiled; ./test docs installs it")

print(*problems, sep="\n\n", end="\n" if problems else "")
print(", ".join(f"{number} {what}" for what, number in sorted(counts.items())) + f"; {len(problems)} problems")
sys.exit(bool(problems))
