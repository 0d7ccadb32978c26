"""Libraries for other systems: formats, names, and on Windows (Wine) our bits."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import sys
import zipfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from macromicro.errors import InputError, MacromicroError
from macromicro.export import building, catalogue, files, fmu
from tests.command import command

needs_zig = pytest.mark.skipif(find_spec("ziglang") is None, reason="the extra `cross` brings it")
# First bytes of ELF for x86-64 and AArch64 (machine at byte 18), PE and a universal Mach-O file.
ELF, PE, UNIVERSAL = b"\x7fELF\x02\x01", b"MZ", b"\xca\xfe\xba\xbe"
X86_64, ARM64 = 62, 183
MACH_X86_64, MACH_ARM64 = 0x01000007, 0x0100000C
PERIODS = 500
DRIVER = """
#include <stdio.h>
#include <string.h>
#ifdef _WIN32
#define API __declspec(dllimport)
#else
#define API
#endif
API void *fmi2Instantiate(const char *, int, const char *, const char *, void *, int, int);
API int fmi2SetupExperiment(void *, int, double, double, int, double);
API int fmi2EnterInitializationMode(void *);
API int fmi2ExitInitializationMode(void *);
API int fmi2SetReal(void *, const unsigned *, size_t, const double *);
API int fmi2GetReal(void *, const unsigned *, size_t, double *);
API int fmi2DoStep(void *, double, double, int);
int main(void)
{
    const unsigned in[] = {%(inputs)s}, out[] = {%(outputs)s};
    void *m = fmi2Instantiate("one", 1, "%(token)s", "", NULL, 0, 0);
    if (!m) return 1;
    fmi2SetupExperiment(m, 0, 0.0, 0.0, 0, 0.0);
    fmi2EnterInitializationMode(m);
    fmi2ExitInitializationMode(m);
    for (int k = 0; k < %(periods)d; k++) {
        for (size_t j = 0; j < sizeof in / sizeof *in; j++) {
            const double value = %(scale)s * ((k / 50 * 7 + (int)j * 3) %% 11 - 5);
            fmi2SetReal(m, in + j, 1, &value);
        }
        fmi2DoStep(m, k * %(period)s, %(period)s, 1);
        for (size_t j = 0; j < sizeof out / sizeof *out; j++) {
            double value;
            unsigned long long bits;
            fmi2GetReal(m, out + j, 1, &value);
            memcpy(&bits, &value, sizeof bits);
            printf("%%016llx\\n", bits);
        }
    }
    return 0;
}
"""


@pytest.fixture(scope="module")
def wine(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Environment of Wine: a prefix of its own, without .NET and a browser."""
    prefix = str(tmp_path_factory.mktemp("wine"))
    return {
        **os.environ, "WINEPREFIX": prefix, "WINEDEBUG": "-all",
        "WINEDLLOVERRIDES": "mscoree,mshtml,winemenubuilder.exe=",
    }  # fmt: skip


