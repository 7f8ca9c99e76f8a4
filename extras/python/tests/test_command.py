# SPDX-License-Identifier: MIT
"""python -m jostle, jostle.plot, and what a user's tools see."""
import inspect
import json
import subprocess
import sys

import numpy as np
import pytest

import jostle

CRATES = """id,lo_x,lo_y,lo_z,hi_x,hi_y,hi_z
crate,0,0,0,2,1,1
barrel,1.5,0,0,2.5,1,1
lamp,8,0,3,8.2,0.2,3.5
floor,-inf,-1,-inf,inf,0,inf
"""


def run(*arguments, text=None, rc=0):
    done = subprocess.run([sys.executable, "-m", "jostle", *map(str, arguments)], input=text, capture_output=True, text=True)
    assert done.returncode == rc, done.stderr
    return done.stdout if rc == 0 else done.stderr


def test_pairs_of_a_file(tmp_path):
    crates = tmp_path / "boxes.csv"
    crates.write_text(CRATES)
    expected = "a,b\ncrate,barrel\ncrate,floor\nbarrel,floor\nlamp,floor\n"
    assert run(crates) == expected and run("-", text="\ufeff" + CRATES.replace("\n", "\r\n")) == expected
    run(crates, "-o", tmp_path / "pairs.jsonl")
    assert (tmp_path / "pairs.jsonl").read_text().splitlines()[0] == '{"a":"crate","b":"barrel"}'
    boxes = np.array([[0, 0, 1, 1], [1, 1, 2, 2], [5, 5, 6, 6]], np.float32)
    np.save(tmp_path / "boxes.npy", boxes)
    run(tmp_path / "boxes.npy", "-o", tmp_path / "pairs.npy")
    assert np.load(tmp_path / "pairs.npy").tolist() == [[0, 1]]
    stats = json.loads(run(crates, "--stats"))
    assert stats["objects"] == 4 and stats["pairs"] == 4
    assert jostle.__version__ in run("--version")


def test_the_names_that_columns_have(tmp_path):
    for text in ("minx,miny,maxx,maxy\n0,0,2,1\n2,1,3,3\n", "xmax,Y_MIN,x_min,ymax\n2,0,0,1\n3,1,2,3\n", "x,y,w,h\n0,0,2,1\n2,1,0,inf\n",
                 "x,y,z,hi_x,h,d\n0,0,0,2,1,1\n2,1,1,3,3,3\n", "0,0,2,1\n\n2,1,3,3", " 0,0,0,2,1,1\n2,1,-inf,3,3,inf\n"):
        assert run("-", text=text) == "a,b\n0,1\n", text
    assert run("-", text="0,0,2,1\n") == "a,b\n"


@pytest.mark.parametrize("text,told", [
    ("", "1:1: the file is empty; the first line may name"),
    ("lo_x,lo_y,hi_x\n1,2,3\n", "1:4: column hi_y is missing; "),
    ("lo_x,lo_y,hi_x,hi_y,colour\n", '1:5: column "colour" is not known; '),
    ("x,minx,y,w,h\n", "1:2: column minx is there twice; remove one"),
    ("x,y,hi_x,w,h\n", "1:4: columns hi_x and w say the same; remove one"),
    ("1,2,3\n", "1:1: there is no line with names, and 3 columns; "),
    ("0,0,1,1\n\n0,0,1\n", "3:4: the row has 3 fields and the first 4; give each column one value"),
    ("lo_x,lo_y,hi_x,hi_y\n1,2,3,x\n", '2:4: hi_y is "x", which is not a number; write one like -12.5, 1e-3 or inf'),
    ("lo_x,lo_y,hi_x,hi_y\n1,2,3,1_0\n", '2:4: hi_y is "1_0", which is not a number; '),
    ("lo_x,lo_y,hi_x,hi_y\n1,,3,4\n", "2:2: lo_y is empty; write a number"),
    ("lo_x,lo_y,hi_x,hi_y\n1,nan,3,4\n", "2:2: lo_y is NaN; every bound must be a number (inf is allowed)"),
    ("lo_x,lo_y,hi_x,hi_y\n1,2,3,1e999\n", '2:4: hi_y is "1e999", which is more than a double can hold; '),
    ("minx,miny,maxx,maxy\n3,0,2,1\n", "2:1: minx = 3 is greater than maxx = 2; swap them or drop the box"),
    ("x,y,w,h\n0,0,1,-2\n", "2:4: h = -2 is below 0; a box begins at y and has this size"),
    ("x,y,w,h\n1e308,0,1e308,1\n", "2:3: x + w is no number that a double can hold; write the upper bound as hi_x"),
    ("id,x,y,w,h\na,0,0,1,1\na,0,0,1,1\n", '3:1: id "a" already names box 0 (the first is 0); make them differ'),
    ("id,x,y,w,h\n,0,0,1,1\n", "2:1: id is empty; name the box, or leave the column out"),
])
def test_bad_files(text, told):
    assert run("-", text=text, rc=2).startswith("jostle: stdin:" + told)


