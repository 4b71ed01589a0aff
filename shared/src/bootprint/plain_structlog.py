"""structlog without what only its console for developers wants: a sixth of a service's start, 4 MB of it.

structlog looks for rich when it is imported, and takes it, with Pygments behind it, for coloured tracebacks.
Services log plain lines. Who wants rich itself (tables, the watch) imports it as ever.
"""

import sys

_UNWANTED = "rich"


def load() -> None:
    """Import structlog while rich is not to be found, unless somebody has imported either before."""
    if _UNWANTED in sys.modules or "structlog" in sys.modules:
        return
    sys.modules[_UNWANTED] = None  # type: ignore[assignment]  # what import looks at: "not there"
    try:
        import structlog as _  # noqa: F401
    finally:
        del sys.modules[_UNWANTED]
