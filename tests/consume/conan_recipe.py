#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""conan_recipe.py SOURCE SCRATCH: the Conan recipe with stand-ins for Conan, up to CMake's configuration, for each of its options.

What it exports must be all that a build and an installation read, and the options that it sets must exist.
"""
import importlib.util
import itertools
import pathlib
import re
import shutil
import subprocess
import sys
import types


class Conan:
    """What the recipe's classes derive from, and its tools: they remember what they are given."""

    cache_variables: dict

    def __init__(self, *_):
        self.cache_variables = {}
        self.required = []

    def requires(self, name):
        self.required.append(name)

    def generate(self):
        Conan.generated.update(self.cache_variables)

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *_, **__: None


def copy(recipe, pattern, source, target):
    """Conan's: patterns are of the path from `source`, and * goes through folders."""
    wanted = re.compile(re.escape(pattern).replace(r"\*", ".*"))
    tops = [top for top in pathlib.Path(source).iterdir() if top.name != "build" and not top.name.startswith(".")]
    files = [file for top in tops for file in ([top] if top.is_file() else top.rglob("*")) if file.is_file()]
    copied = [file for file in files if wanted.fullmatch(file.relative_to(source).as_posix())]
    for file in copied:
        to = pathlib.Path(target, file.relative_to(source))
        to.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(file, to)
    if not copied:
        sys.exit(f"the recipe copies {pattern}, and there is nothing of that name")


def module(name, **parts):
    made = types.ModuleType(name)
    made.__dict__.update(parts)
    sys.modules[name] = made


def main():
    source, scratch = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    shutil.rmtree(scratch, ignore_errors=True)
    Conan.generated = {}
    nothing = lambda *_: None
    module("conan", ConanFile=Conan)
    module("conan.tools")
    module("conan.tools.build", check_min_cppstd=nothing)
    module("conan.tools.cmake", CMake=Conan, CMakeDeps=Conan, CMakeToolchain=Conan, cmake_layout=nothing)
    module("conan.tools.files", copy=copy)
    spec = importlib.util.spec_from_file_location("recipe", source / "packaging/conan/conanfile.py")
    recipe = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(recipe)

    package = recipe.Jostle()
    package.recipe_folder, package.export_sources_folder = str(source / "packaging/conan"), str(scratch / "source")
    package.set_version()
    package.export_sources()
    for tbb, simd in itertools.product(*(package.options[name] for name in ("with_tbb", "with_simd"))):
        chosen = recipe.Jostle()
        chosen.options = types.SimpleNamespace(with_tbb=tbb, with_simd=simd, shared=False)
        chosen.requirements()
        if len(chosen.required) != tbb + simd:
            sys.exit(f"with_tbb={tbb}, with_simd={simd} requires {chosen.required}")
        chosen.generate()
        build = scratch / f"build-{tbb}-{simd}"
        settings = [f"-D{name}={'ON' if value else 'OFF'}" for name, value in Conan.generated.items()]
        done = subprocess.run(["cmake", "-S", scratch / "source", "-B", build, "-G", "Ninja", *settings], capture_output=True, text=True)
        if done.returncode != 0 or "not used by the project" in done.stderr:
            sys.exit(f"what the recipe exports doesn't configure: {done.stdout}{done.stderr}")
        # All that a build would read is there; the build itself would take minutes.
        subprocess.run(["ninja", "-C", build, "-n"], check=True, stdout=subprocess.DEVNULL)
        for script in build.rglob("cmake_install.cmake"):
            for name in re.findall(rf'"({re.escape(str(scratch / "source"))}[^";]*)"', script.read_text()):
                if not pathlib.Path(name).exists():
                    sys.exit(f"what the recipe exports lacks {name}, which is installed")
    version = package.version
    if version not in (source / "packaging/vcpkg/jostle/vcpkg.json").read_text():
        sys.exit(f"the recipe says version {version}")


main()