def test_a_field_without_end():
    told = run("-", text='lo_x,lo_y,hi_x,hi_y\n"0,0,1,1\n' + "2,2,3,3\n" * 20_000, rc=2)  # the quotation mark isn't closed
    assert "field limit" in told and told.count("\n") == 1


def test_a_file_is_there_whole_or_not_at_all(tmp_path):
    (tmp_path / "boxes.csv").write_text(CRATES)
    assert "whole numbers" in run(tmp_path / "boxes.csv", "-o", tmp_path / "pairs.npy", rc=2)
    assert [file.name for file in tmp_path.iterdir()] == ["boxes.csv"]
    assert "ends in" in run(tmp_path / "boxes.csv", "-o", tmp_path / "pairs.txt", rc=2)
    assert "No such file" in run(tmp_path / "missing.csv", rc=2)


def test_plot():
    matplotlib = pytest.importorskip("matplotlib") if "matplotlib" in sys.modules else __import__("matplotlib")
    matplotlib.use("Agg")
    boxes = np.array([[0, 0, 1, 1], [1, 1, 2, 2], [5, 5, 6, 6]], float)
    axes = jostle.plot(boxes, jostle.find_pairs(boxes))
    lines, lone, paired = axes.collections
    assert len(lines.get_segments()) == 1 and len(lone.get_paths()) == 1 and len(paired.get_paths()) == 2
    with pytest.raises(jostle.Error, match=r"pairs\[1\] is \[0, 3\]"):
        jostle.plot(boxes, [[0, 1], [0, 3]])
    with pytest.raises(jostle.Error, match="axes 0 to 1"):
        jostle.plot(boxes, axes=(0, 2))
    jostle.plot(np.random.default_rng(1).random((1, 2, 3)).cumsum(axis=1), axes=(0, 2))


def test_everything_says_what_it_is():
    for name in jostle.__all__:
        thing = getattr(jostle, name)
        assert inspect.getdoc(thing), name
        if inspect.isclass(thing) and thing.__module__.startswith("jostle") and thing.__module__ != "jostle._core":
            for member, function in inspect.getmembers(thing, inspect.isfunction):
                if not member.startswith("_") and member not in ("spheres", "capsules", "boxes", "extend", "clear"):
                    assert function.__doc__, f"{name}.{member}"


def test_the_stub_has_what_the_compiled_part_has():
    import ast
    import pathlib

    from jostle import _core
    stub = ast.parse(pathlib.Path(_core.__file__).with_name("_core.pyi").read_text())
    public = lambda names: {name for name in names if not name.startswith("_")}
    functions = {node.name for node in stub.body if isinstance(node, ast.FunctionDef)}
    classes = {node.name: node for node in stub.body if isinstance(node, ast.ClassDef)}
    assert functions | set(classes) == public(dir(_core))
    for name, node in classes.items():
        assert public(part.name for part in node.body if isinstance(part, ast.FunctionDef)) == public(dir(getattr(_core, name))), name


def test_nothing_leaks():
    import resource
    boxes = np.random.default_rng(1).random((2000, 2, 3))
    boxes[:, 1] = boxes[:, 0] + 0.05
    bad = boxes.copy()
    bad[77, 0, 0] = np.nan

    def some():
        for _ in range(200):
            jostle.find_pairs(boxes)
            world = jostle.World()
            ids = world.add(boxes)
            world.update()
            world.fork().save()
            index = jostle.BoxIndex(boxes)
            index.all(jostle.nearest(boxes[:50, 0], 3))
            for call in (lambda: jostle.find_pairs(bad), lambda: world.boxes([5]), lambda: index.move(ids, bad),
                         lambda: jostle.find_pairs(boxes, accept=lambda a, b: 1 / 0)):
                with pytest.raises(Exception):
                    call()
            next(jostle.iter_pairs(boxes, chunk=10))

    some()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    some()
    some()
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 20_000  # KB; one lost world each would be 80 MB
