"""Texts of the bridge's modules, by their source, with samples for what is filled in.

A text is a string with a space, or whatever is given to a call that says something. Names that are assigned
texts within a function, and functions that return texts, are followed: what they fill in is part of others.
"""

from __future__ import annotations

import ast
import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeGuard

WORD: Final = "7Xq"
"""Stands for a name or a number."""
WORDS: Final = "Zq zq"
"""Stands for a text that is made elsewhere."""
_SAYS: Final = re.compile(
    "Outcome|Refusal|Step|Lack|StopTime|ResetCommunication|(Boot|Mapping|Parameter|Value)Error|OperationFailed"
    "|_?tell|say|_no"
)
_UNSAID: Final = re.compile("(Assertion|Runtime|NotImplemented)Error|BadMessage|Field|Term")
"""Calls that tell programmers, a log or nobody, beside those of loggers."""
_SENTENCE: Final = re.compile(".*(why|reason|error|what|said|text|message|how|sign|failure|detail)_*")
"""Names of values that are sentences."""
_MOST: Final = 48
_DEEPEST: Final = 4


@dataclass(frozen=True, slots=True)
class Text:
    """One way in which a text of line ``line`` may read."""

    line: int
    sample: str


def texts_of(path: Path) -> list[Text]:
    return _Module(ast.parse(path.read_text(encoding="utf-8"))).texts()


