"""``safemanip rule``."""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from pytest_safemanip.cli.folder import read_folder
from pytest_safemanip.cli.tables import print_wrapped
from pytest_safemanip.errors import ConfigError
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.resources import folder
from pytest_safemanip.run.cases import applicable
from pytest_safemanip.run.definitions import Definitions
from pytest_safemanip.sentences.drafting import draft
from pytest_safemanip.sentences.grammar import EXAMPLES, Rule, read_sentence
from pytest_safemanip.sentences.lexicon import Lexicon
from pytest_safemanip.sentences.traces import LONGEST, Examples, examples
from pytest_safemanip.spec.objects import load_attributes
from pytest_safemanip.spec.properties import Property, load_property

EXAMPLE = 'safemanip rule "after touching raw meat do not touch the salad until washed"'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    forms = "; ".join(EXAMPLES)
    parser.add_argument("sentence", metavar="SENTENCE", help=f"in quotes, one of: {forms}")
    parser.add_argument("--id", default="", help="the property's id; by default of the sentence")
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="write the property there, too"
    )


def run(options: argparse.Namespace) -> int:
    """Print the property, and traces that keep to it and that do not."""
    found = read_folder().definitions
    attributes = load_attributes(folder("tasks") / "objects.yaml")
    rule = read_sentence(options.sentence, Lexicon(attributes, found.catalogue))
    arguments = {name: proposition.arguments for name, proposition in found.catalogue.items()}
    text = draft(options.sentence, rule, arguments, options.id)
    prop = _checked(text, found.catalogue)
    if options.output and prop.id in found.properties:
        place = found.properties[prop.id].path
        raise ConfigError(f"property {prop.id!r} is in {place} already; give another with --id")
    print(text)
    print_wrapped(f"formula: {prop.formula}", "  ")
    _print_caveats(rule, prop, found)
    _print_examples(examples(prop))
    if options.output:
        _write(options.output, text)
    return 0


def _checked(text: str, known: Catalogue) -> Property:
    """The property that the text is, read as any other."""
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "rule.yaml"
        path.write_text(text)
        try:
            prop = load_property(path, propositions=known)
            prop.check()
        except ConfigError as error:
            raise ConfigError(str(error).replace(f"{path}:", "the rule, line ")) from error
    return prop


def _print_caveats(rule: Rule, prop: Property, found: Definitions) -> None:
    """What the property asks beside what the sentence may have meant."""
    every = found.unstaged
    tasks = [name for name in every if _applies(prop, found, name)]
    print_wrapped(f"applies to {len(tasks)} of {len(every)} tasks")
    unknown = [n for n, clause in rule.nouns.items() if not clause or clause not in prop.for_each]
    if unknown and prop.ranges:
        named = ", ".join(map(repr, unknown))
        print_wrapped(
            f"{named}: propositions know kinds of things and not names; it is judged for every "
            f"{prop.for_each} of a task"
        )


def _applies(prop: Property, found: Definitions, task: str) -> bool:
    return bool(applicable(found.tasks[task], {prop.id: prop}, {prop.id}))


def _print_examples(shown: Examples) -> None:
    other = "breaks it" if shown.decided else "leaves it open, for want of within N s"
    for title, traces in (("keeps to it", shown.kept), (other, shown.broken)):
        print(f"\n{title}, a step is {shown.dt:g} s:")
        if not traces:
            print(f"  no trace of at most {LONGEST} steps")
        for trace in traces:
            steps = [" + ".join(sorted(step)) or "-" for step in trace]
            print_wrapped("  " + "  >  ".join(steps), "      ")


def _write(path: Path, text: str) -> None:
    if path.suffix != ".yaml":
        raise ConfigError(f"--output {path}: expected a file that ends in .yaml")
    if path.exists():
        raise ConfigError(f"--output {path}: exists; a rule is not written over")
    path.write_text(text)
    print(f"\n{path}")
