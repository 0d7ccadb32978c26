"""Reading a file that a user names: every way it can be wrong is one sentence."""

import math
import os
from pathlib import Path

import numpy as np
import pytest
from tests.systems import posix

from macromicro.errors import InputError
from macromicro.schema import text as textfile
from macromicro.schema.text import plain, printable, read_text, read_toml


def refused(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_text(path, "a settings file")
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_text_comes_back_without_the_byte_order_mark(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    file.write_bytes(b'\xef\xbb\xbftitle = "\xc3\xa4"\r\n')
    assert read_text(file, "x") == 'title = "ä"\r\n'


def test_missing_directory_and_impossible_names(tmp_path: Path) -> None:
    assert "no such file" in refused(tmp_path / "none.toml")
    assert "this is a folder" in refused(tmp_path)
    assert "not a valid" in refused(Path("a\0b"))
    assert "name too long" in refused(Path("x" * 5000)).lower()
    assert "Not a directory" in refused(Path(__file__) / "a.toml")


@posix
def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.toml")
    assert "not a regular file" in refused(tmp_path / "pipe.toml")
    assert "not a regular file" in refused(Path("/dev/zero"))


@pytest.mark.parametrize("content", [b"", b" \n\t\r\n", b"\xef\xbb\xbf", b"\xef\xbb\xbf\n"])
def test_empty_files(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "a.csv"
    file.write_bytes(content)
    assert "the file is empty" in refused(file)


def test_bad_utf8_names_the_byte_offset(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_bytes("é,".encode() + b"\xff\xfe")
    assert "byte 0xff at offset 3" in refused(file)
    file.write_bytes("t_s,macro_mm\n".encode("utf-16"))
    assert "byte 0xff at offset 0" in refused(file)


def test_control_characters_name_the_byte_offset(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_bytes("é".encode() + b"\x00\x01")
    assert "control character 0x00 at offset 2" in refused(file)


def test_size_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert textfile.MAX_BYTES == 20_000_000
    file = tmp_path / "a.csv"
    with file.open("wb") as sparse:
        sparse.truncate(31_200_000)
    assert "31.2 MB" in refused(file)
    assert "at most 20 MB" in refused(file)
    monkeypatch.setattr(textfile, "MAX_BYTES", 4)
    file.write_text("1234")
    assert read_text(file, "x") == "1234"
    file.write_text("12345")
    refused(file)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("a = 1\nb = = 2\n", "line 2"),
        ("a = 1\na = 2\n", "line 2"),
        ("a = " + "[" * 30_000, "nested"),
        ("a = " + "9" * 5000, "digits"),
        ("a = 2001-02-31", "line 1"),
    ],
)
def test_toml_slips_name_file_and_line(tmp_path: Path, text: str, found: str) -> None:
    file = tmp_path / "a.toml"
    file.write_text(text)
    with pytest.raises(InputError, match=found) as caught:
        read_toml(file, "x")
    assert str(file) in str(caught.value)


def test_printable_is_one_short_line() -> None:
    assert printable("a b") == "a b"
    assert printable("a\nb\x1b[31m") == "a\\nb\\x1b[31m"
    assert len(printable("x" * 1000)) == 63
    assert printable(int("f" * 10_000, 16)) == "a very long number"


def test_plain_is_what_json_holds() -> None:
    given = {
        1: np.array([[1.0, math.nan]]),
        "n": np.int64(3),
        "flag": np.bool_(True),
        "never": -math.inf,
        "path": Path("a"),
        "none": None,
    }
    assert plain(given) == {
        "1": [[1.0, None]],
        "n": 3,
        "flag": True,
        "never": None,
        "path": "a",
        "none": None,
    }
    assert plain((math.inf, [-math.inf, math.nan]), spelled=True) == ["inf", ["-inf", None]]
    assert plain((math.inf,)) == [None]
    assert type(plain(np.float32(0.5))) is float
