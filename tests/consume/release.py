#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""release.py SOURCE SCRATCH: packaging/release in a clone: what it makes, and what it refuses.

What --all builds is tested elsewhere, each by its language's tests; here only that the guide names every part.
"""
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile

source, scratch = map(pathlib.Path, sys.argv[1:3])
listed = subprocess.run(["git", "-C", source, "ls-files", "-z"], capture_output=True, text=True, check=False)
if listed.returncode != 0:
    print("this source is no git repository, so no release can be made of it")
    sys.exit(77)
files = [name for name in listed.stdout.split("\0") if name and (source / name).exists()]
clone = scratch / "clone"
shutil.rmtree(scratch, ignore_errors=True)
for name in files:
    (clone / name).parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(source / name, clone / name, follow_symlinks=False)


def git(*arguments):
    subprocess.run(["git", "-C", clone, "-c", "user.name=x", "-c", "user.email=x@example.com", *arguments], check=True)


def release(*arguments, refused=None):
    told = subprocess.run([clone / "packaging/release", *arguments], cwd=scratch, capture_output=True, text=True, check=False)
    if refused is None and told.returncode != 0 or refused is not None and (told.returncode == 0 or refused not in told.stderr):
        sys.exit(f"packaging/release {arguments} says: {told.stderr}")
    return [pathlib.Path(line).name for line in told.stdout.splitlines()]


script = (source / "packaging/release").read_text()
version = re.search(r'"version": "(.*)"', (source / "packaging/vcpkg/jostle/vcpkg.json").read_text())[1]
guide = (source / "docs/guide/packages.md").read_text()
parts = [part.replace("${version}", version).replace("$version", version)
         for line in re.findall(r"parts\+?=\((.*?)\)\n", script, re.DOTALL) for part in re.findall(r'"(.*?)"', line)]
unnamed = [part for part in parts if f"`{part}`" not in guide]
if unnamed or len(parts) < 11:
    sys.exit(f"of {len(parts)} parts of a release docs/guide/packages.md doesn't name {unnamed}")

log = clone / "CHANGELOG.md"
heading = re.compile(rf"^## {re.escape(version)}.*$", re.MULTILINE)
log.write_text(heading.sub(f"## {version} (unreleased)", log.read_text()))
git("init", "--quiet")
git("add", "--all", "--force")
git("commit", "--quiet", "--message", "before")
release("first", refused="CHANGELOG.md has no heading")
log.write_text(heading.sub(f"## {version}", log.read_text()))
release("first", refused="changes that aren't committed")
git("commit", "--quiet", "--all", "--message", "after")
release("--everything", refused="[--all] [FOLDER]")

made = sorted(release("first"))
if made != sorted(["SHA256SUMS", "SHA512SUMS", f"jostle-{version}-in-two-files.tar.gz", f"jostle-{version}.tar.gz"]):
    sys.exit(f"a release has {made}")
for sums in ("sha256sum", "sha512sum"):
    subprocess.run([sums, "--check", "--quiet", f"{sums.removesuffix('sum').upper()}SUMS"], cwd=scratch / "first", check=True)
with tarfile.open(scratch / "first" / f"jostle-{version}.tar.gz") as archive:
    packed = {member.name.partition("/")[2] for member in archive if not member.isdir()}
if packed != set(files):
    sys.exit(f"the source's tarball lacks, or has too much: {sorted(packed ^ set(files))}")
with tarfile.open(scratch / "first" / f"jostle-{version}-in-two-files.tar.gz") as archive:
    packed = {pathlib.Path(member.name).name for member in archive if member.isfile()}
if not {f"jostle_{part}.{end}" for part in ("pairs", "world", "all") for end in ("hpp", "cpp")} <= packed:
    sys.exit(f"the library as two files has {sorted(packed)}")

release("second")
if any((scratch / "first" / name).read_bytes() != (scratch / "second" / name).read_bytes() for name in made):
    sys.exit("a second release of the same commit has other bytes")
letter = scratch / "letters" / "letter"
letter.parent.mkdir()
letter.touch()
release("letters", refused="files that are no release")
if not letter.exists():
    sys.exit("packaging/release deleted a file that wasn't its own")
