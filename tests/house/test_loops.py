"""A loop over cases names each case that fails, and one that fails does not hide the next."""

import pytest
from loops import for_each

pytestmark = pytest.mark.quick


def test_every_case_that_fails_is_named() -> None:
    seen = []

    @for_each(("a", "b"), [(1, 1), (1, 2), pytest.param(0, 5, id="far"), (3, 3)])
    def equal(a: int, b: int) -> None:
        seen.append((a, b))
        assert a == b

    with pytest.raises(AssertionError, match=r"(?s)2 of 4 cases.*1: 1, 2: .*2: far: ") as refused:
        equal()
    assert seen == [(1, 1), (1, 2), (0, 5), (3, 3)]
    assert isinstance(refused.value.__cause__, AssertionError)


def test_what_was_to_be_refused_and_what_was_skipped_count_as_failed() -> None:
    @for_each("word", ["refused", "skipped", "raised"])
    def never(word: str) -> None:
        if word == "refused":
            with pytest.raises(ValueError, match="x"):
                str(word)
        elif word == "skipped":
            pytest.skip("no")
        raise KeyError(word)

    with pytest.raises(AssertionError, match="3 of 3 cases"):
        never()


@for_each("first", [True, True])
@for_each("second", "ab")
def test_each_case_has_a_folder_of_its_own(first, second, tmp_path, monkeypatch) -> None:
    assert first
    assert not list(tmp_path.iterdir())
    (tmp_path / second).touch()
    assert not hasattr(pytest, "of_a_case")
    monkeypatch.setattr(pytest, "of_a_case", 1, raising=False)


def test_no_cases_are_no_test() -> None:
    with pytest.raises(AssertionError, match="no cases"):
        for_each("a", [])
