"""A fingerprint of everything a study was read from: the same input gives the same digest, wherever it lies."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path

from drivetrain.study.assumptions import SHIPPED
from drivetrain.study.document import Document


def study_digest(document: Document, files: Iterable[Path]) -> str:
    """SHA-256 over the study file and the files it names, their paths left out."""
    digest = hashlib.sha256()
    for content in (document.content, SHIPPED.read_bytes(), *_contents(files)):
        digest.update(len(content).to_bytes(8, "big"))  # so that bytes cannot move from one file to the next unseen
        digest.update(content)
    return digest.hexdigest()


def _contents(files: Iterable[Path]) -> Iterable[bytes]:
    for path in files:
        members = sorted(path.glob("*.csv")) if path.is_dir() else [path]
        yield from (member.read_bytes() for member in members if member.is_file())
