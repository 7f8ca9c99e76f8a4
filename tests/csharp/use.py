#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""use.py SOURCE SCRATCH LIBRARY LAYOUT ...: the C# package's tests.

    compile      the package's sources and the tests, to one program
    run GROUP    one class of it
    package      packs; compiles the example and what docs/guide/csharp.md shows against the package alone, and runs them
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import zipfile

source, scratch, library, layout = map(pathlib.Path, sys.argv[1:5])
what = sys.argv[5:]
mcs = [os.environ["JOSTLE_MCS"], "-unsafe", "-langversion:experimental", "-warnaserror", "-r:System.Numerics.dll"]
mono = os.environ["JOSTLE_MONO"]
package = source / "extras" / "csharp"


def compile_to(program, *files):
    program.parent.mkdir(parents=True, exist_ok=True)
    subprocess.run([*mcs, f"-out:{program}", *files], check=True)
    shutil.copy(library, program.parent / "libjostle.so")


def run(program):
    """What it prints, started somewhere else: the library is beside it."""
    done = subprocess.run([mono, "--debug", program], cwd="/", stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{program} fails:\n{done.stdout}")
    return done.stdout


def blocks(page):
    """The page's blocks of C#, each with the line it begins at and, where one follows, what it prints."""
    found = re.finditer(r"```csharp\n(.*?)```(?:\n\n(?:It prints|which prints)[^\n]*\n\n```text\n(.*?)```)?", page, re.DOTALL)
    return [(page[:match.start()].count("\n") + 2, match[1], match[2]) for match in found]


# What the page's pieces of a program take for granted.
PRELUDE = """
using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using Jostle;
using Vector3 = System.Numerics.Vector3;
using Quaternion = System.Numerics.Quaternion;

static class Program
{
    struct Body { public Vector3 Position; public Quaternion Rotation; public float Health; public Vector3 Min, Max; }
    static void Use(object it) { }
    static void Main()
    {
        Random random = new Random(1);
        Box3[] boxes = new Box3[100];
        for (int i = 0; i < 100; ++i)
            boxes[i] = Box3.Around(new Vec3((float)random.NextDouble() * 5, (float)random.NextDouble() * 5, (float)random.NextDouble() * 5), new Vec3(1, 1, 1));
        Body[] bodies = new Body[100];
        for (int i = 0; i < 100; ++i)
            bodies[i] = new Body { Position = new Vector3(i, 0, 0), Rotation = Quaternion.Identity, Min = boxes[i].Min, Max = boxes[i].Max };
        Box3 playerBox = boxes[0], doorBox = boxes[1];
        Vec3 eye = new Vec3(-9, 2, 2), forward = new Vec3(1, 0, 0);
        PairFinder finder = new PairFinder();
        World world = new World();
        ObjectId[] ids = new ObjectId[100];
        world.Add(boxes, ids);
        world.Update();
        ObjectId player = ids[0];
#line 1 "csharp.md"
"""


def check_engines(sources, unity):
    """What is compiled for one of the engines alone: against as much of them as it names."""
    stubs = source / "tests" / "csharp" / "engines.txt"
    for engine in ("UNITY_5_3_OR_NEWER", "UNITY_5_3_OR_NEWER;UNITY_IOS", "GODOT"):
        vector = "Godot.Vector3" if engine == "GODOT" else "UnityEngine.Vector3"
        file = scratch / "engine" / "Program.cs"
        file.parent.mkdir(exist_ok=True)
        file.write_text(f"""using Jostle;
static class Program
{{
    static int Main()
    {{
        {vector}[] corners = {{ new {vector}(0, 0, 0), new {vector}(1, 1, 1), new {vector}(2, 2, 2) }};
        {vector} back = new Box3(corners[0], corners[1]).Max;
        long pairs = 0;
        if ("{engine}".EndsWith("IOS")) return 0; // where the library is a part of the program
        using (PairFinder finder = new PairFinder()) pairs = finder.Find(Boxes.Of(corners, corners)).Count;
        using (Shape hull = Shape.Hull(Values.Of(corners))) return pairs == 0 && back.Equals(corners[1]) ? 0 : 1;
    }}
}}
""")
        program = file.with_suffix(".exe")
        behaviours = []
        if "UNITY" in engine:
            behaviours = [file.with_name(f"Behaviour{k}.cs") for k in range(len(unity))]
            for place, code in zip(behaviours, unity):
                place.write_text(code)
        compile_to(program, f"-define:{engine}", "-nowarn:649", file, *behaviours, stubs, *sources)
        run(program)


def check_package():
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    pack = [sys.executable, "-B", package / "pack"]
    subprocess.run([*pack, scratch / "Jostle", "--library", library, f"arm64={library}"], check=True)
    subprocess.run([*pack, scratch / "Jostle.zip", "--library", library], check=True)
    with zipfile.ZipFile(scratch / "Jostle.zip") as archive:
        names = set(archive.namelist())
    folder = {"Jostle/" + str(file.relative_to(scratch / "Jostle")) for file in (scratch / "Jostle").rglob("*") if file.is_file()}
    if names != folder - {"Jostle/arm64/libjostle.so"} or not {"Jostle/Native.cs", "Jostle/Jostle.asmdef", "Jostle/x86_64/libjostle.so"} <= names:
        sys.exit(f"the package has {sorted(names)}, the folder {sorted(folder)}")
    subprocess.run([*pack, scratch / "Jostle", "--library", library], check=True)  # again, over what it wrote
    (scratch / "other").mkdir()
    (scratch / "other" / "mine").touch()
    refused = subprocess.run([*pack, scratch / "other", "--library", library], stderr=subprocess.PIPE, text=True, check=False)
    if refused.returncode == 0 or "other" not in refused.stderr or not (scratch / "other" / "mine").exists():
        sys.exit("pack writes over somebody's files")
    sources = sorted((scratch / "Jostle").glob("*.cs"))

    example = source / "examples" / "csharp" / "GameLoop.cs"
    if len(example.read_text().splitlines()) > 80:
        sys.exit(f"{example} has more than 80 lines: an example is to be read at a glance")
    compile_to(scratch / "example" / "GameLoop.exe", example, *sources)
    if "5 landed, 5 went through the door, 5 came out" not in run(scratch / "example" / "GameLoop.exe"):
        sys.exit("the example prints something else")

    page = source / "docs" / "guide" / "csharp.md"
    found = blocks(page.read_text())
    if len(found) < 5:
        sys.exit(f"{page} has {len(found)} blocks of C#")
    unity = [code for _, code, _ in found if "using UnityEngine" in code]
    check_engines(sources, unity)
    for line, code, printed in found:
        if code in unity:
            continue
        file = scratch / f"block{line}" / "Program.cs"
        file.parent.mkdir()
        if "static void Main" not in code:
            code = PRELUDE.replace("#line 1", f"#line {line}") + code + "    }\n}\n"
        file.write_text(code)
        compile_to(file.with_suffix(".exe"), "-nowarn:168,219,414,649", file, *sources)
        says = run(file.with_suffix(".exe"))
        if printed is not None and says != printed:
            sys.exit(f"{page}:{line} prints\n{says}in place of\n{printed}")
    print(f"{len(found)} blocks of {page.name} compile and run")


if what[0] == "compile":
    compile_to(scratch.with_name("program") / "tests.exe", "-debug", *sorted(package.glob("*.cs")), *sorted((source / "tests" / "csharp").glob("*.cs")))
elif what[0] == "run":
    program = scratch.with_name("program")
    written = program / f"{what[1]}.txt"
    written.write_text(subprocess.run([layout], stdout=subprocess.PIPE, text=True, check=True).stdout)
    sys.exit(subprocess.run([mono, "--debug", program / "tests.exe", what[1], written], check=False).returncode)
else:
    check_package()
