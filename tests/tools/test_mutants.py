"""The mutation run of tools/mutants: what it changes, what it leaves alone, what it reports."""

import importlib.util
import inspect
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import pytest

from macromicro import kernel

ROOT = Path(__file__).parents[2]
TOOL = ROOT / "tools" / "mutants"


@pytest.fixture
def operators(monkeypatch):
    monkeypatch.syspath_prepend(str(TOOL))
    import operators

    yield operators
    sys.modules.pop("operators", None)


@pytest.fixture
def beside(monkeypatch):
    monkeypatch.syspath_prepend(str(TOOL))
    import beside

    yield beside
    sys.modules.pop("beside", None)


SOURCE = '''
def step(value: float, limit: float = 2.0, fault: int = 0) -> tuple[int, float]:
    """One plus one."""
    if value - 1.0 > limit and not fault:
        fault = 1
    return fault, min(abs(value), limit) * 2.0
'''


def changes(operators, text):
    return {(m.kind, m.after.strip()) for m in operators.mutants(text)}


def test_signs_terms_latches_and_units_are_mutated(operators):
    found = changes(operators, SOURCE)
    assert ("operator", "if (value + 1.0) > limit and not fault:") in found
    assert ("dropped term", "if (value) > limit and not fault:") in found
    assert ("comparison", "if (value - 1.0 <= limit) and not fault:") in found
    assert ("dropped condition", "if (value - 1.0 > limit):") in found
    assert ("negation", "if value - 1.0 > limit and (fault):") in found
    assert ("dropped assignment", "pass") in found
    assert ("bound", "return fault, (max(abs(value), limit)) * 2.0") in found
    assert ("sign", "return fault, min((value), limit) * 2.0") in found
    assert ("number", "return fault, min(abs(value), limit) * (2000.0)") in found


def test_documentation_and_annotations_are_left_alone(operators):
    texts = [m.text for m in operators.mutants(SOURCE)]
    assert all('"""One plus one."""' in text for text in texts)
    assert all("value: float" in text and "tuple[int, float]" in text for text in texts)


def test_a_mutant_is_another_program_that_python_reads(operators):
    text = (ROOT / "src" / "macromicro" / "rig" / "session.py").read_text("utf-8")
    mutants = operators.mutants(text)
    assert mutants
    for mutant in mutants:
        compile(mutant.text, "session.py", "exec")
        assert mutant.text != text


def test_declared_parameters_are_data(operators):
    assert not operators.mutants('class P(NamedTuple):\n    a: Annotated[float, Par("m")] = 2.0\n')


def test_tables_and_slack_are_left_alone(operators):
    assert not operators.mutants("TABLE = ((0.0, 800.0), (0.04, 520.0))\n")
    assert operators.mutants("TIME = 0.01\n")
    found = changes(operators, "def late(t, end):\n    return t >= end - 1e-9\n")
    assert found == {("comparison", "return (t < end - 1e-09)")}


def test_slack_with_a_name_is_slack(operators):
    """And its value is what the tool takes it for."""
    from macromicro.control.arrival import TICK

    assert TICK <= operators._SLACK
    found = changes(operators, "def late(t, end):\n    return t >= end - TICK\n")
    assert found == {("comparison", "return (t < end - TICK)")}


def test_guard_limits_and_live_core_must_kill_all(beside):
    assert beside.required("rig/guard.py") == 1.0
    assert beside.required("control/live/brake.py") == 1.0
    assert beside.required("plant/motor.py") == 0.9


def test_the_tests_of_every_strict_file_are_known(beside):
    strict = [p for p in beside.PACKAGE.rglob("*.py") if beside.required(beside.name(p)) == 1.0]
    assert len(strict) > 20
    missing = [beside.name(p) for p in strict if p.name != "__init__.py" and not beside.tests(p)]
    assert not missing


def test_the_table_of_tests_names_sources_and_tests_that_exist(beside):
    listed = tomllib.loads((TOOL / "beside.toml").read_text("utf-8"))
    named = [beside.PACKAGE / name for name in (*listed, *beside.STRICT)]
    named += [beside.TESTS / name for names in listed.values() for name in names]
    assert [path for path in named if not path.exists()] == []


@pytest.mark.slow
def test_listed_equivalent_mutants_exist(beside, operators):
    """An entry that no longer fits the source would hide nothing, and should go."""
    listed = {}
    for entry in beside.equivalents():
        assert entry.reason
        if entry.file not in listed:
            text = (beside.PACKAGE / entry.file).read_text("utf-8")
            listed[entry.file] = {(m.before, m.after) for m in operators.mutants(text)}
        assert (entry.before, entry.after) in listed[entry.file], entry


def tool(*arguments):
    return subprocess.run(
        [sys.executable, str(TOOL), *arguments],
        capture_output=True, text=True, check=False, timeout=300, cwd=ROOT,
    )  # fmt: skip


@pytest.mark.slow
def test_killed_mutants_pass():
    done = tool("control/deadzone.py")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "90% asked" in done.stdout


