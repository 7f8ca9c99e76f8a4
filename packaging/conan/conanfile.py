# SPDX-License-Identifier: MIT
"""For Conan 2: `conan create packaging/conan` packs the source that it lies in."""
import pathlib
import re

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy


class Jostle(ConanFile):
    name = "jostle"
    license = "MIT"
    description = "Parallel collision detection: which boxes touch"
    topics = ("collision-detection", "broad-phase", "simd", "parallel")
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    options = {"shared": [True, False], "with_tbb": [True, False], "with_simd": [True, False]}
    default_options = {"shared": False, "with_tbb": True, "with_simd": True}

    @property
    def _root(self):
        return pathlib.Path(self.recipe_folder).resolve().parents[1]

    def set_version(self):
        header = (self._root / "include" / "jostle" / "version.hpp").read_text()
        self.version = ".".join(re.search(rf"define JOSTLE_VERSION_{part} (\d+)", header)[1]
                                for part in ("MAJOR", "MINOR", "PATCH"))

    def export_sources(self):
        for pattern in ("CMakeLists.txt", "*.md", "LICENSE", "include/*", "src/*", "extras/bullet/*", "extras/fcl/*", "cmake/*", "docs/*", "examples/*",
                        "tests/c/reach.txt"):
            copy(self, pattern, str(self._root), self.export_sources_folder)

    def requirements(self):
        if self.options.with_tbb:
            self.requires("onetbb/[>=2021]")
        if self.options.with_simd:
            self.requires("highway/[>=1.0.3]")

    def validate(self):
        check_min_cppstd(self, 20)

    def layout(self):
        cmake_layout(self)

    def generate(self):
        CMakeDeps(self).generate()
        toolchain = CMakeToolchain(self)
        for option in ("TOOL", "TESTS", "EXAMPLES", "MPI"):
            toolchain.cache_variables[f"JOSTLE_{option}"] = False
        toolchain.cache_variables["JOSTLE_TBB"] = bool(self.options.with_tbb)
        toolchain.cache_variables["JOSTLE_SIMD"] = bool(self.options.with_simd)
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()
        copy(self, "LICENSE", self.source_folder, str(pathlib.Path(self.package_folder, "licenses")))

    def package_info(self):
        self.cpp_info.set_property("cmake_file_name", "jostle")
        self.cpp_info.set_property("cmake_target_name", "jostle::jostle")
        self.cpp_info.set_property("pkg_config_name", "jostle")
        self.cpp_info.libs = ["jostle"]
        if self.options.shared:
            self.cpp_info.defines = ["JOSTLE_SHARED"]
        elif self.settings.os in ("Linux", "FreeBSD"):
            self.cpp_info.system_libs = ["pthread", "m"]
