"""Messages of bad values and of problems."""

import pytest

from macromicro.errors import InputError, ProblemError, naming_arguments


@pytest.mark.parametrize(
    ("error", "found", "message"),
    [
        (
            InputError("a.toml, x", "12 V", "N"),
            "a.toml, x: '12 V'",
            "a.toml, x: '12 V'; accepted: N",
        ),
        (InputError("moves", "", "one or more"), "moves", "moves; accepted: one or more"),
        (InputError("n", 0, "above 0"), "n: 0", "n: 0; accepted: above 0"),
        (
            ProblemError("results/x", "the folder already exists", "Choose another one."),
            "results/x: the folder already exists",
            "results/x: the folder already exists. Choose another one.",
        ),
        (ProblemError("--fan", "no fan"), "--fan: no fan", "--fan: no fan"),
        (ProblemError("", "it stands.", "Push."), "it stands.", "it stands. Push."),
    ],
)
def test_a_message_and_what_it_says_of_the_finding(
    error: InputError, found: str, message: str
) -> None:
    assert (error.found, str(error), error.exit_status) == (found, message, 2)


@pytest.mark.parametrize("kind", [InputError, ProblemError])
def test_at_another_place_it_is_the_same_error(kind: type[InputError]) -> None:
    moved = kind("x", "gone", "Come back.").at("a.toml, x")
    assert type(moved) is kind
    assert (moved.where, moved.value, moved.accepted) == ("a.toml, x", "gone", "Come back.")
    assert str(moved).startswith("a.toml, x: ")


@pytest.mark.parametrize(
    ("where", "named"), [("--held-out", "held_out"), ("m.toml, load", "m.toml, load"), ("", "")]
)
def test_from_python_an_option_is_an_argument(where: str, named: str) -> None:
    with pytest.raises(ProblemError) as caught, naming_arguments():
        raise ProblemError(where, "it is missing", "Give it.")
    assert (caught.value.where, caught.value.value) == (named, "it is missing")
