"""Ground truth by Mitsuba, in a worker process. Called as a function it is `evalsuite.api.reference`."""

from evalsuite._callable import make_callable

make_callable(__name__)
