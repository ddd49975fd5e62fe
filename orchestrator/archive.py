"""Zip archives and XML from elsewhere, read so that they cannot do harm.

No member of an archive leaves the folder that it is extracted to, and none is a link; the sizes that an archive
declares are bounded before anything is written. XML has no document type, and so neither entities nor references to
other files.
"""

import atexit
import shutil
import stat
import tempfile
import xml.etree.ElementTree as ElementTree
import zipfile
from collections.abc import Callable
from pathlib import Path, PurePosixPath, PureWindowsPath

from tlpsim.loads.errors import FmuError, TlpsimError

Element = ElementTree.Element

LARGEST_SIZE = 8 << 30
"""Bytes that an archive may hold when extracted."""
LARGEST_RATIO = 500
"""Extracted size by packed size that an archive of more than `HARMLESS_SIZE` may have; deflate ends at 1032."""
HARMLESS_SIZE = 256 << 20
LARGEST_COUNT = 100_000
"""Members that an archive may have."""

Fault = Callable[[str], TlpsimError]


class _DocumentTypeError(Exception):
    """The document declares a type."""


class _Builder(ElementTree.TreeBuilder):
    """Builder of an element tree that refuses a document type before its entities are read."""

    def doctype(self, name: str, identifier: str | None, system: str | None) -> None:
        raise _DocumentTypeError


def read_xml(data: bytes, where: str, fault: Fault = FmuError) -> Element:
    """Root element of an XML document.

    Parameters
    ----------
    data
        The document.
    where
        What it is, for the error message, such as the name of the file.
    fault
        Class of the error.

    Raises
    ------
    TlpsimError
        Of the class `fault`, if the document is not well-formed or declares a type (DOCTYPE).
    """
    parser = ElementTree.XMLParser(target=_Builder())
    try:
        parser.feed(data)
        root: Element = parser.close()
    except _DocumentTypeError:
        raise fault(f"{where}: the XML has a DOCTYPE, which could hold entities; remove it") from None
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise fault(f"{where}: the XML cannot be parsed: {error}; write it again") from None
    return root


def extract(path: Path, folder: Path, fault: Fault = FmuError) -> None:
    """Extract a zip archive into a folder that exists.

    Parameters
    ----------
    path, folder
        Archive, and where its members go.
    fault
        Class of the error.

    Raises
    ------
    TlpsimError
        Of the class `fault`, if the file cannot be read or is no zip archive, a member would leave the folder or is a
        link, or the archive is larger than `LARGEST_SIZE`, `LARGEST_RATIO` and `LARGEST_COUNT` allow. Nothing has
        been written then, unless a member is damaged.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            for member in archive.infolist():
                reason = _objection(member)
                if reason:
                    raise fault(f"{path}: the member '{member.filename}' {reason}; pack the archive anew")
            reason = _size_objection(archive.infolist())
            if reason:
                raise fault(f"{path}: {reason}; pack the archive anew, without what it does not need")
            archive.extractall(folder)
    except TlpsimError:
        raise
    except OSError as error:
        raise fault(f"{path}: the archive cannot be extracted to {folder}: {error.strerror or error}") from error
    except Exception as error:  # a damaged member raises many kinds: zlib.error, BadZipFile, NotImplementedError ...
        raise fault(f"{path}: the file is not a zip archive, or damaged: {error}; pack it anew") from error


def _objection(member: zipfile.ZipInfo) -> str:
    """Why a member must not be extracted, or ""."""
    name = member.filename
    if "\\" in name or PureWindowsPath(name).drive or PurePosixPath(name).is_absolute():
        return "has no relative path with '/'"
    if ".." in PurePosixPath(name).parts:
        return "leads out of the folder"
    kind = stat.S_IFMT(member.external_attr >> 16)
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        return "is a link or a device"
    if member.flag_bits & 0x1:
        return "is encrypted"
    return ""


def _size_objection(members: list[zipfile.ZipInfo]) -> str:
    """Why an archive is too large, or ""; a member never extracts to more than it declares."""
    if len(members) > LARGEST_COUNT:
        return f"the archive has {len(members)} members and may have {LARGEST_COUNT}"
    size = sum(member.file_size for member in members)
    packed = sum(member.compress_size for member in members)
    if size > LARGEST_SIZE:
        return f"the archive extracts to {size} bytes and may have {LARGEST_SIZE}"
    if size > HARMLESS_SIZE and size > LARGEST_RATIO * packed:
        return f"the archive extracts to {size} bytes, more than {LARGEST_RATIO} times its own {packed}"
    return ""


def unpacked(path: Path, prefix: str, fault: Fault = FmuError) -> Path:
    """Extract an archive into a new folder that is removed when the process ends; raises as `extract`."""
    folder = Path(tempfile.mkdtemp(prefix=prefix))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    try:
        extract(path, folder, fault)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return folder
