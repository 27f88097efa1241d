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


def mutants(module: str, source: str) -> list[Mutant]:
    """All that the operators make of a module, each once."""
    tree, found = get_ast(source), dict[str, Mutant]()
    for name in operator_names():
        short = name.rpartition("/")[2]
        if not MEANT.fullmatch(short):
            continue
        operator = get_operator(name)()
        for number in range(sum(len(list(operator.mutation_positions(node))) for node in ast_nodes(tree))):
            mutated = mutate_code(source, operator, number)
            if mutated is not None and mutated != source:
                found.setdefault(mutated, Mutant(module, short, *difference(source, mutated), mutated))
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


def sample(every: list[Mutant], most: int, seed: int) -> list[Mutant]:
    """At most so many of them, chosen at random, in the order of their lines."""
    if len(every) <= most:
        return every
    chosen = random.Random(seed).sample(range(len(every)), most)
    return [every[i] for i in sorted(chosen)]
