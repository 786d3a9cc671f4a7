#!/usr/bin/env python3
"""Builds the pages as a site and follows every link of it; nothing of it is fetched from another host.

usage: site.py ROOT     (77: there is no mkdocs)
"""
import importlib.util
import subprocess
import sys
import tempfile
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """What a page links to, what it loads, and its anchors."""

    def __init__(self, path):
        super().__init__()
        self.links, self.loads, self.anchors = [], [], set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.anchors |= {given[key] for key in ("id", "name") if key in given}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        elif tag in ("link", "script", "img"):
            self.loads += [given[key] for key in ("href", "src") if given.get(key)]


def findings(site):
    pages = {path: Page(path) for path in site.rglob("*.html") if path.name != "404.html"}  # whose links are of a host
    for path, page in pages.items():
        name = path.relative_to(site)
        yield from (f"{name} loads {target}" for target in page.loads if urlsplit(target).netloc)
        for target in page.links + page.loads:
            parts = urlsplit(target)
            if parts.scheme or parts.netloc:
                continue
            file = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            file = file / "index.html" if file.is_dir() else file
            if not file.exists():
                yield f"{name}: {target} leads nowhere"
            elif parts.fragment and file in pages and unquote(parts.fragment) not in pages[file].anchors:
                yield f"{name}: {target} names no place of that page"


def main():
    root = Path(sys.argv[1])
    if not importlib.util.find_spec("mkdocs"):
        print("there is no mkdocs: skipped")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        site = Path(folder).resolve() / "site"
        made = subprocess.run([sys.executable, root / "client_examples/docs/site.py", site], capture_output=True, text=True, timeout=300)
        if made.returncode != 0:
            print(made.stdout, made.stderr)
            return 1
        wrong = sorted(set(findings(site)))
        count = len(list(site.rglob("*.html")))
        pages = len(list(site.rglob("index.html")))
    print(*wrong, f"{count} pages, {pages} of them of folders, {len(wrong)} faults", sep="\n")
    return 1 if wrong or count < 20 else 0


if __name__ == "__main__":
    sys.exit(main())
