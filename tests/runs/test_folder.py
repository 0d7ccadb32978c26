"""The folder for the results: what is refused, and what may be replaced."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from tests.systems import linux

from macromicro.errors import InputError
from macromicro.runs import folder


def test_new_and_empty_folders_are_free(tmp_path: Path) -> None:
    folder.check(tmp_path, 0, overwrite=False)
    folder.check(tmp_path / "deep" / "new", 0, overwrite=False)
    assert list(tmp_path.iterdir()) == []


def test_what_is_there_is_refused(tmp_path: Path) -> None:
    (tmp_path / "note.txt").write_text("mine")
    with pytest.raises(InputError, match=r"already exists.*--overwrite"):
        folder.check(tmp_path, 0, overwrite=False)
    folder.check(tmp_path, 0, overwrite=True)


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_file_is_refused(tmp_path: Path, overwrite: bool) -> None:
    file = tmp_path / "file"
    file.write_text("mine")
    for place in (file, file / "below"):
        with pytest.raises(InputError, match="a folder"):
            folder.check(place, 0, overwrite=overwrite)
    assert file.read_text() == "mine"


def test_a_folder_by_the_name_of_a_result_is_refused(tmp_path: Path) -> None:
    (tmp_path / folder.PAGE).mkdir()
    with pytest.raises(InputError, match=folder.PAGE):
        folder.check(tmp_path, 0, overwrite=True)


def test_a_full_disk_is_said_before(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="MB free"):
        folder.check(tmp_path / "new", 10**18, overwrite=False)


@linux
@pytest.mark.parametrize("name", ["/proc/x", "/proc/x/deep", "/proc"])
def test_a_place_that_keeps_no_files_is_not_called_full(name: str) -> None:
    """The kernel's own file system reports no bytes at all, even to the superuser."""
    if not Path("/proc/self").exists():
        pytest.skip("no /proc here")
    with pytest.raises(InputError, match=r"/proc.* is not writable") as error:
        folder.check(Path(name), 10**6, overwrite=True)
    assert "MB" not in str(error.value)


def test_a_folder_without_the_right_to_write_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> str:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(folder.tempfile, "mkdtemp", refuse)
    with pytest.raises(InputError, match=f"{tmp_path} is not writable"):
        folder.check(tmp_path / "new", 0, overwrite=False)


def test_a_name_that_is_none(tmp_path: Path) -> None:
    for name in ("nul\0", "x" * 5000):
        with pytest.raises(InputError, match="--out"):
            folder.check(tmp_path / name, 0, overwrite=False)


def test_only_files_of_a_run_are_replaced(tmp_path: Path) -> None:
    for name in (*folder.FILES, "note.txt"):
        (tmp_path / name).write_text("old")
    folder.make(tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["note.txt"]


def test_folders_that_no_one_named_are_one_for_each_command(tmp_path: Path) -> None:
    """Also of commands that begin at the same time; an earlier one's results stay."""
    usual = tmp_path / "results" / "thesis"
    usual.mkdir(parents=True)
    (usual / folder.SUMMARY).write_text("{}")
    with ThreadPoolExecutor(8) as pool:
        tasks = [pool.submit(folder.choose_folder, None, usual, overwrite=False) for _ in range(8)]
        made = {task.result() for task in tasks}
    assert made == {usual.with_name(f"thesis-{k}") for k in range(2, 10)}
    assert folder.choose_folder(None, usual, overwrite=False, resume=True).name == "thesis-9"
    folder.tidy()
    assert [p.name for p in usual.parent.iterdir()] == ["thesis"]
    assert folder.choose_folder(None, usual, overwrite=True) == usual
    assert folder.choose_folder(usual, tmp_path, overwrite=False) == usual


def test_a_place_where_no_folder_can_be_made_is_refused_by_its_name(tmp_path: Path) -> None:
    (tmp_path / "results").write_text("a file")
    found = folder.choose_folder(None, tmp_path / "results" / "thesis", overwrite=False)
    with pytest.raises(InputError, match="results/thesis"):
        folder.check(found, 0, overwrite=False)
