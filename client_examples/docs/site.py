#!/usr/bin/env python3
"""Makes a static site of the project's pages, which stand beside the code they speak of.

usage: site.py FOLDER

FOLDER gets the site (FOLDER/index.html opens without a server): all Markdown pages and the files of the tree that they link to. Needs
mkdocs (Debian: mkdocs). The table of contents is in mkdocs.yml; a link that leads nowhere is an error.
"""
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
LINK = re.compile(r"(\[[^\]\n]*\]\()([^)\s]+)(\))")


def slug(title, _separator):
    """Anchor of a heading as on GitHub, which is what the links of the pages mean."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def pages():
    listed = subprocess.run(["git", "-C", ROOT, "ls-files", "--cached", "--others", "--exclude-standard", "*.md"],
                            capture_output=True, text=True)
    if listed.returncode == 0:
        return [Path(name) for name in listed.stdout.splitlines()]
    return [path.relative_to(ROOT) for path in ROOT.rglob("*.md")  # an unpacked archive
            if not {"node_modules", "build"} & set(path.relative_to(ROOT).parts)]


def stage(folder):
    """Copies the pages and what they link to; a folder that is linked to becomes its page, or a list of its files."""
    def mend(page, match):
        before, target, after = match.groups()
        path, _, place = target.partition("#")
        linked = (ROOT / page).parent / path
        if re.match(r"[a-z]+:", target) or not path or linked.suffix == ".md":
            return match[0]
        if linked.is_dir():
            return before + listing(folder, page, linked, path) + after
        copy = folder / linked.resolve().relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(linked, copy)
        return match[0]

    for page in pages():
        (folder / page).parent.mkdir(parents=True, exist_ok=True)
        text = (ROOT / page).read_text(encoding="utf-8")
        (folder / page).write_text(LINK.sub(lambda match, page=page: mend(page, match), text), encoding="utf-8")


def listing(folder, page, linked, path):
    """Name of the page of a folder, as `page` links to it."""
    own = linked / "README.md"
    if not own.exists():
        inside = folder / linked.resolve().relative_to(ROOT)
        inside.mkdir(parents=True, exist_ok=True)
        names = sorted(entry.name + ("/" if entry.is_dir() else "") for entry in linked.iterdir())
        (inside / "README.md").write_text(f"# {linked.resolve().relative_to(ROOT)}\n\n" + "".join(f"- `{name}`\n" for name in names),
                                          encoding="utf-8")
    return path.rstrip("/") + "/README.md"


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    try:
        from mkdocs import exceptions
        from mkdocs.commands.build import build
        from mkdocs.config import load_config
    except ImportError:
        sys.exit("site.py: there is no mkdocs; install Debian's package mkdocs and run this with /usr/bin/python3")
    with tempfile.TemporaryDirectory() as folder:
        stage(Path(folder))
        try:
            config = load_config(str(HERE / "mkdocs.yml"), docs_dir=folder, site_dir=str(Path(sys.argv[1]).resolve()), strict=True)
            config["mdx_configs"]["toc"] = {"slugify": slug}
            build(config)
        except exceptions.MkDocsException as error:
            sys.exit(f"site.py: {error}")


if __name__ == "__main__":
    main()
