"""Reading files with a limit of size, and writing them atomically: to a temporary file that is then renamed.

Also the folders that are shipped with the package: inside the wheel, or beside the package in a checkout.
"""

from __future__ import annotations

import csv
import errno
import glob
import io
import json
import os
import tempfile
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from drivetrain.errors import Fault, InputError, plain

DISK = (errno.ENOSPC, errno.EDQUOT, errno.EIO)  # errors that are not due to the path that the user gave
WORKBOOKS = (".xlsx", ".xlsm")
LIST, PART = ".drivetrain-files.json", ".part"
LARGEST_TEXT = 256 << 20  # bytes; for comparison, a day of six joints at 100 Hz is 0.5 GB as text


def read_text(path: Path, *, older: bool = False, decimal: str = ".") -> str:
    """The UTF-8 text of a file given by a user, with control characters escaped; an Excel sheet is read as CSV.

    ``older``: accept UTF-16 and Windows encodings too, as older programs write them. ``decimal``: the sign with which
    the numbers of an Excel sheet are written, as they have none of their own.
    """
    try:
        book = path.parent if is_workbook(path.parent) else path  # path of the workbook, or of a sheet in it
        if is_workbook(book):
            return plain(_sheet_text(book, "" if book is path else path.stem, decimal))
        content = read_bytes(path)
        return plain(_decoded(content) if older else io.TextIOWrapper(io.BytesIO(content), "utf-8-sig").read())
    except InputError:
        raise
    except (OSError, ValueError) as error:
        problem = str(error.strerror) if isinstance(error, OSError) else f"must be UTF-8 text: {error}"
        raise InputError(Fault("the file", f"cannot be read: {problem}", file=str(path))) from None


def read_bytes(path: Path, most: int = LARGEST_TEXT) -> bytes:
    """The content of a file given by a user, up to ``most`` bytes; a device file states no size and may be endless."""
    with path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size
        content = b"" if size > most else file.read(most + 1)
    check_size(path, max(size, len(content)), most)
    return content


def check_size(path: Path, size: int, most: int = LARGEST_TEXT) -> None:
    """Raise ``InputError`` for a file of more than ``most`` bytes."""
    if size > most:
        problem = f"has {size / 1e6:.0f} MB or more; at most {most >> 20} MB are read"
        raise InputError(Fault("the file", problem, hint="keep what the study needs", file=str(path)))


def _decoded(raw: bytes) -> str:
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return raw.decode("utf-16")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace")


def is_there(path: Path, kind: Callable[[Path], bool] = Path.is_file) -> bool:
    """Whether a file exists, or what ``kind`` tests for; False for names that are not valid paths."""
    try:
        return kind(path)
    except (OSError, ValueError):
        return False


def is_workbook(path: Path) -> bool:
    """Whether a file has the suffix of an Excel workbook."""
    return path.suffix.lower() in WORKBOOKS


def sheet_names(path: Path) -> list[str]:
    """The names of a workbook's sheets, in lower case and without surrounding spaces."""
    with _opened(path) as book:
        return [_plain_name(name) for name in book.sheetnames]


def _plain_name(sheet: str) -> str:
    return sheet.strip().lower()


def _sheet_text(path: Path, name: str, decimal: str) -> str:
    """A sheet as CSV text; without a name the first one."""
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    with _opened(path) as book:
        names = {_plain_name(one): one for one in reversed(book.sheetnames)}
        sheet = book[names[_plain_name(name)] if name else book.sheetnames[0]]
        for row in sheet.iter_rows(values_only=True):
            lines.writerow(["" if cell is None else _cell(cell, decimal) for cell in row])
    return text.getvalue()


def _cell(value: object, decimal: str) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return str(value).replace(".", decimal)
    return " ".join(str(value).split())


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """A workbook, with the values of its formulas as last saved."""
    try:
        import openpyxl
    except ImportError:
        hint = "pip install drivetrain[excel], or save each sheet as CSV"
        raise InputError(Fault("the file", "needs openpyxl to be read", hint=hint, file=str(path))) from None
    try:
        with zipfile.ZipFile(path) as packed:
            check_size(path, sum(part.file_size for part in packed.infolist()))  # size after unpacking
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
    except (OSError, InputError):
        raise
    except Exception as error:  # for damaged files the reader raises many types of exceptions
        raise InputError(Fault("the file", f"cannot be read as a workbook: {error}", file=str(path))) from None
    try:
        yield book
    finally:
        book.close()


