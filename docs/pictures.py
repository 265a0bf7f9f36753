"""Figures of commands, for the pages of pictures."""

import json
import subprocess
from pathlib import Path

from IPython.display import Image, Markdown, display


def draw(command: str, folder: str, caption: str = "") -> None:
    """Runs a command and shows the figures that it wrote, each with its caption and the command below it.

    Args:
        command: Command of a shell.
        folder: Folder that it writes to.
        caption: Caption of figures of which no section of a report says more.
    """
    subprocess.run(command, shell=True, check=True, capture_output=True)
    section = Path(folder) / "section.json"
    if section.is_file():
        captions = {
            each["file"]: each["caption"] for each in json.loads(section.read_text(encoding="utf-8"))["figures"]
        }
    else:
        captions = {path.name: caption for path in sorted(Path(folder).glob("*.png"))}
    for name, text in captions.items():
        if name.endswith(".png"):
            display(Image(Path(folder) / name, width=680, alt=text))
            display(Markdown(f"{text}\n\n```bash\n{command}\n```"))
