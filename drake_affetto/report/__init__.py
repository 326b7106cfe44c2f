"""`affetto report`: the results of studies as one page that tells the story.

The page is a single file that needs no network: charts, pictures, sounds and
the replay are in it.
"""

from collections.abc import Sequence
from pathlib import Path

from drake_affetto.common.errors import require
from drake_affetto.common.output import prepare_output, write_text_atomic
from drake_affetto.common.owner import check_file, claim_file


def write_report(
    folders: Sequence[Path], path: Path, command: str | None = None
) -> Path:
    """Writes one self-contained page about the studies in `folders`.

    Args:
        folders: of finished studies, each of another kind.
        path: of the page; its folder is made if need be.
        command: for which the page is claimed, in a folder of another one's
            results; None in a folder of its own.

    Returns:
        The path, with a leading `~` expanded.

    Raises:
        InputError: if a folder is not that of a finished study with a place
            on the page, two are of one kind, a file is damaged or of another
            version, or the page is another command's or cannot be written.
            Then nothing was written.
    """
    from drake_affetto.report.page import make_page
    from drake_affetto.report.study_folder import read_folders

    path = Path(path).expanduser()
    require(not path.is_dir(), "--out", str(path), "a file, not a folder")
    if command is not None:
        check_file(path, command)
    page = make_page(read_folders(folders))
    if command is not None:
        claim_file(path, command)
    prepare_output(path.parent)
    write_text_atomic(path, page)
    return path
