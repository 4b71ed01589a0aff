"""Makes docs/radio-load.md and its pictures.

python -m proving_ground.radio_load.figures DATA DOCS
"""

import sys
from pathlib import Path

from bootprint import logs
from proving_ground.radio_load.page import page
from proving_ground.radio_load.plots import save_curves, save_loss
from proving_ground.radio_load.study import run_study


def main(data: Path, docs: Path) -> None:
    """Write the page; without a folder of recorded data its rows are left out."""
    logs.configure("error")
    images = docs / "img"
    images.mkdir(parents=True, exist_ok=True)
    study = run_study(data if data.is_dir() else None)
    save_curves(study, images / "radio-load-curves.png")
    save_loss(study.loss, images / "radio-load-loss.png")
    (docs / "radio-load.md").write_text(page(study), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
