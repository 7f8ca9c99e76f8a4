# SPDX-License-Identifier: MIT
"""Which pages the site has besides those of docs/, and where their links lead. MkDocs calls the functions on_...

Pages are written to be read in the repository, where a link may lead to any file or folder of it. On the site the
root's pages come beside those of docs/; a link to a header leads to its page of the reference, one to any other
source to a page that shows it, one to a folder to a list of what is in it.
"""
import json
import os
import pathlib
import posixpath
import re
import sys

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import bindings  # noqa: E402
import reference  # noqa: E402

root = pathlib.Path(__file__).resolve().parents[2]
languages = {".cpp": "cpp", ".hpp": "cpp", ".h": "c", ".c": "c", ".py": "python", ".rs": "rust", ".go": "go", ".lua": "lua", ".cs": "csharp", ".js": "javascript",
             ".txt": "text", ".json": "json", ".sh": "bash", ".abi": "text", "": "bash"}
# A link or picture of Markdown, and what must be passed over: blocks of code, and code within a line.
markdown_link = re.compile(r"(^ *```.*?^ *```$|^(?: {4}[^\n]*\n)+|``.+?``|`[^`]+`)|(\]\()([^)\s]+)(\))", re.MULTILINE | re.DOTALL)

# What the search leaves out: it should find guides and the reference, and every visitor loads its index.
not_searched = re.compile(r"(decisions/.|source/|tests/|bench/|examples/|mutants|fuzzing|inside/chapter|reference/chapter|migrate/from-0|CHANGELOG)")
# Words of the trade that a page is found by, although it says others: they come first.
words = {
    "guide/queries/": "raycast raycasting ray kNN nearest neighbour neighbor overlap spatial query sweep shapecast frustum",
    "guide/pairs/": "broadphase broad spatial join intersection",
    "guide/neighbors/": "Verlet cutoff fixed radius neighbour",
    "guide/world/": "trigger rigid body",
    "guide/concepts/": "uniform BVH prune SAP",
    "migrate/hash-grid/": "spatial hash hashing grid",
    "reference/box_index_hpp/": "AABB tree BVH Rtree",
    "guide/contacts/": "narrowphase narrow manifold GJK EPA penetration",
    "guide/csharp/": "C# csharp dotnet .NET Unity Godot mono",
    "guide/c/": "Unreal FFI P/Invoke bindings Zig Julia",
    "guide/install/": "cmake FetchContent install Windows MSVC macOS mingw",
    "guide/packages/": "vcpkg conan Debian apt",
    "guide/python/": "numpy pandas geopandas shapely cKDTree pip wheel",
    "guide/rust/": "cargo crate glam nalgebra bevy rapier parry rstar",
    "guide/javascript/": "npm wasm WebAssembly vite webpack three.js TypeScript",
    "guide/fcl/": "MoveIt ROS robotics",
    "start/batch/": "GIS EDA CAD CSV",
}

places = {}    # of the repository, by the page's name on the site: the way back from `names`
names = {}     # the page's name on the site, by its place in the repository
generated = {} # the text of pages that are in no file, by name


def slug(text, separator):
    """The anchor that GitHub gives to a heading, so that links to it work in both places."""
    return re.sub(r"[^\w\- ]", "", text.strip().lower()).replace(" ", separator)


def on_config(config):
    config["mdx_configs"]["toc"]["slugify"] = slug
    header = (root / "include/jostle/version.hpp").read_text()
    version = ".".join(re.search(rf"VERSION_{part} (\d+)", header)[1] for part in ("MAJOR", "MINOR", "PATCH"))
    config["copyright"] = f"Jostle {version}, MIT licence"
    # There is no public repository yet.
    if os.environ.get("JOSTLE_REPOSITORY"):
        config["repo_url"], config["repo_name"] = os.environ["JOSTLE_REPOSITORY"], f"Jostle {version}"
    return config


def on_post_build(config):
    """The search's index: fewer pages, and more words."""
    file = pathlib.Path(config["site_dir"], "search/search_index.json")
    index = json.loads(file.read_text())
    index["docs"] = [doc for doc in index["docs"] if not not_searched.match(doc["location"])]
    for doc in index["docs"]:
        if doc["location"].startswith("reference/"): # names are in titles; declarations follow
            doc["text"] = doc["text"][:200 if "_hpp/" in doc["location"] else 0]
    found = {doc["location"]: doc for doc in index["docs"]}
    for location, tags in words.items():
        if location not in found:
            raise PluginError(f"docs/site/pages.py has words for {location}, which isn't there")
        found[location]["tags"] = tags.split()
    file.write_text(json.dumps(index, ensure_ascii=False, separators=(",", ":")))


