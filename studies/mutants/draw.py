"""Draws a random sample of mutants with the operators of cosmic-ray, of the extra ``mutation``.

First a place is drawn, each as probable, then one of the replacements there.
"""

import difflib
from collections import defaultdict
from collections.abc import Iterator
from random import Random
from typing import Any

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators.provider import OperatorProvider

from studies.mutants.command import FOLDERS
from studies.mutants.run import ROOT, Mutant, write_sample

# Replacements by these raise TypeError with any float, or are the same as others: cheap mutants, which say nothing.
SILLY = frozenset({"RShift", "LShift", "Mod", "FloorDiv", "Is", "IsNot", "Invert", "UAdd", "USub_Not"})
# Operators here are no arithmetic: types, stars.
NO_ARITHMETIC = ("annassign", "tfpdef", "param", "parameters", "dictorsetmaker", "funcdef")


def _find_replacements(text: str) -> Iterator[tuple[tuple[int, int], str, int]]:
    """Lists place, operator and occurrence of everything worth replacing that cosmic-ray can replace in a module."""
    nodes, provider = list(ast_nodes(get_ast(text))), OperatorProvider()
    for name in provider:
        operator = provider[name]
        if not operator.arguments() and _is_worth_it(name):
            found = [(node, place) for node in nodes for place, _ in operator().mutation_positions(node)]
            for occurrence, (node, place) in enumerate(found):
                if "Binary" not in name or _is_arithmetic(node):
                    yield place, name, occurrence


def _is_worth_it(operator: str) -> bool:
    if "_" not in operator:
        return True
    _, *old, new = operator.split("_")
    if {*old, new} == {"Is", "IsNot"}:
        return True
    if (new.startswith("Bit")) != ("".join(old).startswith("Bit")):
        return False
    return not {new, "_".join([*old, new])} & SILLY


def _is_arithmetic(node: Any) -> bool:
    while (node := node.parent) is not None and node.type not in ("simple_stmt", "suite"):
        if node.type in NO_ARITHMETIC:
            return False
    return True


def draw(number: int, seed: int) -> list[Mutant]:
    """Draws places without replacement, each as probable, and a replacement for each."""
    places = defaultdict(list)
    texts = {
        path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
        for folder in FOLDERS
        for path in (ROOT / ("" if folder.startswith("studies/") else "affordance") / folder).glob("*.py")
    }
    for module, text in sorted(texts.items()):
        for place, name, occurrence in _find_replacements(text):
            places[module, place].append((name, occurrence))
    random, sample = Random(seed), []
    for module, place in random.sample(sorted(places), len(places)):
        name, occurrence = random.choice(places[module, place])
        old = texts[module].splitlines(keepends=True)
        changed = mutate_code(texts[module], OperatorProvider()[name](), occurrence)
        new = changed.splitlines(keepends=True)
        blocks = difflib.SequenceMatcher(a=old, b=new, autojunk=False).get_opcodes()
        changes = [block[1:] for block in blocks if block[0] != "equal"]
        if len(changes) != 1 or not _compiles(changed):
            continue
        ((start, end, begin, stop),) = changes
        before, after = "".join(old[start:end]), "".join(new[begin:stop])
        where = {"module": module, "line": start + 1, "operator": name, "occurrence": occurrence}
        sample.append({**where, "before": before, "after": after})
        if len(sample) == number:
            break
    return sorted(sample, key=lambda mutant: (mutant["module"], mutant["line"]))


def _compiles(text: str) -> bool:
    try:
        compile(text, "mutant", "exec")
    except SyntaxError:
        return False
    return True


def replace_sample(number: int, seed: int) -> int:
    """Draws a sample and writes it in place of the last; returns exit status 0."""
    write_sample(seed, draw(number, seed))
    return 0
