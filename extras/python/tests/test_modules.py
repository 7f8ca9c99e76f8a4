# SPDX-License-Identifier: MIT
import ast
import graphlib
import importlib
import pathlib
import warnings

import jostle
import numpy as np
import pytest


def test_modules_import_each_other_in_no_circle():
    imports = {}
    for file in pathlib.Path(jostle.__file__).parent.glob("_[a-z]*.py"):
        named = [node for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.ImportFrom) and node.level == 1]
        imports[file.stem] = {name for node in named for name in ([node.module] if node.module else [x.name for x in node.names])}
    assert "_arrays" in imports["_index"] and "_shapes" in imports["_contacts"]
    assert len(list(graphlib.TopologicalSorter(imports).static_order())) >= len(imports)  # else a CycleError


def test_a_package_without_simd_says_so(monkeypatch):
    monkeypatch.setattr(jostle._core, "instruction_sets", lambda: ["scalar"])
    with pytest.warns(RuntimeWarning, match="without SIMD.*libhwy-dev"):
        importlib.reload(jostle)
    monkeypatch.setattr(jostle._core, "instruction_sets", lambda: ["avx2", "scalar"])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        importlib.reload(jostle)
    monkeypatch.undo()
    importlib.reload(jostle)


def test_lists_of_answers_and_of_hits_are_alike():
    index = jostle.BoxIndex([[0, 0, 0, 1, 1, 1], [2, 0, 0, 3, 1, 1]])
    rays = jostle.rays([[-1, 0.5, 0.5], [-1, 5, 5]], [10, 0, 0])
    shapes, poses = jostle.Shapes.boxes([[0.5] * 3] * 2), jostle.poses([[0.5] * 3, [2.5, 0.5, 0.5]])
    answers, hits = index.all(rays), index.all(rays, shapes, poses)
    assert answers.ids is answers.values
    for lists in (answers, hits):
        assert [len(one) for one in lists] == [2, 0] and len(lists) == 2
        np.testing.assert_array_equal(lists.query_of(), [0, 0])
        assert len(lists[-2]) == 2 and not lists.more.any()
        with pytest.raises(IndexError, match="there are 2 queries, and none of number 2"):
            lists[2]
    assert repr(answers) == "Answers(2 queries, 2 answers)" and repr(hits) == "ShapeAnswers(2 queries, 2 answers)"
