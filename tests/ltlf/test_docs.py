from __future__ import annotations

import doctest
import re
from pathlib import Path

DOCS = Path(__file__).resolve().parents[2] / "docs" / "ltlf.md"


def test_every_snippet_does_what_is_shown():
    blocks = re.findall(r"^```python\n(.*?)^```", DOCS.read_text(), re.M | re.S)
    assert len(blocks) >= 5
    example = doctest.DocTestParser().get_doctest("".join(blocks), {}, DOCS.name, str(DOCS), 0)
    failures = []
    doctest.DocTestRunner().run(example, out=failures.append)
    assert not failures, "".join(failures)
