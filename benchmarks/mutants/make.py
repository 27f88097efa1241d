"""The mutants of a module: its source with one small mistake. Cosmic Ray's operators make them.

Left out are replacements that only fail to run (``-`` by ``<<``, ``==`` by ``is``): anything would kill them, and they
tell nothing. `make mutants` alone installs Cosmic Ray.
"""

import random
import re
from dataclasses import dataclass

from cosmic_ray.ast import ast_nodes, get_ast  # pyright: ignore[reportMissingImports]
from cosmic_ray.mutating import mutate_code  # pyright: ignore[reportMissingImports]
from cosmic_ray.plugins import get_operator, operator_names  # pyright: ignore[reportMissingImports]

_OF_NUMBERS = (
    "Add_Sub|Sub_Add|Mul_Div|Div_Mul|Mul_Add|FloorDiv_Mul|Mod_FloorDiv|Pow_Mul|BitAnd_BitOr|BitOr_BitAnd|BitXor_BitOr"
)
MEANT = re.compile(
    rf"ReplaceBinaryOperator_({_OF_NUMBERS})"
    r"|ReplaceComparisonOperator_(Lt|LtE|Gt|GtE|Eq|NotEq)_(Lt|LtE|Gt|GtE|Eq|NotEq)"
    r"|ReplaceComparisonOperator_(Is_IsNot|IsNot_Is)"
    r"|ReplaceUnaryOperator_(Delete_\w+|USub_UAdd)"
    r"|AddNot|Replace(TrueWithFalse|FalseWithTrue|AndWithOr|OrWithAnd|BreakWithContinue|ContinueWithBreak)"
    r"|NumberReplacer|ZeroIterationForLoop"
)
"""Which of its operators are used."""


@dataclass(frozen=True)
class Mutant:
    """was, becomes: the lines that differ, without what stands before and after them on their line."""

    module: str
    operator: str
    line: int
    was: str
    becomes: str
    source: str


def places(source: str) -> list[tuple[str, int]]:
    """Where mistakes can be made: an operator, and which of the spots in the source that it fits."""
    nodes = list(ast_nodes(get_ast(source)))
    meant = [name for name in operator_names() if MEANT.fullmatch(name.rpartition("/")[2])]
    count = {name: sum(len(list(get_operator(name)().mutation_positions(node))) for node in nodes) for name in meant}
    return [(name, number) for name in meant for number in range(count[name])]


def mutants(module: str, source: str, known: set[tuple[str, str, str]], most: int, seed: int) -> list[Mutant]:
    """At most so many of a module's, each once, chosen at random, in the order of their lines; none that is known.

    Only those that are chosen are made: making one parses the module anew.
    """
    found = dict[str, Mutant]()
    every = places(source)
    for name, number in random.Random(seed).sample(every, len(every)):
        mutated = mutate_code(source, get_operator(name)(), number)
        if mutated is not None and mutated != source and mutated not in found:
            one = Mutant(module, name.rpartition("/")[2], *difference(source, mutated), mutated)
            if (one.module, one.was, one.becomes) not in known:
                found[mutated] = one
        if len(found) == most:
            break
    return sorted(found.values(), key=lambda one: (one.line, one.becomes))


def difference(source: str, mutated: str) -> tuple[int, str, str]:
    """The number of the first line that differs; what differs before, and after."""
    before, after = source.splitlines(), mutated.splitlines()
    same = next(i for i, (a, b) in enumerate(zip(before, after, strict=False)) if a != b)
    behind = 0
    while before[-1 - behind] == after[-1 - behind] and behind < min(len(before), len(after)) - same - 1:
        behind += 1
    was, becomes = (" ".join(one.strip() for one in lines[same : len(lines) - behind]) for lines in (before, after))
    return same + 1, was, becomes
