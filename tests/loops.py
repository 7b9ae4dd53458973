"""One test for all cases of one form: a pytest item each would say no more and cost more."""

import functools
import inspect
from collections.abc import Callable, Iterable, Sequence

import pytest


def for_each(
    names: str | Sequence[str],
    cases: Iterable[object],
    ids: Callable[[object], str] | Sequence[str] = repr,
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """As ``pytest.mark.parametrize``, but one item: every case runs, and each that fails is named.

    Names, cases and ids are those of ``parametrize``; ``tmp_path`` and ``monkeypatch`` are each
    case's own.
    """
    words = [name.strip() for name in names.split(",")] if isinstance(names, str) else [*names]

    def told(number: int, case: object) -> tuple[str, list[object]]:
        if isinstance(case, type(pytest.param())):  # with a name of its own
            name, values = case.id, [*case.values]
        else:
            name, values = None, [case] if len(words) == 1 else [*case]
        if not callable(ids):
            name = ids[number]
        return (name or ", ".join(str(ids(value))[:80] for value in values)), values

    listed = [told(*each) for each in enumerate(cases)]
    assert listed, "no cases: nothing would be tested"

    def decorate(test: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(test)
        def every(**fixtures: object) -> None:
            failed: dict[str, BaseException] = {}
            for number, (name, values) in enumerate(listed):
                own = dict(fixtures)
                if "tmp_path" in own:
                    own["tmp_path"] = own["tmp_path"] / f"case{number}"
                    own["tmp_path"].mkdir()
                with pytest.MonkeyPatch.context() as patch:
                    if "monkeypatch" in own:
                        own["monkeypatch"] = patch
                    try:
                        test(**own, **dict(zip(words, values, strict=True)))
                    except (Exception, pytest.fail.Exception, pytest.skip.Exception) as fault:
                        failed[f"{number}: {name}"] = fault
            if failed:
                lines = [f"{name}: {type(fault).__name__}: {fault}"
                         for name, fault in failed.items()]  # fmt: skip
                message = f"{len(failed)} of {len(listed)} cases\n" + "\n".join(lines)
                raise AssertionError(message) from next(iter(failed.values()))

        signature = inspect.signature(test)
        missing = set(words) - set(signature.parameters)
        assert not missing, f"{test.__name__} does not take {missing}"
        every.__signature__ = signature.replace(
            parameters=[each for each in signature.parameters.values() if each.name not in words]
        )
        return every

    return decorate
