"""Text of a file in the encodings of spreadsheets and instruments."""

from __future__ import annotations

import codecs
from pathlib import Path

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import check_regular

LARGEST_TABLE = 10_000_000  # bytes
LARGEST_MAP = 400_000_000
ZEROS = 0.7  # fraction of zeros in every second byte, in UTF-16 without a byte order mark
_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),  # begins like that of UTF-16
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_CONTROL = bytes(set(range(32)) - {*b"\t\n\v\f\r\x1a\x1b"})  # what no text has


def read_text(path: Path, said: str, largest: int = LARGEST_TABLE) -> str:
    """Text of the file at `path`; said: its name in messages.

    UTF-8, UTF-16 and UTF-32 are recognised by byte order marks, UTF-16 also by its zeros. Other
    text is taken as Windows-1252, the superset of Latin-1. Raises SceneError if it is not a regular
    file, is larger than `largest` bytes or is not text.
    """
    check_regular(path, said)
    try:
        if (size := path.stat().st_size) > largest:
            reason = f"it has {size / 1e6:.0f} MB; allowed: up to {largest / 1e6:.0f} MB"
        else:
            return decoded(path.read_bytes())
    except OSError as error:
        reason = error.strerror or str(error)
    except ValueError as error:  # not text, or an invalid file name
        reason = "it is not a text file"
        if "archive" in str(error):
            reason = "it is a spreadsheet or an archive; save it as CSV"
    raise SceneError(f"cannot read {said} {path}: {reason}")


def decoded(data: bytes) -> str:
    """Text of the bytes of a file. Raises ValueError if they are no text."""
    if data.startswith(b"PK\x03\x04"):
        raise ValueError("an archive is no text")
    encoding = next((name for mark, name in _MARKS if data.startswith(mark)), None)
    if encoding is None and b"\0" in data:
        begin = data[:1000]
        zeros = [begin[first::2].count(0) / max(len(begin[first::2]), 1) for first in (0, 1)]
        if max(zeros) < ZEROS:
            raise ValueError("zeros are no text")
        encoding = "utf-16-le" if zeros[1] > zeros[0] else "utf-16-be"
    if encoding is not None:
        text = data.decode(encoding)
        if "\0" in text:
            raise ValueError("zeros are no text")
        return text
    if data.translate(None, _CONTROL) != data:
        raise ValueError("control characters are no text")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        whole = data.translate(None, b"\x81\x8d\x8f\x90\x9d") == data  # what Windows-1252 has
        return data.decode("cp1252", errors="strict" if whole else "replace")