@needs_zig
@pytest.mark.slow
def test_one_fmu_has_the_libraries_of_all_systems(tmp_path: Path) -> None:
    done = command(
        "export", "fmu", "two_stage.macro", "--for", "windows,linux,macos,linux-arm",
        "--out", "macro.fmu", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "linux-arm: FMI 2.0 has no folder for it" in done.stdout
    with zipfile.ZipFile(tmp_path / "macro.fmu") as packed:
        made = {n: packed.read(n) for n in packed.namelist() if n.startswith("binaries/")}
    linux, arm, windows, macos = (
        made.pop(f"binaries/{place}/two_stage_macro{suffix}")
        for place, suffix in (
            ("linux64", ".so"), ("aarch64-linux", ".so"), ("win64", ".dll"), ("darwin64", ".dylib"),
        )
    )  # fmt: skip
    assert not made
    assert linux.startswith(ELF) and struct.unpack_from("<H", linux, 18) == (X86_64,)
    assert arm.startswith(ELF) and struct.unpack_from("<H", arm, 18) == (ARM64,)
    header = struct.unpack_from("<I", windows, 0x3C)[0]
    assert windows.startswith(PE) and windows[header : header + 6] == b"PE\0\0\x64\x86"
    assert macos.startswith(UNIVERSAL) and struct.unpack_from(">I", macos, 4) == (2,)
    for k, processor in enumerate((MACH_X86_64, MACH_ARM64)):
        kind, _, offset, size, align = struct.unpack_from(">5I", macos, 8 + 20 * k)
        assert kind == processor and offset % (1 << align) == 0 and offset + size <= len(macos)
        assert macos[offset : offset + 4] == b"\xcf\xfa\xed\xfe"


@needs_zig
@pytest.mark.slow
def test_c_comes_with_a_library_for_each_system(tmp_path: Path) -> None:
    asked = ("export", "c", "axis.law", "--for", "windows,linux-arm", "--out", "law")
    assert command(*asked, cwd=tmp_path).returncode == 0
    assert command(*asked, "--overwrite", cwd=tmp_path).returncode == 0
    made = {p.relative_to(tmp_path / "law").as_posix() for p in tmp_path.rglob("*") if p.is_file()}
    libraries = {"win64/axis_law.dll", "aarch64-linux/axis_law.so"}
    assert made == {"axis_law.c", "axis_law.h", "README.md", *libraries}
    assert b"axis_law_step" in (tmp_path / "law/win64/axis_law.dll").read_bytes()


@needs_zig
@pytest.mark.slow
@pytest.mark.skipif(shutil.which("wine") is None, reason="Debian's package wine brings it")
@pytest.mark.parametrize(
    ("name", "scale", "tolerance"),
    [("two_stage.macro", 1.0, 0.0), ("two_stage.terminal", 1e-5, 1e-12)],
)
def test_on_windows_it_gives_our_numbers(
    name: str, scale: float, tolerance: float, tmp_path: Path, wine: dict[str, str]
) -> None:
    """The same program with the library of Windows under Wine and with that of Linux here.

    `terminal` calls functions of libm, whose last bits differ between the systems.
    """
    place = tmp_path / "unit.fmu"
    face = fmu.write(files.write_unit(catalogue.unit(name)), place, ("linux", "windows"))
    with zipfile.ZipFile(place) as packed:
        packed.extractall(tmp_path)
        token = packed.read("modelDescription.xml").decode().partition('guid="')[2][:38]
    numbers = {
        kind: ",".join(str(k) for k, v in enumerate(face.variables, 1) if v.causality == kind)
        for kind in ("input", "output")
    }
    text = DRIVER % {
        "inputs": numbers["input"], "outputs": numbers["output"], "token": token,
        "periods": PERIODS, "period": repr(face.unit.period), "scale": repr(scale),
    }  # fmt: skip
    (tmp_path / "driver.c").write_text(text)
    zig = [sys.executable, "-m", "ziglang", "cc", "-target"]
    base = tmp_path / "binaries"
    said = {}
    for target, folder, suffix, program in (
        ("x86_64-linux-gnu", "linux64", ".so", "here"),
        ("x86_64-windows-gnu", "win64", ".dll", "there.exe"),
    ):
        library = base / folder / f"{face.written.name}{suffix}"
        words = [*zig, target, "driver.c", library, "-o", base / folder / program]
        subprocess.run([*words, "-Wl,-rpath,$ORIGIN"], cwd=tmp_path, check=True)
        start = ["wine"] if suffix == ".dll" else []
        found = subprocess.run(
            [*start, base / folder / program], check=True, capture_output=True, text=True,
            cwd=base / folder,
            env=wine,
        )  # fmt: skip
        said[folder] = found.stdout.split()
    assert len(set(said["linux64"])) > PERIODS // 2
    here, there = (
        np.array([int(bits, 16) for bits in said[folder]], np.uint64).view(np.float64)
        for folder in ("linux64", "win64")
    )
    np.testing.assert_allclose(there, here, rtol=tolerance, atol=0.0)


def test_an_unknown_system_is_refused() -> None:
    with pytest.raises(InputError, match=r"--for: .amiga.; accepted: one or more of linux"):
        building.systems("linux,amiga")
    assert building.systems("macos, linux,macos") == ("macos", "linux")
    assert building.systems(None) == ()


def test_without_a_compiler_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(building, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"ziglang is not installed.*'macromicro\[cross\]'"):
        building.libraries("a", {"a.c": ""}, ("windows",))
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(MacromicroError, match=r"gcc libc6-dev\), or .*'macromicro\[cross\]'"):
        building.libraries("a", {"a.c": ""})


def test_what_the_compiler_says_is_passed_on() -> None:
    with pytest.raises(MacromicroError, match=r"failed to compile a\.so: a\.c:1"):
        building.libraries("a", {"a.c": "int broken("})
