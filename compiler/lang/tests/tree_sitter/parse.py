"""Reads paths of texts, a line each, from standard input and prints for each a line: `0` where the grammar reads all
of it and `1` where it does not, the first place that it does not read, how many places the colours find, and the units."""
import ctypes
import sys

import tree_sitter


def language(path):
    """The language in a shared library."""
    library = ctypes.cdll.LoadLibrary(path)
    library.tree_sitter_whip.restype = ctypes.c_void_p
    new = ctypes.pythonapi.PyCapsule_New
    new.restype, new.argtypes = ctypes.py_object, [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p]
    return tree_sitter.Language(new(library.tree_sitter_whip(), b"tree_sitter.Language", None))


def nodes(root):
    """All nodes, in the order of the text; texts may be nested deeper than Python calls."""
    waiting = [root]
    while waiting:
        node = waiting.pop()
        yield node
        waiting.extend(reversed(node.children))


whip = language(sys.argv[1])
parser = tree_sitter.Parser(whip)
colours = tree_sitter.Query(whip, open(sys.argv[2]).read())

for path in sys.stdin.read().splitlines():
    text = open(path, "rb").read()
    tree = parser.parse(text)
    wrong = next((n for n in nodes(tree.root_node) if n.is_error or n.is_missing), None)
    units = " ".join(n.text.decode() for n in nodes(tree.root_node) if n.type == "unit")
    place = f"{wrong.start_point[0] + 1}:{wrong.start_point[1] + 1}" if wrong else "-"
    coloured = sum(len(found) for found in tree_sitter.QueryCursor(colours).captures(tree.root_node).values())
    print(f"{int(tree.root_node.has_error)} {place} {coloured} {units}")