def on_files(files, config):
    for file in list(files):
        if file.src_uri.startswith("site/"):
            files.remove(file)
        elif file.is_documentation_page():
            enter(f"docs/{file.src_uri}", file.src_uri)

    def add(place, name, text=None):
        enter(place, name)
        if text is not None:
            generated[name] = text
        file = File(name, str(root), config["site_dir"], config["use_directory_urls"])
        file.abs_src_path = str(root / place)
        files.append(file)

    # The front page is the site's own; the README beside it has the figures.
    add("docs/site/home.md", "index.md")
    for page in sorted(root.glob("*.md")):
        add(page.name, "overview.md" if page.name == "README.md" else page.name)
    for place, text in reference.pages(root / "include/jostle").items():
        name = "index" if place == "" else place.removeprefix("include/jostle/").replace(".", "_")
        add(place or "include/jostle", f"reference/{name}.md", text)
    for place, (name, text) in bindings.pages(root).items():
        add(place, name, text)

    # Whatever these pages lead to, and what that leads to.
    unread = list(names)
    while unread:
        place = unread.pop()
        for target in sorted(targets(place)):
            if target in names or target.startswith("docs/images/"):
                continue
            path = root / target
            if path.is_dir():
                name, text = f"{target.removeprefix('docs/')}/index.md", folder_page(target)
            elif path.suffix == ".md":
                name, text = target, None
            elif path.suffix in languages and path.is_file():
                name, text = f"source/{target}.md", source_page(target)
            else:
                raise PluginError(f"{place}: a link leads to {target}, which isn't there or of no kind that the site shows")
            add(target, name, text)
            unread.append(target)
    return files


def on_nav(nav, config, files):
    """Every page and header must be in the menu."""
    shown = {page.file.src_uri for page in nav.pages}
    for file in files.documentation_pages():
        if re.match(r"(start|guide|migrate|reference)/", file.src_uri) and file.src_uri not in shown:
            raise PluginError(f"{file.src_uri} isn't in the menu; give it a line in docs/site/mkdocs.yml")


def enter(place, name):
    names[place], places[name] = name, place


def text_of(place):
    return generated.get(names[place]) or (root / place).read_text()


def targets(place):
    """The files and folders of the repository that a page links to."""
    for code, _, link, _ in markdown_link.findall(text_of(place)):
        if not code and not re.match(r"[a-z]+:|#", link):
            yield resolve(place, link.split("#")[0])


def resolve(place, link):
    """What a link leads to, for a page's place: pages that list a folder have links that begin at the root."""
    start = "" if names[place] in generated else posixpath.dirname(place)
    return posixpath.normpath(posixpath.join(start, link))


def source_page(place):
    text = (root / place).read_text()
    return f"# {place}\n\n````{languages[pathlib.Path(place).suffix]}\n{text}\n````\n"


def folder_page(place):
    lines = [f"# {place}", ""]
    for path in sorted((root / place).iterdir()):
        title = re.search(r"^# (.*)$", path.read_text(), re.MULTILINE) if path.suffix == ".md" else None
        lines.append(f"- [{title[1] if title else path.name}]({place}/{path.name})")
    return "\n".join(lines) + "\n"


def on_page_read_source(page, config):
    return generated.get(page.file.src_uri)


def on_page_markdown(markdown, page, config, files):
    place, start = places[page.file.src_uri], posixpath.dirname(page.file.src_uri)
    if place == "docs/site/home.md":
        page.meta["hide"] = ["navigation", "toc"] # it has buttons

    def lead(match):
        code, begin, link, end = match.groups()
        if code or re.match(r"[a-z]+:|#", link):
            return match[0]
        path, mark, anchor = link.partition("#")
        target = resolve(place, path)
        name = names.get(target) or target.removeprefix("docs/")
        return begin + posixpath.relpath(name, start or ".") + mark + anchor + end

    return markdown_link.sub(lead, markdown)
