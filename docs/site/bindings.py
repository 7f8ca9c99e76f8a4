# SPDX-License-Identifier: MIT
"""The references of Python and JavaScript, from the package's docstrings and from the comments of jostle.d.ts.

There is a page for each module of Python's package, and for each part of jostle.d.ts; members follow their class.
Signatures are shown as in the source. Nothing is imported or run: Python's own parser reads Python, and jostle.d.ts is
read in the layout that prettier gives it.
"""
import ast
import re
import textwrap


def pages(root):
    """The name on the site and the text of each page, by its place in the repository."""
    return python(root) | javascript(root)


class Entry:
    """A function, class or type: its name, its code, what is said about it, and the same for what it has."""

    def __init__(self, name, code, text, members=()):
        self.name, self.code, self.text, self.members = name, code, text, list(members)

    def functions(self):
        return sum("(" in member.code for member in self.members)

    def page(self, language, known, level="##", within=""):
        path = f"{within}.{self.name}" if within else self.name
        head = f"{level} {path}" + (f" {{: #{self.name} }}" if not within else "")
        parts = [head.replace("__", "\\_\\_") if within else head, f"```{language}\n{self.code}\n```", *markdown(self.text, language, known)]
        for member in self.members:
            parts += member.page(language, known, level + "#", path)
        return parts


def write(language, folder, first, about, parts):
    """Pages of the parts (place, file's name, title, what it is, entries), and the one that lists them, `first`."""
    for _, _, _, _, entries in parts: # what a page is there for comes first
        main = max(entries, key=Entry.functions)
        entries.sort(key=lambda entry: (entry is not main or main.functions() < 3, language == "typescript" and " function " not in entry.code))
    known = {entry.name: f"{place}#{entry.name}" for place, _, _, _, entries in parts for entry in entries}
    result, rows = {}, ["| part | has |", "|---|---|"]
    for place, name, title, text, entries in parts:
        links = ", ".join(f"[`{entry.name}`]({known[entry.name]})" for entry in entries)
        rows.append(f"| [{title}]({place}) | {links} |")
        lines = [f"# {title}", *markdown(text, language, known)]
        for entry in entries:
            lines += entry.page(language, known)
        result[place] = f"reference/{folder}/{name}.md", "\n\n".join(lines) + "\n"
    place, title = first
    result[place] = f"reference/{folder}/index.md", "\n\n".join([f"# {title}", *markdown(about, language, known), "\n".join(rows)]) + "\n"
    return result


# --- Comments ---

def markdown(text, language, known):
    """Blocks of Markdown: paragraphs, code, which is indented by four, and lists, of which a line is `Term   text`."""
    blocks = []
    for block in re.split(r"\n\s*\n", textwrap.dedent(text.expandtabs()).strip("\n")):
        lines = block.rstrip().split("\n")
        if not block.strip():
            continue
        if all(line.startswith("    ") for line in lines):
            blocks.append(f"```{language}\n{textwrap.dedent(block)}\n```")
            continue
        while lines: # a list may follow right behind a paragraph
            found = items(lines)
            length = len(lines) if found else next((at for at in range(1, len(lines)) if items(lines[at:])), len(lines))
            if found:
                blocks.append("\n".join(f"{deeper}- **{plain(term, known)}**: {plain(said, known)}" for deeper, term, said in found))
            else:
                blocks.append(plain(" ".join(line.strip() for line in lines[:length]), known))
            lines = lines[length:]
    return blocks


def items(lines):
    """Terms and what is said of them, if the lines are such a list: all texts begin in one column. Terms may be indented."""
    start = re.match(r"\S+(?: \S+){0,4}?  +(?=\S)", lines[0])
    if not start:
        return []
    found, column = [], start.end()
    for line in lines:
        if line[:column].strip() and line[column - 1:column] == " ":
            found.append(["    " * line.startswith(" "), line[:column].strip(), line[column:].strip()])
        elif found and not line[:column].strip():
            found[-1][2] += " " + line.strip()
        elif found and (longer := re.match(r"(\S[\w, ]*?)  +(\S.*)", line)): # a term that reaches beyond the column
            found.append(["", longer[1], longer[2]])
        else:
            return []
    return found