@pytest.fixture
def running(monkeypatch):
    monkeypatch.syspath_prepend(str(TOOL))
    import running

    yield running
    for name in ("running", "beside", "operators"):
        sys.modules.pop(name, None)


def test_a_forked_process_is_judged_by_how_it_ends(running):
    assert running.forked(lambda: True, 60.0) == running.SURVIVED
    assert running.forked(lambda: False, 60.0) == running.KILLED
    assert running.forked(lambda: bool(1 / 0), 60.0) == running.KILLED
    assert running.forked(lambda: not time.sleep(60.0), 0.1) == running.TIMED_OUT


@pytest.mark.parametrize(
    ("line", "name"),
    [
        ("FAILED rig/test_a.py::test_b - assert 1 == 2", "rig/test_a.py::test_b"),
        ("FAILED rig/test_a.py::test_b[0.0-the one silent] - E", "rig/test_a.py::test_b"),
        ("ERROR rig/test_a.py - SyntaxError", ""),
    ],
)
def test_the_test_that_noticed_a_mutant_can_be_run_by_its_name(running, line, name):
    """A name cut within its parameters is not found, and each further mutant passes for killed."""
    assert running.failed_test(f"1 failed\n{line}\n") == name


@pytest.mark.parametrize(
    ("text", "fresh"),
    [
        ("@kernel\ndef step(x):\n    return x + 1.0\n", True),
        # Compiled though it has no mark, as the guard's loop is.
        ("def _loop(x):\n    yield x + 1.0\n\n\nRUN = compiled(_loop)\n", True),
        ("from other import loop\n\n\ndef run(x):\n    return compiled(loop)(x + 1.0)\n", False),
        # A constant that kernels of other files may have taken over.
        ("STUCK = 1.0\n", True),
    ],
)
def test_what_changes_machine_code_finds_none_in_a_cache(running, operators, text, fresh):
    """numba's index knows neither a function's constants nor those of other files."""
    (mutant,) = (m for m in operators.mutants(text) if m.kind == "number")
    assert running.new_machine_code(text, mutant) is fresh


def test_kernels_are_kept_in_one_folder(running, monkeypatch, tmp_path):
    asked = inspect.signature(kernel.cache_folder)
    monkeypatch.setattr(kernel, "cache_folder", kernel.cache_folder)
    running.keep_kernels(tmp_path)
    assert kernel.cache_folder() == kernel.cache_folder(joined=False) == tmp_path
    assert list(inspect.signature(kernel.cache_folder).parameters) == list(asked.parameters)


def test_files_whose_functions_are_compiled_are_known(running, operators, beside):
    for name, fresh in (("rig/twin.py", True), ("place.py", False)):
        text = (beside.PACKAGE / name).read_text("utf-8")
        mutant = operators.mutants(text)[-1]
        assert running.new_machine_code(text, mutant) is fresh, name


@pytest.fixture
def command(monkeypatch, running):
    spec = importlib.util.spec_from_file_location("mutants_command", TOOL / "__main__.py")
    made = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "mutants_command", made)
    spec.loader.exec_module(made)
    return made


def test_survivors_are_printed_and_fail_the_run(monkeypatch, capfd, command, beside, operators):
    """No test stands beside this file, whichever it is."""
    alone = next(
        beside.name(path)
        for path in sorted(beside.PACKAGE.rglob("*.py"))
        if not beside.tests(path) and 0 < len(operators.mutants(path.read_text("utf-8"))) < 50
    )
    monkeypatch.setattr(sys, "argv", ["mutants", alone])
    assert command.main() == 1
    assert "no test beside it" in capfd.readouterr().out


def test_a_file_that_is_not_there_is_bad_input(monkeypatch, capfd, command):
    monkeypatch.setattr(sys, "argv", ["mutants", "plant/no_such.py"])
    with pytest.raises(SystemExit) as ended:
        command.main()
    assert ended.value.code == 2
    assert "plant/no_such.py: no file or folder of src/macromicro" in capfd.readouterr().err


def test_a_file_whose_tests_fail_without_a_mutation_loses_no_other(
    monkeypatch, capfd, command, running, operators, beside
):
    bad, good = (beside.PACKAGE / name for name in ("control/pd.py", "control/pi.py"))

    class Bench:
        def baseline(self, source, tests):
            if source == bad:
                raise running.TestsFail("E  assert 1 == 2")
            return 0.1

        def tried(self, source, mutant, tests, seconds):
            return running.KILLED

    monkeypatch.setattr(command, "Bench", Bench)
    work = {file: operators.mutants(file.read_text("utf-8")) for file in (bad, good)}
    verdicts, failing = command.tried(work, 1)
    assert {v.file for v in verdicts} == {"control/pi.py"} and failing == ["control/pd.py"]
    assert command.judged(verdicts, failing) == 1
    assert command.judged(verdicts, []) == 0
    out, err = capfd.readouterr()
    assert "control/pd.py: not tried, its tests fail without a mutation" in out
    assert "100.0%" in out and "E  assert 1 == 2" in err
