"""What the example scripts share: finding the package, the command line, figures."""
from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
MOST = 10_000_000
HERE = os.path.dirname(os.path.abspath(__file__))
# The package with its generated stubs: of PYTHONPATH, of the usual build, or as installed; not the sources beside this file.
for folder in [*os.environ.get("PYTHONPATH", "").split(os.pathsep), os.path.join(HERE, "..", "..", "build", "python"), *sys.path]:
    if os.path.isdir(os.path.join(folder, "mbcosim", "v1")):
        sys.path.insert(0, folder)
        break


def model(name: str) -> str:
    """Path of an example deck."""
    return os.path.join(HERE, "..", "models", name)


def whole_number(least: int) -> Callable[[str], int]:
    """For argparse: whole numbers from `least` on."""
    def read(text: str) -> int:
        if not text.isdecimal() or not least <= int(text) <= MOST:
            raise argparse.ArgumentTypeError(f"expected a whole number from {least} to {MOST}, got {text!r}")
        return int(text)
    return read


def picture_file(path: str) -> str:
    """For argparse: a name that a picture can have."""
    from matplotlib.backend_bases import FigureCanvasBase
    kinds = FigureCanvasBase.get_supported_filetypes()
    ending = os.path.splitext(path)[1][1:].lower()
    if ending not in kinds:
        raise argparse.ArgumentTypeError(f"{path!r} names no kind of picture: expected an ending like .png, .pdf, .svg")
    if not os.path.isdir(os.path.dirname(path) or "."):
        raise argparse.ArgumentTypeError(f"there is no folder {os.path.dirname(path)!r} to write a picture into")
    return path


def options(description: Optional[str], plot: str, steps: Optional[int] = None, least: int = 1, second: bool = False,
            deck: Optional[str] = None, points: Optional[int] = None, **others: str) -> argparse.Namespace:
    """--address of the server, --plot file; --steps (at least `least`), --points and --deck if they have a default; --second server if it
    can be used; others with their help."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--address", help="of the server; default: the daemon of this user, or one started for the run")
    parser.add_argument("--plot", type=picture_file, default=plot, help="picture to write; default: %(default)s")
    if second:
        parser.add_argument("--second", help="address of the second server; default: one is started")
    if deck is not None:
        parser.add_argument("--deck", default=deck, help="model; default: %(default)s")
    if points is not None:
        parser.add_argument("--points", type=whole_number(1), default=points, help="how many of each parameter; default: %(default)s")
    if steps is not None:
        parser.add_argument("--steps", type=whole_number(least), default=steps, help="length of the runs; default: %(default)s")
    for name, text in others.items():
        parser.add_argument("--" + name, help=text)
    return parser.parse_args()


def figure(rows: int = 1, **arguments: Any) -> Any:
    """Figure and axes, without a display."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    return plt.subplots(rows, 1, squeeze=False, layout="constrained", **arguments)


def save(picture: Any, path: str) -> None:
    picture.savefig(path, dpi=120)
    print(f"plot: {os.path.abspath(path)}")
