# SPDX-License-Identifier: MIT
"""The reference of C++ and C: a page for each public header, from its own comments; for jostle.h one for each part.

Doxygen reads the headers: the declarations, their lines and their comments. Declarations are shown as in the source;
enums, and structs that are only data, whole and with the comments in them.
"""
import pathlib
import re
import subprocess
import tempfile
import textwrap
import xml.etree.ElementTree

# Comments have lists such as `Cost      linear`, which become lists of Markdown; what a header begins with, before or
# behind its includes, is about all of it.
settings = r"""
INPUT = "{folder}"
FILE_PATTERNS = *.hpp *.h
INPUT_FILTER = "sed -zE -e 's@(#pragma once|#define JOSTLE_JOSTLE_H|#include [^\n]*)\n\n///@\1\n/// \\file\n///@' -e 's@(\n *///) ([A-Z][a-z]*)  +@\1 - **\2**: @g'"
OUTPUT_DIRECTORY = "{out}"
AUTOLINK_SUPPORT = NO
EXTRACT_ALL = YES
GENERATE_HTML = NO
GENERATE_LATEX = NO
GENERATE_XML = YES
XML_PROGRAMLISTING = NO
MACRO_EXPANSION = YES
EXPAND_ONLY_PREDEF = YES
PREDEFINED = "JOSTLE_NAMESPACE_BEGIN=namespace jostle {{" JOSTLE_NAMESPACE_END=}} JOSTLE_API= JOSTLE_C_API= __cplusplus
QUIET = YES
WARN_AS_ERROR = FAIL_ON_WARNINGS
"""
header_names = set()
guides = [] # blocks of code, each with the place of its page
c_places = {} # of each type and function of jostle.h: its page and anchor
not_public = re.compile(r"(^|::)(detail|std)(::|$)")


def pages(folder):
    """The text of each page by the header's place in the repository; that of the list of all pages by ""."""
    with tempfile.TemporaryDirectory() as out:
        subprocess.run(["doxygen", "-"], input=settings.format(folder=folder, out=out), text=True, check=True)
        compounds = [xml.etree.ElementTree.parse(file).getroot().find("compounddef")
                     for file in sorted(pathlib.Path(out, "xml").glob("*.xml"))
                     if file.name not in ("index.xml", "Doxyfile.xml")]
    header_names.update(file.name for file in folder.iterdir())
    root = folder.parents[1]
    for page in [root / "README.md", *sorted((root / "docs/guide").glob("*.md"))]:
        blocks = re.findall(r"^```cpp\n(.*?)^```$", page.read_text(), re.MULTILINE | re.DOTALL)
        guides.extend((page.relative_to(root).as_posix(), block) for block in blocks)
    headers = {file.name: Header(file) for file in sorted(folder.iterdir())}
    for compound in compounds:
        kind, name = compound.get("kind"), compound.findtext("compoundname")
        place = compound.find("location")
        if kind == "file" and name.endswith((".hpp", ".h")):
            headers[pathlib.Path(place.get("file")).name].about = compound
        declared_alone = kind != "concept" and (place is None or int(place.get("bodyend", -1)) < 0)
        if kind in ("class", "struct", "union", "concept") and not not_public.search(name) and not declared_alone:
            if compound.get("prot", "public") == "public":
                headers[pathlib.Path(place.get("file")).name].types.append(compound)
        if kind in ("namespace", "file") and not not_public.search(name):
            for member in compound.iter("memberdef"):
                headers[pathlib.Path(member.find("location").get("file")).name].add(member)
    known = {name: f"include/jostle/{header.name}#{name}" for header in headers.values() for name in header.type_names()}
    written = {}
    for header in headers.values():
        written |= header.pages(known)
    lines = ["# Reference", "", "All headers of Jostle, from their own comments. Begin with", "[jostle.hpp](include/jostle/jostle.hpp),"
             " which lists what each is for. C programs include [jostle.h](include/jostle/jostle.h) alone;",
             "[Python](extras/python/jostle/__init__.py) and [JavaScript](extras/js/jostle.d.ts) have lists of their own.", "",
             "| header | declares |", "|---|---|"]
    for header in headers.values():
        names = [f"[`{name}`](include/jostle/{header.name}#{name})" for name in header.type_names()]
        places = header.function_places()
        names += [f"[`{name}`](include/jostle/{header.name}#{places[name]})" if name in places else f"`{name}`"
                  for name in header.function_names()]
        lines.append(f"| [{header.name}](include/jostle/{header.name}) | {', '.join(names) if header.name != 'jostle.h' else 'everything, for C'} |")
    written[""] = "\n".join(lines) + "\n"
    return written


