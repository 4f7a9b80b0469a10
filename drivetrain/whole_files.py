"""Files as a whole: read within bounds; written beside their place, then renamed, so that a failure changes nothing.

And the folders that ship with the package: inside the wheel, or beside the package in a checkout.
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

DISK = (errno.ENOSPC, errno.EDQUOT, errno.EIO)  # no fault of the path that the user gave
WORKBOOKS = (".xlsx", ".xlsm")
LIST, PART = ".drivetrain-files.json", ".part"
LARGEST_TEXT = 256 << 20  # bytes: a day of six joints at 100 Hz is 0.5 GB as text, and nobody sizes with that


def read_text(path: Path, *, older: bool = False) -> str:
    """The UTF-8 text of a file that a user names, its control characters spelled out; of an Excel sheet as CSV.

    ``older``: UTF-16 and Windows' letters too, as older programs write them.
    """
    try:
        book = path.parent if is_workbook(path.parent) else path  # or one of its sheets
        if is_workbook(book):
            return plain(_sheet_text(book, "" if book is path else path.stem))
        content = read_bytes(path)
        return plain(_decoded(content) if older else io.TextIOWrapper(io.BytesIO(content), "utf-8-sig").read())
    except InputError:
        raise
    except (OSError, ValueError) as error:
        problem = str(error.strerror) if isinstance(error, OSError) else f"must be UTF-8 text: {error}"
        raise InputError(Fault("the file", f"cannot be read: {problem}", file=str(path))) from None


def read_bytes(path: Path, most: int = LARGEST_TEXT) -> bytes:
    """The content of a file that a user names, which has so many bytes at most: a device has no size, and no end."""
    with path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size
        content = b"" if size > most else file.read(most + 1)
    check_size(path, max(size, len(content)), most)
    return content


def check_size(path: Path, size: int, most: int = LARGEST_TEXT) -> None:
    """Refuse a file of more bytes than anybody needs."""
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
    """Whether a file is there, or what else ``kind`` asks for; under a name that none can have, there is none."""
    try:
        return kind(path)
    except (OSError, ValueError):
        return False


def is_workbook(path: Path) -> bool:
    """Whether a file is named as one of Excel's."""
    return path.suffix.lower() in WORKBOOKS


def sheet_names(path: Path) -> list[str]:
    """The sheets of a workbook; capitals and spaces around a name do not count."""
    with _opened(path) as book:
        return [_plain_name(name) for name in book.sheetnames]


def _plain_name(sheet: str) -> str:
    return sheet.strip().lower()


def _sheet_text(path: Path, name: str) -> str:
    """A sheet as CSV, a line a row; left unnamed the first one."""
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    with _opened(path) as book:
        names = {_plain_name(one): one for one in reversed(book.sheetnames)}
        sheet = book[names[_plain_name(name)] if name else book.sheetnames[0]]
        for row in sheet.iter_rows(values_only=True):
            lines.writerow(["" if cell is None else _cell(cell) for cell in row])
    return text.getvalue()


def _cell(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return " ".join(str(value).split())


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """A workbook, the values of its formulas as last saved."""
    try:
        import openpyxl
    except ImportError:
        hint = "pip install drivetrain[excel], or save each sheet as CSV"
        raise InputError(Fault("the file", "needs openpyxl to be read", hint=hint, file=str(path))) from None
    try:
        with zipfile.ZipFile(path) as packed:
            check_size(path, sum(part.file_size for part in packed.infolist()))  # which unpack to no more than that
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
    except (OSError, InputError):
        raise
    except Exception as error:  # what the reader of a damaged file raises is of many kinds
        raise InputError(Fault("the file", f"cannot be read as a workbook: {error}", file=str(path))) from None
    try:
        yield book
    finally:
        book.close()


def write_files(out_dir: str | Path, texts: Mapping[str, str]) -> dict[str, Path]:
    """Write several files that belong together: all of them, or none.

    All are written beside their places, then a list of what takes which place, then each is renamed. Who is killed
    before the list is there has changed nothing; what a list left behind names is renamed by the next that writes here.
    """
    folder, waiting = Path(out_dir), dict[str, Path]()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _finish(folder)
        for name, text in texts.items():
            waiting[name] = _written_beside(folder / name, text)
        write_whole(folder / LIST, json.dumps({name: beside.name for name, beside in waiting.items()}))
        waiting = {}  # the list holds them now
        _finish(folder)
    except OSError as error:
        raise refusal(error, "output folder", out_dir) from None
    finally:
        for beside in waiting.values():
            beside.unlink(missing_ok=True)
    return {name: folder / name for name in texts}


def refusal(error: OSError, what: str, place: str | Path) -> Exception:
    """What to raise where a place cannot be written: the user's fault, unless the disk itself has no room or fails."""
    if error.errno in DISK:
        return OSError(error.errno, error.strerror, str(place))
    return InputError(Fault(what, f"cannot be written: {error.strerror}", str(place)))


def _finish(folder: Path) -> None:
    """Give every file of a list its place."""
    try:
        listed = json.loads((folder / LIST).read_text(encoding="utf-8"))
    except FileNotFoundError:
        return
    for name, beside in listed.items():
        if Path(name).name != name or Path(beside).name != beside:
            raise OSError(errno.EINVAL, f"{LIST} in it names files elsewhere")
        with suppress(FileNotFoundError):  # it has its place already
            (folder / beside).replace(folder / name)
    (folder / LIST).unlink(missing_ok=True)


def write_whole(place: Path, content: str | bytes | Callable[[IO[bytes]], object]) -> None:
    """Write one file whole or not at all."""
    beside = _written_beside(place, content)
    try:
        beside.replace(place)
    finally:
        beside.unlink(missing_ok=True)


def _written_beside(place: Path, content: str | bytes | Callable[[IO[bytes]], object]) -> Path:
    """A hidden file in the same folder that holds everything, on the disk; the caller renames it to its place."""
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
        beside.chmod(0o644)  # as other files are, not as temporary ones
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
    return beside


def _clear(place: Path) -> None:
    """Take away what processes that are gone have left beside a place."""
    for left in place.parent.glob(f".{glob.escape(place.name)}.*{PART}"):
        writer = left.name.removeprefix(f".{place.name}.").split(".")[0]
        if writer.isdigit() and not _alive(int(writer)):
            left.unlink(missing_ok=True)


def _alive(process: int) -> bool:
    """Whether a process runs, as far as the system shows without ending it."""
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
    """The folder ``catalogs`` or ``examples`` as shipped; FileNotFoundError where the installation is broken."""
    package = Path(__file__).resolve().parent
    for place in (package / "_data" / folder, package.parent / folder):
        if place.is_dir():
            return place
    raise FileNotFoundError(f"the shipped folder {folder!r} is missing from this installation of drivetrain")


def write_text(path: str | Path, text: str) -> Path:
    """Write a file whole or not at all; raises InputError, or OSError where the disk is full or fails."""
    place = Path(path)
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        write_whole(place, text)
    except OSError as error:
        raise refusal(error, "path", place) from None
    return place
