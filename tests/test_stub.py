"""The stub of the native module, which editors read."""

import ast

from support.stub import STUB, documented


def test_it_tells_what_the_module_tells():
    """Run ``python -m support.stub`` from tests/ if it does not."""
    for node, told in documented(ast.parse(STUB.read_text(encoding="utf-8"))):
        assert ast.get_docstring(node) == told, node.name
