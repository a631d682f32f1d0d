"""Small changes of a program, found in its syntax tree."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from pathlib import Path
from typing import Final

_SIGNS: Final[dict[type[ast.cmpop], tuple[str, str]]] = {
    ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="),
    ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
}
"""Each comparison as it is written, and as a mutant has it."""
_OPERATORS: Final[dict[type[ast.operator], str]] = {
    ast.Add: "-",
    ast.Sub: "+",
    ast.Mult: "+",
    ast.Div: "*",
    ast.FloorDiv: "*",
    ast.Mod: "*",
    ast.LShift: ">>",
    ast.RShift: "<<",
    ast.BitAnd: "|",
    ast.BitOr: "&",
    ast.BitXor: "|",
}


@dataclass(frozen=True, slots=True)
class Mutant:
    """``new`` in place of ``old`` at ``begin`` of a file (in bytes). ``statement``: the first line of the
    statement that has it."""

    path: Path
    statement: int
    line: int
    begin: int
    old: str
    new: str

    def __str__(self) -> str:
        old, new = (" ".join(text.split()) for text in (self.old, self.new))
        return f"{self.path}:{self.line}: {old}  ->  {new}"

    def applied(self, source: bytes) -> bytes:
        return source[: self.begin] + self.new.encode() + source[self.begin + len(self.old.encode()) :]


class _Finder(ast.NodeVisitor):
    """Changes of one file. What is only said (messages, annotations, decorators) is left alone."""

    def __init__(self, path: Path, source: str) -> None:
        self.found: list[Mutant] = []
        self._path = path
        self._source = source
        self._statement = 0
        self._starts = [0]
        for text in source.encode().splitlines(keepends=True):
            self._starts.append(self._starts[-1] + len(text))

    def _change(self, node: ast.expr | ast.stmt, new: str) -> None:
        old = ast.get_source_segment(self._source, node)
        assert old is not None
        begin = self._starts[node.lineno - 1] + node.col_offset
        self.found.append(Mutant(self._path, self._statement, node.lineno, begin, old, new))

    def visit(self, node: ast.AST) -> None:
        if isinstance(node, ast.stmt):
            self._statement = node.lineno
        super().visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        for place, operator in enumerate(node.ops):
            operands = [node.left, *node.comparators]
            signs = [_SIGNS[type(each)][0] for each in node.ops]
            signs[place] = _SIGNS[type(operator)][1]
            texts = [ast.unparse(operand) for operand in operands]
            parts = [texts[0], *(f"{sign} {text}" for sign, text in zip(signs, texts[1:], strict=True))]
            self._change(node, f"({' '.join(parts)})")
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        sign = " or " if isinstance(node.op, ast.And) else " and "
        self._change(node, f"({sign.join(f'({ast.unparse(value)})' for value in node.values)})")
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        sign = _OPERATORS.get(type(node.op))
        is_text = any(isinstance(side, ast.JoinedStr) or _is_text(side) for side in (node.left, node.right))
        if sign and not is_text:
            self._change(node, f"(({ast.unparse(node.left)}) {sign} ({ast.unparse(node.right)}))")
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, ast.Not):
            self._change(node, f"({ast.unparse(node.operand)})")
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        sign = _OPERATORS.get(type(node.op))
        if sign:
            self._change(node, f"{ast.unparse(node.target)} {sign}= {ast.unparse(node.value)}")
        self.generic_visit(node)

    def visit_IfExp(self, node: ast.IfExp) -> None:
        self._change(
            node, f"({ast.unparse(node.orelse)} if {ast.unparse(node.test)} else {ast.unparse(node.body)})"
        )
        self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        if isinstance(node.value, bool):
            self._change(node, str(not node.value))
        elif isinstance(node.value, int | float):
            self._change(node, repr(node.value + 1))

    def visit_Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Call) and not _is_told(node.value):
            self._change(node, "pass")
        self.generic_visit(node)

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """A text: what it says is not changed."""

    def visit_Assert(self, node: ast.Assert) -> None:
        """For the type checker, or for whoever programs."""

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value:
            self.visit(node.value)

    def visit_FunctionDef(self, node: ast.FunctionDef | ast.AsyncFunctionDef) -> None:
        for part in [*node.args.defaults, *(one for one in node.args.kw_defaults if one), *node.body]:
            self.visit(part)

    visit_AsyncFunctionDef = visit_FunctionDef

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        for part in node.body:
            self.visit(part)


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _is_told(call: ast.Call) -> bool:
    """A line of the log."""
    return isinstance(call.func, ast.Attribute) and call.func.attr in ("debug", "info", "warning", "error")


def find(path: Path, source: str) -> list[Mutant]:
    finder = _Finder(path, source)
    finder.visit(ast.parse(source))
    return finder.found
