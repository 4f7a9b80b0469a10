"""The small studies of the tests of sizing."""

from sizing.conftest import make

__all__ = ["make"]
