#!/usr/bin/env python3
"""Put the report of a study into a repository: the Markdown page, results.json, and the figures and pictures that the page shows.

Usage: publish_study.py OUT docs

OUT is the folder of `lookalike study ... --out OUT`. Writes docs/results.md, docs/results.json and docs/results/ (emptied first), and makes the
page's links point there. Nothing is typed: the page is the one that the study wrote.
"""
import re
import shutil
import sys
from pathlib import Path


def main() -> None:
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    study, docs = Path(sys.argv[1]), Path(sys.argv[2])
    page = (study / "results.md").read_text()
    folder = docs / "results"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    linked = sorted(set(re.findall(r"\]\(((?:figures|pictures)/[^)]+)\)", page)))
    linked += sorted(set(re.findall(r'src="((?:figures|pictures)/[^"]+)"', page)))
    for link in linked:
        source = study / link
        if not source.exists():
            sys.exit(f"{source}: the page shows it, but it is not there")
        target = folder / link.replace("/", "-")
        shutil.copyfile(source, target)
        for opening, closing in (("](", ")"), ('src="', '"')):
            page = page.replace(f"{opening}{link}{closing}", f"{opening}results/{target.name}{closing}")
    (docs / "results.md").write_text(page)
    shutil.copyfile(study / "results.json", docs / "results.json")
    print(f"{docs / 'results.md'}: {len(linked)} figures and pictures")


if __name__ == "__main__":
    main()