class _Module:
    def __init__(self, tree: ast.Module) -> None:
        self._tree = tree
        self._functions: dict[str, list[ast.FunctionDef]] = {}
        self._function_of: dict[ast.AST, ast.AST] = {}
        self._consumed: set[ast.AST] = set()
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                self._functions.setdefault(node.name, []).append(node)
        self._place(tree, tree)

    def _place(self, node: ast.AST, function: ast.AST) -> None:
        for child in ast.iter_child_nodes(node):
            self._function_of[child] = function
            self._place(child, child if isinstance(child, ast.FunctionDef) else function)

    def texts(self) -> list[Text]:
        found: dict[ast.AST, list[str]] = {}
        for node in self._roots():
            found[node] = self._render(node, 0)
        texts = [
            Text(getattr(node, "lineno", 0), sample)
            for node, samples in found.items()
            if node not in self._consumed
            for sample in dict.fromkeys(samples)
        ]
        return sorted(texts, key=lambda text: text.line)

    def _roots(self) -> Iterator[ast.AST]:
        """Each text that is part of no other one."""
        inside: set[ast.AST] = set()
        said = {id(one) for one in self._said()}
        for node in ast.walk(self._tree):
            match node:
                case ast.Expr(value=ast.Constant()):
                    inside.add(node.value)
                case ast.JoinedStr() | ast.BinOp():
                    inside.update(one for one in ast.walk(node) if one is not node)
                case ast.Call(func=ast.Name(id=name)) if _UNSAID.fullmatch(name):
                    inside.update(ast.walk(node))
                case ast.Call(func=ast.Attribute(value=ast.Name(id="_log"))):
                    inside.update(ast.walk(node))
                case ast.Dict():
                    inside.update(key for key in node.keys if key)
                case ast.Compare() | ast.Subscript():
                    inside.update(one for one in ast.walk(node) if isinstance(one, ast.Constant))
                case _:
                    pass
            if node in inside:
                continue
            is_made = isinstance(node, ast.JoinedStr | ast.BinOp) and _has_text(node)
            if is_made or (_is_whole(node) and (" " in node.value.strip() or id(node) in said)):
                yield node

    def _said(self) -> Iterator[ast.AST]:
        for node in ast.walk(self._tree):
            if isinstance(node, ast.Call) and _SAYS.fullmatch(_name(node.func)):
                yield from node.args

    def _render(self, node: ast.AST, depth: int) -> list[str]:
        return list(itertools.islice(self._ways(node, depth), _MOST))

    def _ways(self, node: ast.AST, depth: int) -> Iterator[str]:
        match node:
            case ast.Constant(value=str(text)):
                yield text
            case ast.Constant(value=value):
                yield str(value)
            case ast.JoinedStr(values=parts):
                yield from self._joined(parts, depth)
            case ast.BinOp(left=left, op=ast.Add(), right=right):
                yield from self._joined([left, right], depth)
            case ast.FormattedValue(value=value, format_spec=spec):
                yield from [WORD] if spec else self._ways(value, depth)
            case ast.IfExp(body=body, orelse=other):
                yield from self._render(body, depth)
                yield from self._render(other, depth)
            case ast.BoolOp(values=values):
                for value in values:
                    yield from self._render(value, depth)
            case ast.Name(id=name) if (found := self._assigned(node, name)) and depth < _DEEPEST:
                for value in found:
                    yield from self._taken(value, depth)
            case ast.Subscript(value=ast.Name(id=name)) if found := self._listed(name):
                for value in found:
                    yield from self._taken(value, depth)
            case ast.Call(func=ast.Attribute(value=value, attr="rstrip" | "strip" | "removeprefix")):
                yield from self._ways(value, depth)
            case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name)) if depth < _DEEPEST:
                returned = list(self._returned(name))
                for value in returned:
                    yield from self._taken(value, depth)
                if not returned:
                    yield _sample(node)
            case _:
                yield _sample(node)

    def _taken(self, node: ast.AST, depth: int) -> list[str]:
        self._consumed.update(ast.walk(node))
        return self._render(node, depth + 1)

    def _joined(self, parts: Sequence[ast.AST], depth: int) -> Iterator[str]:
        ways = [self._render(part, depth) for part in parts]
        for each in itertools.islice(itertools.product(*ways), _MOST):
            yield "".join(each)

    def _assigned(self, node: ast.AST, name: str) -> list[ast.AST]:
        """The texts that ``name`` may have in the function of ``node``, without those that are made of it."""
        function = self._function_of.get(node)
        return [
            one.value
            for one in ast.walk(function or node)
            if isinstance(one, ast.Assign)
            and any(isinstance(target, ast.Name) and target.id == name for target in one.targets)
            and _is_text(one.value)
            and not any(isinstance(inner, ast.Name) and inner.id == name for inner in ast.walk(one.value))
        ]

    def _listed(self, name: str) -> list[ast.AST]:
        """The texts in the module's table ``name``."""
        return [
            value
            for one in self._tree.body
            if isinstance(one, ast.AnnAssign) and isinstance(one.target, ast.Name) and one.target.id == name
            if isinstance(one.value, ast.Dict)
            for value in one.value.values
            if _is_text(value)
        ]

    def _returned(self, name: str) -> Iterator[ast.AST]:
        """The texts that the module's functions of this name return, where they return nothing but texts."""
        for function in self._functions.get(name, ()):
            returns = [one.value for one in ast.walk(function) if isinstance(one, ast.Return) and one.value]
            if returns and all(_is_text(value) for value in returns):
                yield from returns


def _is_text(node: ast.AST) -> bool:
    match node:
        case ast.Constant(value=str()) | ast.JoinedStr():
            return True
        case ast.IfExp(body=body, orelse=other):
            return _is_text(body) or _is_text(other)
        case ast.BinOp(left=left, op=ast.Add()):
            return _is_text(left)
        case ast.BoolOp(values=values):
            return any(_is_text(value) for value in values)
        case _:
            return False


def _has_text(node: ast.AST) -> bool:
    return any(isinstance(one, ast.Constant) and isinstance(one.value, str) for one in ast.walk(node))


def _is_whole(node: ast.AST) -> TypeGuard[ast.Constant]:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _name(node: ast.AST) -> str:
    return node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""


def _sample(node: ast.AST) -> str:
    """Sample for a value that is not known here."""
    if isinstance(node, ast.Call):
        if _name(node.func) == "str" and node.args:
            return _sample(node.args[0])
        node = node.func
    return WORDS if _SENTENCE.fullmatch(_name(node)) else WORD