class Header:
    def __init__(self, file):
        self.name, self.lines = file.name, file.read_text().splitlines()
        self.about, self.types, self.members = None, [], {}

    def add(self, member):
        """Namespaces and files both list what they declare: once is enough."""
        if member.get("kind") in ("function", "typedef", "variable", "enum") and not not_public.search(
                member.findtext("qualifiedname") or ""):
            self.members.setdefault(member.get("id"), member)

    def type_names(self):
        if self.name == "jostle.h":
            return []
        return list(dict.fromkeys(name_of(type) for type in sorted(self.types, key=line_of)))

    def function_names(self):
        if self.name == "jostle.h":
            return []
        functions = [member for member in self.members.values() if member.get("kind") == "function"]
        names = [member.findtext("qualifiedname").removeprefix("jostle::") for member in sorted(functions, key=line_of)]
        types = self.type_names() # which deduction guides are named after
        return list(dict.fromkeys(name for name in names if name not in types and not name.startswith("operator")))

    def pages(self, known):
        self.known = known
        types = [type.findtext("compoundname") for type in self.types] # `typedef struct a {...} a;` is one thing
        members = [member for member in self.members.values() if member.findtext("name") not in types]
        if self.name == "jostle.h":
            return self.parts(members)
        about = self.described(self.about)
        if not about and re.search(r"^///.*\n\nJOSTLE_NAMESPACE_BEGIN", "\n".join(self.lines), re.MULTILINE):
            raise RuntimeError(f"{self.name}: the comment that it begins with isn't on its page")
        text = [f"# {self.name}", *about, *self.example()]
        inner = [(type is not self.main_type(), line_of(type), self.type(type)) for type in self.types]
        for group in self.groups(members):
            inner.append((True, group[0].line, self.entry(group, "##")))
        for _, _, block in sorted(inner, key=lambda each: each[:2]):
            text += block
        return {f"include/jostle/{self.name}": "\n\n".join(text) + "\n"}

    def parts(self, members):
        """jostle.h: a page for each of its parts, which begin with `TITLE: more` between two lines, and one that lists them."""
        starts = [line for line, text in enumerate(self.lines) if re.match(r"// -{20}", text)][::2]
        titles = [re.match(r"// ([^:]*):?(.*)", self.lines[line + 1]) for line in starts]
        inner = {line: [] for line in starts}

        def place(line):
            begin = max(each for each in starts if each < line)
            return f"include/jostle/jostle.h/{slug_of(titles[starts.index(begin)][1])}", begin

        declared = [(line_of(type), [name_of(type)], type) for type in self.types]
        declared += [(group[0].line, [member.name for member in group], group) for group in self.groups(members)]
        declared.sort(key=lambda each: each[0])
        for line, names, thing in declared:
            anchor = slug_of(self.title(thing) if isinstance(thing, list) else names[0])
            for name in names:
                c_places.setdefault(name, f"{place(line)[0]}#{anchor}")
        for line, names, thing in declared:
            inner[place(line)[1]].append((names, self.entry(thing, "##") if isinstance(thing, list) else self.type(thing)))
        pages, table = {}, ["| part | declares |", "|---|---|"]
        for line, title in zip(starts, titles):
            here = place(line + 1)[0]
            names = list(dict.fromkeys(name for names, _ in inner[line] for name in names if not name.startswith("@")))
            table.append(f"| [{title[1]}]({here}) | {', '.join(f'[`{name}`]({c_places[name]})' for name in names)} |")
            more = [plain(title[2].strip()[:1].upper() + title[2].strip()[1:].removesuffix(".")) + "."] if title[2] else []
            pages[here] = "\n\n".join([f"# {title[1]}", "A part of [jostle.h](include/jostle/jostle.h).", *more,
                                       *(block for _, blocks in inner[line] for block in blocks)]) + "\n"
        pages["include/jostle/jostle.h"] = "\n\n".join(["# jostle.h", *self.described(self.about), "\n".join(table)]) + "\n"
        return pages

    def example(self):
        """The first part of a program in the README or a guide that uses what the header is there for, a short one if there
        is one. Those are compiled by tests."""
        main = self.main_type()
        names = ([name_of(main)] if main is not None else []) + self.type_names() + self.function_names()
        for most in (16, 30):
            for name in names:
                for place, block in guides:
                    code = re.sub(r"//.*", "", block)
                    if re.search(rf"\b{re.escape(name)}(\d[fd]?)?\b", code) and block.count("\n") <= most:
                        return [f"In use, from [{place}]({place}):", f"```cpp\n{block}```"]
        return []

    def main_type(self):
        """What the header is there for, and its page begins with: the class of its name, or the one with most functions."""
        if self.name == "jostle.h":
            return None

        def functions(type):
            return sum(member.get("kind") == "function" and member.get("prot") == "public" and
                       not member.findtext("name").startswith("operator") for member in type.iter("memberdef"))

        def rank(type):
            named = name_of(type).lower() == self.name.removesuffix(".hpp").replace("_", "")
            return named and functions(type) > 0, functions(type), -line_of(type)

        best = max(self.types, key=rank, default=None)
        return best if best is not None and functions(best) > 0 else None

    def function_places(self):
        """The anchor of each function on the page: that of the first heading with its name."""
        types = [type.findtext("compoundname") for type in self.types]
        members = [member for member in self.members.values() if member.findtext("name") not in types]
        places = {}
        for group in self.groups(members):
            for member in group:
                places.setdefault(member.name, slug_of(self.title(group)))
        return places

    def title(self, group):
        names = list(dict.fromkeys(member.name for member in group if not member.name.startswith("@")))
        return ", ".join(names[:6]) + (", ..." if len(names) > 6 else "")

    def type(self, type):
        name = name_of(type)
        head = [f"## {name} {{: #{name} }}"] if self.name != "jostle.h" else [f"## {name}"]
        location = type.find("location")
        first, last = int(location.get("bodystart", 0)), int(location.get("bodyend", 0))
        public = [member for section in type.findall("sectiondef") for member in section.findall("memberdef")
                  if member.get("prot") == "public"]
        data_alone = all(member.get("kind") in ("variable", "typedef", "enum") or member.findtext("name").startswith("operator")
                         and "default" in member.findtext("argsstring") for member in public)
        line = line_of(type)
        if type.get("kind") == "concept" or data_alone and 0 < last:
            start = self.start(line)
            last = max(last, line)
            while type.get("kind") == "concept" and not self.lines[last - 1].rstrip().endswith(";"):
                last += 1
            return [*head, *self.described(type), self.code(self.lines[start:last])]
        text = [*head, self.code([*self.lines[self.start(line):first - 1], "{ ... };"]), *self.described(type)]
        for group in self.groups(public):
            text += self.entry(group, "###")
        return text

    def groups(self, members):
        """What one comment is about: a declaration that has it, and those right behind that have none."""
        result, end = [], None
        for member in sorted((Declared(self, member) for member in members), key=lambda each: each.line):
            if result and member.line == result[-1][-1].line:
                continue # `Vec a, b;`
            if result and not member.text and member.first == result[-1][-1].last and member.kind == result[-1][-1].kind:
                result[-1].append(member)
            else:
                result.append([member])
        return result

    def entry(self, group, level):
        title = self.title(group).replace("<", "&lt;").replace("*", "&#42;")
        heading = [f"{level} {title}"] if title else []
        code = [line for member in group for line in textwrap.dedent("\n".join(member.code)).split("\n")]
        return [*heading, self.code(code), *group[0].text]

    def start(self, line):
        """The index of the first line of a declaration whose name is in this line (from 1)."""
        first = line - 1
        while first > 0 and not re.match(r"\s*$|.*[;{}]\s*(//.*)?$|\s*(//|/\*|#|public:|private:|protected:)|.*\*/$",
                                         self.lines[first - 1]):
            first -= 1
        return first

    def code(self, lines):
        shown, shift, depth = [], 0, 0
        for line in textwrap.dedent("\n".join(lines)).replace("///<", "//").replace("///", "//").split("\n"):
            without = re.sub(r"\bJOSTLE_(C_)?API ", "", line[shift:] if line[:shift].isspace() else line)
            if depth == 0:
                shift = len(line) - len(without) # by which the parameters on the next lines move to the left
            depth += line.count("(") - line.count(")")
            shift = shift if depth else 0
            shown.append(without)
        text = "\n".join(shown)
        return f"```{'c' if self.name == 'jostle.h' else 'cpp'}\n{text}\n```"

    def described(self, element):
        """The comment as blocks of Markdown."""
        blocks = []
        for tag in ("briefdescription", "detaileddescription"):
            for part in element.find(tag):
                blocks += self.blocks(part)
        return blocks

    def blocks(self, part):
        blocks, text = [], [part.text or ""]
        text[0] = plain(text[0])

        def flush():
            if "".join(text).strip():
                blocks.append(re.sub(r"\s+", " ", "".join(text)).strip())
            text.clear()

        for child in part:
            if child.tag in ("verbatim", "preformatted", "programlisting"):
                flush()
                blocks.append(self.code((child.text or "").strip("\n").split("\n")))
            elif child.tag in ("itemizedlist", "orderedlist"):
                flush()
                for item in child:
                    inside = [block for each in item for block in self.blocks(each)]
                    blocks.append("- " + "\n\n".join(inside).replace("\n", "\n    "))
            elif child.tag == "table":
                flush()
                rows = ["| " + " | ".join(" ".join(block for each in entry for block in self.blocks(each)) for entry in row)
                        + " |" for row in child.findall("row")]
                blocks.append("\n".join([rows[0], "|" + "---|" * len(child.find("row")), *rows[1:]]))
            else:
                text.append(self.words(child))
            text.append(plain(child.tail or ""))
        flush()
        return blocks

    def words(self, element):
        inside = "".join(element.itertext())
        if element.tag == "computeroutput":
            target = (self.known if not inside.startswith("jostle_") else c_places).get(inside)
            return f"[`{inside}`]({target})" if target else f"`{inside}`"
        if element.tag in ("bold", "emphasis"):
            mark = "**" if element.tag == "bold" else "*"
            return mark + plain(inside) + mark
        if element.tag in ("sp", "nonbreakablespace"):
            return " "
        if element.tag in ("ndash", "mdash"):
            return "--" if element.tag == "ndash" else "---"
        return plain(inside)


