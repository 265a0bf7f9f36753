"""Files in which texts are exchanged."""

from pathlib import Path


def change_file(path: Path, *texts: str) -> Path:
    """Exchanges texts of a file, each of which must stand there: old, new, old, new and so on; returns the path."""
    text = path.read_text(encoding="utf-8")
    for old, new in zip(texts[::2], texts[1::2], strict=True):
        assert old in text, old
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return path