def plain(text, known):
    """Text that Markdown shows as it is; names in backquotes that have a place are links to it."""
    parts = []
    for part in re.split(r"(`[^`]+`)", text):
        if part.startswith("`") and len(part) > 1:
            target = known.get(part[1:-1].removeprefix("jostle.").partition("(")[0])
            parts.append(f"[{part}]({target})" if target else part)
        else:
            part = re.sub(r"([\\`*_\[\]|])", r"\\\1", part).replace("<", "&lt;").replace(">", "&gt;")
            parts.append(re.sub(r"docs/[\w/-]+\.md", lambda link: f"[{link[0]}]({link[0]})", part))
    return "".join(parts)


# --- Python ---

def python(root):
    folder = root / "extras/python/jostle"
    init = ast.parse((folder / "__init__.py").read_text())
    core = {node.name: node for node in ast.parse((folder / "_core.pyi").read_text()).body if hasattr(node, "name")}
    parts = []
    for wanted in init.body:
        if not isinstance(wanted, ast.ImportFrom) or wanted.level != 1:
            continue
        names = [alias.name for alias in wanted.names]
        for module in [wanted.module] if wanted.module else names: # `from . import ase` is a whole module
            file = folder / f"{module}.py"
            if module == "_core":
                file, title = folder / "_core.pyi", "Build"
            else:
                title = module.strip("_").replace("_", " ").capitalize() if module.startswith("_") else f"jostle.{module}"
            tree = ast.parse(file.read_text())
            entries = []
            for node in tree.body:
                if isinstance(node, ast.Assign) and ast.unparse(node.value).startswith("_core."):
                    node = core[ast.unparse(node.value).removeprefix("_core.")] # a class of the compiled part
                own = getattr(node, "name", "_")
                if own in names if wanted.module else not own.startswith("_"):
                    entries.append(python_entry(node))
            name = "box_index" if module == "_index" else module.strip("_") # the list of all has the other name
            parts.append((f"extras/python/jostle/{file.name}", name, title, ast.get_docstring(tree) or "", entries))
    return write("python", "python", ("extras/python/jostle/__init__.py", "Python"), ast.get_docstring(init), parts)


def python_entry(node, method=False):
    about = ast.get_docstring(node) or ""
    if isinstance(node, ast.FunctionDef):
        return Entry(node.name, signature(node, f"def {node.name}", method), about)
    members = [member for member in node.body if isinstance(member, ast.FunctionDef)]
    made = next((member for member in members if member.name == "__init__"), None)
    fields = [ast.unparse(member) for member in node.body if isinstance(member, ast.AnnAssign) and not ast.unparse(member).startswith("_")]
    bases = f"({', '.join(map(ast.unparse, node.bases))})" if node.bases else ""
    code = signature(made, f"class {node.name}", True, False) if made and not fields else f"class {node.name}{bases}"
    shown = [member for member in members if not member.name.startswith("_") or
             member.name != "__init__" and member.name.startswith("__") and ast.get_docstring(member)]
    about += "\n\n" + (ast.get_docstring(made) or "") if made else ""
    return Entry(node.name, "\n    ".join([code + (":" if fields else ""), *fields]), about, [python_entry(each, True) for each in shown])


def signature(node, begin, method, returns=True):
    decorators = "".join(f"@{ast.unparse(each)}\n" for each in node.decorator_list)
    for argument in [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]:
        if argument.annotation and ast.unparse(argument.annotation) == "Any": # says nothing
            argument.annotation = None
    if method and "@staticmethod" not in decorators:
        del node.args.args[0] # self, or a class
    arguments = ast.unparse(node.args)
    end = f") -> {ast.unparse(node.returns)}" if node.returns and returns else ")"
    line = f"{begin}({arguments}{end}"
    if len(line) > 84:
        together = re.sub(r"(?<!,) |(?<=[\[(])[^\])]*(?=[\])])", lambda part: part[0].replace(" ", "\0"), arguments) # breaks only between them
        line = f"{begin}(\n    " + "\n    ".join(textwrap.wrap(together, 80)).replace("\0", " ") + f"\n{end}"
    return decorators + line


