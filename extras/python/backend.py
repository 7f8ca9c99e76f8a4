# SPDX-License-Identifier: MIT
"""Builds the package's wheel and source distribution: PEP 517, with nothing but Python, CMake and a compiler.

`pip install .` in the source, `python -m build`, or by hand `python backend.py FOLDER [BUILT]`. The setting `built`
(`--config-settings built=FOLDER`) names a build folder of Jostle's whose library is linked; without it the library is built, too.
"""
from __future__ import annotations

import base64
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
# Of the source: what the library and the package are built from, and what says how.
PARTS = ("include", "src", "cmake", "extras/python", "docs/guide", "CMakeLists.txt", "pyproject.toml", "LICENSE")
# What every system has that runs C++ programs; everything else that the module needs goes into the wheel.
SYSTEM = re.compile(r"^(libc|libm|libdl|librt|libpthread|libstdc\+\+|libgcc_s|ld-linux.*|linux-vdso)\.so")


def version() -> str:
    header = (ROOT / "include" / "jostle" / "version.hpp").read_text()
    return ".".join(re.search(rf"define JOSTLE_VERSION_{part} (\d+)", header)[1] for part in ("MAJOR", "MINOR", "PATCH"))


def metadata() -> str:
    page = (ROOT / "docs" / "guide" / "python.md").read_text()
    return (f"Metadata-Version: 2.1\nName: jostle\nVersion: {version()}\n"
            "Summary: Parallel collision detection: which boxes touch\nLicense: MIT\nRequires-Python: >=3.10\n"
            "Requires-Dist: numpy>=1.22\nDescription-Content-Type: text/markdown\n\n" + page)


def _missing() -> list[str]:
    needed = []
    if shutil.which("cmake") is None:
        needed.append("cmake")
    if shutil.which("ninja") is None:
        needed.append("ninja")
    if not any(pathlib.Path(folder, "cmake", "pybind11").is_dir() for folder in ("/usr/lib", "/usr/share", "/usr/local/share")):
        try:
            import pybind11  # noqa: F401
        except ImportError:
            needed.append("pybind11>=2.10")
    return needed


def get_requires_for_build_wheel(config_settings: dict | None = None) -> list[str]:
    return _missing()


def get_requires_for_build_sdist(config_settings: dict | None = None) -> list[str]:
    return []


def _needed(module: pathlib.Path) -> dict[str, pathlib.Path]:
    """Shared libraries that aren't every system's, by name."""
    out = subprocess.run(["ldd", module], check=True, capture_output=True, text=True).stdout
    found = re.findall(r"^\s*(\S+) => (/\S+)", out, re.MULTILINE)
    if "not found" in out:
        raise SystemExit(f"{module} needs libraries that aren't there:\n{out}")
    return {name: pathlib.Path(path) for name, path in found if not SYSTEM.match(name)}


def _licence(library: pathlib.Path) -> pathlib.Path | None:
    """Debian's record of the licence of a library."""
    package = subprocess.run(["dpkg", "-S", library.name], capture_output=True, text=True).stdout.partition(":")[0]
    page = pathlib.Path("/usr/share/doc", package, "copyright")
    return page if package and page.exists() else None


def _compile(folder: pathlib.Path, settings: dict) -> pathlib.Path:
    arguments = ["-S", HERE, "-B", folder, f"-DPython3_EXECUTABLE={sys.executable}", "-DCMAKE_BUILD_TYPE=Release"]
    if shutil.which("ninja"):
        arguments += ["-G", "Ninja"]
    if settings.get("built"):
        arguments.append(f"-DJOSTLE_BUILT={pathlib.Path(settings['built']).resolve()}")
    try:
        import pybind11
        arguments.append(f"-Dpybind11_DIR={pybind11.get_cmake_dir()}")
    except (ImportError, AttributeError):
        pass  # Debian's lies where CMake looks
    log = subprocess.DEVNULL if settings.get("quiet") else None
    subprocess.run(["cmake", *map(str, arguments)], check=True, stdout=log)
    subprocess.run(["cmake", "--build", str(folder), "--parallel", os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL") or str(os.cpu_count() or 1), "--target", "_core"], check=True,
                   stdout=log)
    return next((folder / "out").glob("_core*"))


def _tag() -> str:
    python = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    return f"{python}-{python}-{re.sub('[^A-Za-z0-9]', '_', sysconfig.get_platform())}"


def _wheel_file() -> str:
    return f"Wheel-Version: 1.0\nGenerator: jostle\nRoot-Is-Purelib: false\nTag: {_tag()}\n"


def prepare_metadata_for_build_wheel(metadata_directory: str, config_settings: dict | None = None) -> str:
    """Without it pip builds a wheel to look into, and then another one."""
    info = f"jostle-{version()}.dist-info"
    folder = pathlib.Path(metadata_directory, info)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "METADATA").write_text(metadata())
    (folder / "WHEEL").write_text(_wheel_file())
    return info


def build_wheel(wheel_directory: str, config_settings: dict | None = None, metadata_directory: str | None = None) -> str:
    info = f"jostle-{version()}.dist-info"
    files: dict[str, bytes] = {}
    pathlib.Path(wheel_directory).mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        module = _compile(pathlib.Path(scratch), dict(config_settings or {}))
        for file in sorted((HERE / "jostle").iterdir()):
            if file.suffix in (".py", ".pyi", ".typed"):
                files[f"jostle/{file.name}"] = file.read_bytes()
        files[f"jostle/{module.name}"] = module.read_bytes()
        for name, library in sorted(_needed(module).items()):
            files[f"jostle/{name}"] = library.read_bytes()
            page = _licence(library)
            if page is not None:
                files[f"{info}/licenses/{name}.txt"] = page.read_bytes()
    files[f"{info}/licenses/LICENSE"] = (ROOT / "LICENSE").read_bytes()
    files[f"{info}/METADATA"] = metadata().encode()
    files[f"{info}/WHEEL"] = _wheel_file().encode()
    record = "".join(f"{name},sha256={base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b'=').decode()},"
                     f"{len(data)}\n" for name, data in files.items())
    files[f"{info}/RECORD"] = (record + f"{info}/RECORD,,\n").encode()
    wheel = f"jostle-{version()}-{_tag()}.whl"
    with zipfile.ZipFile(pathlib.Path(wheel_directory, wheel), "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name, (2020, 1, 1, 0, 0, 0))
            entry.external_attr = (0o755 if ".so" in name else 0o644) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, data)
    return wheel


def build_sdist(sdist_directory: str, config_settings: dict | None = None) -> str:
    name = f"jostle-{version()}"

    def plain(entry: tarfile.TarInfo) -> tarfile.TarInfo | None:
        if any(part in ("__pycache__", "build") or part.endswith((".so", ".pyc")) for part in pathlib.Path(entry.name).parts):
            return None
        entry.uid = entry.gid = 0
        entry.uname = entry.gname = "root"
        entry.mtime = 1577836800
        return entry

    with tempfile.TemporaryDirectory() as scratch, tarfile.open(pathlib.Path(sdist_directory, name + ".tar.gz"), "w:gz",
                                                                format=tarfile.PAX_FORMAT) as archive:
        information = pathlib.Path(scratch, "PKG-INFO")
        information.write_text(metadata())
        archive.add(information, f"{name}/PKG-INFO", filter=plain)
        for part in PARTS:
            archive.add(ROOT / part, f"{name}/{part}", filter=plain)
    return name + ".tar.gz"


if __name__ == "__main__":
    print(build_wheel(sys.argv[1], {"built": sys.argv[2]} if len(sys.argv) > 2 else None))
