#!/usr/bin/env python3
"""Put the report of a study into a repository: the Markdown page, results.json, and the figures and pictures that the page shows.

Usage: publish_study.py OUT docs [NAME]

OUT is the folder of `lookalike study ... --out OUT`. Writes docs/NAME.md, docs/NAME.json and docs/NAME/ (emptied first), NAME being "results" if
left out, and makes the page's links point there. The page is the one that the study wrote; a note that was added to the previous page by hand, such
as that its figures are older than the program, is replaced with it.
"""
import re
import shutil
import sys
from pathlib import Path


def main() -> None:
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    study, docs = Path(sys.argv[1]), Path(sys.argv[2])
    name = sys.argv[3] if len(sys.argv) == 4 else "results"
    page = (study / "results.md").read_text()
    folder = docs / name
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
            page = page.replace(f"{opening}{link}{closing}", f"{opening}{name}/{target.name}{closing}")
    (docs / f"{name}.md").write_text(page)
    shutil.copyfile(study / "results.json", docs / f"{name}.json")
    print(f"{docs / name}.md: {len(linked)} figures and pictures")


if __name__ == "__main__":
    main()