def write_files(out_dir: str | Path, texts: Mapping[str, str]) -> dict[str, Path]:
    """Write several files that belong together: all of them, or none.

    All are written to temporary files, then a list of their targets is written, then each is renamed. A process killed
    before the list is written has changed nothing; if it is killed later, the next process that writes to the folder
    completes the list.
    """
    folder, waiting = Path(out_dir), dict[str, Path]()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _finish(folder)
        for name, text in texts.items():
            waiting[name] = _written_beside(folder / name, text)
        write_whole(folder / LIST, json.dumps({name: beside.name for name, beside in waiting.items()}))
        waiting = {}  # they are in the list now
        _finish(folder)
    except OSError as error:
        raise refusal(error, "output folder", out_dir) from None
    finally:
        for beside in waiting.values():
            beside.unlink(missing_ok=True)
    return {name: folder / name for name in texts}


def refusal(error: OSError, what: str, place: str | Path) -> Exception:
    """The error for a path that cannot be written: ``InputError``, unless the disk is full or fails."""
    if error.errno in DISK:
        return OSError(error.errno, error.strerror, str(place))
    return InputError(Fault(what, f"cannot be written: {error.strerror}", str(place)))


def _finish(folder: Path) -> None:
    """Rename the files of a list to their targets."""
    try:
        listed = json.loads((folder / LIST).read_text(encoding="utf-8"))
    except FileNotFoundError:
        return
    for name, beside in listed.items():
        if Path(name).name != name or Path(beside).name != beside:
            raise OSError(errno.EINVAL, f"{LIST} in it names files elsewhere")
        with suppress(FileNotFoundError):  # it has been renamed already
            (folder / beside).replace(folder / name)
    (folder / LIST).unlink(missing_ok=True)


def write_whole(place: Path, content: str | bytes | Callable[[IO[bytes]], object]) -> None:
    """Write one file completely or not at all."""
    beside = _written_beside(place, content)
    try:
        beside.replace(place)
    finally:
        beside.unlink(missing_ok=True)


def _written_beside(place: Path, content: str | bytes | Callable[[IO[bytes]], object]) -> Path:
    """Write the content to a hidden file in the same folder, flushed to disk, for the caller to rename."""
    _clear(place)
    handle, name = tempfile.mkstemp(prefix=f".{place.name}.{os.getpid()}.", suffix=PART, dir=place.parent)
    beside = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            if callable(content):
                content(file)
            else:
                file.write(content.encode("utf-8") if isinstance(content, str) else content)
            file.flush()
            os.fsync(file.fileno())
        beside.chmod(0o644)  # the usual mode of files, not that of temporary files
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
    return beside


def _clear(place: Path) -> None:
    """Remove temporary files beside a path that ended processes have left."""
    for left in place.parent.glob(f".{glob.escape(place.name)}.*{PART}"):
        writer = left.name.removeprefix(f".{place.name}.").split(".")[0]
        if writer.isdigit() and not _alive(int(writer)):
            left.unlink(missing_ok=True)


def _alive(process: int) -> bool:
    """Whether a process runs; always True on Windows, where ``os.kill`` would end it."""
    if os.name != "posix":
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True


def shipped(folder: str) -> Path:
    """The shipped folder ``catalogs`` or ``examples``; raises FileNotFoundError for a broken installation."""
    package = Path(__file__).resolve().parent
    for place in (package / "_data" / folder, package.parent / folder):
        if place.is_dir():
            return place
    raise FileNotFoundError(f"the shipped folder {folder!r} is missing from this installation of drivetrain")


def write_text(path: str | Path, text: str) -> Path:
    """Write a file completely or not at all; raises ``InputError``, or OSError if the disk is full or fails."""
    place = Path(path)
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        write_whole(place, text)
    except OSError as error:
        raise refusal(error, "path", place) from None
    return place
