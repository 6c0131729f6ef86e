"""How a refusal is expected in tests: an InputError that is one paragraph of plain text with the given words."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from kinetostat.spec.errors import InputError


@contextmanager
def refused(pattern: str | None = None) -> Iterator[pytest.ExceptionInfo[InputError]]:
    """Expect that something is refused.

    Args:
        pattern: of the message, as `pytest.raises` takes it; none if the test looks at the message itself.
    """
    with pytest.raises(InputError, match=pattern) as caught:
        yield caught
    message = str(caught.value)
    assert message.isprintable(), f"one paragraph without control characters: {message!r}"
    assert message.rstrip('`"')[-1] in ".?)", f"a sentence: {message!r}"