class Declared:
    """A member: its lines in the source, and what its comment says."""

    def __init__(self, header, member):
        self.name, self.kind, self.line = member.findtext("name"), member.get("kind"), line_of(member)
        self.text = header.described(member)
        location = member.find("location")
        self.first = header.start(self.line)
        if self.kind == "enum":
            self.last = int(location.get("bodyend"))
            self.code = header.lines[self.first:self.last]
            return
        self.last, depth, code = self.first, 0, []
        while self.last < len(header.lines):
            line = header.lines[self.last]
            self.last += 1
            end = None
            for at, letter in enumerate(re.sub(r"//.*", "", line)):
                body = self.kind == "function" and depth == 0 and (
                    letter == "{" and "operator" not in line[:at][-12:] or letter == ":" and line[at - 1:at + 2] == " : ")
                if body or letter == ";" and depth == 0:
                    end = at
                    break
                depth += {"(": 1, "[": 1, "{": 1, ")": -1, "]": -1, "}": -1}.get(letter, 0)
            if end is not None:
                code.append(line[:end].rstrip() + ";" if line[:end].strip() else "")
                self.skip_body(header.lines, line, end)
                break
            code.append(line)
        while code and not code[-1]:
            code.pop()
            code[-1] += ";"
        self.code = code

    def skip_body(self, lines, line, end):
        """`last` goes to the line behind the body of an inline function."""
        depth = 0
        rest = line[end:]
        if rest.startswith(";"):
            return
        while True:
            for letter in re.sub(r'//.*|"(\\.|[^"])*"', "", rest):
                depth += {"{": 1, "}": -1}.get(letter, 0)
            if depth == 0 and "}" in rest or self.last >= len(lines):
                return
            rest = lines[self.last]
            self.last += 1


def slug_of(title):
    """As pages.py makes anchors of headings."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def name_of(type):
    """A class is known by its name, also one that is there for some template arguments only."""
    return type.findtext("compoundname").removeprefix("jostle::").split("<")[0].strip()


def line_of(element):
    return int(element.find("location").get("line"))


def plain(text):
    """Text that Markdown shows as it is; pages of the guide and names of headers become links."""
    text = re.sub(r"([\\`*\[\]|])", r"\\\1", text).replace("<", "&lt;").replace(">", "&gt;")
    text = re.sub(r"(?<![\w/])\w+\.h(?:pp)?\b",
                  lambda match: f"[{match[0]}](include/jostle/{match[0]})" if match[0] in header_names else match[0], text)
    text = re.sub(r"(?<![\w/`.])jostle_\w+", lambda match: f"[{match[0]}]({c_places[match[0]]})" if match[0] in c_places else match[0], text)
    return re.sub(r"(docs/[\w/-]+|CHANGELOG)\.md", r"[\g<0>](\g<0>)", text)