# --- JavaScript ---

def javascript(root):
    place = "extras/js/jostle.d.ts"
    sections = re.split(r"^// --- (.*?) -+\n", (root / place).read_text(), flags=re.MULTILINE)
    about, first = javascript_entries(sections[0])
    parts = [(f"{place}/loading", "loading", "Loading, files", "", first)]
    for title, text in zip(sections[1::2], sections[2::2]):
        name = re.sub(r"\W+", "-", title.lower())
        parts.append((f"{place}/{name}", name, title, "", javascript_entries(text)[1]))
    for name in ("rbush", "flatbush"):
        text, entries = javascript_entries((root / f"extras/js/{name}.d.ts").read_text())
        parts.append((f"extras/js/{name}.d.ts", name, f"jostle/{name}", text, entries))
    return write("typescript", "javascript", (place, "JavaScript and TypeScript"), about, parts)


def javascript_entries(text, inside=False):
    """What a file begins with, and its declarations; or those of a class."""
    about, entries, comment = "", [], None
    lines = textwrap.dedent(text).split("\n")
    at = 0
    while at < len(lines):
        begin = at
        line = lines[at]
        at += 1
        if line.startswith("/**"):
            while "*/" not in lines[at - 1]:
                at += 1
            if comment is not None and not entries:
                about = comment
            comment = "\n".join(re.sub(r"^ ?\*/?|^/\*\*|\*/$", "", each).removeprefix(" ") for each in lines[begin:at])
            if not entries and not about and not inside and at < len(lines) and not lines[at]:
                about, comment = comment, None
            continue
        if not line.strip() or line.startswith(("//", "}")):
            continue
        depth = 0
        while True: # to the end of the declaration
            code = re.sub(r"//.*|/\*.*?\*/", "", lines[at - 1]) if not lines[at - 1].lstrip().startswith(("*", "/*")) else ""
            depth += sum({"{": 1, "(": 1, "}": -1, ")": -1}.get(letter, 0) for letter in code)
            if depth <= 0 and code.rstrip().endswith((";", "}")) or at == len(lines):
                break
            at += 1
        entry = javascript_entry(lines[begin:at], comment or "", inside)
        if entry and entries and not comment and (entries[-1].name == entry.name or inside and begin and lines[begin - 1]):
            entries[-1].code += "\n" + entry.code # one comment is about all of them
        elif entry:
            entries.append(entry)
        comment = None
    return about, entries


def javascript_entry(lines, comment, inside):
    code = "\n".join(lines)
    if inside:
        return Entry(re.match(r"(?:readonly )?(?:new )?(\[[\w.]+\]|\w+)?", code)[1] or "new", code, comment)
    named = re.match(r"export (?:declare )?(?:class|interface|type|const|function) (\w+)", code)
    if not named:
        return None
    body = re.match(r"(export (?:class|interface) .*?\{)\n(.*)\n\}$", code, re.DOTALL)
    if not body or not re.search(r"^  [\w\[\].]+\??(<.*>)?\(", body[2], re.MULTILINE):
        code = re.sub(r"^( *)/\*\*(.*?)\*/", lambda each: textwrap.fill(re.sub(r"\s+(\* )?", " ", each[2]).strip(), 84, initial_indent=each[1] + "// ",
                                                                       subsequent_indent=each[1] + "// "), code, flags=re.DOTALL | re.MULTILINE)
        return Entry(named[1], code, comment) # data alone: whole, with the comments in it
    return Entry(named[1], body[1] + " ... }", comment, javascript_entries(body[2], True)[1])
