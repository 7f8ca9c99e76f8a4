#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""check_site.py SITE: every link within the built site leads to a page or file of it, and every anchor to a place.

Links to elsewhere may stand in the text; a page that would itself fetch something from elsewhere fails. The search
knows words of the trade, and each visitor loads its index: it is below a megabyte. Headers begin with an example and with what
they are for. Every name of C, Python and JavaScript is in the list of its language's reference, and no page is too long.
"""
import ast
import html.parser
import json
import pathlib
import posixpath
import re
import sys
import urllib.parse


class Page(html.parser.HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.links, self.fetched, self.anchors = set(), set(), set()
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name == "id" or name == "name" and tag == "a":
                self.anchors.add(value)
            elif name == "href" and tag == "a":
                self.links.add(value)
            elif name in ("href", "src") and value and dict(attributes).get("rel") != "canonical":
                self.fetched.add(value)


site = pathlib.Path(sys.argv[1])
pages = {file.relative_to(site).as_posix(): Page(file.read_text()) for file in site.rglob("*.html")}
checked, problems = 0, []
for name, page in sorted(pages.items()):
    for link in sorted(page.links | page.fetched):
        address = urllib.parse.urlsplit(link)
        if address.scheme or address.netloc:
            if link in page.fetched and address.scheme != "data":
                problems.append(f"{name}: fetches {link}")
            continue
        checked += 1
        start = "" if link.startswith("/") or name == "404.html" else posixpath.dirname(name)
        target = posixpath.normpath(posixpath.join(start, urllib.parse.unquote(address.path).lstrip("/"))) \
            if address.path else name
        if (site / target).is_dir():
            target = posixpath.normpath(posixpath.join(target, "index.html"))
        if not (site / target).is_file():
            problems.append(f"{name}: {link} leads nowhere")
        elif address.fragment and target in pages and urllib.parse.unquote(address.fragment) not in pages[target].anchors:
            problems.append(f"{name}: {link} names no place of {target}")

index = site / "search/search_index.json"
docs = {doc["location"]: doc for doc in json.loads(index.read_text())["docs"]}
if index.stat().st_size > 1_000_000:
    problems.append(f"the search's index has {index.stat().st_size} bytes")
problems += [f"the search finds {location}" for location in docs if re.match("decisions/.|source/", location)]
for word, location in (("C#", "guide/csharp/"), ("kNN", "guide/queries/"), ("tree", "reference/box_index_hpp/"), ("cmake", "guide/install/")):
    if word not in docs[location].get("tags", []):
        problems.append(f"{location} isn't found by {word}")
for header, first in (("find_pairs", "PairFinder"), ("world", "World"), ("contact", "ContactFinder"), ("shapes", "Shape")):
    headings = re.findall(r'<h2 id="([^"]*)"', (site / f"reference/{header}_hpp/index.html").read_text())
    if headings[0] != first:
        problems.append(f"{header}.hpp begins with {headings[0]}, which isn't what it is for")
    if "In use, from" not in (site / f"reference/{header}_hpp/index.html").read_text().partition("<h2")[0]:
        problems.append(f"{header}.hpp doesn't begin with an example")
root = pathlib.Path(__file__).resolve().parents[2]
init = ast.parse((root / "extras/python/jostle/__init__.py").read_text())
[listed] = [node.value for node in init.body if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"]
exported = re.findall(r"^export (?:class|const|function|interface|type) (\w+)", (root / "extras/js/jostle.d.ts").read_text(), re.MULTILINE)
functions = [each["name"] for each in json.loads((root / "extras/jostle.json").read_text())["functions"]]
for language, wanted in (("python", set(ast.literal_eval(listed)) - {"ase", "trimesh"}), ("javascript", exported), ("jostle_h", functions)):
    linked = re.findall(r'<a href="[^"]+"><code>(\w+)</code></a>', (site / f"reference/{language}/index.html").read_text())
    problems += [f"{language}'s reference doesn't list {name}" for name in sorted(set(wanted) - set(linked))]
problems += [f"{file.parent.relative_to(site)} has {file.stat().st_size} bytes" for file in site.glob("reference/**/index.html")
             if file.stat().st_size > 250_000]

print(*problems, sep="\n", end="\n" if problems else "")
print(f"{len(pages)} pages, {checked} links, {len(problems)} of them wrong")
sys.exit(bool(problems) or len(pages) < 50)
